//! `--turntable`: views around the target, each a file in a folder.

use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::output::format::Format;
use crate::output::is_stream;
use std::path::{Path, PathBuf};

/// Most views.
const MOST: u32 = 10_000;

/// The files of the views, in a folder named as `output` without its extension, which is made; `None`
/// without `--turntable`.
pub(super) fn frames(
    args: &RenderArgs,
    output: &Path,
    format: Format,
) -> Result<Option<Vec<PathBuf>>> {
    let Some(count) = args.turntable else {
        return Ok(None);
    };
    if count == 0 || count > MOST {
        return Err(Error::Setting(format!(
            "--turntable must be from 1 to {MOST}, got {count}"
        )));
    }
    if is_stream(output) {
        let message = "--turntable makes a folder of files; name one that is no pipe or device";
        return Err(Error::input(output, None, message));
    }
    let folder = output.with_extension("");
    std::fs::create_dir_all(&folder).map_err(Error::io(&folder, "the folder cannot be made"))?;
    let digits = (count - 1).to_string().len().max(3);
    let name = |index: u32| folder.join(format!("{index:0digits$}.{}", format.extension()));
    Ok(Some((0..count).map(name).collect()))
}
