//! PNG for looking at: 8 bits, sRGB.

use super::write_whole;
use crate::error::Result;
use crate::image::{Image, to_srgb};
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use std::io::Write;
use std::path::Path;

/// Pixels as displays show them.
#[derive(Clone, Debug)]
pub struct Pixels {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Red, green and blue of each pixel in sRGB, row by row from the upper left corner.
    pub rgb: Vec<u8>,
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
        }
    }

    /// As the bytes of a PNG file.
    pub fn encode(&self) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let (width, height) = (self.width as u32, self.height as u32);
        PngEncoder::new(&mut bytes)
            .write_image(&self.rgb, width, height, image::ExtendedColorType::Rgb8)
            .map_err(|e| match e {
                image::ImageError::IoError(e) => e,
                e => std::io::Error::other(e),
            })?;
        Ok(bytes)
    }

    /// Writes a PNG file.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_whole(path, |file| file.write_all(&self.encode()?))
    }
}
