//! Checkpoints: the film in a file, from which a render goes on to the same bits as if it had never
//! ended.
//!
//! A file holds a line that says what it is, the length of a JSON header and the header, the film's sums,
//! and a checksum of all that. It is written beside its place, synchronised and renamed: whatever happens
//! meanwhile, the place holds a whole checkpoint, the old one or the new one.

use crate::error::{Error, Result};
use crate::film::Film;
use crate::path::Counts;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

const MAGIC: &[u8] = b"gdpt checkpoint 4\n";
/// No header is longer.
const LONGEST_HEADER: u64 = 1 << 20;

/// What the bits of a render depend on, by name: scene, settings, version. A checkpoint goes on only where
/// all of it is the same.
pub type Identity = BTreeMap<String, String>;

/// How far a render has come, beside its film.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// What was counted.
    pub counts: Counts,
    /// Seconds tracing.
    pub seconds: f64,
    /// Samples after which `--error` looks at the error again.
    pub next_check: u64,
}

#[derive(Serialize, Deserialize)]
struct Header {
    identity: Identity,
    progress: Progress,
}

/// Writes a checkpoint to `path`, replacing the one that is there.
pub fn save(path: &Path, identity: &Identity, progress: &Progress, film: &Film) -> Result<()> {
    let part = part(path);
    let write = || -> io::Result<()> {
        let header = serde_json::to_vec(&Header {
            identity: identity.clone(),
            progress: progress.clone(),
        })?;
        let mut out = Hashed::new(BufWriter::new(File::create(&part)?));
        out.write_all(MAGIC)?;
        out.write_all(&(header.len() as u64).to_le_bytes())?;
        out.write_all(&header)?;
        film.write_to(&mut out)?;
        let (checksum, mut file) = (out.hash.digest(), out.inner);
        file.write_all(&checksum.to_le_bytes())?;
        file.into_inner()
            .map_err(io::IntoInnerError::into_error)?
            .sync_all()?;
        fs::rename(&part, path)
    };
    write().map_err(|e| {
        let _ = fs::remove_file(&part);
        Error::io(path, "the checkpoint cannot be written")(e)
    })
}

/// Reads the checkpoint at `path` into `film`, which is of the size of `identity`. What was started and
/// not finished beside it is removed.
pub fn load(path: &Path, identity: &Identity, film: &mut Film) -> Result<Progress> {
    let _ = fs::remove_file(part(path));
    let failed = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => damaged(path, "it is cut short"),
        _ => Error::io(path, "the checkpoint cannot be read")(e),
    };
    let file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    let mut input = Hashed::new(BufReader::new(file));

    // Header.
    let mut magic = [0; MAGIC.len()];
    match input.read_exact(&mut magic) {
        Ok(()) if magic == MAGIC => (),
        Err(e) if e.kind() != io::ErrorKind::UnexpectedEof => return Err(failed(e)),
        _ => return Err(Error::input(path, None, "is no checkpoint of this program")),
    }
    let mut bytes = [0; 8];
    input.read_exact(&mut bytes).map_err(failed)?;
    let header_length = u64::from_le_bytes(bytes);
    if header_length > LONGEST_HEADER {
        return Err(damaged(path, "its header makes no sense"));
    }
    let mut header = vec![0; header_length as usize];
    input.read_exact(&mut header).map_err(failed)?;
    let header: Header =
        serde_json::from_slice(&header).map_err(|_| damaged(path, "its header makes no sense"))?;
    if let Some(difference) = difference(&header.identity, identity) {
        let message = format!("is of another render: {difference}");
        return Err(Error::input(path, None, message));
    }

    // Film.
    let before = (MAGIC.len() + 8) as u64 + header_length;
    let expected = before + film.bytes() + 8;
    if length != expected {
        let what = format!("it has {length} bytes of {expected}");
        return Err(damaged(path, &what));
    }
    film.read_from(&mut input).map_err(failed)?;
    let checksum = input.hash.digest();
    input.inner.read_exact(&mut bytes).map_err(failed)?;
    if checksum != u64::from_le_bytes(bytes) {
        return Err(damaged(path, "its checksum is wrong"));
    }
    Ok(header.progress)
}

/// The checksum that ends a file with these bytes before it.
pub fn checksum(bytes: &[u8]) -> u64 {
    xxh3_64(bytes)
}

fn damaged(path: &Path, what: &str) -> Error {
    let message = format!("the checkpoint is damaged, {what}; remove it to start anew");
    Error::input(path, None, message)
}

/// The first thing that differs.
fn difference(there: &Identity, here: &Identity) -> Option<String> {
    // The scene has the size in it, and says less: last.
    let names = here.keys().chain(there.keys());
    let (scene, other): (Vec<_>, Vec<_>) = names.partition(|name| *name == "scene");
    let names = other.into_iter().chain(scene);
    let value = |map: &Identity, name: &str| map.get(name).map_or("nothing", |v| v).to_owned();
    names
        .map(|name| (name, value(there, name), value(here, name)))
        .find(|(_, there, here)| there != here)
        .map(|(name, there, here)| format!("its {name} is {there}, this one's is {here}"))
}

/// Where a checkpoint is written before it takes its place.
fn part(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    path.with_file_name(name)
}

/// What is read or written goes into a checksum.
struct Hashed<T> {
    inner: T,
    hash: Xxh3,
}

impl<T> Hashed<T> {
    fn new(inner: T) -> Self {
        Self {
            inner,
            hash: Xxh3::new(),
        }
    }
}

impl<T: Write> Write for Hashed<T> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.inner.write(bytes)?;
        self.hash.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<T: Read> Read for Hashed<T> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(bytes)?;
        self.hash.update(&bytes[..count]);
        Ok(count)
    }
}
