//! What the OBJ parser (tobj) reads instead of the file, line by line as it comes:
//! - Groups of at most [`GROUP`] faces. tobj keeps the faces of a group in a bulky form until it ends; one
//!   of ten million would take gigabytes.
//! - Faces with and without normals or texture coordinates in groups of their own: tobj makes up what a
//!   face lacks where others of its group have it.
//! - Groups named after their material: libraries are read later, wherever in the file they are named.
//! - UTF-8, as tobj refuses to read anything else.
//! - Lines that a backslash continues as one, and without what tobj misreads.

use super::line;
use std::collections::HashMap;
use std::io::{BufRead, Read};

/// Most faces of one group.
const GROUP: usize = 1 << 16;

/// What the faces of a group have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// Into [`Regroup::materials`].
    pub material: Option<u32>,
    /// Whether the corners name texture coordinates.
    pub texcoords: bool,
    /// Whether they name normals.
    pub normals: bool,
}

impl Group {
    fn name(&self) -> String {
        let material = self.material.map_or(-1, i64::from);
        let (texcoords, normals) = (self.texcoords as u8, self.normals as u8);
        format!("{material}/{texcoords}/{normals}")
    }

    /// The group that tobj calls `name`.
    pub fn from_name(name: &str) -> Self {
        let mut parts = name.split('/').map(|part| part.parse::<i64>().ok());
        let mut next = || parts.next().flatten();
        Self {
            material: next().and_then(|m| u32::try_from(m).ok()),
            texcoords: next() == Some(1),
            normals: next() == Some(1),
        }
    }

    /// The group of a face by the first corner that it names, such as `3/4/5`.
    fn of_face(line: &[u8], material: Option<u32>) -> Self {
        let mut words = line
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty());
        let mut parts = words.nth(1).unwrap_or_default().split(|&b| b == b'/');
        parts.next();
        let mut given = || parts.next().is_some_and(|part| !part.is_empty());
        Self {
            material,
            texcoords: given(),
            normals: given(),
        }
    }
}

/// The reader; it collects what it keeps from tobj.
pub struct Regroup<R> {
    /// `mtllib` arguments with their lines, in order.
    pub libraries: Vec<(String, usize)>,
    /// `usemtl` arguments that faces follow, with the line of the first use, in order of first use.
    pub materials: Vec<(String, usize)>,
    /// Whether there are faces with normals.
    pub normals: bool,
    inner: R,
    numbers: HashMap<String, u32>,
    /// A `usemtl` argument with its line that no face has followed yet.
    named: Option<(String, usize)>,
    /// The group of the faces, and how many it has.
    group: Group,
    faces: usize,
    /// Lines so far.
    lines: usize,
    /// Bytes of the inner buffer that pass as they are.
    passing: usize,
    /// A line that does not, and how much of it has been read.
    line: Vec<u8>,
    at: usize,
}

impl<R: BufRead> Regroup<R> {
    /// Reads from `inner`.
    pub fn new(inner: R) -> Self {
        Self {
            libraries: Vec::new(),
            materials: Vec::new(),
            normals: false,
            inner,
            numbers: HashMap::new(),
            named: None,
            group: Group::default(),
            // The first face begins a group.
            faces: GROUP,
            lines: 0,
            passing: 0,
            line: Vec::new(),
            at: 0,
        }
    }

    /// Lets the whole lines at the front of the inner buffer pass that need no change: vertices, and faces
    /// of the same group.
    fn pass(&mut self) -> std::io::Result<()> {
        let buffer = self.inner.fill_buf()?;
        let mut end = 0;
        while let Some(&first) = buffer.get(end) {
            let Some(length) = memchr::memchr(b'\n', &buffer[end..]) else {
                break;
            };
            let line = &buffer[end..end + length];
            let face = first == b'f';
            let same = match first {
                b'v' => true,
                b'f' => {
                    self.named.is_none()
                        && self.faces < GROUP
                        && Group::of_face(line, self.group.material) == self.group
                }
                _ => false,
            };
            if !same || !line::is_tidy(line) {
                break;
            }
            self.faces += face as usize;
            self.lines += 1;
            end += length + 1;
        }
        self.passing = end;
        Ok(())
    }

    /// Puts the next line, with a new group before it where one is due, into `line`.
    fn next_line(&mut self) -> std::io::Result<()> {
        self.at = 0;
        let number = self.lines + 1;
        self.lines += line::read(&mut self.inner, &mut self.line)?;
        line::tidy(&mut self.line);
        let text = String::from_utf8_lossy(&self.line);
        let (word, argument) = match text.trim().split_once(char::is_whitespace) {
            Some((word, argument)) => (word, argument.trim()),
            None => (text.trim(), ""),
        };
        match word {
            "f" => {
                if let Some((name, line)) = self.named.take() {
                    let next = self.materials.len() as u32;
                    let index = *self.numbers.entry(name.clone()).or_insert(next);
                    if index == next {
                        self.materials.push((name, line));
                    }
                    if self.group.material != Some(index) {
                        self.group.material = Some(index);
                        self.faces = GROUP;
                    }
                }
                let group = Group::of_face(text.as_bytes(), self.group.material);
                self.normals |= group.normals;
                let text = if self.faces == GROUP || group != self.group {
                    (self.group, self.faces) = (group, 0);
                    format!("g {}\n{text}", group.name())
                } else {
                    text.into_owned()
                };
                self.faces += 1;
                self.line = text.into_bytes();
            }
            "mtllib" if argument.is_empty() => self.line = vec![b'\n'],
            "mtllib" => {
                self.libraries.push((argument.to_owned(), number));
                self.line = vec![b'\n'];
            }
            "usemtl" if !argument.is_empty() => {
                self.named = Some((argument.to_owned(), number));
                self.line = vec![b'\n'];
            }
            // The file's own groups say nothing of materials.
            "g" | "o" => self.line = vec![b'\n'],
            _ => self.line = text.into_owned().into_bytes(),
        }
        Ok(())
    }
}

impl<R: BufRead> Read for Regroup<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        if self.at == self.line.len() && self.passing == 0 {
            self.pass()?;
            if self.passing == 0 {
                self.next_line()?;
            }
        }
        if self.passing > 0 {
            let count = out.len().min(self.passing);
            out[..count].copy_from_slice(&self.inner.fill_buf()?[..count]);
            self.inner.consume(count);
            self.passing -= count;
            return Ok(count);
        }
        let count = (&self.line[self.at..]).read(out)?;
        self.at += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_grouped_by_what_they_have() {
        let text = "mtllib a b.mtl\nv 1 2 3\no x\nf 1 2 3\nusemtl red\nf 1 2 \\\n 3\nf 1/1 2/2 3/3\n\
                    g y\nf 1//1 2//2 3//3\nusemtl blue\nusemtl red\nf 1//1 2//2 3//3\nf 1//1 2//2 3//3";
        // A small buffer, so that lines go across its end.
        for capacity in [5, 16, 1000] {
            let inner = std::io::BufReader::with_capacity(capacity, text.as_bytes());
            let mut reader = Regroup::new(inner);
            let mut out = String::new();
            reader.read_to_string(&mut out).unwrap();
            let lines: Vec<&str> = out.lines().filter(|l| !l.is_empty()).collect();
            let wanted = [
                "v 1 2 3",
                "g -1/0/0",
                "f 1 2 3",
                "g 0/0/0",
                "f 1 2   3",
                "g 0/1/0",
                "f 1/1 2/2 3/3",
                "g 0/0/1",
                "f 1//1 2//2 3//3",
                "f 1//1 2//2 3//3",
                "f 1//1 2//2 3//3",
            ];
            assert_eq!(lines, wanted);
            assert_eq!(reader.libraries, [("a b.mtl".to_owned(), 1)]);
            // No face is blue.
            assert_eq!(reader.materials, [("red".to_owned(), 5)]);
            assert!(reader.normals);
        }
        let group = Group {
            material: Some(7),
            texcoords: true,
            normals: false,
        };
        assert_eq!(Group::from_name(&group.name()), group);
    }
}
