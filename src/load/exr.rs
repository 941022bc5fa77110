//! EXR files: all channels by name, as 32-bit float.

use super::{MAX_PIXELS, MAX_SIDE, check_readable, guarded};
use crate::error::{Error, Result};
use crate::machine;
use exr::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Bytes of a value while it is read: as in the file, and as 32-bit float.
const BYTES_PER_VALUE: u64 = 8;

/// The channels of an EXR file's first part.
#[derive(Debug, Default)]
pub struct ExrFile {
    /// Pixels across and down.
    pub size: (usize, usize),
    /// Column and row of the first pixel in the whole picture: the data window's place in the display window.
    pub position: (i32, i32),
    /// Pixels of the whole picture, across and down.
    pub picture: (usize, usize),
    /// Values row by row from the upper left corner, by channel name.
    pub channels: BTreeMap<String, Vec<f32>>,
    /// Texts of the header by name.
    pub texts: BTreeMap<String, String>,
}

/// Reads a file. Half and integer channels become 32-bit float.
pub fn load(path: &Path) -> Result<ExrFile> {
    check_readable(path)?;
    check_size(path)?;
    let parsed = guarded(|| {
        read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_file(path)
    });
    let image = match parsed {
        Ok(Ok(image)) => image,
        Ok(Err(e)) => {
            return Err(Error::input(
                path,
                None,
                format!("is no EXR file that can be read: {e}"),
            ));
        }
        Err(()) => return Err(Error::input(path, None, "is no EXR file that can be read")),
    };
    let display = image.attributes.display_window;
    let layer = image.layer_data;
    let position = layer.attributes.layer_position - display.position;
    let text = |(name, value): (Text, AttributeValue)| match value {
        AttributeValue::Text(value) => Some((name.to_string(), value.to_string())),
        _ => None,
    };
    let shared = image.attributes.other.into_iter();
    let texts = shared
        .chain(layer.attributes.other)
        .filter_map(text)
        .collect();
    let channels = layer.channel_data.list.into_iter();
    let channels = channels.map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()));
    Ok(ExrFile {
        size: (layer.size.width(), layer.size.height()),
        position: (position.x(), position.y()),
        picture: (display.size.width(), display.size.height()),
        channels: channels.collect(),
        texts,
    })
}

/// Refuses what the header announces if it is more than a picture can be, before anything is allocated.
fn check_size(path: &Path) -> Result<()> {
    let unreadable = || Error::input(path, None, "is no EXR file that can be read");
    let meta = guarded(|| exr::meta::MetaData::read_from_file(path, false));
    let Ok(Ok(meta)) = meta else {
        return Err(unreadable());
    };
    for header in &meta.headers {
        let Vec2(width, height) = header.layer_size;
        let pixels = width as u64 * height as u64;
        if width.max(height) > MAX_SIDE as usize || pixels > MAX_PIXELS {
            let message = format!(
                "is {width}x{height}: a picture has at most {MAX_SIDE} pixels along a side, {MAX_PIXELS} in all"
            );
            return Err(Error::input(path, None, message));
        }
        let channels = header.channels.list.len() as u64;
        if pixels * channels * BYTES_PER_VALUE > machine::memory() {
            let message =
                format!("has {channels} channels of {pixels} pixels: more than memory holds");
            return Err(Error::input(path, None, message));
        }
    }
    Ok(())
}

impl ExrFile {
    /// A colour layer: `name.R`, `name.G`, `name.B`, or `R`, `G`, `B` where the name is empty. `None` if
    /// one is missing.
    pub fn colour(&self, name: &str) -> Option<[&Vec<f32>; 3]> {
        let prefix = if name.is_empty() {
            String::new()
        } else {
            format!("{name}.")
        };
        let channel = |c: &str| self.channels.get(&format!("{prefix}{c}"));
        Some([channel("R")?, channel("G")?, channel("B")?])
    }
}
