//! The Lambert surface: reflects the same radiance in all directions, on both sides.

use super::{Evals, Samples};
use crate::lanes::{Float, Mask, Vector, positive};
use crate::warp;
use std::f32::consts::FRAC_1_PI;

/// By the cosines of both directions to the normal, which is all that matters.
#[inline(always)]
pub fn eval<F: Float>(albedo: Vector<F>, cos_o: F, cos_i: F) -> Evals<F> {
    let pdf = cos_i.magnitude() * F::splat(FRAC_1_PI);
    Evals {
        value: albedo * pdf,
        pdf,
        // A black surface samples nothing, so no path through it has a density.
        valid: positive(cos_o * cos_i) & albedo.is_not_zero(),
    }
}

/// Local directions with density cosθ/π; they do not hold where nothing is reflected.
#[inline(always)]
pub fn sample<F: Float>(albedo: Vector<F>, cos_o: F, u: [F; 2]) -> Samples<F> {
    let mut wi = warp::cosine_hemisphere(u);
    wi.z = wi.z.signed_as(cos_o);
    let mut eval = eval(albedo, cos_o, wi.z);
    eval.valid = eval.valid & positive(eval.pdf);
    Samples {
        wi,
        eval,
        transmits: F::Mask::none(),
        delta: F::Mask::none(),
    }
}
