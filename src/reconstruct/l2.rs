//! L2: least squares with one weight α for the whole image, exactly. Unbiased; the sum of the picture
//! is the sum of the primal.

use super::dct::ScreenedPoisson;
use super::{Problem, divergence};
use crate::image::Image;

/// The picture I that minimises Σ|DI − G|² + α²Σ|I − P|². With α = 0 gradients alone decide, but for
/// the mean, which is the primal's.
pub fn solve(problem: &Problem, alpha: f32) -> Image {
    let (width, height) = (problem.primal.width, problem.primal.height);
    let solver = ScreenedPoisson::new(width, height);
    let screen = alpha * alpha;
    let channels = std::array::from_fn(|c| {
        let primal = &problem.primal.channels[c];
        let mut x = divergence(
            (width, height),
            &problem.dx.channels[c],
            &problem.dy.channels[c],
            None,
        );
        // Solve for the correction to the primal's mean: keeps the transform's rounding away from it.
        let mean = primal.iter().map(|&p| f64::from(p)).sum::<f64>() / primal.len().max(1) as f64;
        x.iter_mut()
            .zip(primal)
            .for_each(|(x, p)| *x += screen * (p - mean as f32));
        solver.solve(&mut x, screen, 1.0);
        x.iter_mut().for_each(|x| *x += mean as f32);
        x
    });
    Image {
        width,
        height,
        channels,
    }
}
