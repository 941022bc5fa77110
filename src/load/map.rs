//! Texture statements of MTL files (`map_Kd -s 2 2 wood.png`), and where their files are.

use super::bitmap::Bitmap;
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
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
            // The numbers that follow, three at most: `-s 2 2 1`.
            let mut numbers = Vec::new();
            let most = match option {
                "-o" | "-s" | "-t" => 3,
                "-mm" => 2,
                "-bm" | "-boost" | "-texres" => 1,
                _ => 0,
            };
            while numbers.len() < most
                && let (number, next) = word(after)
                && !next.is_empty()
                && let Ok(number) = number.parse::<f32>()
                && number.is_finite()
            {
                numbers.push(number);
                after = next;
            }
            let pair = |default: f32| {
                let first = numbers.first().copied().unwrap_or(default);
                [first, numbers.get(1).copied().unwrap_or(default)]
            };
            match option {
                "-s" => map.scale = pair(1.0),
                "-o" => map.offset = pair(0.0),
                "-bm" => map.multiplier = numbers.first().copied().unwrap_or(1.0),
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

    /// The file: as written, with backslashes as slashes, in any letter case; or under its bare name, since
    /// many files carry the paths of another machine. `Err` is the path at which it was expected.
    pub fn find(&self) -> Result<PathBuf, PathBuf> {
        let name = self.file.replace('\\', "/");
        let bare = name.rsplit('/').next().unwrap_or(&name);
        let expected = self
            .folder
            .join(if name.contains(':') { bare } else { &name });
        [Path::new(&name), Path::new(bare)]
            .into_iter()
            .chain(std::iter::once(Path::new("textures").join(bare).as_path()))
            .find_map(|path| in_any_case(&self.folder, path))
            .ok_or_else(|| std::path::absolute(&expected).unwrap_or(expected))
    }
}

/// The first word of `text`, and what comes after it.
fn word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    (&text[..end], text[end..].trim_start())
}

/// The file `path` from `folder` on, each part of the path in any letter case where there is none in the
/// right one.
fn in_any_case(folder: &Path, path: &Path) -> Option<PathBuf> {
    let direct = folder.join(path);
    if direct.is_file() {
        return Some(direct);
    }
    let mut found = if path.is_absolute() {
        PathBuf::from("/")
    } else if folder.as_os_str().is_empty() {
        PathBuf::from(".")
    } else {
        folder.to_owned()
    };
    for part in path.components() {
        use std::path::Component::{CurDir, Normal, ParentDir};
        match part {
            Normal(part) if found.join(part).exists() => found.push(part),
            Normal(part) => {
                let wanted = part.to_str()?.to_lowercase();
                let alike = |e: &std::fs::DirEntry| {
                    e.file_name()
                        .to_str()
                        .is_some_and(|name| name.to_lowercase() == wanted)
                };
                let entries = std::fs::read_dir(&found).ok()?.filter_map(Result::ok);
                // The least name, so that the order of the folder does not matter.
                found = entries.filter(alike).map(|e| e.path()).min()?;
            }
            ParentDir => found.push(".."),
            CurDir => {}
            _ => continue,
        }
    }
    found.is_file().then_some(found)
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
        // A number alone is the file, not a value.
        assert_eq!(parse("-s 1 1 1").unwrap().0.file, "1");
        assert_eq!(parse("-odd.png").unwrap().0.file, "-odd.png");
        assert_eq!(parse(r"C:\tex\a b.png").unwrap().0.file, r"C:\tex\a b.png");
        assert!(parse("  ").is_none());
    }

    #[test]
    fn files_are_found_as_people_name_them() {
        let folder = tempfile::tempdir().unwrap();
        let sub = folder.path().join("Maps");
        std::fs::create_dir(&sub).unwrap();
        let file = sub.join("Red Wood.PNG");
        std::fs::write(&file, "x").unwrap();
        let plain = folder.path().join("plain.png");
        std::fs::write(&plain, "x").unwrap();
        let find = |name: &str| {
            let at = String::new();
            let (map, _) = MapStatement::parse("map_Kd", name, at, folder.path()).unwrap();
            map.find()
        };
        for name in [
            "Maps/Red Wood.PNG",
            r"maps\red wood.png",
            r".\MAPS\Red Wood.png",
        ] {
            assert_eq!(find(name), Ok(file.clone()), "{name}");
        }
        for name in [
            "PLAIN.png",
            r"C:\Users\me\plain.png",
            "/elsewhere/plain.png",
            "\"plain.png\"",
        ] {
            assert_eq!(find(name), Ok(plain.clone()), "{name}");
        }
        let missing = find(r"maps\none.png").unwrap_err();
        assert!(missing.is_absolute() && missing.ends_with("maps/none.png"));
    }
}
