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

    /// Minimises Σ w (DI − G)² + Σ v (I − P)² from the start `x`, until the error of `x` has fallen to
    /// `tolerance` times that of the primal as the solution: so the end does not depend on what is added
    /// to the image. Errors are measured as ‖M⁻¹r‖ with the residual r and the preconditioner M: M⁻¹r is
    /// nearly the error itself, where r alone would hardly see one of low frequency, which the screen
    /// alone holds.
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
        let of_primal = norm_squared(multigrid.precondition(r)).max(f64::MIN_POSITIVE);
        // Below the rounding of the solution there is nothing to gain, and steps lead astray.
        let solution = norm_squared(multigrid.precondition(&b));
        let rounding = f64::from(4.0 * f32::EPSILON).powi(2) * solution;
        let limit = (of_primal * tolerance * tolerance).max(rounding);
        let ended = |iterations, error: f64| Solution {
            iterations,
            residual: if error <= rounding {
                0.0
            } else {
                (error / of_primal).sqrt()
            },
        };

        multigrid.operator().residual(x, &b, r);
        p.copy_from_slice(multigrid.precondition(r));
        let mut rz = dot(r, p);
        let mut error = norm_squared(p);
        for iteration in 0..MAX_ITERATIONS {
            if error <= limit {
                return ended(iteration, error);
            }
            multigrid.operator().apply(p, q);
            let step = rz / dot(p, q);
            if !(step > 0.0 && step.is_finite()) {
                return ended(iteration, error);
            }
            add(x, step as f32, p);
            add(r, -step as f32, q);
            let z = multigrid.precondition(r);
            let next = dot(r, z);
            error = norm_squared(z);
            let beta = (next / rz) as f32;
            rz = next;
            p.par_chunks_mut(CHUNK)
                .zip(z.par_chunks(CHUNK))
                .for_each(|(p, z)| p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p));
        }
        ended(MAX_ITERATIONS, error)
    }
}

/// x += a y
fn add(x: &mut [f32], a: f32, y: &[f32]) {
    x.par_chunks_mut(CHUNK)
        .zip(y.par_chunks(CHUNK))
        .for_each(|(x, y)| x.iter_mut().zip(y).for_each(|(x, y)| *x += a * y));
}

fn norm_squared(a: &[f32]) -> f64 {
    dot(a, a)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Dense Gaussian elimination in doubles on Σ w (DI − G)² + Σ v (I − P)².
    fn dense(width: usize, [p, gx, gy]: [&[f32]; 3], [v, wx, wy]: [&[f32]; 3]) -> Vec<f64> {
        let n = p.len();
        let mut a = vec![vec![0.0f64; n + 1]; n];
        for i in 0..n {
            a[i][i] += f64::from(v[i]);
            a[i][n] += f64::from(v[i]) * f64::from(p[i]);
            let right = (i % width + 1 < width).then_some((i + 1, wx[i], gx[i]));
            let below = (i + width < n).then_some((i + width, wy[i], gy[i]));
            for (j, w, g) in [right, below].into_iter().flatten() {
                let (w, g) = (f64::from(w), f64::from(g));
                a[i][i] += w;
                a[j][j] += w;
                a[i][j] -= w;
                a[j][i] -= w;
                a[j][n] += w * g;
                a[i][n] -= w * g;
            }
        }
        for i in 0..n {
            let pivot = a[i].clone();
            for row in a.iter_mut().skip(i + 1) {
                let factor = row[i] / pivot[i];
                for (x, p) in row.iter_mut().zip(&pivot).skip(i) {
                    *x -= factor * p;
                }
            }
        }
        let mut x = vec![0.0; n];
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| a[i][j] * x[j]).sum();
            x[i] = (a[i][n] - known) / a[i][i];
        }
        x
    }

    /// Also for images of one pixel's width. Where weights span twelve orders of magnitude, 32-bit floats
    /// cannot hold the residual of the weak ones beside the strong: there it does not diverge.
    #[test]
    fn it_is_the_dense_solution() {
        for (width, height) in [(1, 1), (1, 9), (8, 1), (2, 2), (9, 7), (12, 13)] {
            for (orders, tolerance, allowed) in
                [(0.0, 1e-6, 1e-4), (4.0, 1e-6, 1e-3), (12.0, 1e-3, 10.0)]
            {
                let n = width * height;
                let value = |i: usize, k: usize| mix((i * 64 + k) as u64) as f32 / u64::MAX as f32;
                let plane = |k: usize| -> Vec<f32> { (0..n).map(|i| value(i, k)).collect() };
                let weight = |k: usize| -> Vec<f32> {
                    plane(k)
                        .iter()
                        .map(|x| 10f32.powf(orders * (x - 0.5)))
                        .collect()
                };
                let (p, gx, gy) = (plane(0), plane(1), plane(2));
                let (v, wx, wy) = (weight(3), weight(4), weight(5));
                let want = dense(width, [&p, &gx, &gy], [&v, &wx, &wy]);
                let mut solver = Solver::new(Operator::new(width, v, wx, wy));
                let mut x = p.clone();
                let solution = solver.solve(&p, (&gx, &gy), &mut x, tolerance);
                assert!(
                    solution.iterations < MAX_ITERATIONS,
                    "{width}x{height} {orders}: {solution:?}"
                );
                let size = want.iter().fold(1.0f64, |m, x| m.max(x.abs()));
                for (x, want) in x.iter().zip(&want) {
                    let error = (f64::from(*x) - want).abs() / size;
                    assert!(
                        error < allowed,
                        "{width}x{height} {orders}: {x} against {want}"
                    );
                }
            }
        }
    }

    /// SplitMix64.
    fn mix(x: u64) -> u64 {
        let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }
}
