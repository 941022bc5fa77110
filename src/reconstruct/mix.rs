//! Pixel by pixel the mean of the weighted picture and of two denoised ones, of the primal and of the weighted picture,
//! by the inverses of their squared errors.
//!
//! The halves tell the errors of each other's pictures: nothing is denoised away that the samples contradict, so there is
//! next to no bias.

use super::blur::{blur, blur_signed};
use super::error_estimate::HalfPictures;
use super::{Reconstruction, Source, weighted};
use crate::denoise::Denoiser;
use crate::image::Image;

/// Over so many pixels errors are measured.
const SMOOTHING: f32 = 4.0;
/// So much of the variance of its halves' mean an improved picture has at least.
const LEAST_VARIANCE: f32 = 0.05;

/// The picture; its halves are made of one half of the samples each, but for the weights, and have the weighted halves in
/// place of the improved picture: their errors are rather larger. Both halves need the samples
/// that weighted needs.
pub(super) fn solve(source: &Source, denoiser: &Denoiser) -> Reconstruction {
    let (width, height) = source.size;
    let (improved, weighted, solution) = weighted::improved(source);
    let [of_primal, of_weighted] = denoised(source, &weighted, denoiser);
    let pictures = [&of_primal, &of_weighted].map(|halves| source.merge(halves));
    let [first, second] = &pictures;
    let candidates = [
        (&improved, &weighted),
        (first, &of_primal),
        (second, &of_weighted),
    ];
    let taken = blurred(squares(&improved, &source.merge(&weighted)), width);
    let errors = [
        errors(&weighted, &weighted, Some(&taken)),
        errors(&of_primal, &weighted, None),
        errors(&of_weighted, &weighted, None),
    ];
    let least = |pixel: usize| {
        errors
            .iter()
            .map(|e| e[pixel])
            .fold(f32::INFINITY, f32::min)
    };
    let mut sum = vec![0f32; width * height];
    let mut picture = Image::new(width, height);
    let mut halves = [(); 2].map(|()| Image::new(width, height));
    for ((candidate, candidate_halves), errors) in candidates.iter().zip(&errors) {
        for (pixel, error) in errors.iter().enumerate() {
            // At most 1, whatever the unit.
            let share = least(pixel) / error;
            sum[pixel] += share;
            let add = |image: &mut Image, of_candidate: &Image| {
                image.set(pixel, image.get(pixel) + share * of_candidate.get(pixel));
            };
            add(&mut picture, candidate);
            add(&mut halves[0], &candidate_halves[0]);
            add(&mut halves[1], &candidate_halves[1]);
        }
    }
    for image in halves.iter_mut().chain([&mut picture]) {
        for (pixel, sum) in sum.iter().enumerate() {
            image.set(pixel, image.get(pixel) / *sum);
        }
    }
    Reconstruction {
        picture,
        halves: Some(HalfPictures::Biased {
            halves,
            unbiased: weighted,
        }),
        solution,
        seconds_halves: 0.0,
    }
}

/// The halves' primals, denoised, and their weighted pictures, denoised.
pub(super) fn denoised(
    source: &Source,
    weighted: &[Image; 2],
    denoiser: &Denoiser,
) -> [[Image; 2]; 2] {
    let primals = [0, 1].map(|half| source.images(half).primal);
    let not_negative = weighted.clone().map(|mut image| {
        let values = image.channels.iter_mut().flatten();
        values.for_each(|v| *v = v.max(0.0));
        image
    });
    [primals, not_negative]
        .map(|halves| halves.map(|half| denoiser.denoise(&half, source.features)))
}

/// The squares of the distances between pixels' colours.
fn squares(a: &Image, b: &Image) -> Vec<f32> {
    let square = |pixel| (a.get(pixel) - b.get(pixel)).length_squared();
    (0..a.width * a.height).map(square).collect()
}

fn blurred(mut values: Vec<f32>, width: usize) -> Vec<f32> {
    blur(&mut values, width, SMOOTHING);
    values
}

/// The squared errors of a candidate, over the channels; positive. Its bias is how far either half is from the other half's
/// weighted picture, less both their variances; its own variance a quarter of what its halves disagree about, less the
/// square of what it took from their mean, if it is not that mean.
fn errors(halves: &[Image; 2], weighted: &[Image; 2], taken: Option<&[f32]>) -> Vec<f32> {
    let width = weighted[0].width;
    let across = squares(&halves[0], &weighted[1]);
    let back = squares(&halves[1], &weighted[0]);
    let both = across.iter().zip(&back).map(|(a, b)| 0.5 * (a + b));
    let noise = squares(&weighted[0], &weighted[1]);
    let own = squares(&halves[0], &halves[1]);
    let excess = both.zip(&noise).zip(&own);
    let mut bias: Vec<f32> = excess.map(|((e, n), o)| e - 0.5 * n - 0.5 * o).collect();
    let mut squared: Vec<f32> = bias.iter().map(|b| b * b).collect();
    blur_signed(&mut bias, width, SMOOTHING);
    blur(&mut squared, width, SMOOTHING);
    let count = 4.0 * std::f32::consts::PI * SMOOTHING * SMOOTHING;
    let variance = blurred(own, width);
    let all = bias.iter().zip(&squared).zip(&variance).enumerate();
    all.map(|(pixel, ((b, s), v))| {
        let doubt = ((s - b * b).max(0.0) / count).sqrt();
        let taken = taken.map_or(0.0, |taken| taken[pixel]);
        (b.max(0.0) + doubt + (0.25 * v - taken).max(LEAST_VARIANCE * 0.25 * v))
            .max(f32::MIN_POSITIVE)
    })
    .collect()
}
