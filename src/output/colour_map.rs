//! Numbers as colours: errors as a heat map, differences with their sign.

use super::png::Pixels;
use crate::image::{Image, to_srgb};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

/// Powers of ten of the errors between which a heat map goes from violet to yellow. Fixed, so that heat
/// maps can be compared.
pub const HEAT: (f32, f32) = (-6.0, 0.0);

/// Relative squared errors of pixels, row by row, on a logarithmic scale: violet 10⁻⁶ or less (or below
/// 0), green 10⁻³, yellow 1 or more.
pub fn heat_map(errors: &[f32], width: usize) -> Pixels {
    let colour = |error: &f32| {
        let (low, high) = HEAT;
        let place = (error.max(f32::MIN_POSITIVE).log10() - low) / (high - low);
        let colour = ViridisRGB.get_color(place.clamp(0.0, 1.0));
        [colour.0, colour.1, colour.2]
    };
    Pixels {
        width,
        height: errors.len() / width,
        rgb: errors.iter().flat_map(colour).collect(),
        alpha: None,
    }
}

/// Differences, brightened by `exposure` stops: middle grey is 0, brighter is above, darker below.
pub fn signed(image: &Image, exposure: f32) -> Pixels {
    let scale = exposure.exp2();
    let pixel = |i| {
        image.get(i).to_array().map(|v| {
            let away = to_srgb((v * scale).abs()) / 2;
            if v < 0.0 { 128 - away } else { 128 + away }
        })
    };
    Pixels {
        width: image.width,
        height: image.height,
        rgb: (0..image.width * image.height).flat_map(pixel).collect(),
        alpha: None,
    }
}
