//! Directions by their half vector: the coordinates in which the shift copies a scattering event
//! (Kettunen et al. 2015, section 5.2; refraction by Walter et al. 2007, equation 16).
//!
//! An index of 1 is that of thin panes, which refract nothing: there the half vector is that of the direction
//! mirrored to `wo`'s side.

use super::fresnel::{reflect, refract, relative_index};
use super::thin::mirrored;
use crate::lanes::{Float, Mask, Vector, negative, positive};

/// The unit half vectors of pairs, on `wo`'s side of the surface: the normal of the microfacet that
/// carries `wo` to `wi`; and where there is a facet that does so seen from its front.
/// `ior` is inside over outside and matters for transmission alone.
#[inline(always)]
pub fn from_directions<F: Float>(ior: F, wo: Vector<F>, wi: Vector<F>) -> (Vector<F>, F::Mask) {
    let is_pane = ior.equals(F::ONE);
    let wi = Vector::select(negative(wo.z * wi.z) & is_pane, mirrored(wi), wi);
    let reflects = positive(wo.z * wi.z);
    let index = F::select(reflects, F::ONE, relative_index(ior, wo));
    let h = wo + wi * index;
    let per_length = h.length_recip();
    let h = h * per_length;
    let h = Vector::select(negative(h.z * wo.z), -h, h);
    let valid = per_length.finite()
        & positive(per_length)
        & positive(wo.dot(h))
        & positive(wi.dot(h) * wi.z * h.z);
    (h, valid)
}

/// The directions to which facets with normals `h` on `wo`'s side carry `wo`, to the other side where
/// `transmits`; and where they do: not at total internal reflection, nor where the result lies on the wrong side
/// of the surface.
#[inline(always)]
pub fn to_direction<F: Float>(
    transmits: F::Mask,
    ior: F,
    wo: Vector<F>,
    h: Vector<F>,
) -> (Vector<F>, F::Mask) {
    let mut wi = reflect(wo, h);
    let mut valid = positive(wo.dot(h));
    if transmits.any() {
        let is_pane = ior.equals(F::ONE);
        let (refracted, bends) = refract(wo, h, relative_index(ior, wo));
        let passing = Vector::select(is_pane, mirrored(wi), refracted);
        wi = Vector::select(transmits, passing, wi);
        valid = valid & (bends | is_pane | !transmits);
    }
    (wi, valid & on_side(transmits, wo, wi))
}

/// Where `wi` is on the side that it must be on.
#[inline(always)]
pub(super) fn on_side<F: Float>(transmits: F::Mask, wo: Vector<F>, wi: Vector<F>) -> F::Mask {
    let sides = wo.z * wi.z;
    ((transmits & !positive(sides)) | (!transmits & positive(sides))) & !wi.z.equals(F::ZERO)
}

/// |dω_i/dω_h|: how much the solid angle around `wi` grows with that around `h`, `wo` held fixed.
#[inline(always)]
pub fn jacobian<F: Float>(
    transmits: F::Mask,
    ior: F,
    wo: Vector<F>,
    wi: Vector<F>,
    h: Vector<F>,
) -> F {
    let cos_i = wi.dot(h);
    let reflected = F::splat(4.0) * cos_i.magnitude();
    if !transmits.any() {
        return reflected;
    }
    let eta = relative_index(ior, wo);
    let sum = wo.dot(h) + eta * cos_i;
    let refracted = sum * sum / (eta * eta * cos_i.magnitude());
    let mirrored = F::splat(4.0) * mirrored(wi).dot(h).magnitude();
    let passing = F::select(ior.equals(F::ONE), mirrored, refracted);
    F::select(transmits, passing, reflected)
}
