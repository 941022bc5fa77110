//! PNG for looking at: 8 bits, sRGB.

use super::write_whole;
use crate::error::Result;
use crate::image::Image;
use std::path::Path;

/// Writes `image` brightened by `exposure` stops; what is below 0 is black, above 1 white.
pub fn write(path: &Path, image: &Image, exposure: f32) -> Result<()> {
    let scale = exposure.exp2();
    let bytes: Vec<u8> = (0..image.width * image.height)
        .flat_map(|i| image.get(i).to_array().map(|v| to_srgb(v * scale)))
        .collect();
    let (width, height) = (image.width as u32, image.height as u32);
    write_whole(path, |file| {
        image::ImageEncoder::write_image(
            image::codecs::png::PngEncoder::new(file),
            &bytes,
            width,
            height,
            image::ExtendedColorType::Rgb8,
        )
        .map_err(|e| match e {
            image::ImageError::IoError(e) => e,
            e => std::io::Error::other(e),
        })
    })
}

/// The sRGB transfer function, to a byte.
fn to_srgb(linear: f32) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes() {
        assert_eq!(
            [0.0, 1.0, -1.0, f32::NAN, 9.0, 0.214_04].map(to_srgb),
            [0, 255, 0, 0, 255, 127]
        );
    }
}
