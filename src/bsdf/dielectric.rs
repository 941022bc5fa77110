//! Glass: smooth, and rough by GGX microfacets (Walter et al. 2007). The index `ior` is inside over
//! outside; the normal points outside. Values are for radiance: what refraction carries from the other
//! side is scaled by the square of the relative index. `tint` multiplies what is transmitted.

use super::fresnel::{dielectric, reflect, refract, relative_index};
use super::{Evals, Samples, ggx, half_vector};
use crate::lanes::{Float, Mask, Vector, positive};
use glam::Vec3;

/// What glass is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glass<F> {
    pub(super) ior: F,
    pub(super) tint: Vector<F>,
}

impl Glass<f32> {
    #[inline(always)]
    pub(super) fn one(ior: f32, tint: Vec3) -> Self {
        Self {
            ior,
            tint: tint.into(),
        }
    }
}

impl<F: Float> Glass<F> {
    /// The single directions of smooth glass.
    #[inline(always)]
    pub(super) fn eval_smooth(&self, wo: Vector<F>, transmits: F::Mask) -> Evals<F> {
        let eta = relative_index(self.ior, wo);
        let f = dielectric(wo.z.magnitude(), eta);
        let through = self.tint * ((F::ONE - f) / (eta * eta));
        let pdf = F::select(transmits, F::ONE - f, f);
        Evals {
            value: Vector::select(transmits, through, Vector::grey(f)),
            pdf,
            valid: positive(pdf),
        }
    }

    #[inline(always)]
    pub(super) fn sample_smooth(&self, wo: Vector<F>, u: F) -> Samples<F> {
        let eta = relative_index(self.ior, wo);
        let transmits = !u.below(dielectric(wo.z.magnitude(), eta));
        let normal = Vector::new(F::ZERO, F::ZERO, F::ONE.signed_as(wo.z));
        let (refracted, bends) = refract(wo, normal, eta);
        let mirrored = Vector::new(-wo.x, -wo.y, wo.z);
        let mut eval = self.eval_smooth(wo, transmits);
        eval.valid = eval.valid & (bends | !transmits);
        Samples {
            wi: Vector::select(transmits, refracted, mirrored),
            eval,
            transmits,
            delta: F::Mask::every(),
        }
    }

    #[inline(always)]
    pub(super) fn eval(&self, alpha: F, wo: Vector<F>, wi: Vector<F>) -> Evals<F> {
        let (h, carries) = half_vector::from_directions(self.ior, wo, wi);
        let eta = relative_index(self.ior, wo);
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        let f = dielectric(cos_o, eta);
        let up = h * F::ONE.signed_as(h.z);
        let d = ggx::density(up, alpha) * cos_o / wo.z.magnitude();
        let g = ggx::masking_shadowing(wo.upwards(), wi.upwards(), alpha);
        let g1 = ggx::masking(wo.upwards(), alpha);
        // Reflected, and transmitted.
        let r = f * d / (F::splat(4.0) * cos_o);
        let denominator = cos_o + eta * cos_i;
        let t = (F::ONE - f) * d * cos_i.magnitude() / (denominator * denominator);
        let reflects = positive(wo.z * wi.z);
        let there = !(wo.z.equals(F::ZERO) | wi.z.equals(F::ZERO));
        Evals {
            value: Vector::select(reflects, Vector::grey(r * g), self.tint * (t * g)),
            pdf: F::select(reflects, r * g1, t * eta * eta * g1),
            valid: carries & there & (reflects | positive(t)),
        }
    }

    #[inline(always)]
    pub(super) fn sample(&self, alpha: F, wo: Vector<F>, u: [F; 2], u_lobe: F) -> Samples<F> {
        let mut h = ggx::sample(wo.upwards(), alpha, u);
        h.z = h.z * F::ONE.signed_as(wo.z);
        let eta = relative_index(self.ior, wo);
        let transmits = !u_lobe.below(dielectric(wo.dot(h), eta));
        let (refracted, bends) = refract(wo, h, eta);
        let wi = Vector::select(transmits, refracted, reflect(wo, h));
        let mut eval = self.eval(alpha, wo, wi);
        eval.valid = eval.valid & (bends | !transmits) & half_vector::on_side(transmits, wo, wi);
        Samples {
            wi,
            eval,
            transmits,
            delta: F::Mask::none(),
        }
    }
}
