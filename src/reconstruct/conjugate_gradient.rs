//! Conjugate gradients for the screened Poisson equation with a weight for every difference and every
//! pixel, preconditioned by a multigrid cycle.

use super::Solution;
use super::multigrid::{Multigrid, Operator};
use rayon::prelude::*;

/// A limit that no sensible system reaches: the tolerance ends it.
const MAX_ITERATIONS: usize = 200;
/// Values handled by one task; fixed, so that sums have one order whatever the number of threads.
const CHUNK: usize = 1 << 14;

/// A solver for one set of weights, with its buffers.
pub(super) struct Solver {
    multigrid: Multigrid,
    r: Vec<f32>,
    p: Vec<f32>,
    q: Vec<f32>,
}

impl Solver {
    pub(super) fn new(operator: Operator) -> Self {
        Self {
            multigrid: Multigrid::new(operator),
            r: Vec::new(),
            p: Vec::new(),
            q: Vec::new(),
        }
    }

    /// Minimises Σ w (DI − G)² + Σ v (I − P)² from the start `x`, until the residual has fallen to
    /// `tolerance` times that of the primal as the solution: so the end does not depend on what is added
    /// to the image. Residuals are measured as rᵀM⁻¹r with the preconditioner M: an error of low
    /// frequency has a small residual in the plain norm, since the screen alone holds it.
    pub(super) fn solve(
        &mut self,
        primal: &[f32],
        (dx, dy): (&[f32], &[f32]),
        x: &mut [f32],
        tolerance: f64,
    ) -> Solution {
        let Self { multigrid, r, p, q } = self;
        let b = multigrid.operator().right_side(primal, dx, dy);
        for buffer in [&mut *r, p, q] {
            buffer.resize(b.len(), 0.0);
        }
        multigrid.operator().residual(primal, &b, r);
        let scale = dot(r, multigrid.precondition(r)).max(f64::MIN_POSITIVE);
        // Below the rounding of the right side there is nothing to gain, and steps lead astray.
        let rounding = f64::from(4.0 * f32::EPSILON).powi(2) * dot(&b, multigrid.precondition(&b));
        let limit = (scale * tolerance * tolerance).max(rounding);
        let ended = |iterations, rz: f64| Solution {
            iterations,
            residual: if rz <= rounding {
                0.0
            } else {
                (rz / scale).max(0.0).sqrt()
            },
        };

        multigrid.operator().residual(x, &b, r);
        p.copy_from_slice(multigrid.precondition(r));
        let mut rz = dot(r, p);
        for iteration in 0..MAX_ITERATIONS {
            if rz <= limit {
                return ended(iteration, rz);
            }
            multigrid.operator().apply(p, q);
            let step = rz / dot(p, q);
            if !(step > 0.0 && step.is_finite()) {
                return ended(iteration, rz);
            }
            add(x, step as f32, p);
            add(r, -step as f32, q);
            let z = multigrid.precondition(r);
            let next = dot(r, z);
            let beta = (next / rz) as f32;
            rz = next;
            p.par_chunks_mut(CHUNK)
                .zip(z.par_chunks(CHUNK))
                .for_each(|(p, z)| p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p));
        }
        ended(MAX_ITERATIONS, rz)
    }
}

/// x += a y
fn add(x: &mut [f32], a: f32, y: &[f32]) {
    x.par_chunks_mut(CHUNK)
        .zip(y.par_chunks(CHUNK))
        .for_each(|(x, y)| x.iter_mut().zip(y).for_each(|(x, y)| *x += a * y));
}

/// The scalar product, in double precision and in a fixed order.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let parts: Vec<f64> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| dot_chunk(a, b))
        .collect();
    parts.iter().sum()
}

/// With eight sums side by side, which vector instructions take together.
fn dot_chunk(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0f64; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = a8.remainder().iter().zip(b8.remainder());
    let rest: f64 = rest.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
    for (a, b) in a8.zip(b8) {
        for lane in 0..8 {
            sums[lane] += f64::from(a[lane]) * f64::from(b[lane]);
        }
    }
    sums.iter().sum::<f64>() + rest
}
