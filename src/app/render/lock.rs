//! Files that one process alone may write.

use crate::error::{Error, Result};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// A file that says that another one is being written.
pub(super) struct Lock {
    place: PathBuf,
    /// Locked as long as it is open.
    _file: File,
}

impl Lock {
    /// For the file at `path`; an error where another process has it.
    pub(super) fn new(path: &Path) -> Result<Self> {
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".lock");
        let place = path.with_file_name(name);
        loop {
            let file = File::create(&place).map_err(Error::io(&place, "cannot be written"))?;
            if let Err(TryLockError::WouldBlock) = file.try_lock() {
                let message = "another render is writing this file";
                return Err(Error::input(path, None, message));
            }
            // Whoever held it has removed it, if that was between opening and locking.
            if is_at(&file, &place) {
                return Ok(Self { place, _file: file });
            }
        }
    }
}

#[cfg(unix)]
fn is_at(file: &File, place: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let there = file.metadata().ok().zip(std::fs::metadata(place).ok());
    there.is_some_and(|(a, b)| (a.dev(), a.ino()) == (b.dev(), b.ino()))
}

#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

impl Drop for Lock {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.place);
    }
}
