//! Reconstruction: the picture whose values fit the primal and whose differences fit dx and dy, by a
//! screened Poisson equation (Kettunen et al. 2015, section 4; method.md section 6).

mod conjugate_gradient;
mod dct;
pub mod l1;
pub mod l2;

use crate::image::Image;

/// What is to be fitted: primal and differences, each without light seen directly.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The path-traced image.
    pub primal: &'a Image,
    /// Differences to the right neighbour; the last column does not count.
    pub dx: &'a Image,
    /// Differences to the lower neighbour; the last row does not count.
    pub dy: &'a Image,
}

/// How a solver ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solution {
    /// Iterations of conjugate gradients, over all channels and outer rounds; 0 for a direct solve.
    pub iterations: usize,
    /// Largest relative residual over the channels, 0 for a direct solve.
    pub residual: f64,
}

/// Dᵀ(w G): what weighted differences contribute to the right side of the normal equations. `None` is
/// weight 1.
fn divergence(
    (width, height): (usize, usize),
    dx: &[f32],
    dy: &[f32],
    weights: Option<(&[f32], &[f32])>,
) -> Vec<f32> {
    let mut out = vec![0.0; width * height];
    let (wx, wy) = weights.unzip();
    let weighted = |g: &[f32], w: Option<&[f32]>, i: usize| g[i] * w.map_or(1.0, |w| w[i]);
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            if x + 1 < width {
                let g = weighted(dx, wx, i);
                out[i] -= g;
                out[i + 1] += g;
            }
            if y + 1 < height {
                let g = weighted(dy, wy, i);
                out[i] -= g;
                out[i + width] += g;
            }
        }
    }
    out
}
