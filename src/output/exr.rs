//! OpenEXR: one part, 32-bit float. The picture is `R`, `G`, `B`; all else has dotted names.

use super::write_whole;
use crate::error::{Error, Result};
use crate::film::Window;
use crate::image::Image;
use exr::prelude::*;
use std::path::Path;

/// The layers of an EXR file, in any order.
#[derive(Debug, Default)]
pub struct Layers {
    channels: Vec<(String, Vec<f32>)>,
    attributes: Vec<(String, String)>,
}

impl Layers {
    /// The picture itself.
    pub fn picture(&mut self, image: &Image) {
        self.named(["R", "G", "B"].map(str::to_owned), image);
    }

    /// A colour layer `name.R`, `name.G`, `name.B`.
    pub fn colour(&mut self, name: &str, image: &Image) {
        self.named(["R", "G", "B"].map(|c| format!("{name}.{c}")), image);
    }

    /// A vector layer `name.X`, `name.Y`, `name.Z`.
    pub fn vector(&mut self, name: &str, image: &Image) {
        self.named(["X", "Y", "Z"].map(|c| format!("{name}.{c}")), image);
    }

    /// A single channel.
    pub fn channel(&mut self, name: &str, values: Vec<f32>) {
        self.channels.push((name.to_owned(), values));
    }

    /// A text in the header.
    pub fn attribute(&mut self, name: &str, value: impl Into<String>) {
        self.attributes.push((name.to_owned(), value.into()));
    }

    /// All channels with their names, row by row.
    pub fn channels(&self) -> &[(String, Vec<f32>)] {
        &self.channels
    }

    fn named(&mut self, names: [String; 3], image: &Image) {
        for (name, values) in names.into_iter().zip(&image.channels) {
            self.channels.push((name, values.clone()));
        }
    }

    /// Writes the file of a whole picture.
    pub fn write(self, path: &Path, width: usize, height: usize) -> Result<()> {
        self.write_crop(path, Window::whole(width as u32, height as u32))
    }

    /// Writes the file. A crop has its place in the whole picture: that is the display window, the crop the data
    /// window.
    pub fn write_crop(self, path: &Path, window: Window) -> Result<()> {
        let text = |s: &str| {
            let text = latin1(s);
            Text::new_or_none(&text).ok_or_else(|| Error::Setting(format!("'{s}' is no EXR text")))
        };
        let mut list = SmallVec::new();
        for (name, values) in self.channels {
            list.push(AnyChannel::new(text(&name)?, FlatSamples::F32(values)));
        }
        let size = |width: u32, height: u32| Vec2(width as usize, height as usize);
        let mut attributes = LayerAttributes {
            layer_position: Vec2(window.x as i32, window.y as i32),
            ..Default::default()
        };
        for (name, value) in self.attributes {
            attributes
                .other
                .insert(text(&name)?, AttributeValue::Text(text(&value)?));
        }
        let layer = Layer::new(
            size(window.width, window.height),
            attributes,
            Encoding::FAST_LOSSLESS,
            AnyChannels::sort(list),
        );
        let (width, height) = window.picture;
        let display = IntegerBounds::from_dimensions(size(width, height));
        let image = exr::image::Image::new(ImageAttributes::new(display), layer);
        write_whole(path, |file| {
            image.write().to_buffered(file).map_err(|e| match e {
                exr::error::Error::Io(e) => e,
                e => std::io::Error::other(e.to_string()),
            })
        })
    }
}

/// As EXR files hold texts: characters that Latin-1 does not have as their code points, such as `\u{416}`.
fn latin1(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match u8::try_from(c) {
            Ok(_) => out.push(c),
            Err(_) => out.extend(c.escape_unicode()),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_any_language_can_be_written() {
        assert_eq!(latin1("Zürich/Ж.obj"), "Zürich/\\u{416}.obj");
        assert!(Text::new_or_none(latin1("日本 🏠")).is_some());
    }
}
