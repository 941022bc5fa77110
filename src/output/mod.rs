//! Pictures, figures and statistics to files: whole or not at all.

pub mod colour_map;
pub mod exr;
pub mod figure;
pub mod png;
pub mod stats;

use crate::error::{Error, Result};
use serde::Serialize;
use std::fs::Permissions;
use std::io::{BufWriter, Seek, Write};
use std::path::Path;

/// What `write` writes to `path`, by way of a temporary file in the same folder that is renamed at the
/// end: a reader never sees half a file, and a failure leaves what was there.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut std::fs::File>) -> std::io::Result<()>,
) -> Result<()> {
    let failed = |e| Error::io(path, "cannot be written")(e);
    let mut file = temporary_beside(path).map_err(failed)?;
    let mut buffer = BufWriter::new(file.as_file_mut());
    write(&mut buffer)
        .and_then(|()| buffer.flush())
        .map_err(failed)?;
    drop(buffer);
    // A disk may find out only now that it is full.
    file.as_file().sync_all().map_err(failed)?;
    file.as_file_mut().rewind().map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

/// Writes `value` as JSON, indented.
pub fn write_json(path: &Path, value: &(impl Serialize + ?Sized)) -> Result<()> {
    write_whole(path, |file| {
        serde_json::to_writer_pretty(&mut *file, value)?;
        file.write_all(b"\n")
    })
}

/// Whether a file can be written at `path`: found out before hours of rendering, not after.
fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::input(
            path,
            None,
            "is a directory; name a file in it",
        ));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(Error::input(
            path,
            None,
            format!("the folder {} does not exist", folder.display()),
        ));
    }
    temporary_beside(path)
        .map(drop)
        .map_err(Error::io(path, "cannot be written"))
}

/// Checks all files that a command is to write: possible, none of them its `input`, none named twice.
pub fn check_outputs(input: &Path, outputs: &[&Path]) -> Result<()> {
    let mut taken = vec![std::fs::canonicalize(input).unwrap_or_else(|_| input.to_path_buf())];
    for path in outputs {
        check_writable(path)?;
        let folder = std::fs::canonicalize(folder_of(path)).unwrap_or_default();
        let place = folder.join(path.file_name().unwrap_or_default());
        if taken.contains(&place) {
            return Err(Error::input(
                path,
                None,
                "is named for two purposes; give each file its own name",
            ));
        }
        taken.push(place);
    }
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn temporary_beside(path: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".gdpt-").suffix(".part");
    // As any new file; the process's umask is applied.
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(folder_of(path))
}
