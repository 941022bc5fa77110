//! L1: least absolute residuals, by iteratively reweighted least squares. Robust to outliers, slightly
//! biased. The residual of a pixel or of a difference is the length of its RGB vector, so that the
//! channels agree on what is an outlier.

use super::conjugate_gradient::Solver;
use super::multigrid::Operator;
use super::{Problem, Solution, l2};
use crate::image::Image;
use rayon::prelude::*;

/// Rounds of reweighting, and the decay of the regulariser from one to the next (the paper's code). It
/// begins at the mean residual of L2, where the paper's code has 0.05 for any image: so it fits images
/// of any brightness, and outliers that L2 has spread far are undone before the weights freeze.
const ROUNDS: i32 = 10;
const DECAY: f32 = 0.25;
/// Residuals below this share of the image's brightness are rounding errors.
const ROUNDING: f32 = 1e-5;
/// Accuracy and effort of one round.
const TOLERANCE: f64 = 1e-3;

/// The picture I that minimises Σ|DI − G| + αΣ|I − P|.
pub fn solve(problem: &Problem, alpha: f32) -> (Image, Solution) {
    let width = problem.primal.width;
    let mut picture = l2::solve(problem, alpha);
    let first = mean_residual(problem, &picture);
    let floor = (ROUNDING * mean_absolute(problem.primal)).max(f32::MIN_POSITIVE);
    let mut ended = Solution::default();
    for round in 0..ROUNDS {
        let regulariser = (first * DECAY.powi(round)).max(floor);
        let (v, wx, wy) = weights(problem, &picture, alpha, regulariser);
        let mut residual = 0.0f64;
        let mut solver = Solver::new(Operator::new(width, v, wx, wy));
        for c in 0..3 {
            let differences = (&problem.dx.channels[c][..], &problem.dy.channels[c][..]);
            let primal = &problem.primal.channels[c];
            let s = solver.solve(primal, differences, &mut picture.channels[c], TOLERANCE);
            ended.iterations += s.iterations;
            residual = residual.max(s.residual);
        }
        ended.residual = residual;
    }
    (picture, ended)
}

/// The lengths of the residuals of pixel (`i` = y * width + x) and of its differences to the right and
/// downwards; 0 for a difference that does not exist.
#[inline]
fn residuals(problem: &Problem, picture: &Image, i: usize) -> (f32, f32, f32) {
    let (width, height) = (picture.width, picture.height);
    let own = picture.get(i);
    let difference = |exists: bool, other: usize, g: &Image| {
        if exists {
            (picture.get(other) - own - g.get(i)).length()
        } else {
            0.0
        }
    };
    (
        (own - problem.primal.get(i)).length(),
        difference(i % width + 1 < width, i + 1, problem.dx),
        difference(i / width + 1 < height, i + width, problem.dy),
    )
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

fn mean_residual(problem: &Problem, picture: &Image) -> f32 {
    let n = picture.width * picture.height;
    let sum: f64 = (0..n)
        .map(|i| residuals(problem, picture, i))
        .map(|(p, x, y)| f64::from(p + x + y))
        .sum();
    (sum / (3 * n) as f64) as f32
}

/// 1/|residual| for pixels (times α) and differences, scaled so that the largest possible is 1.
fn weights(
    problem: &Problem,
    picture: &Image,
    alpha: f32,
    regulariser: f32,
) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
    let weight = |residual: f32| regulariser / (residual + regulariser);
    let n = picture.width * picture.height;
    let (mut v, mut wx, mut wy) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    v.par_iter_mut()
        .zip(&mut wx)
        .zip(&mut wy)
        .enumerate()
        .for_each(|(i, ((v, wx), wy))| {
            let (p, x, y) = residuals(problem, picture, i);
            (*v, *wx, *wy) = (alpha * weight(p), weight(x), weight(y));
        });
    (v, wx, wy)
}
