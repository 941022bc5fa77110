//! How far a picture is from the truth, from its two halves: they are independent, so what they disagree
//! about is noise (method.md section 5).

use super::blur::blur;
use crate::image::Image;

/// Smoothing of the squared disagreement, in pixels. One disagreement has one degree of freedom.
const SMOOTHING: f32 = 3.0;
/// In relMSE: added to the square of the picture (method.md section 8).
const EPSILON: f32 = 0.01;

/// The error of a picture.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Standard error of each pixel, smoothed.
    pub standard: Image,
    /// Mean of the squared error over the square of the picture + 0.01: relMSE without a reference. It
    /// does not see bias.
    pub rel_mse: f64,
}

/// The error of `picture`, the mean of `halves` weighted by `samples`.
pub fn estimate(picture: &Image, halves: &[Image; 2], samples: [u64; 2]) -> Estimated {
    let [na, nb] = samples.map(|n| n as f32);
    // The variances of the halves go as 1/n: that of the mean is this share of (A − B)².
    let share = na * nb / ((na + nb) * (na + nb));
    let mut standard = Image::new(picture.width, picture.height);
    let mut sum = 0.0;
    for c in 0..3 {
        let (a, b) = (&halves[0].channels[c], &halves[1].channels[c]);
        let mut variance: Vec<f32> = a
            .iter()
            .zip(b)
            .map(|(a, b)| share * (a - b) * (a - b))
            .collect();
        sum += variance
            .iter()
            .zip(&picture.channels[c])
            .map(|(v, i)| f64::from(v / (i * i + EPSILON)))
            .sum::<f64>();
        blur(&mut variance, picture.width, SMOOTHING);
        standard.channels[c] = variance.into_iter().map(f32::sqrt).collect();
    }
    Estimated {
        standard,
        rel_mse: sum / (3 * picture.width * picture.height) as f64,
    }
}
