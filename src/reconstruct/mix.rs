//! Pixel by pixel the mean of the weighted picture and of two denoised ones, of the primal and of the weighted picture,
//! by the inverses of their squared errors.
//!
//! The halves tell the errors of each other's pictures: nothing is denoised away that the samples contradict, so there is
//! next to no bias.

use super::blur::{blur, blur_signed};
use super::{Reconstruction, Source, weighted};
use crate::denoise::Denoiser;
use crate::image::Image;

/// Over so many pixels errors are measured.
const SMOOTHING: f32 = 4.0;

/// The picture; its halves are made of one half of the samples each, but for the weights. Both halves need the samples
/// that weighted needs.
pub(super) fn solve(source: &Source, denoiser: &Denoiser) -> Reconstruction {
    let (width, height) = source.size;
    let (weighted, solution) = weighted::solve(source);
    let denoise =
        |images: &[Image; 2]| [0, 1].map(|half| denoiser.denoise(&images[half], source.features));
    let primals = [0, 1].map(|half| source.images(half).primal);
    let not_negative = weighted.clone().map(|mut image| {
        let values = image.channels.iter_mut().flatten();
        values.for_each(|v| *v = v.max(0.0));
        image
    });
    let candidates = [weighted.clone(), denoise(&primals), denoise(&not_negative)];
    let mut sum = vec![0f32; width * height];
    let mut halves = [(); 2].map(|()| Image::new(width, height));
    for candidate in &candidates {
        let errors = errors(candidate, &weighted, width);
        for (pixel, error) in errors.iter().enumerate() {
            let share = 1.0 / error;
            sum[pixel] += share;
            for (half, of_candidate) in halves.iter_mut().zip(candidate) {
                half.set(pixel, half.get(pixel) + share * of_candidate.get(pixel));
            }
        }
    }
    for half in &mut halves {
        for (pixel, sum) in sum.iter().enumerate() {
            half.set(pixel, half.get(pixel) / *sum);
        }
    }
    Reconstruction {
        picture: source.merge(&halves),
        halves: Some(halves),
        unbiased: Some(weighted),
        solution,
        seconds_halves: 0.0,
    }
}

/// The squared errors, positive, of the mean of a candidate's halves, over the channels: how far each is from the other
/// half's weighted picture, less the variance of that; of its own variance one half.
fn errors(candidate: &[Image; 2], weighted: &[Image; 2], width: usize) -> Vec<f32> {
    let squares = |a: &Image, b: &Image| -> Vec<f32> {
        let square = |pixel| (a.get(pixel) - b.get(pixel)).length_squared();
        (0..a.width * a.height).map(square).collect()
    };
    let blurred = |mut values: Vec<f32>| {
        blur(&mut values, width, SMOOTHING);
        values
    };
    let across = squares(&candidate[0], &weighted[1]);
    let back = squares(&candidate[1], &weighted[0]);
    let both = across.iter().zip(&back).map(|(a, b)| 0.5 * (a + b));
    let noise = squares(&weighted[0], &weighted[1]);
    let own = squares(&candidate[0], &candidate[1]);
    let excess = both.zip(&noise).zip(&own);
    let mut bias: Vec<f32> = excess.map(|((e, n), o)| e - 0.5 * n - 0.5 * o).collect();
    let mut squared: Vec<f32> = bias.iter().map(|b| b * b).collect();
    blur_signed(&mut bias, width, SMOOTHING);
    blur(&mut squared, width, SMOOTHING);
    let count = 4.0 * std::f32::consts::PI * SMOOTHING * SMOOTHING;
    let variance = blurred(own);
    let all = bias.iter().zip(&squared).zip(&variance);
    all.map(|((b, s), v)| {
        let doubt = ((s - b * b).max(0.0) / count).sqrt();
        (b.max(0.0) + doubt + 0.25 * v).max(f32::MIN_POSITIVE)
    })
    .collect()
}
