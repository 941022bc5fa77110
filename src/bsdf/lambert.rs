//! The Lambert surface: reflects the same radiance in all directions, on both sides.

use super::{Eval, Lobe, Sampled};
use crate::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

#[inline]
pub(super) fn eval(albedo: Vec3, wo: Vec3, wi: Vec3) -> Option<Eval> {
    // A black surface samples nothing, so no path through it has a density.
    if wo.z * wi.z <= 0.0 || albedo == Vec3::ZERO {
        return None;
    }
    let pdf = wi.z.abs() * FRAC_1_PI;
    Some(Eval {
        value: albedo * pdf,
        pdf,
    })
}

#[inline]
pub(super) fn sample(albedo: Vec3, wo: Vec3, u: [f32; 2]) -> Option<Sampled> {
    let mut wi = warp::cosine_hemisphere(u);
    wi.z = wi.z.copysign(wo.z);
    let Eval { value, pdf } = eval(albedo, wo, wi)?;
    Some(Sampled {
        wi,
        value,
        pdf,
        lobe: Lobe::Reflection,
    })
}
