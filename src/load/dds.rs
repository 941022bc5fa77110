//! DDS files: the first surface of a texture, decompressed.

use super::bitmap::{Bitmap, Texels};
use super::{MAX_PIXELS, MAX_SIDE, guarded};
use crate::error::{Error, Result};
use dds::{ColorFormat, Decoder, Format, ImageViewMut, Precision};
use std::path::Path;

/// Reads the largest picture of a file.
pub(super) fn load(path: &Path, bytes: &[u8]) -> Result<Bitmap> {
    let unreadable = |reason: &str| {
        let message = format!("is no DDS picture that can be read: {reason}");
        Error::input(path, None, message)
    };
    let mut decoder = Decoder::new(bytes).map_err(|e| unreadable(&e.to_string()))?;
    let size = decoder.main_size();
    let pixels = u64::from(size.width) * u64::from(size.height);
    if size.width.max(size.height) > MAX_SIDE || pixels > MAX_PIXELS || pixels == 0 {
        return Err(unreadable(&format!("it is {}x{}", size.width, size.height)));
    }
    let precision = decoder.native_color().precision;
    let colour = match precision {
        Precision::U8 => ColorFormat::RGBA_U8,
        Precision::U16 | Precision::F32 => ColorFormat::RGBA_F32,
    };
    let mut data = vec![0; pixels as usize * usize::from(colour.bytes_per_pixel())];
    let view = ImageViewMut::new(&mut data, size, colour).expect("the buffer has that size");
    match guarded(|| decoder.read_surface(view)) {
        Ok(Ok(())) => {}
        Ok(Err(e)) => return Err(unreadable(&e.to_string())),
        Err(()) => return Err(unreadable("the decoder gave up")),
    }
    let texels = if precision == Precision::U8 {
        let (texels, _) = data.as_chunks::<4>();
        Texels::Bytes(texels.to_vec())
    } else {
        let value = |x: &[u8; 4]| f32::from_ne_bytes(*x);
        let (values, _) = data.as_chunks::<4>();
        let (values, _) = values.as_chunks::<4>();
        let values: Vec<[f32; 4]> = values.iter().map(|t| t.each_ref().map(value)).collect();
        Texels::of_floats(&values, true, precision == Precision::U16)
    };
    let mut bitmap = Bitmap::new((size.width, size.height), texels);
    if matches!(decoder.format(), Format::BC5_UNORM | Format::BC5_SNORM)
        && let Texels::Bytes(texels) = &mut bitmap.texels
    {
        texels.iter_mut().for_each(complete_normal);
    }
    Ok(bitmap)
}

/// BC5 has two channels, x and y of unit normals; the third gets z.
fn complete_normal(texel: &mut [u8; 4]) {
    let [x, y] = [texel[0], texel[1]].map(|c| f32::from(c) / 127.5 - 1.0);
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    texel[2] = (127.5 * (z + 1.0)).round() as u8;
}
