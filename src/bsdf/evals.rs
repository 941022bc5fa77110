//! What BSDFs give, in lanes.

use super::{Eval, Lobe, Sampled};
use crate::lanes::{Float, Mask, Vector, positive};

/// [`Eval`] in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Evals<F: Float> {
    /// The BSDFs with the cosines at `wi`.
    pub value: Vector<F>,
    /// Densities per solid angle.
    pub pdf: F,
    /// Where there is anything; the other lanes mean nothing.
    pub valid: F::Mask,
}

/// [`Sampled`] in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Samples<F: Float> {
    /// Unit directions.
    pub wi: Vector<F>,
    /// What they evaluate to; where it does not hold the path ends.
    pub eval: Evals<F>,
    /// Where they go through the surface.
    pub transmits: F::Mask,
    /// Where they are single directions.
    pub delta: F::Mask,
}

impl<F: Float> Evals<F> {
    /// Nothing in all lanes.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            value: Vector::ZERO,
            pdf: F::ZERO,
            valid: F::Mask::none(),
        }
    }

    /// Lanes of `a` where `mask` holds, of `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, a: Self, b: Self) -> Self {
        Self {
            value: Vector::select(mask, a.value, b.value),
            pdf: F::select(mask, a.pdf, b.pdf),
            valid: (mask & a.valid) | (!mask & b.valid),
        }
    }
}

impl<F: Float> Samples<F> {
    /// Nothing in all lanes.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            wi: Vector::ZERO,
            eval: Evals::none(),
            transmits: F::Mask::none(),
            delta: F::Mask::none(),
        }
    }

    /// Lanes of `a` where `mask` holds, of `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, a: Self, b: Self) -> Self {
        Self {
            wi: Vector::select(mask, a.wi, b.wi),
            eval: Evals::select(mask, a.eval, b.eval),
            transmits: (mask & a.transmits) | (!mask & b.transmits),
            delta: (mask & a.delta) | (!mask & b.delta),
        }
    }
}

impl<F: Float> Samples<F> {
    /// Those that leave the surface, seen from `wo`, and have a density; the others do not hold.
    #[inline(always)]
    pub(super) fn leaves(mut self, wo: Vector<F>) -> Self {
        let flat = wo.z.equals(F::ZERO) | self.wi.z.equals(F::ZERO);
        self.eval.valid = self.eval.valid & positive(self.eval.pdf) & !flat;
        self
    }
}

impl Evals<f32> {
    /// The one of a single lane.
    #[inline(always)]
    pub fn held(self) -> Option<Eval> {
        self.valid.then(|| Eval {
            value: self.value.into(),
            pdf: self.pdf,
        })
    }
}

impl Samples<f32> {
    /// The one of a single lane.
    #[inline(always)]
    pub fn held(self) -> Option<Sampled> {
        let eval = self.eval.held()?;
        Some(Sampled {
            wi: self.wi.into(),
            value: eval.value,
            pdf: eval.pdf,
            lobe: if self.transmits {
                Lobe::Transmission
            } else {
                Lobe::Reflection
            },
            delta: self.delta,
        })
    }
}
