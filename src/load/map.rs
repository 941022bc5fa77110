//! Texture statements of MTL files (`map_Kd -s 2 2 wood.png`), and where their files are.

use super::bitmap::Bitmap;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A texture as a material names it.
#[derive(Clone, Debug, PartialEq)]
pub struct MapStatement {
    /// Which parameter it stands for, in lower case: `map_kd`, `norm`, …
    pub key: String,
    /// The file as written.
    pub file: String,
    /// `-s`: repetitions across and up.
    pub scale: [f32; 2],
    /// `-o`: what is added to texture coordinates after scaling.
    pub offset: [f32; 2],
    /// `-clamp on`: the texture ends at its borders.
    pub clamp: bool,
    /// `-bm`: factor on bumps.
    pub multiplier: f32,
    /// `-imfchan`: the channel of a scalar texture.
    pub channel: Channel,
    /// File and line of the statement, for messages.
    pub at: String,
    /// The folder of the MTL file, in which files are searched.
    pub folder: PathBuf,
    /// The picture; `None` where it is missing, or not read because no face uses the material.
    pub bitmap: Option<Arc<Bitmap>>,
}

/// The channel of an image that a scalar parameter takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Channel {
    /// The alpha channel for opacity where the image has one, else the luminance.
    #[default]
    Auto,
    /// Red.
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
    /// Alpha ("matte").
    Alpha,
    /// Mean of the colours.
    Luminance,
}

impl MapStatement {
    /// Whether both statements name one picture.
    pub fn same_picture(&self, other: &Self) -> bool {
        match (&self.bitmap, &other.bitmap) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// Reads what stands after the key. The second value names options that are ignored. `None` where
    /// there is no file name.
    pub fn parse(key: &str, rest: &str, at: String, folder: &Path) -> Option<(Self, Vec<String>)> {
        let mut map = Self {
            key: key.to_ascii_lowercase(),
            file: String::new(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            clamp: false,
            multiplier: 1.0,
            channel: Channel::Auto,
            at,
            folder: folder.to_owned(),
            bitmap: None,
        };
        let mut ignored = Vec::new();
        let mut rest = rest.trim();
        while rest.starts_with('-') {
            let (option, mut after) = word(rest);
            // The numbers that follow, three at most: `-s 2 2 1`. In the place of one that is none, there is the
            // option's own.
            let mut numbers: Vec<Option<f32>> = Vec::new();
            let most = match option {
                "-o" | "-s" | "-t" => 3,
                "-mm" => 2,
                "-bm" | "-boost" | "-texres" => 1,
                _ => 0,
            };
            while numbers.len() < most
                && let (number, next) = word(after)
                && !next.is_empty()
                && let Some(value) = value(number)
            {
                if value.is_none() {
                    ignored.push(format!("{option} {number}"));
                }
                numbers.push(value);
                after = next;
            }
            let number = |index: usize| numbers.get(index).copied().flatten();
            let pair = |default: f32| [0, 1].map(|i| number(i).unwrap_or(default));
            match option {
                "-s" => map.scale = pair(1.0),
                "-o" => map.offset = pair(0.0),
                "-bm" => map.multiplier = number(0).unwrap_or(1.0),
                "-clamp" | "-blendu" | "-blendv" | "-cc" => {
                    let (value, next) = word(after);
                    after = next;
                    if option == "-clamp" {
                        map.clamp = value.eq_ignore_ascii_case("on");
                    }
                }
                "-imfchan" => {
                    let (value, next) = word(after);
                    after = next;
                    map.channel = match value {
                        "r" => Channel::Red,
                        "g" => Channel::Green,
                        "b" => Channel::Blue,
                        "m" => Channel::Alpha,
                        _ => Channel::Luminance,
                    };
                }
                "-type" => after = word(after).1,
                // Resolution and sharpness are for filters that are not here.
                "-texres" | "-boost" => {}
                _ if word(after).0.is_empty() => break,
                _ => ignored.push(option.to_owned()),
            }
            rest = after;
        }
        map.file = rest.trim_matches('"').to_owned();
        (!map.file.is_empty()).then_some((map, ignored))
    }
}

/// The number that a word stands for: `Some(None)` for what programs write in the place of one, such as `nan`,
/// `-1.#IND` or `3.1+e2`, and `None` for a word that is none.
fn value(word: &str) -> Option<Option<f32>> {
    let number = word.parse::<f32>().ok();
    let bare = word.trim_start_matches(['+', '-']).to_ascii_lowercase();
    let digits = |b: u8| b.is_ascii_digit() || b"+-.e".contains(&b);
    let wrong = ["nan(", "1.#"].iter().any(|w| bare.starts_with(w))
        || ["nan", "inf", "infinity", "ind"].contains(&bare.as_str())
        || (bare.bytes().any(|b| b.is_ascii_digit()) && bare.bytes().all(digits));
    match number {
        Some(x) if x.is_finite() => Some(Some(x)),
        _ => wrong.then_some(None),
    }
}

/// The first word of `text`, and what comes after it.
fn word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    (&text[..end], text[end..].trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Option<(MapStatement, Vec<String>)> {
        MapStatement::parse("map_Kd", text, "x.mtl:1".into(), Path::new("."))
    }

    #[test]
    fn options_are_understood_or_named() {
        let (map, ignored) =
            parse("-s 2 3 1 -o 0.5 -bm 0.25 -clamp on -blendu off -imfchan g -mm 0 1 my wood.png")
                .unwrap();
        assert_eq!(map.file, "my wood.png");
        assert_eq!((map.scale, map.offset), ([2.0, 3.0], [0.5, 0.0]));
        assert_eq!((map.multiplier, map.clamp), (0.25, true));
        assert_eq!(map.channel, Channel::Green);
        assert_eq!(ignored, ["-mm"]);
        let (map, ignored) = parse("-bm 1.#QNAN -s -nan(ind) 3 -o 3.1+e2 n.png").unwrap();
        assert_eq!((map.multiplier, map.file.as_str()), (1.0, "n.png"));
        assert_eq!((map.scale, map.offset), ([1.0, 3.0], [0.0; 2]));
        assert_eq!(ignored, ["-bm 1.#QNAN", "-s -nan(ind)", "-o 3.1+e2"]);
        // A number alone is the file, not a value.
        assert_eq!(parse("-s 1 1 1").unwrap().0.file, "1");
        assert_eq!(parse("-odd.png").unwrap().0.file, "-odd.png");
        assert_eq!(parse(r"C:\tex\a b.png").unwrap().0.file, r"C:\tex\a b.png");
        assert!(parse("  ").is_none());
    }
}
