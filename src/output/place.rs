//! Where the path of an output leads: to a file, through links, into a pipe or a device, or to standard
//! output.

use crate::error::{Error, Result};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The path that stands for standard output.
const DASH: &str = "-";
/// What messages call it.
pub(super) const STANDARD_OUTPUT: &str = "standard output";
/// No chain of links is longer on Linux either.
const MOST_LINKS: usize = 40;

/// Where a path leads, all links followed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A regular file that is there or is to be made: replaced as a whole.
    File(PathBuf),
    /// A pipe, a device or something that is open: written into, never replaced.
    Stream(PathBuf),
    /// What this program prints to.
    StandardOutput,
}

impl Place {
    /// Follows `path`. A file need not be there, nor what a link names.
    pub(super) fn of(path: &Path) -> io::Result<Self> {
        if path == Path::new(DASH) {
            return Ok(Self::StandardOutput);
        }
        let mut place = path.to_owned();
        for _ in 0..MOST_LINKS {
            if let Some(open) = Self::open(&place) {
                return Ok(open);
            }
            match fs::read_link(&place) {
                // A relative link starts from the folder that it is in.
                Ok(target) => place = folder_of(&place).join(target),
                Err(_) => return Ok(Self::at(place)),
            }
        }
        Err(io::Error::other("too many symbolic links"))
    }

    /// What is open under a number, as /dev/stdout, /dev/fd/3 and the like name it: its file, if it is one,
    /// is where it is written on, not one to replace.
    fn open(path: &Path) -> Option<Self> {
        let folder = fs::canonicalize(folder_of(path)).ok()?;
        let own = Path::new("/proc").join(std::process::id().to_string());
        let in_proc = folder.starts_with("/proc") && folder.ends_with("fd");
        if !(in_proc || folder == Path::new("/dev/fd")) {
            return None;
        }
        let is_own = folder.starts_with(own) || !in_proc;
        match path.file_name()?.to_str()?.parse::<u32>().ok()? {
            1 if is_own => Some(Self::StandardOutput),
            _ => Some(Self::Stream(path.to_owned())),
        }
    }

    /// What is at a path that is no link.
    fn at(path: PathBuf) -> Self {
        match fs::metadata(&path) {
            Ok(there) if !there.is_file() && !there.is_dir() => Self::Stream(path),
            _ => {
                // So that two paths to one place are equal.
                let folder = fs::canonicalize(folder_of(&path));
                let name = path.file_name();
                Self::File(match folder.ok().zip(name) {
                    Some((folder, name)) => folder.join(name),
                    None => path,
                })
            }
        }
    }
}

/// What messages call an output.
pub fn name_of(path: &Path) -> String {
    match path == Path::new(DASH) {
        true => STANDARD_OUTPUT.to_owned(),
        false => path.display().to_string(),
    }
}

/// Whether an output goes to standard output, where the words for people must then not go.
pub(super) fn is_standard_output(path: &Path) -> bool {
    matches!(Place::of(path), Ok(Place::StandardOutput))
}

/// Whether `path` leads to something that is written into, and has no name that says what.
pub fn is_stream(path: &Path) -> bool {
    !matches!(Place::of(path), Ok(Place::File(_)) | Err(_))
}

/// Opens what is there to write on at its end.
pub(super) fn open_stream(path: &Path) -> io::Result<File> {
    // To append matters where it is a file that someone else has open; pipes and devices do not mind.
    OpenOptions::new().append(true).open(path)
}

/// The file that `path` leads to, for what must be one, such as a checkpoint.
pub fn regular_file(path: &Path) -> Result<PathBuf> {
    match Place::of(path).map_err(Error::io(path, "cannot be written"))? {
        Place::File(file) => Ok(file),
        _ => Err(Error::input(
            path,
            None,
            "is a pipe or a device; this needs a file, which can be read again",
        )),
    }
}

/// Checks all files that a command is to write: possible, none of them one of its `inputs`, none named
/// twice. Found out before hours of rendering, not after.
pub fn check_outputs(inputs: &[&Path], outputs: &[&Path]) -> Result<()> {
    let place_of = |path: &Path| Place::of(path).map_err(Error::io(path, "cannot be written"));
    let inputs = inputs.iter().filter(|path| **path != Path::new(DASH));
    let mut taken = inputs
        .map(|path| fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()))
        .map(Place::File)
        .collect::<Vec<_>>();
    for path in outputs {
        let place = place_of(path)?;
        match &place {
            Place::File(file) => check_file(path, file)?,
            // To open a pipe would wait for its reader, or tell it that this was all.
            Place::Stream(stream) if !is_pipe(stream) => {
                open_stream(stream).map_err(Error::io(path, "cannot be written"))?;
            }
            Place::Stream(_) | Place::StandardOutput => (),
        }
        // A device such as /dev/null takes whatever comes.
        if taken.contains(&place) && !is_device(&place) {
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

/// Whether `file`, to which `path` leads, can be written.
fn check_file(path: &Path, file: &Path) -> Result<()> {
    if file.is_dir() {
        let message = "is a directory; name a file in it";
        return Err(Error::input(path, None, message));
    }
    let folder = folder_of(file);
    if !folder.is_dir() {
        let message = format!("the folder {} does not exist", folder.display());
        return Err(Error::input(path, None, message));
    }
    temporary_beside(file)
        .map(drop)
        .map_err(Error::io(path, "cannot be written"))
}

#[cfg(unix)]
fn is_pipe(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    fs::metadata(path).is_ok_and(|there| there.file_type().is_fifo())
}

#[cfg(not(unix))]
fn is_pipe(_: &Path) -> bool {
    false
}

#[cfg(unix)]
fn is_device(place: &Place) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let Place::Stream(path) = place else {
        return false;
    };
    fs::metadata(path).is_ok_and(|there| there.file_type().is_char_device())
}

#[cfg(not(unix))]
fn is_device(_: &Place) -> bool {
    false
}

/// The folder that a file is in.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A new file in the folder of `path`, which is gone if it is not kept.
pub(super) fn temporary_beside(path: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".gdpt-").suffix(".part");
    // As any new file; the process's umask is applied.
    #[cfg(unix)]
    builder.permissions(<fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(folder_of(path))
}

/// Writes `bytes` to standard output itself, not to a file that is there by chance: what was printed before
/// stays before.
pub(super) fn write_standard_output(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)?;
    out.flush()
}
