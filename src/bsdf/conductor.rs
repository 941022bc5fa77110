//! Metals: a perfect mirror, and a GGX conductor. Schlick's reflectance, on both sides.

use super::fresnel::{reflect, schlick};
use super::{Eval, Lobe, Sampled, ggx};
use glam::Vec3;

#[inline]
pub(super) fn sample_mirror(f0: Vec3, wo: Vec3) -> Sampled {
    Sampled {
        wi: Vec3::new(-wo.x, -wo.y, wo.z),
        value: schlick(f0, wo.z.abs()),
        pdf: 1.0,
        lobe: Lobe::Reflection,
        delta: true,
    }
}

#[inline]
pub(super) fn eval(f0: Vec3, alpha: f32, mut wo: Vec3, mut wi: Vec3) -> Option<Eval> {
    if wo.z * wi.z <= 0.0 {
        return None;
    }
    (wo.z, wi.z) = (wo.z.abs(), wi.z.abs());
    let h = (wo + wi).normalize();
    let d = ggx::density(h, alpha) / (4.0 * wo.z);
    let value = schlick(f0, wo.dot(h)) * (d * ggx::masking_shadowing(wo, wi, alpha));
    Some(Eval {
        value,
        pdf: d * ggx::masking(wo, alpha),
    })
}

#[inline]
pub(super) fn sample(f0: Vec3, alpha: f32, wo: Vec3, u: [f32; 2]) -> Option<Sampled> {
    let side = wo.z.signum();
    let up = Vec3::new(wo.x, wo.y, wo.z.abs());
    let mut wi = reflect(up, ggx::sample(up, alpha, u));
    wi.z *= side;
    Some(eval(f0, alpha, wo, wi)?.sampled(wi, Lobe::Reflection))
}
