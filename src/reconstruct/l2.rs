//! L2: least squares with one weight α for the whole image, exactly. Unbiased; the sum of the picture
//! is the sum of the primal.

use super::Problem;
use super::dct::ScreenedPoisson;
use crate::image::Image;
use rayon::prelude::*;

/// The picture I that minimises Σ|DI − G|² + α²Σ|I − P|². With α = 0 gradients alone decide, but for
/// the mean, which is the primal's.
///
/// A noisy ramp, of which the differences are known:
///
/// ```
/// use gdpt::image::Image;
/// use gdpt::reconstruct::{Problem, l2};
///
/// let image = |row: [f32; 4]| Image { width: 4, height: 1, channels: [row.to_vec(), row.to_vec(), row.to_vec()] };
/// let primal = image([0.3, 0.8, 2.1, 2.8]);
/// // From each pixel to its right neighbour; the last one has none.
/// let (dx, dy) = (image([1.0, 1.0, 1.0, 0.0]), image([0.0; 4]));
/// let picture = l2::solve(&Problem { primal: &primal, dx: &dx, dy: &dy }, 0.0);
/// for (found, ramp) in picture.channels[0].iter().zip([0.0, 1.0, 2.0, 3.0]) {
///     assert!((found - ramp).abs() < 1e-5);
/// }
/// ```
pub fn solve(problem: &Problem, alpha: f32) -> Image {
    let (width, height) = (problem.primal.width, problem.primal.height);
    let solver = ScreenedPoisson::new(width, height);
    let channels = std::array::from_fn(|c| {
        let [primal, dx, dy] = [problem.primal, problem.dx, problem.dy].map(|i| &i.channels[c][..]);
        channel(&solver, primal, (dx, dy), alpha)
    });
    Image {
        width,
        height,
        channels,
    }
}

/// One channel of [`solve`].
pub(super) fn channel(
    solver: &ScreenedPoisson,
    primal: &[f32],
    (dx, dy): (&[f32], &[f32]),
    alpha: f32,
) -> Vec<f32> {
    let screen = alpha * alpha;
    let mut x = divergence(solver.size(), dx, dy);
    // Solve for the correction to the primal's mean: keeps the transform's rounding away from it.
    let mean = primal.iter().map(|&p| f64::from(p)).sum::<f64>() / primal.len().max(1) as f64;
    x.iter_mut()
        .zip(primal)
        .for_each(|(x, p)| *x += screen * (p - mean as f32));
    solver.solve(&mut x, screen, 1.0);
    x.iter_mut().for_each(|x| *x += mean as f32);
    x
}

/// Dᵀ G: what differences contribute to the right side of the normal equations.
pub fn divergence((width, height): (usize, usize), dx: &[f32], dy: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; width * height];
    out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = y * width..(y + 1) * width;
        let dx = &dx[row.start..row.end - 1];
        out.iter_mut().zip(dx).for_each(|(o, g)| *o -= g);
        out[1..].iter_mut().zip(dx).for_each(|(o, g)| *o += g);
        if y > 0 {
            let above = &dy[row.start - width..row.end - width];
            out.iter_mut().zip(above).for_each(|(o, g)| *o += g);
        }
        if y + 1 < height {
            out.iter_mut().zip(&dy[row]).for_each(|(o, g)| *o -= g);
        }
    });
    out
}
