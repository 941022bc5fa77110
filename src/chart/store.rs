//! What is kept between calls: finished runs and references, each in files under a key of all that it
//! depends on, so that a chart which was interrupted goes on where it was.

use super::Row;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::load::exr;
use crate::output::exr::Layers;
use crate::output::write_json;
use std::fs;
use std::path::PathBuf;
use xxhash_rust::xxh3::xxh3_64;

/// A folder of finished work.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Of this program: another one may render, measure or be as fast otherwise.
    program: u64,
}

impl Store {
    /// The folder, which is made if it is not there.
    pub fn new(folder: PathBuf) -> Result<Self> {
        fs::create_dir_all(&folder).map_err(Error::io(&folder, "cannot be made"))?;
        let program = std::env::current_exe().and_then(fs::read);
        Ok(Self {
            folder,
            program: program.map_or(0, |bytes| xxh3_64(&bytes)),
        })
    }

    /// The file for `what`, which depends on `key` and on this program.
    fn file(&self, what: &str, key: &str, extension: &str) -> PathBuf {
        let hash = xxh3_64(format!("{:016x} {key}", self.program).as_bytes());
        let plain = |c: char| if c.is_alphanumeric() { c } else { '-' };
        let what: String = what.chars().map(plain).collect();
        self.folder.join(format!("{what}-{hash:016x}.{extension}"))
    }

    /// The rows of a finished run. A file that cannot be read counts as not there.
    pub fn rows(&self, what: &str, key: &str) -> Option<Vec<Row>> {
        let text = fs::read(self.file(what, key, "json")).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Keeps the rows of a finished run.
    pub fn keep_rows(&self, what: &str, key: &str, rows: &[Row]) -> Result<()> {
        write_json(&self.file(what, key, "json"), rows)
    }

    /// Images that were kept, by the names of their layers. A file that cannot be read or lacks one counts
    /// as not there.
    pub fn images(&self, what: &str, key: &str, layers: &[&str]) -> Option<Vec<Image>> {
        let path = self.file(what, key, "exr");
        let file = exr::load(&path).ok()?;
        let (width, height) = file.size;
        let image = |layer: &str| {
            let channels = file.colour(layer)?.map(Vec::clone);
            Some(Image {
                width,
                height,
                channels,
            })
        };
        layers.iter().copied().map(image).collect()
    }

    /// Keeps images, the one without a name as the picture itself.
    pub fn keep_images(&self, what: &str, key: &str, images: &[(&str, &Image)]) -> Result<()> {
        let mut layers = Layers::default();
        let (mut width, mut height) = (0, 0);
        for (name, image) in images {
            (width, height) = (image.width, image.height);
            if name.is_empty() {
                layers.picture(image);
            } else {
                layers.colour(name, image);
            }
        }
        layers.attribute("gdpt.version", env!("CARGO_PKG_VERSION"));
        layers.write(&self.file(what, key, "exr"), width, height)
    }
}
