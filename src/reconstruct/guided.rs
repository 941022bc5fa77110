//! The weighted picture with a denoiser as a second witness of the differences.
//!
//! A denoised picture of one half of the samples has little variance and some bias. How far its differences are from the
//! truth the other half tells: it is independent of them. So they enter the other half's weighted solve as further
//! observations of every difference, each with the inverse of its measured squared error as its weight. Where they are
//! wrong they hardly count, and with more samples they count less and less: the picture is consistent, as a denoised one
//! is not.
//!
//! The witness also knows what an outlier is: values and differences that are far from it count as if they varied more.
//! That sees how far they are, not where they point, and changes weights alone.
//!
//! The constants are the best of about three values each on glossy, mirrors, ajar, caustic, cornell and still at 16 samples.

use super::blur::{blur, blur_signed};
use super::conjugate_gradient::Solver;
use super::multigrid::Operator;
use super::weighted::{self, Weights};
use super::{Reconstruction, Source};
use crate::denoise::Denoiser;
use crate::estimate::Planes;
use crate::image::Image;
use std::time::Instant;

/// When the solver ends. What is left of the error is 0.3 to 2 % of the picture's squared error (glossy, mirrors at 4 and 16
/// samples, 512x512), for two thirds of the steps of the weighted picture's tolerance.
const TOLERANCE: f64 = 4e-3;
/// Over so many pixels the error of the witness' differences is measured.
const DIFFERENCES: f32 = 3.0;
/// Over so many its own error, and that of the weighted picture.
const TRUST: f32 = 6.0;
/// Shares of the squared distances to the witness that add to the variances of differences and of values.
const OUTLIER: Outlier = Outlier {
    differences: 1.0 / 8.0,
    values: 1.0 / 32.0,
};
/// What is smoother than this has the brightness of the primal.
const BRIGHTNESS: f32 = 16.0;

struct Outlier {
    differences: f32,
    values: f32,
}

/// The picture; its halves are made of one half of the samples each, and beside them stands the weighted picture's pair,
/// against which bias is measured. Both halves need the samples that weighted needs.
pub(super) fn solve(source: &Source, denoiser: &Denoiser) -> Reconstruction {
    let width = source.size.0;
    let (weighted, mut solution) = weighted::solve(source);
    let primals = [0, 1].map(|half| source.images(half).primal);
    let witnesses = [0, 1].map(|half| denoiser.denoise(&primals[half], source.features));
    // Near enough to begin with.
    let mut crossed = weighted.clone();
    let mut own = weighted.clone();
    let mut seconds_halves = 0.0;
    for channel in 0..3 {
        let halves = [0, 1].map(|half| (source.planes)(half, channel));
        let weights = [0, 1].map(|half| Weights::new(&halves, half, width));
        let of = |images: &[Image; 2], half: usize| images[half].channels[channel].clone();
        let observed = [0, 1].map(|half| {
            let other = 1 - half;
            Observed::new(
                of(&witnesses, half),
                &halves[other],
                (&of(&weighted, other), &of(&weighted, half)),
                width,
            )
        });
        let mut solve = |pictures: &mut [Image; 2], values: usize, witness: usize| {
            let picture = &mut pictures[values].channels[channel];
            let (operator, dx, dy) =
                observed[witness].join(&weights[1 - values], &halves[values], width);
            let primal = &halves[values].primal;
            let ended = Solver::new(operator).solve(primal, (&dx, &dy), picture, TOLERANCE);
            solution.iterations += ended.iterations;
            solution.residual = solution.residual.max(ended.residual);
            brighten(picture, primal, width);
        };
        solve(&mut crossed, 0, 1);
        solve(&mut crossed, 1, 0);
        // For the error all of a half is to be by itself.
        let start = Instant::now();
        solve(&mut own, 0, 0);
        solve(&mut own, 1, 1);
        seconds_halves += start.elapsed().as_secs_f64();
    }
    Reconstruction {
        picture: source.merge(&crossed),
        halves: Some(own),
        unbiased: Some(weighted),
        solution,
        seconds_halves,
    }
}

/// Gives a picture the primal's low frequencies, by a factor: what is black stays so.
fn brighten(picture: &mut [f32], primal: &[f32], width: usize) {
    let (mut wanted, mut there) = (primal.to_vec(), picture.to_vec());
    blur_signed(&mut wanted, width, BRIGHTNESS);
    blur_signed(&mut there, width, BRIGHTNESS);
    for ((value, wanted), there) in picture.iter_mut().zip(wanted).zip(there) {
        if wanted > 0.0 && there > 0.0 {
            *value *= wanted / there;
        }
    }
}

/// A witness with its differences, and the inverses of their squared errors.
struct Observed {
    values: Vec<f32>,
    dx: Vec<f32>,
    dy: Vec<f32>,
    precision_x: Vec<f32>,
    precision_y: Vec<f32>,
}

impl Observed {
    /// Of a denoised picture, whose errors the other half tells: its estimates, and its weighted picture beside that
    /// of the witness' own half.
    fn new(
        witness: Vec<f32>,
        other: &Planes,
        (weighted, weighted_own): (&[f32], &[f32]),
        width: usize,
    ) -> Self {
        let [dx, dy] = differences(&witness, width);
        let trust = trust(&witness, (weighted, weighted_own), width);
        let precision = |observed: &[f32], means: &[f32], variances: &[f32]| -> Vec<f32> {
            let squared = observed.iter().zip(means).zip(variances);
            let squared = squared.map(|((d, g), v)| (d - g) * (d - g) - v).collect();
            let (error, doubt) = measured(squared, width, DIFFERENCES);
            let precisions = error.iter().zip(&doubt).zip(&trust);
            precisions
                .map(|((e, d), t)| t / (e.max(0.0) + d).max(f32::MIN_POSITIVE))
                .collect()
        };
        let mut other = other.clone();
        weighted::fill_last_differences(&mut other, width);
        Self {
            precision_x: precision(&dx, &other.dx, &other.dx_variance),
            precision_y: precision(&dy, &other.dy, &other.dy_variance),
            dx,
            dy,
            values: witness,
        }
    }

    /// The system of a half, with weights of the other half, in which these observations count too, and its
    /// differences.
    fn join(
        &self,
        weights: &Weights,
        values: &Planes,
        width: usize,
    ) -> (Operator, Vec<f32>, Vec<f32>) {
        let join = |w: &[f32], g: &[f32], precision: &[f32], d: &[f32]| -> (Vec<f32>, Vec<f32>) {
            let all = w.iter().zip(g).zip(precision.iter().zip(d));
            all.map(|((&w, &g), (&p, &d))| {
                // Not beyond what 32-bit floats can tell apart.
                let p = (p * weights.unit).min(weighted::LARGEST);
                let w = doubted(w, OUTLIER.differences * (g - d) * (g - d) / weights.unit);
                (w + p, (w * g + p * d) / (w + p))
            })
            .unzip()
        };
        let (wx, dx) = join(&weights.dx, &values.dx, &self.precision_x, &self.dx);
        let (wy, dy) = join(&weights.dy, &values.dy, &self.precision_y, &self.dy);
        let of_values = weights.primal.iter().zip(&values.primal).zip(&self.values);
        let v = of_values
            .map(|((&v, p), d)| doubted(v, OUTLIER.values * (p - d) * (p - d) / weights.unit));
        let operator = Operator::new(width, v.collect(), wx, wy);
        (operator, dx, dy)
    }
}

/// A weight whose variance is larger by this; never 0, to be divided by.
fn doubted(weight: f32, variance: f32) -> f32 {
    (weight / (1.0 + weight * variance)).max(f32::MIN_POSITIVE)
}

/// How far a witness is to be believed, from 0 to 1: it is wrong at all scales where it is worse than the weighted
/// picture.
fn trust(witness: &[f32], (weighted, weighted_own): (&[f32], &[f32]), width: usize) -> Vec<f32> {
    let squares = |a: &[f32], b: &[f32]| -> Vec<f32> {
        let mut squares: Vec<f32> = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).collect();
        blur(&mut squares, width, TRUST);
        squares
    };
    // Of the two halves together half of one's: a quarter of what they disagree about.
    let disagreement = squares(weighted, weighted_own);
    let against = squares(witness, weighted);
    let pairs = disagreement.iter().zip(&against);
    pairs
        .map(|(d, a)| {
            let error = (a - 0.5 * d).max(0.0);
            let variance = 0.25 * d;
            if error <= variance {
                1.0
            } else {
                variance / error
            }
        })
        .collect()
}

/// Means over a neighbourhood of `sigma` pixels, and the standard errors of these.
fn measured(mut values: Vec<f32>, width: usize, sigma: f32) -> (Vec<f32>, Vec<f32>) {
    let mut squares: Vec<f32> = values.iter().map(|v| v * v).collect();
    blur_signed(&mut values, width, sigma);
    blur(&mut squares, width, sigma);
    // Of the blur as many as this are as good as independent.
    let count = 4.0 * std::f32::consts::PI * sigma * sigma;
    let pairs = values.iter().zip(&squares);
    let doubt = pairs.map(|(m, s)| ((s - m * m).max(0.0) / count).sqrt());
    let doubt = doubt.collect();
    (values, doubt)
}

/// Differences to the right and to the lower neighbour; those across the border are 0.
fn differences(image: &[f32], width: usize) -> [Vec<f32>; 2] {
    let (mut dx, mut dy) = (vec![0.0; image.len()], vec![0.0; image.len()]);
    for i in 0..image.len() {
        if (i + 1) % width != 0 {
            dx[i] = image[i + 1] - image[i];
        }
        if i + width < image.len() {
            dy[i] = image[i + width] - image[i];
        }
    }
    [dx, dy]
}
