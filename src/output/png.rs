//! PNG and JPEG for looking at: 8 bits, sRGB.

use super::format::Encoding;
use super::write_whole;
use crate::error::Result;
use crate::image::{Image, to_srgb};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// Of JPEG, from 1 to 100: where its marks are hard to see.
const JPEG_QUALITY: u8 = 92;

/// Pixels as displays show them.
#[derive(Clone, Debug)]
pub struct Pixels {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Red, green and blue of each pixel in sRGB, row by row from the upper left corner.
    pub rgb: Vec<u8>,
    /// The opacity of each pixel, which is not multiplied into its colour; `None` where all are opaque.
    pub alpha: Option<Vec<u8>>,
}

impl Pixels {
    /// `image` brightened by `exposure` stops; what is below 0 is black, above 1 white.
    pub fn tone_mapped(image: &Image, exposure: f32) -> Self {
        let scale = exposure.exp2();
        let pixel = |i| image.get(i).to_array().map(|v| to_srgb(v * scale));
        Self {
            width: image.width,
            height: image.height,
            rgb: (0..image.width * image.height).flat_map(pixel).collect(),
            alpha: None,
        }
    }

    /// As the bytes of a file.
    pub fn encode(&self, encoding: Encoding) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let (width, height) = (self.width as u32, self.height as u32);
        let written = match (encoding, &self.alpha) {
            (Encoding::Png, None) => PngEncoder::new(&mut bytes).write_image(
                &self.rgb,
                width,
                height,
                ExtendedColorType::Rgb8,
            ),
            (Encoding::Png, Some(alpha)) => {
                let pixels = self.rgb.chunks_exact(3).zip(alpha);
                let rgba: Vec<u8> = pixels.flat_map(|(c, &a)| [c[0], c[1], c[2], a]).collect();
                let rgba8 = ExtendedColorType::Rgba8;
                PngEncoder::new(&mut bytes).write_image(&rgba, width, height, rgba8)
            }
            // Without alpha: what is not there is black.
            (Encoding::Jpeg, _) => JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY)
                .write_image(&self.rgb, width, height, ExtendedColorType::Rgb8),
        };
        written.map_err(|e| match e {
            image::ImageError::IoError(e) => e,
            e => std::io::Error::other(e),
        })?;
        Ok(bytes)
    }

    /// Writes a file.
    pub fn write(&self, path: &Path, encoding: Encoding) -> Result<()> {
        write_whole(path, |file| file.write_all(&self.encode(encoding)?))
    }
}
