//! Reflectances at a boundary, and refraction.

use crate::lanes::{Float, Mask, Vector, positive};

/// At an index this near to 1 light passes unbent, however rough the surface is; and half vectors, of
/// length |index − 1|, would be made of rounding errors.
pub const SAME_INDEX: f32 = 1e-3;

/// Schlick's reflectance of a conductor with reflectance `f0` at normal incidence; `cos` in [0, 1].
#[inline(always)]
pub fn schlick<F: Float>(f0: Vector<F>, cos: F) -> Vector<F> {
    f0 + (Vector::ONE - f0) * fifth_power(F::ONE - cos)
}

/// The same of a single channel, or of a dielectric, of which it is near.
#[inline(always)]
pub fn schlick_grey<F: Float>(f0: f32, cos: F) -> F {
    let f0 = F::splat(f0);
    f0 + (F::ONE - f0) * fifth_power(F::ONE - cos)
}

/// The fifth power of a number that is clamped to [0, 1] before.
#[inline(always)]
pub fn fifth_power<F: Float>(x: F) -> F {
    let m = x.clamped();
    m * m * m * m * m
}

/// The unpolarised reflectance of a dielectric boundary. `cos` > 0 is the incident cosine, `eta` the
/// index behind the boundary over the index before it. 1 where there is total internal reflection.
#[inline(always)]
pub fn dielectric<F: Float>(cos: F, eta: F) -> F {
    let (cos_t, bends) = refracted_cosine(cos, eta);
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    let reflectance = F::splat(0.5) * (parallel * parallel + perpendicular * perpendicular);
    F::select(bends, reflectance, F::ONE)
}

/// The cosine behind the boundary, and where there is one: elsewhere there is total internal reflection.
#[inline(always)]
fn refracted_cosine<F: Float>(cos: F, eta: F) -> (F, F::Mask) {
    let sin2_t = (F::ONE - cos * cos).larger(F::ZERO) / (eta * eta);
    ((F::ONE - sin2_t).root(), sin2_t.below(F::ONE))
}

/// `wo` mirrored about the unit vector `h`.
#[inline(always)]
pub fn reflect<F: Float>(wo: Vector<F>, h: Vector<F>) -> Vector<F> {
    h * (F::splat(2.0) * wo.dot(h)) - wo
}

/// `wo` refracted through the microfacet with unit normal `h` on `wo`'s side, and where that is possible: not
/// at total internal reflection. `eta` as for [`dielectric`].
#[inline(always)]
pub fn refract<F: Float>(wo: Vector<F>, h: Vector<F>, eta: F) -> (Vector<F>, F::Mask) {
    let cos = wo.dot(h);
    let (cos_t, bends) = refracted_cosine(cos, eta);
    (h * (cos / eta - cos_t) - wo / eta, bends)
}

/// The index behind the boundary over the index before it, seen from the local direction `wo`; `ior` is
/// inside over outside, the normal points outside.
#[inline(always)]
pub fn relative_index<F: Float>(ior: F, wo: Vector<F>) -> F {
    let outside = positive(wo.z);
    if outside.all() {
        return ior;
    }
    F::select(outside, ior, F::ONE / ior)
}
