//! The screened Poisson equation with a weight for every difference and every pixel, by conjugate
//! gradients with the constant-weight solve as preconditioner.

use super::dct::ScreenedPoisson;
use super::{Solution, divergence};
use rayon::prelude::*;

/// One channel: Σ w (I_b − I_a − G)² + Σ v (I − P)² is to be least.
pub(super) struct Weighted<'a> {
    pub size: (usize, usize),
    pub primal: &'a [f32],
    pub dx: &'a [f32],
    pub dy: &'a [f32],
    /// Weights v of the pixels, ≥ 0.
    pub v: &'a [f32],
    /// Weights w of the differences to the right and downwards, ≥ 0.
    pub w: (&'a [f32], &'a [f32]),
}

/// Rows handled by one task; fixed, so that sums have one order whatever the number of threads.
const ROWS: usize = 16;

impl Weighted<'_> {
    /// Improves `x` until the residual has fallen to `tolerance` times that of the primal as the
    /// solution, or for `max_iterations`: so the end does not depend on what is added to the image.
    /// Residuals are measured as rᵀM⁻¹r with the preconditioner M: an error of low frequency has a small
    /// residual in the plain norm, since the screen alone holds it.
    pub(super) fn solve(
        &self,
        preconditioner: &ScreenedPoisson,
        x: &mut [f32],
        tolerance: f64,
        max_iterations: usize,
    ) -> Solution {
        // The preconditioner's constant weights: the mean of the operator's.
        let mean = |v: &[f32]| v.iter().map(|&v| f64::from(v)).sum::<f64>() / v.len() as f64;
        let screen = mean(self.v) as f32;
        let smooth = (0.5 * (mean(self.w.0) + mean(self.w.1))) as f32;
        if !(screen >= 0.0 && smooth > 0.0 && screen.is_finite() && smooth.is_finite()) {
            return Solution::default();
        }
        let precondition = |r: &[f32]| {
            let mut z = r.to_vec();
            preconditioner.solve(&mut z, screen, smooth);
            z
        };
        let mut b = divergence(self.size, self.dx, self.dy, Some(self.w));
        b.iter_mut()
            .zip(self.v)
            .zip(self.primal)
            .for_each(|((b, v), p)| *b += v * p);
        let mut r = vec![0.0; b.len()];
        let residual = |x: &[f32], r: &mut [f32]| {
            self.apply(x, r);
            r.iter_mut().zip(&b).for_each(|(r, b)| *r = b - *r);
        };
        residual(self.primal, &mut r);
        let scale = dot(&r, &precondition(&r)).max(f64::MIN_POSITIVE);
        // Below the rounding of the right side there is nothing to gain, and steps lead astray.
        let rounding = f64::from(4.0 * f32::EPSILON).powi(2) * dot(&b, &precondition(&b));
        let limit = (scale * tolerance * tolerance).max(rounding);
        let ended = |iterations, rz: f64| Solution {
            iterations,
            residual: if rz <= rounding {
                0.0
            } else {
                (rz / scale).max(0.0).sqrt()
            },
        };

        residual(x, &mut r);
        let mut p = precondition(&r);
        let mut rz = dot(&r, &p);
        let mut q = vec![0.0; b.len()];
        for iteration in 0..max_iterations {
            if rz <= limit {
                return ended(iteration, rz);
            }
            self.apply(&p, &mut q);
            let step = rz / dot(&p, &q);
            if !(step > 0.0 && step.is_finite()) {
                return ended(iteration, rz);
            }
            let step = step as f32;
            x.iter_mut().zip(&p).for_each(|(x, p)| *x += step * p);
            r.iter_mut().zip(&q).for_each(|(r, q)| *r -= step * q);
            let z = precondition(&r);
            let next = dot(&r, &z);
            let beta = (next / rz) as f32;
            rz = next;
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
        }
        ended(max_iterations, rz)
    }

    /// out = (v + Dᵀ w D) x
    fn apply(&self, x: &[f32], out: &mut [f32]) {
        let (width, height) = self.size;
        let (wx, wy) = self.w;
        out.par_chunks_mut(width * ROWS)
            .enumerate()
            .for_each(|(chunk, out)| {
                for (row, out) in out.chunks_mut(width).enumerate() {
                    let y = chunk * ROWS + row;
                    for (column, out) in out.iter_mut().enumerate() {
                        let i = y * width + column;
                        let mut sum = self.v[i] * x[i];
                        if column > 0 {
                            sum += wx[i - 1] * (x[i] - x[i - 1]);
                        }
                        if column + 1 < width {
                            sum += wx[i] * (x[i] - x[i + 1]);
                        }
                        if y > 0 {
                            sum += wy[i - width] * (x[i] - x[i - width]);
                        }
                        if y + 1 < height {
                            sum += wy[i] * (x[i] - x[i + width]);
                        }
                        *out = sum;
                    }
                }
            });
    }
}

/// The scalar product, in double precision and in a fixed order.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    const CHUNK: usize = 1 << 14;
    let parts: Vec<f64> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| {
            a.iter()
                .zip(b)
                .map(|(a, b)| f64::from(*a) * f64::from(*b))
                .sum()
        })
        .collect();
    parts.iter().sum()
}
