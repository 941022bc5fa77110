//! `--turntable`: views around the target, each a file in a folder.

use crate::app::finish;
use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::exposure::Exposure;
use crate::film::Film;
use crate::output::format::Format;
use crate::output::is_stream;
use crate::path::Counts;
use crate::picture;
use crate::reconstruct::Method;
use crate::render::{Ending, Job, Limits, Method as RenderMethod, TILE_SIZE};
use crate::scene::camera::Camera;
use std::path::{Path, PathBuf};

/// Most views.
const MOST: u32 = 10_000;
/// Samples by which the first view is metered, and pixels along its longer side.
const METERED: u64 = 16;
const METERED_SIDE: u32 = 256;

/// One of the views.
#[derive(Debug)]
pub(super) struct Frame {
    /// From 0 on.
    pub(super) index: u32,
    /// How many there are in all.
    pub(super) views: u32,
    pub(super) file: PathBuf,
}

/// The views that are to be rendered, each to a file in a folder named as `output` without its extension, which is
/// made; a film goes to `output` itself, where `format` is `None`. `None` without `--turntable`.
pub(super) fn frames(
    args: &RenderArgs,
    output: &Path,
    format: Option<Format>,
) -> Result<Option<Vec<Frame>>> {
    let Some(views) = args.turntable else {
        return Ok(None);
    };
    if views == 0 || views > MOST {
        return Err(Error::Setting(format!(
            "--turntable must be from 1 to {MOST}, got {views}"
        )));
    }
    let indices = match args.frame {
        Some(frame) if frame >= views => {
            return Err(Error::Setting(format!(
                "--frame must be from 0 to {}, got {frame}",
                views - 1
            )));
        }
        Some(frame) => frame..frame + 1,
        None => 0..views,
    };
    let given = [
        ("--preview", args.preview.is_some()),
        ("--stats", args.stats.is_some()),
        ("--checkpoint", args.checkpoint.is_some()),
        ("a .gdpt", format.is_none()),
    ];
    if let (None, Some((what, _))) = (args.frame, given.iter().find(|(_, given)| *given)) {
        let message = format!("{what} is for one picture; --frame renders one of the turntable's");
        return Err(Error::Setting(message));
    }
    let Some(format) = format else {
        let of = |index| Frame {
            index,
            views,
            file: output.to_owned(),
        };
        return Ok(Some(indices.map(of).collect()));
    };
    if is_stream(output) {
        let message = "--turntable makes a folder of files; name one that is no pipe or device";
        return Err(Error::input(output, None, message));
    }
    let folder = output.with_extension("");
    std::fs::create_dir_all(&folder).map_err(Error::io(&folder, "the folder cannot be made"))?;
    let digits = (views - 1).to_string().len().max(3);
    let of = |index| Frame {
        index,
        views,
        file: folder.join(format!("{index:0digits$}.{}", format.extension())),
    };
    Ok(Some(indices.map(of).collect()))
}

/// A camera that sees what `camera` does, in few pixels.
pub(super) fn of_few_pixels(camera: &Camera) -> Camera {
    let longest = camera.width.max(camera.height).max(METERED_SIDE);
    let shrink =
        |side: u32| (u64::from(side) * u64::from(METERED_SIDE) / u64::from(longest)).max(1) as u32;
    camera.at_size(shrink(camera.width), shrink(camera.height))
}

/// By how many stops views are brightened that are rendered one by one: as the first one of few samples, so that it is
/// the same for all. Works on the current pool; `stop` ends it early.
pub(super) fn stops(first: Job, stop: &(dyn Fn() -> bool + Sync)) -> f32 {
    let camera = &first.scene.camera;
    let mut film = Film::new(camera.width, camera.height, TILE_SIZE);
    let job = Job {
        method: RenderMethod::Pt,
        limits: Limits {
            samples: METERED,
            time: None,
        },
        ..first
    };
    let mut ended = |_: &Film, _: &Counts| stop().then_some(Ending::Interrupted);
    job.run(&mut film, &mut ended, &mut |_| ());
    let picture = picture::of_film(&film, Method::Primal);
    finish::stops(Exposure::Auto, &film, &picture, &film.first_hits())
}
