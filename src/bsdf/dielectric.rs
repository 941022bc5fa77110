//! Glass: smooth, and rough by GGX microfacets (Walter et al. 2007). The index `ior` is inside over
//! outside; the normal points outside. Values are for radiance: what refraction carries from the other
//! side is scaled by the square of the relative index. `tint` multiplies what is transmitted.

use super::fresnel::{dielectric, reflect, refract, relative_index};
use super::{Eval, Lobe, Sampled, ggx, half_vector};
use glam::Vec3;

#[inline]
pub(super) fn eval_smooth(ior: f32, tint: Vec3, wo: Vec3, lobe: Lobe) -> Eval {
    let eta = relative_index(ior, wo);
    let f = dielectric(wo.z.abs(), eta);
    match lobe {
        Lobe::Reflection => Eval {
            value: Vec3::splat(f),
            pdf: f,
        },
        Lobe::Transmission => Eval {
            value: tint * ((1.0 - f) / (eta * eta)),
            pdf: 1.0 - f,
        },
    }
}

#[inline]
pub(super) fn sample_smooth(ior: f32, tint: Vec3, wo: Vec3, u: f32) -> Option<Sampled> {
    let lobe = if u < dielectric(wo.z.abs(), relative_index(ior, wo)) {
        Lobe::Reflection
    } else {
        Lobe::Transmission
    };
    let wi = match lobe {
        Lobe::Reflection => Vec3::new(-wo.x, -wo.y, wo.z),
        Lobe::Transmission => refract_smooth(ior, wo)?,
    };
    Some(eval_smooth(ior, tint, wo, lobe).sampled_delta(wi, lobe))
}

#[inline]
pub(super) fn refract_smooth(ior: f32, wo: Vec3) -> Option<Vec3> {
    refract(wo, Vec3::Z.copysign(wo), relative_index(ior, wo))
}

#[inline]
pub(super) fn eval(ior: f32, alpha: f32, tint: Vec3, wo: Vec3, wi: Vec3) -> Option<Eval> {
    if wo.z == 0.0 || wi.z == 0.0 {
        return None;
    }
    let h = half_vector::from_directions(ior, wo, wi)?;
    let eta = relative_index(ior, wo);
    let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
    let f = dielectric(cos_o, eta);
    let up = |w: Vec3| Vec3::new(w.x, w.y, w.z.abs());
    let h_up = h * h.z.signum();
    let d = ggx::density(h_up, alpha) * cos_o / wo.z.abs();
    let g = ggx::masking_shadowing(up(wo), up(wi), alpha);
    let g1 = ggx::masking(up(wo), alpha);
    if wo.z * wi.z > 0.0 {
        let d = f * d / (4.0 * cos_o);
        Some(Eval {
            value: Vec3::splat(d * g),
            pdf: d * g1,
        })
    } else {
        let denominator = cos_o + eta * cos_i;
        let d = (1.0 - f) * d * cos_i.abs() / (denominator * denominator);
        (d > 0.0).then_some(Eval {
            value: tint * (d * g),
            pdf: d * eta * eta * g1,
        })
    }
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
    let side = wo.z.signum();
    let mut h = ggx::sample(Vec3::new(wo.x, wo.y, wo.z.abs()), alpha, u);
    h.z *= side;
    let eta = relative_index(ior, wo);
    let (wi, lobe) = if u_lobe < dielectric(wo.dot(h), eta) {
        (reflect(wo, h), Lobe::Reflection)
    } else {
        (refract(wo, h, eta)?, Lobe::Transmission)
    };
    if (wo.z * wi.z > 0.0) != (lobe == Lobe::Reflection) {
        return None;
    }
    Some(eval(ior, alpha, tint, wo, wi)?.sampled(wi, lobe))
}
