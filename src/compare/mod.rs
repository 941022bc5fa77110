//! How far an image is from references.
//!
//! With two independent references R₁ and R₂, (I − R₁)(I − R₂) is an unbiased estimate of (I − R)²: their
//! own noise cancels. With one, its noise counts as error.

mod similarity;
mod specks;

pub use similarity::{psnr, ssim};

use crate::image::Image;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Added to the square of the reference in relMSE.
pub const EPSILON: f64 = 0.01;
/// The share of pixels that the trimmed error leaves out.
const WORST: f64 = 0.001;
/// Side of the squares over which errors of the references may be correlated.
const BLOCK: usize = 16;

/// References for the same picture.
#[derive(Clone, Copy, Debug)]
pub enum References<'a> {
    /// One, whose noise counts as error.
    One(&'a Image),
    /// Two independent ones of the same quality.
    Two(&'a Image, &'a Image),
}

/// An error, with what is known of its own uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// The estimate. That of an error that is far below the references' noise may be negative.
    pub value: f64,
    /// Half of the 95 % interval around it: what the references' noise makes uncertain, for this image.
    /// Of one reference nothing is known. For relMSE it leaves out that noisy references have noisy squares
    /// to divide by, which matters where they are dark.
    pub interval: Option<f64>,
}

/// Errors of an image against references, over all pixels and channels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Mean squared error.
    pub mse: Measured,
    /// Mean of the squared error over the square of the reference + 0.01.
    pub rel_mse: Measured,
    /// The same without the worst 0.1 % of pixels.
    pub rel_mse_trimmed: f64,
    /// What of the relative squared error is dots and dashes: that of the Laplacian, over that of white noise, so that
    /// it is relMSE where neighbouring pixels err independently, and next to nothing where they err alike.
    pub rel_mse_specks: f64,
    /// Mean of image minus reference.
    pub bias: f64,
    /// The same as a share of the reference's mean; `None` for a black reference.
    pub rel_bias: Option<f64>,
}

/// Errors, and how alike the pictures are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The errors.
    #[serde(flatten)]
    pub errors: Errors,
    /// Peak signal-to-noise ratio in decibels, of the pictures in sRGB.
    pub psnr: f64,
    /// Structural similarity of the pictures' luma in sRGB, at most 1; `None` for pictures smaller than its
    /// window of 11 by 11 pixels.
    pub ssim: Option<f64>,
}

impl References<'_> {
    /// Their mean.
    pub fn mean(&self) -> Image {
        match self {
            References::One(r) => (*r).clone(),
            References::Two(a, b) => {
                let mut mean = (*a).clone().plus(b);
                let values = mean.channels.iter_mut().flatten();
                values.for_each(|v| *v *= 0.5);
                mean
            }
        }
    }

    /// The references' values, the second that of the first where there is one.
    fn at(&self, channel: usize, index: usize) -> [f64; 2] {
        let (a, b) = match self {
            References::One(r) => (r, r),
            References::Two(a, b) => (a, b),
        };
        [a, b].map(|r| f64::from(r.channels[channel][index]))
    }

    fn are_two(&self) -> bool {
        matches!(self, References::Two(..))
    }
}

/// Squared errors of each pixel: the mean over the channels.
struct PixelErrors {
    width: usize,
    /// Estimates of (I − R)².
    squared: Vec<f64>,
    /// Over R² + 0.01.
    relative: Vec<f64>,
    /// Half the difference between what the two references say alone, of which see [`interval`].
    spread: Vec<f64>,
    relative_spread: Vec<f64>,
    /// By what pixels are called the worst: not by the product, whose noise would choose too.
    badness: Vec<f64>,
}

impl PixelErrors {
    fn new(image: &Image, references: References) -> Self {
        let pixels = image.width * image.height;
        let zeros = || vec![0.0; pixels];
        let mut errors = Self {
            width: image.width,
            squared: zeros(),
            relative: zeros(),
            spread: zeros(),
            relative_spread: zeros(),
            badness: zeros(),
        };
        for c in 0..3 {
            for i in 0..pixels {
                let [e1, e2] = references
                    .at(c, i)
                    .map(|r| f64::from(image.channels[c][i]) - r);
                let [r1, r2] = references.at(c, i);
                let reference = 0.5 * (r1 + r2);
                let weight = 1.0 / 3.0;
                let relative = weight / (reference * reference + EPSILON);
                errors.squared[i] += weight * e1 * e2;
                errors.relative[i] += relative * e1 * e2;
                errors.badness[i] += relative * (e1 * e1 + e2 * e2);
                let spread = 0.5 * (e1 * e1 - e2 * e2);
                errors.spread[i] += weight * spread;
                errors.relative_spread[i] += relative * spread;
            }
        }
        errors
    }
}

/// Compares an image to references of its size.
pub fn compare(image: &Image, references: References) -> Comparison {
    let reference = references.mean();
    Comparison {
        errors: errors(image, references),
        psnr: psnr(image, &reference),
        ssim: ssim(image, &reference),
    }
}

/// The errors alone.
pub fn errors(image: &Image, references: References) -> Errors {
    let errors = PixelErrors::new(image, references);
    let measured = |values: &[f64], spread: &[f64]| Measured {
        value: mean(values),
        interval: references.are_two().then(|| interval(spread, errors.width)),
    };
    let reference = references.mean();
    let mean_of = |image: &Image| {
        let values = image.channels.iter().flatten();
        let count = 3 * image.width * image.height;
        values.map(|&v| f64::from(v)).sum::<f64>() / count as f64
    };
    let bias = mean_of(image) - mean_of(&reference);
    Errors {
        mse: measured(&errors.squared, &errors.spread),
        rel_mse: measured(&errors.relative, &errors.relative_spread),
        rel_mse_trimmed: trimmed(&errors),
        rel_mse_specks: specks::rel_mse_specks(image, references),
        bias,
        rel_bias: Some(bias / mean_of(&reference)).filter(|b| b.is_finite()),
    }
}

/// The relative squared error of each pixel, as relMSE has it.
pub fn relative_errors(image: &Image, references: References) -> Vec<f32> {
    let errors = PixelErrors::new(image, references);
    errors.relative.iter().map(|&e| e as f32).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Half of the 95 % interval of the mean of (I − R₁)(I − R₂).
///
/// With C the covariance of the references' noise, and if it is normal and of one quality in both,
/// products at pixels i and j with errors e have the covariance 2C e_i e_j + C². This is also the mean of q_i q_j for the spread q = ((I − R₁)² − (I − R₂)²)/2, so
/// the square of the sum of q estimates the variance of the sum of products: over blocks, as far as the
/// noise of a reconstructed reference is correlated. Few blocks that count know it badly: Student's t.
fn interval(spread: &[f64], width: usize) -> f64 {
    let columns = width.div_ceil(BLOCK);
    let height = spread.len() / width;
    let mut blocks = vec![0.0; columns * height.div_ceil(BLOCK)];
    for (i, q) in spread.iter().enumerate() {
        blocks[i / width / BLOCK * columns + i % width / BLOCK] += q;
    }
    let variance: f64 = blocks.iter().map(|q| q * q).sum();
    if variance == 0.0 {
        return 0.0;
    }
    let fourth: f64 = blocks.iter().map(|q| q.powi(4)).sum();
    let freedom = variance * variance / fourth;
    let quantile = StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975));
    quantile * variance.sqrt() / spread.len() as f64
}

/// The mean without the worst pixels.
fn trimmed(errors: &PixelErrors) -> f64 {
    let mut order: Vec<usize> = (0..errors.relative.len()).collect();
    order.sort_by(|&a, &b| errors.badness[a].total_cmp(&errors.badness[b]));
    let kept = order.len() - (order.len() as f64 * WORST) as usize;
    order.truncate(kept);
    let sum: f64 = order.iter().map(|&i| errors.relative[i]).sum();
    sum / kept as f64
}
