//! The Lambert surface: reflects the same radiance in all directions, on both sides.

use super::{Eval, Lobe, Sampled};
use crate::lanes::{Vec3x8, positive};
use crate::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use wide::f32x8;

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

/// [`Eval`] in lanes.
#[derive(Clone, Copy, Debug)]
pub struct EvalX8 {
    /// The BSDF with the cosine.
    pub value: Vec3x8,
    /// Density per solid angle.
    pub pdf: f32x8,
    /// Where there is anything; the other lanes mean nothing.
    pub holds: f32x8,
}

/// [`eval`] in lanes.
#[inline(always)]
pub fn eval_x8(albedo: Vec3x8, cos_o: f32x8, cos_i: f32x8) -> EvalX8 {
    let pdf = cos_i.abs() * f32x8::splat(FRAC_1_PI);
    EvalX8 {
        value: albedo * pdf,
        pdf,
        holds: positive(cos_o * cos_i) & albedo.is_not_zero(),
    }
}

/// [`sample`] in lanes: local directions and their evaluations.
#[inline(always)]
pub fn sample_x8(albedo: Vec3x8, cos_o: f32x8, u: [f32x8; 2]) -> (Vec3x8, EvalX8) {
    let mut wi = warp::cosine_hemisphere_x8(u);
    wi.z = wi.z.copysign(cos_o);
    let mut eval = eval_x8(albedo, cos_o, wi.z);
    eval.holds &= positive(eval.pdf);
    (wi, eval)
}
