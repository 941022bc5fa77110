//! The weighted picture with a denoiser's pictures as witnesses of the differences: of the primal, and of the weighted
//! picture.
//!
//! A denoised picture of one half of the samples has little variance and some bias. Two of them err differently enough to
//! be better than either.

use super::error_estimate::HalfPictures;
use super::weighted::Channel;
use super::witness::{Alike, Crossing};
use super::{Reconstruction, Source, mix, weighted};
use crate::denoise::Denoiser;
use crate::image::Image;
use std::time::Instant;

/// The errors of a denoiser's differences.
const ALIKE: Alike = Alike {
    reach: 4.0,
    dots: false,
};

/// The picture; its halves are made of one half of the samples each, and beside them stands the weighted picture's pair,
/// against which bias is measured. Both halves need the samples that weighted needs.
pub(super) fn solve(source: &Source, denoiser: &Denoiser) -> Reconstruction {
    let (weighted, mut solution) = weighted::halves(source);
    let denoised = mix::denoised(source, &weighted, denoiser);
    // Near enough to begin with.
    let mut crossed = weighted.clone();
    let mut own = weighted.clone();
    let mut seconds_halves = 0.0;
    for channel in 0..3 {
        let of_channel = Channel::new(source, channel);
        let crossing = Crossing::new(
            &of_channel,
            planes(&weighted, channel),
            &denoised.each_ref().map(|images| planes(images, channel)),
            ALIKE,
        );
        for (values, picture) in crossed.iter_mut().enumerate() {
            solution += crossing.solve(values, 1 - values, &mut picture.channels[channel]);
        }
        // For the error all of a half is to be by itself.
        let start = Instant::now();
        for (values, picture) in own.iter_mut().enumerate() {
            solution += crossing.solve(values, values, &mut picture.channels[channel]);
        }
        seconds_halves += start.elapsed().as_secs_f64();
    }
    Reconstruction {
        picture: source.merge(&crossed),
        halves: Some(HalfPictures::Biased {
            halves: own,
            unbiased: weighted,
        }),
        solution,
        seconds_halves,
    }
}

/// A channel of both halves.
fn planes(images: &[Image; 2], channel: usize) -> [&[f32]; 2] {
    images.each_ref().map(|image| &image.channels[channel][..])
}
