//! Pictures that textures are made of: PNG, JPEG, TGA, BMP, HDR and EXR.

use super::{MAX_PIXELS, MAX_SIDE, check_readable, exr, guarded};
use crate::error::{Error, Result};
use std::path::Path;

/// The pixels of a picture, row by row from the upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Bitmap {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` of them.
    pub texels: Texels,
    /// Whether some pixel is not opaque.
    pub has_alpha: bool,
}

/// Pixels as they stand in the file.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Red, green, blue, alpha; colours are sRGB.
    Bytes(Vec<[u8; 4]>),
    /// Red, green, blue.
    Floats {
        /// The values: from 0 to 1 where `encoded`.
        values: Vec<[f32; 3]>,
        /// Whether colours are sRGB (16-bit files) or linear (HDR, EXR).
        encoded: bool,
    },
}

/// Reads a picture.
pub fn load(path: &Path) -> Result<Bitmap> {
    check_readable(path)?;
    let bitmap = if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    {
        load_exr(path)?
    } else {
        load_image(path)?
    };
    let (width, height) = (bitmap.width as usize, bitmap.height as usize);
    let count = match &bitmap.texels {
        Texels::Bytes(bytes) => bytes.len(),
        Texels::Floats { values, .. } => values.len(),
    };
    if count == 0 || count != width * height {
        return Err(Error::input(path, None, "has no pixels"));
    }
    let finite = match &bitmap.texels {
        Texels::Bytes(_) => true,
        Texels::Floats { values, .. } => values.iter().flatten().all(|x| x.is_finite()),
    };
    if finite {
        Ok(bitmap)
    } else {
        Err(Error::input(path, None, "has values that are not finite"))
    }
}

fn load_exr(path: &Path) -> Result<Bitmap> {
    let file = exr::load(path)?;
    let grey = || file.channels.get("Y").map(|y| [y, y, y]);
    let Some([r, g, b]) = file.colour("").or_else(grey) else {
        return Err(Error::input(path, None, "has neither R, G and B nor Y"));
    };
    let values = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]);
    Ok(Bitmap {
        width: file.size.0 as u32,
        height: file.size.1 as u32,
        texels: Texels::Floats {
            values: values.collect(),
            encoded: false,
        },
        has_alpha: false,
    })
}

fn load_image(path: &Path) -> Result<Bitmap> {
    use image::{ColorType, ImageReader, Limits};
    let unreadable = |reason: &str| {
        let message = format!("is no picture that can be read: {reason}");
        Error::input(path, None, message)
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(8 * MAX_PIXELS);
    let decoded = guarded(|| {
        let mut reader = ImageReader::open(path)?.with_guessed_format()?;
        reader.limits(limits);
        reader.decode()
    });
    let image = match decoded {
        Ok(Ok(image)) => image,
        Ok(Err(e)) => return Err(unreadable(&e.to_string())),
        Err(()) => return Err(unreadable("the decoder gave up")),
    };
    let (width, height) = (image.width(), image.height());
    let encoded = match image.color() {
        // High dynamic range: linear.
        ColorType::Rgb32F | ColorType::Rgba32F => Some(false),
        ColorType::L16 | ColorType::Rgb16 => Some(true),
        _ => None,
    };
    let texels = match encoded {
        Some(encoded) => Texels::Floats {
            values: image.into_rgb32f().pixels().map(|p| p.0).collect(),
            encoded,
        },
        None => Texels::Bytes(image.into_rgba8().pixels().map(|p| p.0).collect()),
    };
    let has_alpha = match &texels {
        Texels::Bytes(bytes) => bytes.iter().any(|t| t[3] < 255),
        Texels::Floats { .. } => false,
    };
    Ok(Bitmap {
        width,
        height,
        texels,
        has_alpha,
    })
}
