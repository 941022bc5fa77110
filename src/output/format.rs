//! What a picture is written as.

use super::place::is_stream;
use crate::error::{Error, Result};
use clap::ValueEnum;
use clap::builder::PossibleValue;
use std::path::Path;

/// What a picture is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// All layers in 32-bit float.
    Exr,
    /// The picture alone, tone-mapped to 8 bits.
    Display(Encoding),
}

/// What a picture of 8 bits is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Without loss.
    Png,
    /// With little loss: quality 92.
    Jpeg,
}

impl Format {
    /// By the extension of a file, or by `flag` where that does not say it. A pipe or a device gets a PNG if
    /// nothing is said.
    pub fn of(path: &Path, flag: Option<Self>) -> Result<Self> {
        let extension = path.extension().and_then(|e| e.to_str());
        let by_name = extension.and_then(|e| Self::from_str(e, true).ok());
        let wrong = |message: &str| Err(Error::input(path, None, message));
        match (by_name, flag) {
            (Some(name), Some(flag)) if name != flag => {
                wrong("its extension and --format say two things; leave one of them out")
            }
            (Some(format), _) | (None, Some(format)) => Ok(format),
            (None, None) if is_stream(path) => Ok(Self::Display(Encoding::Png)),
            (None, None) => wrong("the extension must be .exr, .png or .jpg"),
        }
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Display(Encoding::Png) => "png",
            Self::Display(Encoding::Jpeg) => "jpg",
        }
    }
}

impl Encoding {
    /// By the extension of the file for `flag`, which takes no EXR.
    pub fn of(flag: &str, path: &Path) -> Result<Self> {
        match Format::of(path, None) {
            Ok(Format::Display(encoding)) => Ok(encoding),
            _ => Err(Error::input(
                path,
                None,
                format!("{flag} writes a .png or .jpg"),
            )),
        }
    }
}

impl ValueEnum for Format {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Self::Exr,
            Self::Display(Encoding::Png),
            Self::Display(Encoding::Jpeg),
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let value = PossibleValue::new(self.extension());
        Some(match self {
            Self::Display(Encoding::Jpeg) => value.alias("jpeg"),
            _ => value,
        })
    }
}
