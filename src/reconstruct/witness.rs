//! Witnesses: pictures of one half of the samples that tell the other half's solve of differences.
//!
//! How far a picture's differences are from the truth the other half tells: it is independent of them. So they enter the
//! other half's weighted solve as further observations of every difference, each with the inverse of its measured squared
//! error as its weight. Where they are wrong they hardly count, and with more samples they count less and less: the picture
//! is consistent.
//!
//! That error is measured over a neighbourhood, which says nothing of single pixels: the dots of a witness, the edges that it
//! has blurred. There the other half's own difference contradicts it, which has nothing like them. What is contradicted does not
//! count, and the rest, better than the average then, counts the more. Over the scenes that had no part in choosing the
//! constants the error of `weighted` is 0.68 (16 samples), 0.69 (64) and 0.76 (256) times what it is without, that of `guided`
//! 0.96.
//!
//! The witnesses also know what an outlier is: values and differences that are far from theirs count as if they varied more.
//! That, and the witness' measured error, see how far values are from it, not where they point, and change weights alone; the
//! brightness that outliers have is spread over their neighbourhood.
//!
//! The constants are the best of about three values each at 16, 64 and 256 samples on one half of the scenes (cornell, glossy,
//! ajar, pane, caustic, a curved mirror); the other half had no part in it.

use super::Solution;
use super::blur::{blur, blur_signed};
use super::conjugate_gradient::Solver;
use super::multigrid::Operator;
use super::weighted::{self, Channel, Weights};
use crate::estimate::Planes;
use rayon::prelude::*;

/// When the solver ends. What is left of the error is 0.3 to 2 % of the picture's squared error (glossy, mirrors at 4 and 16
/// samples, 512x512), for two thirds of the steps of the weighted picture's tolerance.
const TOLERANCE: f64 = 4e-3;
/// Over so many pixels a witness' own error is measured, and that of the weighted picture.
const TRUST: f32 = 6.0;
/// A witness' difference is contradicted whose square distance from the judge's is above so many variances of that: a dot of
/// the one half where the other has none, or an edge that a denoiser has blurred.
const CONTRADICTED: f32 = 4.0;
/// What is above counts so many times as the witness' squared error at that place: such a difference hardly counts. (Of
/// `weighted` the error is as 1, 0.84, 0.76 and 0.74 with 1, 4, 32 and 128, of ajar as 1, 0.97, 0.98 and 1.02.)
const AGAINST: f32 = 32.0;
/// Shares of the squared distances to the witnesses that add to the variances of differences and of values.
const OUTLIER: Outlier = Outlier {
    differences: 1.0 / 32.0,
    values: 1.0 / 32.0,
};
/// What is smoother than this many pixels has the brightness of the primal.
const BRIGHTNESS: f32 = 16.0;
/// By no more than this factor, or its inverse.
const BRIGHTER: f32 = 2.0;
/// A witness counts at most so many times as much as the half's own difference does before it is held against the witness. More has no less error, but the
/// solver takes six times as many steps (glossy at 1920x1080, 4 samples), as neighbouring weights are farther apart.
const STRONGEST: f32 = 128.0;

/// How the errors of a witness' differences go together.
#[derive(Clone, Copy)]
pub(super) struct Alike {
    /// Over so many pixels they are alike.
    pub(super) reach: f32,
    /// But for dots: what is contradicted says nothing of the rest. Where a denoiser has blurred an edge it has blurred others.
    pub(super) dots: bool,
}

struct Outlier {
    differences: f32,
    values: f32,
}

/// A channel of both halves, with what their witnesses say.
pub(super) struct Crossing<'a> {
    channel: &'a Channel,
    observed: [Observed; 2],
}

impl<'a> Crossing<'a> {
    /// Each half's weighted picture is the witness for the other half. Errors of its differences go together as `alike`
    /// says.
    pub(super) fn by_each_other(channel: &'a Channel, weighted: [&[f32]; 2], alike: Alike) -> Self {
        let observed = [0, 1].map(|half: usize| {
            let judge = &channel.halves[1 - half];
            Observed::new(weighted[half], judge, channel.width, alike)
        });
        Self { channel, observed }
    }

    /// Several pictures of each half are its witnesses, as far as they are better than the weighted ones.
    pub(super) fn new(
        channel: &'a Channel,
        weighted: [&[f32]; 2],
        witnesses: &[[&[f32]; 2]],
        alike: Alike,
    ) -> Self {
        let width = channel.width;
        let disagreement = squares(weighted[0], weighted[1], width);
        let observed = [0, 1].map(|half: usize| {
            let other = 1 - half;
            let all = witnesses.iter().map(|pictures| {
                let trust = trust(pictures[half], weighted[other], &disagreement, width);
                Observed::new(pictures[half], &channel.halves[other], width, alike)
                    .times(|i| trust[i])
            });
            all.reduce(Observed::and).expect("there is a witness")
        });
        Self { channel, observed }
    }

    /// The picture of the values of half `values`, with the witnesses that were made from half `witnesses`, from a first
    /// guess on, into `picture`.
    pub(super) fn solve(&self, values: usize, witnesses: usize, picture: &mut [f32]) -> Solution {
        let Channel {
            width,
            halves,
            weights,
        } = self.channel;
        let planes = &halves[values];
        let (operator, dx, dy) =
            self.observed[witnesses].join(&weights[1 - values], planes, *width);
        let primal = &planes.primal;
        let solution = Solver::new(operator).solve(primal, (&dx, &dy), picture, TOLERANCE);
        brighten(picture, primal, *width);
        solution
    }
}

/// Gives a picture the primal's low frequencies: by a factor, so that what is black stays so, and where that would be large, as
/// where hardly any sample found light, by a sum.
fn brighten(picture: &mut [f32], primal: &[f32], width: usize) {
    let (mut wanted, mut there) = (primal.to_vec(), picture.to_vec());
    blur_signed(&mut wanted, width, BRIGHTNESS);
    blur_signed(&mut there, width, BRIGHTNESS);
    for ((value, wanted), there) in picture.iter_mut().zip(wanted).zip(there) {
        let factor = if wanted > 0.0 && there > 0.0 {
            (wanted / there).clamp(1.0 / BRIGHTER, BRIGHTER)
        } else {
            1.0
        };
        *value = factor * *value + (wanted - factor * there);
    }
}

/// What witnesses say: values, differences, and the inverses of the differences' squared errors.
struct Observed {
    values: Vec<f32>,
    dx: Vec<f32>,
    dy: Vec<f32>,
    precision_x: Vec<f32>,
    precision_y: Vec<f32>,
}

impl Observed {
    /// A witness of one half, with its errors as the estimates of the other half tell them.
    fn new(witness: &[f32], judge: &Planes, width: usize, alike: Alike) -> Self {
        let [dx, dy] = differences(witness, width);
        let precision = |squared: Vec<f32>,
                         variance: &[f32],
                         fill: fn(&mut [f32], usize)|
         -> Vec<f32> {
            // Of the differences' squared errors, without the judge's own noise.
            let most = alike.dots.then_some(CONTRADICTED);
            let pairs = squared.par_iter().zip(variance);
            let excess = pairs.map(|(&s, v)| most.map_or(s, |most| s.min(most * v)) - v);
            let mut excess: Vec<f32> = excess.collect();
            fill(&mut excess, width);
            let (error, doubt) = measured(excess, width, alike.reach);
            let pairs = squared.par_iter().zip(variance);
            let against = pairs.map(|(s, v)| AGAINST * (s - CONTRADICTED * v));
            let all = error.par_iter().zip(&doubt).zip(against);
            all.map(|((e, d), against)| 1.0 / (e.max(0.0) + d).max(against).max(f32::MIN_POSITIVE))
                .collect()
        };
        let squared = |observed: &[f32], means: &[f32]| -> Vec<f32> {
            let pairs = observed.par_iter().zip(means);
            pairs.map(|(d, g)| (d - g) * (d - g)).collect()
        };
        let (x, y) = (squared(&dx, &judge.dx), squared(&dy, &judge.dy));
        Self {
            precision_x: precision(x, &judge.dx_variance, weighted::fill_last_column),
            precision_y: precision(y, &judge.dy_variance, weighted::fill_last_row),
            dx,
            dy,
            values: witness.to_vec(),
        }
    }

    /// The same as far as it is trusted.
    fn times(mut self, trust: impl Fn(usize) -> f32 + Sync) -> Self {
        for precision in [&mut self.precision_x, &mut self.precision_y] {
            let values = precision.par_iter_mut().enumerate();
            values.for_each(|(i, p)| *p *= trust(i));
        }
        self
    }

    /// Both, as if they erred independently.
    fn and(mut self, other: Self) -> Self {
        let join = |p: &mut [f32], d: &mut [f32], q: &[f32], e: &[f32]| {
            let all = p.par_iter_mut().zip(d).zip(q.par_iter().zip(e));
            all.for_each(|((p, d), (q, e))| {
                *d += (e - *d) * (q / (*p + q).max(f32::MIN_POSITIVE));
                *p += q;
            });
        };
        join(
            &mut self.precision_x,
            &mut self.dx,
            &other.precision_x,
            &other.dx,
        );
        join(
            &mut self.precision_y,
            &mut self.dy,
            &other.precision_y,
            &other.dy,
        );
        let values = self.values.iter_mut().zip(other.values);
        values.for_each(|(a, b)| *a = 0.5 * (*a + b));
        self
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
            let all = w.par_iter().zip(g).zip(precision.par_iter().zip(d));
            all.map(|((&w, &g), (&p, &d))| {
                // Not beyond what 32-bit floats can tell apart.
                let p = (p * weights.unit).min(weighted::LARGEST).min(STRONGEST * w);
                let w = doubted(w, OUTLIER.differences * (g - d) * (g - d) / weights.unit);
                (w + p, (w * g + p * d) / (w + p))
            })
            .unzip()
        };
        let (wx, dx) = join(&weights.dx, &values.dx, &self.precision_x, &self.dx);
        let (wy, dy) = join(&weights.dy, &values.dy, &self.precision_y, &self.dy);
        let of_values = weights
            .primal
            .par_iter()
            .zip(&values.primal)
            .zip(&self.values);
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

/// The squares of differences between two pictures, over the neighbourhood in which trust is measured.
fn squares(a: &[f32], b: &[f32], width: usize) -> Vec<f32> {
    let pairs = a.par_iter().zip(b);
    let mut squares: Vec<f32> = pairs.map(|(a, b)| (a - b) * (a - b)).collect();
    blur(&mut squares, width, TRUST);
    squares
}

/// How far a witness is to be believed, from 0 to 1: it is wrong at all scales where it is worse than the mean of the
/// weighted pictures, of which `other` is that of the half which the witness is not of. `disagreement` is the [`squares`]
/// between both.
fn trust(witness: &[f32], other: &[f32], disagreement: &[f32], width: usize) -> Vec<f32> {
    let against = squares(witness, other, width);
    // Of the two halves together half of one's: a quarter of what they disagree about.
    let pairs = disagreement.par_iter().zip(&against);
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
    let mut squares: Vec<f32> = values.par_iter().map(|v| v * v).collect();
    blur_signed(&mut values, width, sigma);
    blur(&mut squares, width, sigma);
    // Of the blur as many as this are as good as independent.
    let count = 4.0 * std::f32::consts::PI * sigma * sigma;
    let pairs = values.par_iter().zip(&squares);
    let doubt = pairs.map(|(m, s)| ((s - m * m).max(0.0) / count).sqrt());
    let doubt = doubt.collect();
    (values, doubt)
}

/// Differences to the right and to the lower neighbour; those across the border are 0.
fn differences(image: &[f32], width: usize) -> [Vec<f32>; 2] {
    let (mut dx, mut dy) = (vec![0.0; image.len()], vec![0.0; image.len()]);
    let rows = dx.par_chunks_mut(width).zip(dy.par_chunks_mut(width));
    rows.enumerate().for_each(|(y, (dx, dy))| {
        let row = &image[y * width..];
        for x in 0..width {
            if x + 1 < width {
                dx[x] = row[x + 1] - row[x];
            }
            if let Some(below) = row.get(x + width) {
                dy[x] = below - row[x];
            }
        }
    });
    [dx, dy]
}
