//! From a film to files: the picture with its layers, a preview, the summary.

mod files;
mod layers;

pub(super) use files::elsewhere;
pub(super) use layers::layers;

use crate::checkpoint::{About, Identity, Progress};
use crate::develop::Plate;
use crate::error::{Error, Result};
use crate::exposure::{Exposure, Metered};
use crate::film::{BYTES_PER_PIXEL, Film, FirstHits, Halves};
use crate::load::environment::Background;
use crate::mattes::Mattes;
use crate::output::format::{Encoding, Format};
use crate::output::stats::{Shown, Stats};
use crate::picture::{self, Picture};
use crate::progress::Reporter;
use crate::reconstruct;
use crate::render::{Ending, Method};
use crate::tone::Tone;
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::Path;

/// What is to be written, and how.
#[derive(Clone, Copy)]
pub(super) struct Outputs<'a> {
    /// The picture.
    pub(super) picture: &'a Path,
    pub(super) format: Format,
    pub(super) preview: Option<(&'a Path, Encoding)>,
    pub(super) stats: Option<&'a Path>,
    pub(super) exposure: Exposure,
    pub(super) tone: Tone,
    /// Where the samples are kept, if they are.
    pub(super) checkpoint: Option<&'a Path>,
}

/// What there is of a render.
pub(super) struct Rendered<'a> {
    pub(super) film: &'a Film,
    pub(super) method: Method,
    pub(super) background: Background,
    pub(super) identity: &'a Identity,
    pub(super) about: &'a About,
    pub(super) progress: &'a Progress,
    /// Why it ended.
    pub(super) ended: &'static str,
    /// What pixels show, where that was asked for.
    pub(super) mattes: Option<&'a Mattes>,
    pub(super) warnings: Vec<String>,
}

impl Outputs<'_> {
    /// Whether pictures of 8 bits are among them.
    pub(super) fn shows(format: Format, preview: Option<(&Path, Encoding)>) -> bool {
        format != Format::Exr || preview.is_some()
    }

    /// How pictures of 8 bits are shown, if any is to be written; by how many stops is metered where that is not
    /// known yet.
    pub(super) fn shown(
        &self,
        known: &OnceCell<f32>,
        film: &Film,
        picture: &Picture,
        hits: &FirstHits,
    ) -> Option<Shown> {
        Self::shows(self.format, self.preview).then(|| Shown {
            exposure: *known.get_or_init(|| stops(self.exposure, film, picture, hits)),
            tone: self.tone,
        })
    }

    /// Writes everything, and prints the summary.
    pub(super) fn write(
        &self,
        rendered: Rendered,
        (picture, method): (&Picture, reconstruct::Method),
        hits: &FirstHits,
        shown: Option<Shown>,
        reporter: &mut Reporter,
    ) -> Result<()> {
        let Rendered { film, .. } = rendered;
        let plate = Plate {
            image: &picture.image,
            coverage: &hits.coverage,
            background: rendered.background,
        };
        let stats = stats(&rendered, (picture, method), shown);
        let made = files::Made {
            outputs: self,
            method: rendered.method,
            picture,
            plate: &plate,
            hits,
            film,
            mattes: rendered.mattes,
            stats: &stats,
        };
        // What can be written is, whatever fails.
        let written = files::write(&made);
        if let (Some((path, encoding)), Some(shown)) = (self.preview, shown) {
            plate
                .pixels(shown.exposure, shown.tone)
                .write(path, encoding)?;
        }
        if let Some(path) = self.stats {
            stats.write(path)?;
        }
        written?;
        let others = [self.preview.map(|(path, _)| path), self.stats];
        let others: Vec<&Path> = others.into_iter().flatten().collect();
        reporter.summary(&stats, self.picture, &others)
    }
}

/// By how many stops a picture is brightened.
pub(super) fn stops(exposure: Exposure, film: &Film, picture: &Picture, hits: &FirstHits) -> f32 {
    exposure.stops(&Metered {
        image: &picture.image,
        direct: &film.direct(Halves::Both),
        lit: &film.lit(),
        coverage: &hits.coverage,
        albedo: Some(&hits.albedo),
    })
}

fn stats(
    rendered: &Rendered,
    (picture, method): (&Picture, reconstruct::Method),
    shown: Option<Shown>,
) -> Stats {
    let Rendered {
        film,
        about,
        identity,
        progress,
        ..
    } = rendered;
    let mut settings: BTreeMap<String, String> = (*identity).clone();
    // These stand elsewhere.
    settings.retain(|name, _| !["version", "scene", "size"].contains(&name.as_str()));
    let (name, alpha) = picture::describe(method);
    settings.insert("background".into(), rendered.background.to_string());
    settings.insert("reconstruct".into(), name.into());
    if !alpha.is_empty() {
        settings.insert("alpha".into(), alpha);
    }
    let mut stats = Stats {
        version: env!("CARGO_PKG_VERSION"),
        scene: about.scene.clone(),
        scene_hash: identity.get("scene").cloned().unwrap_or_default(),
        settings,
        width: film.window.width,
        height: film.window.height,
        camera: about.camera.clone(),
        triangles: about.triangles,
        samples: film.count(Halves::Both),
        interrupted: rendered.ended == Ending::Interrupted.name(),
        ended: rendered.ended,
        seconds_loading: about.seconds_loading,
        seconds_building: about.seconds_building,
        seconds_tracing: progress.seconds,
        seconds_solving: picture.seconds,
        solver_iterations: picture.solution.iterations,
        solver_residual: picture.solution.residual,
        estimated_rel_mse: picture.rel_mse,
        shows_something: film.shows_something(),
        rays: BTreeMap::new(),
        mrays_per_second: 0.0,
        dead_shifts: BTreeMap::new(),
        dropped: 0,
        film_bytes_per_pixel: BYTES_PER_PIXEL,
        shown,
        warnings: rendered.warnings.clone(),
    };
    stats.count(&progress.counts);
    stats
}

/// The picture for a display that `--preview` asks for.
pub(super) fn preview(path: Option<&Path>) -> Result<Option<(&Path, Encoding)>> {
    path.map(|path| Ok((path, Encoding::of("--preview", path)?)))
        .transpose()
}

/// Refuses a picture that its file cannot hold.
pub(super) fn check_background(format: Format, background: Background) -> Result<()> {
    if background == Background::Transparent && format == Format::Display(Encoding::Jpeg) {
        return Err(Error::Setting(
            "JPEG files cannot be transparent: give -o a name that ends in .png or .exr, or another --background"
                .into(),
        ));
    }
    Ok(())
}
