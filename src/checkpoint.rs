//! Checkpoints: the film in a file, from which a render goes on to the same bits as if it had never
//! ended.
//!
//! A file holds a line that says what it is, the length of a JSON header and the header, the film's sums,
//! and a checksum of all that. It is also what a part of a render is passed on in, to be merged with others. It is written beside its place, synchronised and renamed: whatever happens
//! meanwhile, the place holds a whole checkpoint, the old one or the new one.

use crate::error::{Error, Result};
use crate::film::Film;
use crate::part::Share;
use crate::path::Counts;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

/// What a file begins with, but for the number of its format.
const NAME: &str = "gdpt checkpoint ";
/// Changes whenever what follows does.
const FORMAT: u32 = 5;
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
    /// Whether it has come to its end.
    pub finished: bool,
}

/// What is told of a render, and does not change its bits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The OBJ.
    pub scene: String,
    /// Where the camera stands, and why, in words.
    pub camera: String,
    /// Triangles of the scene.
    pub triangles: usize,
    /// What is behind the scene, as `--background` has it.
    pub background: String,
    /// What the machine computes with.
    pub processor: String,
    /// Seconds reading the scene.
    pub seconds_loading: f64,
    /// Seconds building the acceleration structure.
    pub seconds_building: f64,
}

/// All that stands before the sums.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// What the bits depend on.
    pub identity: Identity,
    /// What the film holds of the picture.
    pub share: Share,
    /// How far it has come.
    pub progress: Progress,
    /// What else is to be told.
    pub about: About,
}

/// Writes a checkpoint to `path`, replacing the one that is there.
pub fn save(path: &Path, header: &Header, film: &Film) -> Result<()> {
    let part = part(path);
    let write = || -> io::Result<()> {
        let header = serde_json::to_vec(header)?;
        let mut out = Hashed::new(BufWriter::new(File::create(&part)?));
        out.write_all(format!("{NAME}{FORMAT}\n").as_bytes())?;
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
pub fn load(path: &Path, identity: &Identity, film: &mut Film) -> Result<Header> {
    let _ = fs::remove_file(part(path));
    let mut file = Opened::open(path)?;
    if let Some(difference) = difference(&file.header.identity, identity) {
        let message = format!("is of another render: {difference}");
        return Err(Error::input(path, None, message));
    }
    file.check_length(film.bytes())?;
    file.read(|mut input| film.read_from(&mut input))?;
    Ok(file.header)
}

/// A checkpoint whose sums are still to be read.
pub struct Opened {
    path: PathBuf,
    input: Hashed<BufReader<File>>,
    /// Bytes of the file, and of what stands before the sums.
    length: u64,
    before: u64,
    /// What stands before the sums.
    pub header: Header,
}

impl Opened {
    /// Reads the header.
    pub fn open(path: &Path) -> Result<Self> {
        let failed = |e| unreadable(path, e);
        // To open a pipe would wait for its writer.
        if !fs::metadata(path).map_err(failed)?.is_file() {
            return Err(Error::input(
                path,
                None,
                "is no file that can be read again",
            ));
        }
        let file = File::open(path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut input = Hashed::new(BufReader::new(file));
        let mut before = 0;
        let mut read = |count: u64| -> io::Result<Vec<u8>> {
            let mut bytes = vec![0; count as usize];
            input.read_exact(&mut bytes)?;
            before += count;
            Ok(bytes)
        };

        // What it is.
        let foreign = || Error::input(path, None, "is no checkpoint of this program");
        let or_foreign = |e: io::Error| match e.kind() {
            io::ErrorKind::UnexpectedEof => foreign(),
            _ => failed(e),
        };
        if read(NAME.len() as u64).map_err(or_foreign)? != NAME.as_bytes() {
            return Err(foreign());
        }
        let mut number = Vec::new();
        while number.last() != Some(&b'\n') {
            if number.len() > 10 {
                return Err(foreign());
            }
            number.extend(read(1).map_err(or_foreign)?);
        }
        let number = std::str::from_utf8(&number).ok();
        let number = number.and_then(|n| n.trim_end().parse::<u32>().ok());
        if number != Some(FORMAT) {
            let message = match number {
                Some(n) => format!(
                    "is a checkpoint of another version of this program: its format is {n}, this one's {FORMAT}"
                ),
                None => return Err(foreign()),
            };
            return Err(Error::input(path, None, message));
        }

        // Header.
        let bytes = read(8).map_err(failed)?;
        let header_length = u64::from_le_bytes(bytes.try_into().expect("8 bytes"));
        let senseless = || damaged(path, "its header makes no sense");
        if header_length > LONGEST_HEADER {
            return Err(senseless());
        }
        let bytes = read(header_length).map_err(failed)?;
        let header: Header = serde_json::from_slice(&bytes).map_err(|_| senseless())?;
        if !header.share.is_valid() {
            return Err(senseless());
        }
        Ok(Self {
            path: path.to_owned(),
            input,
            length,
            before,
            header,
        })
    }

    /// Refuses a file that has not as many bytes of sums.
    pub fn check_length(&self, sums: u64) -> Result<()> {
        let expected = self.before + sums + 8;
        if self.length != expected {
            let what = format!("it has {} bytes of {expected}", self.length);
            return Err(damaged(&self.path, &what));
        }
        Ok(())
    }

    /// Has `take` read the sums, all of them, and checks what was read.
    pub fn read<T>(&mut self, take: impl FnOnce(&mut dyn Read) -> io::Result<T>) -> Result<T> {
        let failed = |e| unreadable(&self.path, e);
        let taken = take(&mut self.input).map_err(failed)?;
        let checksum = self.input.hash.digest();
        let mut bytes = [0; 8];
        self.input.inner.read_exact(&mut bytes).map_err(failed)?;
        if checksum != u64::from_le_bytes(bytes) {
            return Err(damaged(&self.path, "its checksum is wrong"));
        }
        Ok(taken)
    }
}

fn unreadable(path: &Path, e: io::Error) -> Error {
    match e.kind() {
        io::ErrorKind::UnexpectedEof => damaged(path, "it is cut short"),
        io::ErrorKind::InvalidData => damaged(path, &e.to_string()),
        _ => Error::io(path, "the checkpoint cannot be read")(e),
    }
}

/// The checksum that ends a file with these bytes before it.
pub fn checksum(bytes: &[u8]) -> u64 {
    xxh3_64(bytes)
}

fn damaged(path: &Path, what: &str) -> Error {
    let message = format!("the checkpoint is damaged, {what}; without it the render starts anew");
    Error::input(path, None, message)
}

/// The first thing that differs.
pub fn difference(there: &Identity, here: &Identity) -> Option<String> {
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
