//! Metals: a perfect mirror, and a GGX conductor. Schlick's reflectance, on both sides.

use super::fresnel::{reflect, schlick};
use super::{Evals, Samples, ggx};
use crate::lanes::{Float, Mask, Vector, positive};

/// The single direction of a mirror.
#[inline(always)]
pub(super) fn eval_mirror<F: Float>(f0: Vector<F>, wo: Vector<F>) -> Evals<F> {
    Evals {
        value: schlick(f0, wo.z.magnitude()),
        pdf: F::ONE,
        valid: F::Mask::every(),
    }
}

#[inline(always)]
pub(super) fn sample_mirror<F: Float>(f0: Vector<F>, wo: Vector<F>) -> Samples<F> {
    Samples {
        wi: Vector::new(-wo.x, -wo.y, wo.z),
        eval: eval_mirror(f0, wo),
        transmits: F::Mask::none(),
        delta: F::Mask::every(),
    }
}

#[inline(always)]
pub(super) fn eval<F: Float>(f0: Vector<F>, alpha: F, wo: Vector<F>, wi: Vector<F>) -> Evals<F> {
    let (up_o, up_i) = (wo.upwards(), wi.upwards());
    let h = (up_o + up_i).normalize();
    let d = ggx::density(h, alpha) / (F::splat(4.0) * up_o.z);
    Evals {
        value: schlick(f0, up_o.dot(h)) * (d * ggx::masking_shadowing(up_o, up_i, alpha)),
        pdf: d * ggx::masking(up_o, alpha),
        valid: positive(wo.z * wi.z),
    }
}

#[inline(always)]
pub(super) fn sample<F: Float>(f0: Vector<F>, alpha: F, wo: Vector<F>, u: [F; 2]) -> Samples<F> {
    let up = wo.upwards();
    let mut wi = reflect(up, ggx::sample(up, alpha, u));
    wi.z = wi.z * F::ONE.signed_as(wo.z);
    Samples {
        wi,
        eval: eval(f0, alpha, wo, wi),
        transmits: F::Mask::none(),
        delta: F::Mask::none(),
    }
}
