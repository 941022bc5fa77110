//! How far a picture is from the truth, from its two halves: they are independent, so what they disagree
//! about is noise. Of a biased picture the halves agree on what is wrong; that shows against other pictures of the halves,
//! which have no bias: (X_A - U_B)² is the bias squared and the variances of both.
//!
//! A picture that improves on the mean of its halves has taken noise from it. What is left is the mean's variance less the
//! square of what was taken, if the two have nothing to do with each other, as it is for a best estimate (Rao 1952);
//! where dots are made smaller, in place of being taken away, less is left than that. So it is an upper estimate, but for what is
//! taken wrongly.

use super::blur::{blur, blur_signed};
use crate::image::Image;
use rayon::prelude::*;

/// Smoothing of the squared disagreement, in pixels. One disagreement has one degree of freedom.
const SMOOTHING: f32 = 3.0;
/// In relMSE: added to the square of the picture.
const EPSILON: f32 = 0.01;

/// Pictures of one half of the samples each, independent of one another.
#[derive(Clone, Debug)]
pub enum HalfPictures {
    /// Made as the picture of all is, which has about half their variance.
    Alike([Image; 2]),
    /// The same of a picture with bias, and others without bias worth the name, to measure it.
    Biased {
        /// With the picture's bias.
        halves: [Image; 2],
        /// Without.
        unbiased: [Image; 2],
    },
    /// The picture of all improves on their mean.
    Improved([Image; 2]),
}

impl HalfPictures {
    /// The pictures that are closest to the picture of all.
    pub fn pictures(&self) -> &[Image; 2] {
        match self {
            HalfPictures::Alike(halves)
            | HalfPictures::Improved(halves)
            | HalfPictures::Biased { halves, .. } => halves,
        }
    }
}

/// The error of a picture.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Standard error of each pixel, smoothed.
    pub standard: Image,
    /// Mean of the squared error over the square of the picture + 0.01: relMSE without a reference. It
    /// sees nothing that no sample has found yet, and bias only of [`HalfPictures::Biased`].
    pub rel_mse: f64,
}

/// An image, and what is known of its error.
#[derive(Clone, Copy, Debug)]
pub struct Halved<'a> {
    /// All samples.
    pub all: &'a Image,
    /// Of half A and of half B.
    pub halves: &'a HalfPictures,
}

/// The error of the sum of what was reconstructed and of light seen directly. `samples` are those of the
/// halves.
pub fn estimate(solved: Halved, direct: Halved, samples: [u64; 2]) -> Estimated {
    let [na, nb] = samples.map(|n| n as f32);
    // The variances of the halves go as 1/n: that of the mean is this share of (A − B)².
    let share = na * nb / ((na + nb) * (na + nb));
    let (width, height) = (solved.all.width, solved.all.height);
    let mut standard = Image::new(width, height);
    let mut sum = 0.0;
    for c in 0..3 {
        let difference = |images: &[Image; 2]| -> Vec<f32> {
            let (a, b) = (&images[0].channels[c], &images[1].channels[c]);
            a.iter().zip(b).map(|(a, b)| a - b).collect()
        };
        let (of_solved, of_direct) = (
            difference(solved.halves.pictures()),
            difference(direct.halves.pictures()),
        );
        // The picture's own noise must not be divided by: an outlier would hide itself.
        let mut brightness = median(&solved.all.channels[c], width);
        let seen = &direct.all.channels[c];
        brightness.iter_mut().zip(seen).for_each(|(b, d)| *b += d);
        // What the halves' variance leaves out, of either sign.
        let mut rest = match solved.halves {
            HalfPictures::Alike(_) => vec![0.0; of_solved.len()],
            HalfPictures::Biased { halves, unbiased } => bias(halves, unbiased, c),
            HalfPictures::Improved(halves) => taken(solved.all, halves, [na, nb], c),
        };
        let errors = of_solved.iter().zip(&of_direct).zip(&rest);
        for (((s, d), b), i) in errors.zip(&brightness) {
            sum += f64::from((share * (s + d) * (s + d) + b) / (i * i + EPSILON));
        }
        // Light seen directly has error at the edges of lamps alone: that is not spread.
        let mut variance: Vec<f32> = of_solved.iter().map(|s| share * s * s).collect();
        blur(&mut variance, width, SMOOTHING);
        match solved.halves {
            HalfPictures::Alike(_) => {}
            HalfPictures::Biased { .. } => {
                blur_signed(&mut rest, width, SMOOTHING);
                rest.iter_mut().for_each(|bias| *bias = bias.max(0.0));
            }
            HalfPictures::Improved(_) => blur_signed(&mut rest, width, SMOOTHING),
        }
        let total = variance
            .iter()
            .zip(&of_direct)
            .zip(&rest)
            .map(|((v, d), b)| (v + b).max(0.0) + share * d * d);
        standard.channels[c] = total.map(f32::sqrt).collect();
    }
    Estimated {
        standard,
        // Of nearly nothing the rest may come out below it.
        rel_mse: (sum / (3 * width * height) as f64).max(0.0),
    }
}

/// What a picture has less of each pixel's variance than the mean of its halves: minus the square of what it took from it.
fn taken(all: &Image, halves: &[Image; 2], [na, nb]: [f32; 2], channel: usize) -> Vec<f32> {
    let [a, b] = halves.each_ref().map(|half| &half.channels[channel]);
    let pairs = a.iter().zip(b).zip(&all.channels[channel]);
    let taken = pairs.map(|((a, b), x)| x - (a + (b - a) * (nb / (na + nb))));
    taken.map(|t| -t * t).collect()
}

/// The squared bias of each pixel of a channel, of either sign by the noise in it.
fn bias(halves: &[Image; 2], unbiased: &[Image; 2], channel: usize) -> Vec<f32> {
    let of = |images: &[Image; 2]| {
        let [a, b] = images;
        [a, b].map(|image| image.channels[channel].clone())
    };
    let ([xa, xb], [ua, ub]) = (of(halves), of(unbiased));
    let square = |a: f32, b: f32| (a - b) * (a - b);
    (0..xa.len())
        .map(|i| {
            let across = square(xa[i], ub[i]) + square(xb[i], ua[i]);
            0.5 * (across - square(ua[i], ub[i]) - square(xa[i], xb[i]))
        })
        .collect()
}

/// The median of each pixel and its eight neighbours; beyond the border the border's pixels again.
fn median(data: &[f32], width: usize) -> Vec<f32> {
    let height = data.len() / width;
    let sorted = |a: f32, b: f32, c: f32| {
        let (low, high) = (a.min(b), a.max(b));
        (low.min(c), low.max(high.min(c)), high.max(c))
    };
    let mut out = vec![0.0; data.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = |y: usize| &data[y * width..(y + 1) * width];
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(row);
        let column = |x: usize| sorted(rows[0][x], rows[1][x], rows[2][x]);
        for (x, out) in out.iter_mut().enumerate() {
            // Columns sorted, the median of all is that of the largest of the smallest, the median of the
            // medians, and the smallest of the largest.
            let [a, b, c] = [x.saturating_sub(1), x, (x + 1).min(width - 1)].map(column);
            let (_, middle, _) = sorted(a.1, b.1, c.1);
            *out = sorted(a.0.max(b.0).max(c.0), middle, a.2.min(b.2).min(c.2)).1;
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_those_of_sorted_neighbours() {
        let (width, height) = (7, 5);
        let data: Vec<f32> = (0..width * height)
            .map(|i| (i * 7919 % 101) as f32)
            .collect();
        let median = median(&data, width);
        for y in 0..height {
            for x in 0..width {
                let mut around = Vec::new();
                for (dy, dx) in (0..3).flat_map(|dy| (0..3).map(move |dx| (dy, dx))) {
                    let y = (y + dy).saturating_sub(1).min(height - 1);
                    let x = (x + dx).saturating_sub(1).min(width - 1);
                    around.push(data[y * width + x]);
                }
                around.sort_by(f32::total_cmp);
                assert_eq!(median[y * width + x], around[4], "{x},{y}");
            }
        }
    }
}
