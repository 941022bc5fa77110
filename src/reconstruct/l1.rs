//! L1: least absolute residuals, by iteratively reweighted least squares. Robust to outliers, slightly
//! biased. The residual of a pixel or of a difference is the length of its RGB vector, so that the
//! channels agree on what is an outlier.

use super::conjugate_gradient::Weighted;
use super::dct::ScreenedPoisson;
use super::{Problem, Solution, l2};
use crate::image::Image;
use rayon::prelude::*;

/// Rounds of reweighting, the regulariser of the first one and its decay (the paper's code).
const ROUNDS: i32 = 20;
const REGULARISER: f32 = 0.05;
const DECAY: f32 = 0.5;
/// Accuracy and effort of one round.
const TOLERANCE: f64 = 1e-3;
const MAX_ITERATIONS: usize = 50;

/// The picture I that minimises Σ|DI − G| + αΣ|I − P|.
pub fn solve(problem: &Problem, alpha: f32) -> (Image, Solution) {
    let (width, height) = (problem.primal.width, problem.primal.height);
    let preconditioner = ScreenedPoisson::new(width, height);
    let mut picture = l2::solve(problem, alpha);
    // The regulariser is relative to the image's brightness.
    let brightness = mean_absolute(problem.primal).max(f32::MIN_POSITIVE);
    let mut ended = Solution::default();
    for round in 0..ROUNDS {
        let regulariser = REGULARISER * DECAY.powi(round) * brightness;
        let (v, wx, wy) = weights(problem, &picture, alpha, regulariser);
        let mut residual = 0.0f64;
        for c in 0..3 {
            let system = Weighted {
                size: (width, height),
                primal: &problem.primal.channels[c],
                dx: &problem.dx.channels[c],
                dy: &problem.dy.channels[c],
                v: &v,
                w: (&wx, &wy),
            };
            let s = system.solve(
                &preconditioner,
                &mut picture.channels[c],
                TOLERANCE,
                MAX_ITERATIONS,
            );
            ended.iterations += s.iterations;
            residual = residual.max(s.residual);
        }
        ended.residual = residual;
    }
    (picture, ended)
}

/// 1/|residual| for pixels (times α) and differences, scaled so that the largest possible is 1.
fn weights(
    problem: &Problem,
    picture: &Image,
    alpha: f32,
    regulariser: f32,
) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
    let (width, height) = (picture.width, picture.height);
    let weight = |residual: f32| regulariser / (residual + regulariser);
    let each = |f: &(dyn Fn(usize, usize, usize) -> f32 + Sync)| -> Vec<f32> {
        (0..width * height)
            .into_par_iter()
            .map(|i| f(i, i % width, i / width))
            .collect()
    };
    let v = each(&|i, _, _| {
        let r = (picture.get(i) - problem.primal.get(i)).length();
        alpha * weight(r)
    });
    let wx = each(&|i, x, _| {
        if x + 1 == width {
            return 0.0;
        }
        weight((picture.get(i + 1) - picture.get(i) - problem.dx.get(i)).length())
    });
    let wy = each(&|i, _, y| {
        if y + 1 == height {
            return 0.0;
        }
        weight((picture.get(i + width) - picture.get(i) - problem.dy.get(i)).length())
    });
    (v, wx, wy)
}

fn mean_absolute(image: &Image) -> f32 {
    let sum: f64 = image
        .channels
        .iter()
        .flatten()
        .map(|&x| f64::from(x.abs()))
        .sum();
    (sum / (3 * image.width * image.height) as f64) as f32
}
