//! Thin panes: two parallel boundaries of a dielectric so close together that they are one surface. What passes
//! goes on in its direction, and keeps its radiance. Smooth, and rough by GGX microfacets, where light that
//! passes is spread as if it were reflected, mirrored to the other side (as in glTF's KHR_materials_transmission).
//! `ior` is pane over air, which is on both sides; `tint` is what one way through the pane leaves of light.

use super::fresnel::{dielectric, reflect};
use super::{Eval, Lobe, Sampled, ggx};
use glam::Vec3;

/// The shares of light that are reflected and that pass, of all the bounces between the two boundaries; `cos` > 0.
///
/// With R the reflectance of a boundary and t the tint: R + (1 - R)² t² R (1 + R² t² + …) and
/// (1 - R)² t (1 + R² t² + …).
#[inline]
fn shares(ior: f32, tint: Vec3, cos: f32) -> (Vec3, Vec3) {
    let r = dielectric(cos, ior);
    if r >= 1.0 {
        return (Vec3::ONE, Vec3::ZERO);
    }
    let passes = (1.0 - r) * (1.0 - r) / (Vec3::ONE - r * r * tint * tint) * tint;
    (r + r * tint * passes, passes)
}

/// The share of a lobe, and the probability of its choice.
#[inline]
fn choice(ior: f32, tint: Vec3, cos: f32, lobe: Lobe) -> (Vec3, f32) {
    let (reflected, passing) = shares(ior, tint, cos);
    let (r, t) = (reflected.element_sum(), passing.element_sum());
    // Nothing is left of the light where the index is 1 and the tint black.
    let p = if r + t > 0.0 { r / (r + t) } else { 0.0 };
    match lobe {
        Lobe::Reflection => (reflected, p),
        Lobe::Transmission => (passing, 1.0 - p),
    }
}

#[inline]
fn choose(ior: f32, tint: Vec3, cos: f32, u: f32) -> Lobe {
    if u < choice(ior, tint, cos, Lobe::Reflection).1 {
        Lobe::Reflection
    } else {
        Lobe::Transmission
    }
}

/// `w` on the other side of the pane.
#[inline]
pub(super) fn mirrored(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, -w.z)
}

#[inline]
pub(super) fn eval_smooth(ior: f32, tint: Vec3, wo: Vec3, lobe: Lobe) -> Option<Eval> {
    let (value, pdf) = choice(ior, tint, wo.z.abs(), lobe);
    (value != Vec3::ZERO && pdf > 0.0).then_some(Eval { value, pdf })
}

#[inline]
pub(super) fn sample_smooth(ior: f32, tint: Vec3, wo: Vec3, u: f32) -> Option<Sampled> {
    let lobe = choose(ior, tint, wo.z.abs(), u);
    let wi = match lobe {
        Lobe::Reflection => mirrored(-wo),
        Lobe::Transmission => -wo,
    };
    Some(eval_smooth(ior, tint, wo, lobe)?.sampled_delta(wi, lobe))
}

#[inline]
pub(super) fn eval(ior: f32, alpha: f32, tint: Vec3, mut wo: Vec3, mut wi: Vec3) -> Option<Eval> {
    if wo.z == 0.0 || wi.z == 0.0 {
        return None;
    }
    let lobe = if wo.z * wi.z > 0.0 {
        Lobe::Reflection
    } else {
        Lobe::Transmission
    };
    (wo.z, wi.z) = (wo.z.abs(), wi.z.abs());
    let h = (wo + wi).normalize();
    let (share, p) = choice(ior, tint, wo.dot(h), lobe);
    let d = ggx::density(h, alpha) / (4.0 * wo.z);
    let pdf = p * d * ggx::masking(wo, alpha);
    (pdf > 0.0).then(|| Eval {
        value: share * (d * ggx::masking_shadowing(wo, wi, alpha)),
        pdf,
    })
}

#[inline]
pub(super) fn sample(
    ior: f32,
    alpha: f32,
    tint: Vec3,
    wo: Vec3,
    u: [f32; 2],
    u_lobe: f32,
) -> Option<Sampled> {
    let up = Vec3::new(wo.x, wo.y, wo.z.abs());
    let h = ggx::sample(up, alpha, u);
    let mut wi = reflect(up, h);
    if wi.z <= 0.0 {
        return None;
    }
    let lobe = choose(ior, tint, up.dot(h), u_lobe);
    if (lobe == Lobe::Reflection) != (wo.z > 0.0) {
        wi = mirrored(wi);
    }
    Some(eval(ior, alpha, tint, wo, wi)?.sampled(wi, lobe))
}
