//! Pictures that textures are made of: PNG, JPEG, TGA, BMP, GIF, WebP, TIFF, PNM, DDS, Radiance HDR and EXR. What a file
//! holds says which of them it is, whatever its name ends in.

use super::{MAX_PIXELS, MAX_SIDE, check_readable, dds, exr, guarded};
use crate::error::{Error, Result};
use image::codecs::hdr::HdrDecoder;
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, ImageResult, Limits};
use std::fs::File;
use std::io::{Cursor, Read};
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
        /// As many, from 0 to 1; `None` where everything is opaque.
        alpha: Option<Vec<f32>>,
        /// Whether colours are sRGB (16-bit files) or linear (HDR, EXR).
        encoded: bool,
    },
}

impl Bitmap {
    /// A picture; `width * height` pixels are expected.
    pub(super) fn new((width, height): (u32, u32), mut texels: Texels) -> Self {
        let has_alpha = match &mut texels {
            Texels::Bytes(bytes) => bytes.iter().any(|t| t[3] < 255),
            Texels::Floats { alpha, .. } => {
                *alpha = alpha.take().filter(|a| a.iter().any(|&a| a < 1.0));
                alpha.is_some()
            }
        };
        Self {
            width,
            height,
            texels,
            has_alpha,
        }
    }

    /// The opacity of a pixel, from 0 to 1.
    #[inline]
    pub fn alpha(&self, index: usize) -> f32 {
        match &self.texels {
            Texels::Bytes(bytes) => f32::from(bytes[index][3]) / 255.0,
            Texels::Floats { alpha, .. } => alpha.as_ref().map_or(1.0, |alpha| alpha[index]),
        }
    }
}

impl Texels {
    /// Of red, green, blue and alpha; without alpha all is opaque.
    pub(super) fn of_floats(values: &[[f32; 4]], has_alpha: bool, encoded: bool) -> Self {
        Texels::Floats {
            values: values.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
            alpha: has_alpha.then(|| values.iter().map(|t| t[3]).collect()),
            encoded,
        }
    }
}

/// What EXR files begin with.
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Reads a picture.
pub fn load(path: &Path) -> Result<Bitmap> {
    check_readable(path)?;
    let mut head = Vec::new();
    File::open(path)
        .and_then(|file| file.take(64).read_to_end(&mut head))
        .map_err(Error::io(path, "cannot be read"))?;
    let bitmap = if head.starts_with(&EXR_MAGIC) {
        load_exr(path)?
    } else if head.starts_with(b"version https://git-lfs") {
        let message = "is not the picture but a Git LFS pointer to it: `git lfs pull` fetches it";
        return Err(Error::input(path, None, message));
    } else {
        let bytes = std::fs::read(path).map_err(Error::io(path, "cannot be read"))?;
        if head.starts_with(b"DDS ") {
            dds::load(path, &bytes)?
        } else {
            load_image(path, &bytes)?
        }
    };
    let (width, height) = (bitmap.width as usize, bitmap.height as usize);
    let (count, finite) = match &bitmap.texels {
        Texels::Bytes(bytes) => (bytes.len(), true),
        Texels::Floats { values, alpha, .. } => {
            let all = values.iter().flatten().chain(alpha.iter().flatten());
            (values.len(), all.into_iter().all(|x| x.is_finite()))
        }
    };
    if count == 0 || count != width * height {
        return Err(Error::input(path, None, "has no pixels"));
    }
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
    let texels = Texels::Floats {
        values: values.collect(),
        alpha: file.channels.get("A").cloned(),
        encoded: false,
    };
    Ok(Bitmap::new(
        (file.size.0 as u32, file.size.1 as u32),
        texels,
    ))
}

fn load_image(path: &Path, bytes: &[u8]) -> Result<Bitmap> {
    let unreadable = |reason: &str| {
        let message = format!("is no picture that can be read: {reason}");
        Error::input(path, None, message)
    };
    let image = match guarded(|| decode(bytes)) {
        Ok(Ok(image)) => image,
        Ok(Err(e)) => return Err(unreadable(&e.to_string())),
        Err(()) => return Err(unreadable("the decoder gave up")),
    };
    let size = (image.width(), image.height());
    let colour = image.color();
    let encoded = match colour {
        // High dynamic range: linear.
        ColorType::Rgb32F | ColorType::Rgba32F => Some(false),
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => Some(true),
        _ => None,
    };
    let texels = match encoded {
        Some(encoded) if colour.has_alpha() => {
            let values: Vec<[f32; 4]> = image.into_rgba32f().pixels().map(|p| p.0).collect();
            Texels::of_floats(&values, true, encoded)
        }
        Some(encoded) => Texels::Floats {
            values: image.into_rgb32f().pixels().map(|p| p.0).collect(),
            alpha: None,
            encoded,
        },
        None => Texels::Bytes(image.into_rgba8().pixels().map(|p| p.0).collect()),
    };
    Ok(Bitmap::new(size, texels))
}

fn decode(bytes: &[u8]) -> ImageResult<DynamicImage> {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(8 * MAX_PIXELS);
    // Radiance files name the program that wrote them, `#?RGBE` for one; a strict decoder knows one name.
    if bytes.starts_with(b"#?") {
        let mut decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes))?;
        decoder.set_limits(limits)?;
        return DynamicImage::from_decoder(decoder);
    }
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    if reader.format().is_none() {
        // Of the formats that are read, only this one has no mark of its own.
        reader.set_format(ImageFormat::Tga);
    }
    reader.limits(limits);
    reader.decode()
}
