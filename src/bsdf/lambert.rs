//! The Lambert surface: reflects the same radiance in all directions, on both sides.

use super::{Eval, Lobe, Sampled};
use crate::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// By the cosines of both directions to the normal, which is all that matters.
#[inline]
pub fn eval(albedo: Vec3, cos_o: f32, cos_i: f32) -> Option<Eval> {
    // A black surface samples nothing, so no path through it has a density.
    if cos_o * cos_i <= 0.0 || albedo == Vec3::ZERO {
        return None;
    }
    let pdf = cos_i.abs() * FRAC_1_PI;
    Some(Eval {
        value: albedo * pdf,
        pdf,
    })
}

/// A direction with density cosθ/π; `None` where nothing is reflected.
#[inline]
pub fn sample(albedo: Vec3, wo: Vec3, u: [f32; 2]) -> Option<Sampled> {
    let mut wi = warp::cosine_hemisphere(u);
    wi.z = wi.z.copysign(wo.z);
    let Eval { value, pdf } = eval(albedo, wo.z, wi.z)?;
    (pdf > 0.0).then_some(Sampled {
        wi,
        value,
        pdf,
        lobe: Lobe::Reflection,
        delta: false,
    })
}
