//! The picture to its file, or to another place where that fails.

use super::{Outputs, layers};
use crate::develop::Plate;
use crate::error::{Error, Result};
use crate::film::{Film, FirstHits};
use crate::load::scene_name;
use crate::mattes::Mattes;
use crate::output::cryptomatte;
use crate::output::format::Format;
use crate::output::is_stream;
use crate::output::stats::Stats;
use crate::picture::Picture;
use crate::render::Method;
use std::ffi::{OsStr, OsString};
use std::path::Path;

/// What a render has made.
pub(super) struct Made<'a> {
    pub(super) outputs: &'a Outputs<'a>,
    pub(super) method: Method,
    pub(super) picture: &'a Picture,
    pub(super) plate: &'a Plate<'a>,
    pub(super) hits: &'a FirstHits,
    pub(super) film: &'a Film,
    pub(super) mattes: Option<&'a Mattes>,
    pub(super) stats: &'a Stats,
}

/// Writes the picture. Where that fails it goes to the folder for temporary files or to the working
/// directory: hours of rendering are not lost to a full disk. The error names where it is.
pub(super) fn write(made: &Made) -> Result<()> {
    let Outputs {
        picture: output,
        format,
        tone,
        checkpoint,
        ..
    } = *made.outputs;
    let to = |path: &Path| match format {
        Format::Exr => exr(path, made),
        Format::Display(encoding) => {
            let exposure = made.stats.shown.map_or(0.0, |shown| shown.exposure);
            made.plate.pixels(exposure, tone).write(path, encoding)
        }
    };
    let Err(error) = to(output) else {
        return Ok(());
    };
    let name = match output.file_name() {
        Some(file) if !is_stream(output) => file.to_owned(),
        _ => {
            let scene = scene_name(Path::new(&made.stats.scene));
            format!("{scene}.{}", format.extension()).into()
        }
    };
    let error = match elsewhere("picture", &name, error, to) {
        moved @ Error::Elsewhere { .. } => return Err(moved),
        error => error,
    };
    match checkpoint {
        Some(checkpoint) => Err(Error::Kept {
            checkpoint: checkpoint.to_owned(),
            error: Box::new(error),
        }),
        None => Err(error),
    }
}

/// Writes `what` by the name `name` to the folder for temporary files or the working directory, as it cannot be where it
/// should be. The error says where it is; it is `error` where that fails too.
pub(in crate::app) fn elsewhere(
    what: &'static str,
    name: &OsStr,
    error: Error,
    write: impl Fn(&Path) -> Result<()>,
) -> Error {
    let mut other = OsString::from(format!("gdpt-{}-", std::process::id()));
    other.push(name);
    let folders = [Some(std::env::temp_dir()), std::env::current_dir().ok()];
    let mut places = folders.into_iter().flatten().map(|f| f.join(&other));
    match places.find(|place| write(place).is_ok()) {
        Some(place) => Error::Elsewhere {
            what,
            place,
            error: Box::new(error),
        },
        None => error,
    }
}

/// All layers to `path`.
fn exr(path: &Path, made: &Made) -> Result<()> {
    let Made {
        outputs: _,
        method,
        picture,
        plate,
        hits,
        film,
        mattes,
        stats,
    } = made;
    let mut layers = layers(*method, plate, picture, hits, film);
    if let Some(mattes) = mattes {
        cryptomatte::add(&mut layers, mattes);
    }
    layers.attribute("gdpt.version", stats.version);
    layers.attribute("gdpt.scene", stats.scene.clone());
    layers.attribute("gdpt.scene_hash", stats.scene_hash.clone());
    layers.attribute("gdpt.samples", stats.samples.to_string());
    layers.attribute(
        "gdpt.seconds",
        format!("{:.3}", stats.seconds_tracing + stats.seconds_solving),
    );
    for (name, value) in &stats.settings {
        layers.attribute(&format!("gdpt.{name}"), value.clone());
    }
    layers.write_crop(path, film.window)
}
