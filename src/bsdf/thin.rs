//! Thin panes: two parallel boundaries of a dielectric so close together that they are one surface. What passes
//! goes on in its direction, and keeps its radiance. Smooth, and rough by GGX microfacets, where light that
//! passes is spread as if it were reflected, mirrored to the other side (as in glTF's KHR_materials_transmission).
//! `ior` is pane over air, which is on both sides; `tint` is what one way through the pane leaves of light.

use super::fresnel::{dielectric, reflect};
use super::{Evals, Samples, ggx};
use crate::lanes::{Float, Mask, Vector, positive};
use glam::Vec3;

/// What a pane is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pane<F> {
    pub(super) ior: F,
    pub(super) tint: Vector<F>,
}

/// The shares of light that are reflected and that pass, and the probabilities of their choice.
struct Shares<F> {
    reflected: Vector<F>,
    passing: Vector<F>,
    /// Of reflection.
    probability: F,
}

/// `w` on the other side of the pane.
#[inline(always)]
pub(super) fn mirrored<F: Float>(w: Vector<F>) -> Vector<F> {
    Vector { z: -w.z, ..w }
}

impl<F: Float> Shares<F> {
    /// The share where `transmits` or of reflection elsewhere, and the probability of its choice.
    #[inline(always)]
    fn of(&self, transmits: F::Mask) -> (Vector<F>, F) {
        let p = self.probability;
        (
            Vector::select(transmits, self.passing, self.reflected),
            F::select(transmits, F::ONE - p, p),
        )
    }
}

impl Pane<f32> {
    #[inline(always)]
    pub(super) fn one(ior: f32, tint: Vec3) -> Self {
        Self {
            ior,
            tint: tint.into(),
        }
    }
}

impl<F: Float> Pane<F> {
    /// Of all the bounces between the two boundaries; `cos` > 0.
    ///
    /// With R the reflectance of a boundary and t the tint: R + (1 - R)² t² R (1 + R² t² + …) and
    /// (1 - R)² t (1 + R² t² + …).
    #[inline(always)]
    fn shares(&self, cos: F) -> Shares<F> {
        let (r, tint) = (dielectric(cos, self.ior), self.tint);
        let bounces = Vector::ONE - tint * (r * r) * tint;
        let once = (F::ONE - r) * (F::ONE - r);
        let passing = Vector::new(once / bounces.x, once / bounces.y, once / bounces.z) * tint;
        let reflected = Vector::grey(r) + tint * r * passing;
        let total = !r.below(F::ONE);
        let passing = Vector::select(total, Vector::ZERO, passing);
        let reflected = Vector::select(total, Vector::ONE, reflected);
        // Nothing is left of the light where the index is 1 and the tint black.
        let (r, t) = (reflected.element_sum(), passing.element_sum());
        Shares {
            reflected,
            passing,
            probability: (r / (r + t)).only(positive(r + t)),
        }
    }

    #[inline(always)]
    pub(super) fn eval_smooth(&self, wo: Vector<F>, transmits: F::Mask) -> Evals<F> {
        Self::single(&self.shares(wo.z.magnitude()), transmits)
    }

    #[inline(always)]
    fn single(shares: &Shares<F>, transmits: F::Mask) -> Evals<F> {
        let (value, pdf) = shares.of(transmits);
        Evals {
            value,
            pdf,
            valid: value.is_not_zero() & positive(pdf),
        }
    }

    #[inline(always)]
    pub(super) fn sample_smooth(&self, wo: Vector<F>, u: F) -> Samples<F> {
        let shares = self.shares(wo.z.magnitude());
        let transmits = !u.below(shares.probability);
        Samples {
            wi: Vector::select(transmits, -wo, mirrored(-wo)),
            eval: Self::single(&shares, transmits),
            transmits,
            delta: F::Mask::every(),
        }
    }

    #[inline(always)]
    pub(super) fn eval(&self, alpha: F, wo: Vector<F>, wi: Vector<F>) -> Evals<F> {
        let transmits = !positive(wo.z * wi.z);
        let there = !(wo.z.equals(F::ZERO) | wi.z.equals(F::ZERO));
        let (wo, wi) = (wo.upwards(), wi.upwards());
        let h = (wo + wi).normalize();
        let (share, p) = self.shares(wo.dot(h)).of(transmits);
        let d = ggx::density(h, alpha) / (F::splat(4.0) * wo.z);
        let pdf = p * d * ggx::masking(wo, alpha);
        Evals {
            value: share * (d * ggx::masking_shadowing(wo, wi, alpha)),
            pdf,
            valid: there & positive(pdf),
        }
    }

    #[inline(always)]
    pub(super) fn sample(&self, alpha: F, wo: Vector<F>, u: [F; 2], u_lobe: F) -> Samples<F> {
        let up = wo.upwards();
        let h = ggx::sample(up, alpha, u);
        let wi = reflect(up, h);
        let above = positive(wi.z);
        let transmits = !u_lobe.below(self.shares(up.dot(h)).probability);
        let front = positive(wo.z);
        let turns = (transmits & front) | !(transmits | front);
        let wi = Vector::select(turns, mirrored(wi), wi);
        let mut eval = self.eval(alpha, wo, wi);
        eval.valid = eval.valid & above;
        Samples {
            wi,
            eval,
            transmits,
            delta: F::Mask::none(),
        }
    }
}
