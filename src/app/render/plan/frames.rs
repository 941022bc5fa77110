//! `--turntable`: views around the target, each a file in a folder.

use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::output::format::Format;
use crate::output::is_stream;
use std::path::{Path, PathBuf};

/// Most views.
const MOST: u32 = 10_000;

/// One of the views.
#[derive(Debug)]
pub(in crate::app::render) struct Frame {
    /// From 0 on.
    pub(in crate::app::render) index: u32,
    /// How many there are in all.
    pub(in crate::app::render) views: u32,
    pub(in crate::app::render) file: PathBuf,
}

/// The views that are to be rendered, each to a file in a folder named as `output` without its extension, which is
/// made; a film goes to `output` itself, where `format` is `None`. `None` without `--turntable`.
pub(super) fn of_flags(
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
