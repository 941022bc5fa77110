//! Text files however they are packed: compressed by gzip, in UTF-16, with line ends of any system.

use super::check_readable;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

/// Bytes read at once.
const BUFFER: usize = 1 << 20;
/// The path that stands for standard input.
pub const STANDARD_INPUT: &str = "-";

/// The text of a file, line by line.
pub type Lines<'a> = Box<dyn BufRead + Send + 'a>;

/// A text file that can be read several times.
pub struct Text {
    path: PathBuf,
    /// Of what can be read only once: standard input, or a pipe.
    bytes: Option<Vec<u8>>,
}

impl Text {
    /// The file at `path`; `-` is standard input.
    pub fn new(path: &Path) -> Result<Self> {
        let mut bytes = Vec::new();
        let once = if path == Path::new(STANDARD_INPUT) {
            std::io::stdin()
                .lock()
                .read_to_end(&mut bytes)
                .map_err(Error::io(path, "standard input cannot be read"))?;
            true
        } else {
            let meta = std::fs::metadata(path).map_err(Error::io(path, "cannot be read"))?;
            let special = !meta.is_file() && !meta.is_dir();
            if special {
                bytes = std::fs::read(path).map_err(Error::io(path, "cannot be read"))?;
            } else {
                check_readable(path)?;
            }
            special
        };
        if once && bytes.is_empty() {
            return Err(Error::input(path, None, "is empty"));
        }
        Ok(Self {
            path: path.to_owned(),
            bytes: once.then_some(bytes),
        })
    }

    /// Its length in bytes as it is packed; 0 where that cannot be known.
    pub fn length(&self) -> u64 {
        match &self.bytes {
            Some(bytes) => bytes.len() as u64,
            None => std::fs::metadata(&self.path).map_or(0, |meta| meta.len()),
        }
    }

    /// Its text in UTF-8 (as far as it is text), where every line ends in a line feed. A byte order mark of
    /// UTF-8 stays.
    pub fn open(&self) -> Result<Lines<'_>> {
        let failed = || Error::io(&self.path, "cannot be read");
        let mut reader: Box<dyn BufRead + Send> = match &self.bytes {
            Some(bytes) => Box::new(Cursor::new(bytes)),
            None => {
                let file = File::open(&self.path).map_err(failed())?;
                Box::new(BufReader::with_capacity(BUFFER, file))
            }
        };
        if reader
            .fill_buf()
            .map_err(failed())?
            .starts_with(b"\x1f\x8b")
        {
            let unpacked = flate2::bufread::MultiGzDecoder::new(reader);
            reader = Box::new(BufReader::with_capacity(BUFFER, unpacked));
        }
        let head = reader.fill_buf().map_err(failed())?;
        if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
            let mut bytes = Vec::new();
            reader.read_to_end(&mut bytes).map_err(failed())?;
            let (text, ..) = encoding_rs::UTF_16LE.decode(&bytes);
            reader = Box::new(Cursor::new(text.into_owned().into_bytes()));
        }
        let lines = LineEnds {
            inner: reader,
            held: None,
        };
        Ok(Box::new(BufReader::with_capacity(BUFFER, lines)))
    }
}

/// The whole text of a file; what is not UTF-8 in it is replaced by U+FFFD.
pub fn read(path: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    Text::new(path)?
        .open()?
        .read_to_end(&mut bytes)
        .map_err(Error::io(path, "cannot be read"))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Makes line feeds of carriage returns that stand alone.
struct LineEnds<R> {
    inner: R,
    /// A byte that was read to see what follows a carriage return.
    held: Option<u8>,
}

impl<R: BufRead> Read for LineEnds<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let Some((first, rest)) = out.split_first_mut() else {
            return Ok(0);
        };
        let count = match self.held.take() {
            Some(byte) => {
                *first = byte;
                1 + self.inner.read(rest)?
            }
            None => self.inner.read(out)?,
        };
        let mut next = 0;
        while let Some(at) = memchr::memchr(b'\r', &out[next..count]) {
            let at = next + at;
            let follows = if at + 1 < count {
                Some(out[at + 1])
            } else {
                let mut one = [0];
                self.held = (self.inner.read(&mut one)? == 1).then_some(one[0]);
                self.held
            };
            if follows != Some(b'\n') {
                out[at] = b'\n';
            }
            next = at + 1;
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn read_bytes(bytes: &[u8]) -> Result<String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        read(file.path())
    }

    #[test]
    fn every_packing_gives_the_same_text() {
        const TEXT: &str = "newmtl gr\u{fc}n\nKd 1 0 0\n";
        let mac = TEXT.replace('\n', "\r");
        let zip = |text: &[u8]| {
            let mut packed = flate2::write::GzEncoder::new(Vec::new(), Default::default());
            packed.write_all(text).unwrap();
            packed.finish().unwrap()
        };
        let utf16 = |text: &str, bytes: fn(u16) -> [u8; 2]| {
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            units.flat_map(bytes).collect::<Vec<u8>>()
        };
        let two_parts = [zip(&TEXT.as_bytes()[..9]), zip(&TEXT.as_bytes()[9..])].concat();
        for bytes in [
            TEXT.as_bytes().to_vec(),
            mac.as_bytes().to_vec(),
            zip(TEXT.as_bytes()),
            two_parts,
            utf16(TEXT, u16::to_le_bytes),
            utf16(TEXT, u16::to_be_bytes),
            zip(&utf16(&mac, u16::to_le_bytes)),
        ] {
            assert_eq!(read_bytes(&bytes).unwrap(), TEXT);
        }
        assert_eq!(
            read_bytes(b"\xef\xbb\xbfa\r\n\xe9").unwrap(),
            "\u{feff}a\r\n\u{fffd}"
        );
        let cut = &zip(TEXT.as_bytes())[..20];
        assert!(
            read_bytes(cut)
                .unwrap_err()
                .to_string()
                .contains("cannot be read")
        );
        assert!(read_bytes(b"").is_err());
    }

    #[test]
    fn line_ends_are_seen_across_reads() {
        let text = b"a\rb\r\nc\r\rd\r\n\re\r";
        for size in 1..8 {
            let mut lines = LineEnds {
                inner: &text[..],
                held: None,
            };
            let (mut all, mut piece) = (Vec::new(), vec![0; size]);
            while let count @ 1.. = lines.read(&mut piece).unwrap() {
                all.extend_from_slice(&piece[..count]);
            }
            assert_eq!(all, b"a\nb\r\nc\n\nd\r\n\ne\n", "{size}");
        }
    }
}
