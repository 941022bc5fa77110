//! Weighted least squares: every pixel and every difference counts by its own variance, first in either half of the
//! samples, then with the other half's picture as a witness.
//!
//! The film's two halves are independent. Weights from the variances of one half go with the values of
//! the other, and the other way round: so weights are independent of the noise that they weigh, and the
//! solve is as unbiased as one with constant weights. What the two halves' differences disagree about
//! adds to their variance: that trims outliers, which one half's variances cannot foresee. It is the one
//! place where these weights see the noise; it sees only how large it is, not where it points.
//!
//! A dot that all differences around it agree about stays so: of its half nothing contradicts it. The other half's picture
//! does. Its differences, as [witnesses](super::witness), take nothing to nine tenths of the error away, most where samples are
//! few and some of them rare.

use super::blur::blur;
use super::conjugate_gradient::Solver;
use super::dct::ScreenedPoisson;
use super::error_estimate::HalfPictures;
use super::multigrid::Operator;
use super::witness::{Alike, Crossing};
use super::{PAPER_ALPHA, Reconstruction, Solution, Source, l2};
use crate::estimate::Planes;
use crate::image::Image;
use rayon::prelude::*;

/// Variances are smoothed at two scales, in pixels, and averaged: the fine one follows shadows' edges, the
/// coarse one knows of rare events that a pixel may have missed. Of 2 to 12 each and their pairs this had
/// the least error over the shipped scenes.
const SMOOTHING: [f32; 2] = [2.0, 8.0];
/// Share of the squared disagreement of the halves that adds to a difference's variance. (A − B)²/2 would
/// be an unbiased estimate of one half's variance from itself; a quarter of that had the least error.
const DISAGREEMENT: f32 = 0.125;
/// No variance is taken to be less than this share of the mean: where nothing was seen to vary, there
/// may still be what has not been seen.
const FLOOR: f32 = 1e-2;
/// To that mean no pixel adds more than so many times the square of the mean standard deviation: a highlight of a few pixels
/// says nothing of the others.
const MOST: f32 = 100.0;
/// No variance is taken to be less than this share of the primal's mean variance.
const LEAST_SHARE: f32 = 1e-5;
/// So no weight is larger.
pub(super) const LARGEST: f32 = 1.0 / LEAST_SHARE;
/// Accuracy of the solve. As squares, what is left is about a hundredth of the picture's own noise
/// (cornell at 256x256 and at 1920x1080), a tenth where light is rare (ajar).
const TOLERANCE: f64 = 1.5e-3;
/// Fewer samples in a half do not tell a variance.
pub(super) const LEAST_SAMPLES: u64 = 2;

/// The errors of the other half's picture: single dots, and others.
const ALIKE: Alike = Alike {
    reach: 3.0,
    dots: true,
};

/// The picture, and as its halves those that have no part in each other. Both need [`LEAST_SAMPLES`].
pub(super) fn solve(source: &Source) -> Reconstruction {
    let (picture, halves, solution) = improved(source);
    Reconstruction {
        picture,
        halves: Some(HalfPictures::Improved(halves)),
        solution,
        seconds_halves: 0.0,
    }
}

/// The same picture, halves and end of the solver.
pub(super) fn improved(source: &Source) -> (Image, [Image; 2], Solution) {
    let (width, height) = source.size;
    let poisson = ScreenedPoisson::new(width, height);
    let mut halves = [(); 2].map(|()| Image::new(width, height));
    let mut crossed = halves.clone();
    let mut solution = Solution::default();
    for c in 0..3 {
        let channel = Channel::new(source, c);
        solution += channel.solve(&poisson, halves.each_mut().map(|h| &mut h.channels[c]));
        let of_halves = halves.each_ref().map(|half| &half.channels[c][..]);
        let crossing = Crossing::by_each_other(&channel, of_halves, ALIKE);
        for (values, picture) in crossed.iter_mut().enumerate() {
            let picture = &mut picture.channels[c];
            // Near enough to begin with.
            picture.copy_from_slice(of_halves[values]);
            solution += crossing.solve(values, 1 - values, picture);
        }
    }
    (source.merge(&crossed), halves, solution)
}

/// The pictures from the values of half A and of half B, by weights of the other one and nothing else of it. Both halves
/// need [`LEAST_SAMPLES`].
pub(super) fn halves(source: &Source) -> ([Image; 2], Solution) {
    let (width, height) = source.size;
    let poisson = ScreenedPoisson::new(width, height);
    let mut halves = [(); 2].map(|()| Image::new(width, height));
    let mut solution = Solution::default();
    for c in 0..3 {
        let channel = Channel::new(source, c);
        solution += channel.solve(&poisson, halves.each_mut().map(|h| &mut h.channels[c]));
    }
    (halves, solution)
}

/// A channel of both halves, with its weights.
pub(super) struct Channel {
    pub(super) width: usize,
    pub(super) halves: [Planes; 2],
    /// From the variances of the same half: for the values of the other.
    pub(super) weights: [Weights; 2],
}

impl Channel {
    pub(super) fn new(source: &Source, channel: usize) -> Self {
        let width = source.size.0;
        let halves = [0, 1].map(|half| (source.planes)(half, channel));
        Self {
            width,
            weights: [0, 1].map(|half| Weights::new(&halves, half, width)),
            halves,
        }
    }

    /// The pictures of the values of each half, by the weights of the other.
    fn solve(&self, poisson: &ScreenedPoisson, pictures: [&mut Vec<f32>; 2]) -> Solution {
        let mut solution = Solution::default();
        for (values, picture) in pictures.into_iter().enumerate() {
            let weights = &self.weights[1 - values];
            let [v, wx, wy] = [&weights.primal, &weights.dx, &weights.dy].map(Vec::clone);
            let operator = Operator::new(self.width, v, wx, wy);
            let Planes { primal, dx, dy, .. } = &self.halves[values];
            // L2 has the low frequencies nearly right, which take the most steps.
            *picture = l2::channel(poisson, primal, (dx, dy), PAPER_ALPHA);
            solution += Solver::new(operator).solve(primal, (dx, dy), picture, TOLERANCE);
        }
        solution
    }
}

/// What the halves' disagreement adds to the variances of dx and dy.
fn disagreement([a, b]: &[Planes; 2]) -> [Vec<f32>; 2] {
    [(&a.dx, &b.dx), (&a.dy, &b.dy)].map(|(a, b)| {
        let squared = a.par_iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squared.map(|d| DISAGREEMENT * d).collect()
    })
}

/// Differences across the border do not exist: what is known of them is 0, which smoothing would carry inside. So what is
/// known of their neighbours is put there; of dx.
pub(super) fn fill_last_column(of_dx: &mut [f32], width: usize) {
    if width > 1 {
        for row in of_dx.chunks_mut(width) {
            row[width - 1] = row[width - 2];
        }
    }
}

/// The same of dy.
pub(super) fn fill_last_row(of_dy: &mut [f32], width: usize) {
    let n = of_dy.len();
    if n > width {
        of_dy.copy_within(n - 2 * width..n - width, n - width);
    }
}

/// The inverse variances of one half.
pub(super) struct Weights {
    /// Of the primal.
    pub(super) primal: Vec<f32>,
    /// Of the differences to the right.
    pub(super) dx: Vec<f32>,
    /// Of the differences downwards.
    pub(super) dy: Vec<f32>,
    /// The variance whose weight is 1, so that weights are of order 1 for any scene.
    pub(super) unit: f32,
}

impl Weights {
    /// Those of half `of`; what the halves disagree about takes from them.
    pub(super) fn new(halves: &[Planes; 2], of: usize, width: usize) -> Self {
        let [disagree_x, disagree_y] = disagreement(halves);
        let half = &halves[of];
        let (mut x, mut y) = (half.dx_variance.clone(), half.dy_variance.clone());
        fill_last_column(&mut x, width);
        fill_last_row(&mut y, width);
        let mut v = smoothed(&half.primal_variance, width);
        let mut wx = smoothed(&x, width);
        let mut wy = smoothed(&y, width);
        let add = |w: &mut [f32], d: &[f32]| {
            w.par_iter_mut().zip(d).for_each(|(w, d)| *w += d);
        };
        add(&mut wx, &disagree_x);
        add(&mut wy, &disagree_y);
        // In units of the primal's variance.
        let unit = [&v, &wx, &wy]
            .into_iter()
            .map(|w| mean_of(w, |v| v))
            .find(|&m| m > 0.0)
            .unwrap_or(1.0);
        for w in [&mut v, &mut wx, &mut wy] {
            // Weights beyond this would drown the others in the rounding of 32-bit floats.
            let floor = (FLOOR * typical(w)).max(LEAST_SHARE * unit);
            w.par_iter_mut().for_each(|w| *w = unit / (*w + floor));
        }
        Self {
            primal: v,
            dx: wx,
            dy: wy,
            unit,
        }
    }
}

fn smoothed(variance: &[f32], width: usize) -> Vec<f32> {
    let [mut fine, mut coarse] = [variance.to_vec(), variance.to_vec()];
    blur(&mut fine, width, SMOOTHING[0]);
    blur(&mut coarse, width, SMOOTHING[1]);
    fine.par_iter_mut()
        .zip(coarse)
        .for_each(|(f, c)| *f = 0.5 * (*f + c));
    fine
}

/// The mean of variances, but for those that are far above it.
fn typical(variances: &[f32]) -> f32 {
    let most = MOST * mean_of(variances, f32::sqrt).powi(2);
    mean_of(variances, |v| v.min(most))
}

/// The mean of what `of` says of each.
fn mean_of(values: &[f32], of: impl Fn(f32) -> f32 + Sync) -> f32 {
    // In parts, whose order does not depend on the number of threads.
    let part = |values: &[f32]| values.iter().map(|&v| f64::from(of(v))).sum::<f64>();
    let parts: Vec<f64> = values.par_chunks(1 << 14).map(part).collect();
    (parts.iter().sum::<f64>() / values.len().max(1) as f64) as f32
}
