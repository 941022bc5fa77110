//! Pictures, figures and statistics to files, whole or not at all, and to pipes and devices.

pub mod colour_map;
pub mod cryptomatte;
pub mod exr;
pub mod figure;
pub mod format;
mod place;
pub mod png;
mod print;
pub mod stats;

pub use place::{check_outputs, is_stream, name_of, regular_file};
pub use print::{print, print_beside};

use crate::error::{Error, Result};
use place::{Place, open_stream, temporary_beside};
use serde::Serialize;
use std::fs;
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::Path;

/// What a file is written to: pictures in EXR go back to write where their parts are.
pub trait Sink: Write + Seek {}

impl<T: Write + Seek> Sink for T {}

/// What `write` writes to where `path` leads. A file is replaced by way of a temporary one in the same folder
/// that is renamed at the end: a reader never sees half a file, and a failure leaves what was there. A link
/// goes on being one. Pipes, devices, and what is open (/dev/stdout, /dev/fd/3; `-` is standard output) are
/// written into.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut dyn Sink) -> io::Result<()>) -> Result<()> {
    let failed = |e| Error::io(path, "cannot be written")(e);
    let mut bytes = Cursor::new(Vec::new());
    match Place::of(path).map_err(failed)? {
        Place::File(file) => replace(&file, write).map_err(failed),
        Place::Stream(stream) => write(&mut bytes)
            .and_then(|()| open_stream(&stream)?.write_all(bytes.get_ref()))
            .map_err(failed),
        Place::StandardOutput => {
            write(&mut bytes).map_err(failed)?;
            print::print_bytes(bytes.get_ref())
        }
    }
}

/// Replaces a regular file, or makes it.
fn replace(path: &Path, write: impl FnOnce(&mut dyn Sink) -> io::Result<()>) -> io::Result<()> {
    let mut file = temporary_beside(path)?;
    // Who may read what is there may read what takes its place.
    if let Ok(there) = fs::metadata(path) {
        file.as_file().set_permissions(there.permissions())?;
    }
    let mut buffer = BufWriter::new(file.as_file_mut());
    write(&mut buffer)?;
    buffer.flush()?;
    drop(buffer);
    // A disk may find out only now that it is full.
    file.as_file().sync_all()?;
    file.as_file_mut().rewind()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Writes `value` as JSON, indented.
pub fn write_json(path: &Path, value: &(impl Serialize + ?Sized)) -> Result<()> {
    write_whole(path, |file| {
        serde_json::to_writer_pretty(&mut *file, value)?;
        file.write_all(b"\n")
    })
}
