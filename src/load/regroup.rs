//! What the OBJ parser (tobj) reads instead of the file, line by line as it comes:
//! - Groups of at most [`GROUP`] faces. tobj keeps the faces of a group in a bulky form until it ends; one
//!   of ten million would take gigabytes.
//! - Faces with and without normals or texture coordinates in groups of their own: tobj makes up what a
//!   face lacks where others of its group have it.
//! - Groups named after their material and smoothing group: libraries are read later, wherever in the file
//!   they are named.
//! - UTF-8, as tobj refuses to read anything else, lines that a backslash continues as one, and no comments.
//! - Numbers that are none as NaN, and faces only as far as what they name is there; those that name what
//!   stands further down come last.
//! - Colours at every vertex or at none.

use super::face::{self, Counts, Face, Shape};
use super::line;
use super::objects::Objects;
use super::passed_over::PassedOver;
use std::collections::HashMap;
use std::fmt::Write;
use std::io::{BufRead, Read};

/// Most faces of one group.
const GROUP: usize = 1 << 16;

/// What the faces of a group have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// Into [`Regroup::materials`].
    pub material: Option<u32>,
    /// The smoothing group of faces without normals; 0 is none.
    pub smoothing: u32,
    /// What the corners name.
    pub shape: Shape,
}

impl Group {
    fn new(material: Option<u32>, smoothing: u32, shape: Shape) -> Self {
        Self {
            material,
            smoothing: if shape.normals { 0 } else { smoothing },
            shape,
        }
    }

    fn name(&self) -> String {
        let material = self.material.map_or(-1, i64::from);
        let Shape { texcoords, normals } = self.shape;
        let (texcoords, normals) = (texcoords as u8, normals as u8);
        format!("{material}/{}/{texcoords}/{normals}", self.smoothing)
    }

    /// The group that tobj calls `name`.
    pub fn from_name(name: &str) -> Self {
        let mut parts = name.split('/').map(|part| part.parse::<i64>().ok());
        let mut next = || parts.next().flatten();
        Self {
            material: next().and_then(|m| u32::try_from(m).ok()),
            smoothing: next().and_then(|s| u32::try_from(s).ok()).unwrap_or(0),
            shape: Shape {
                texcoords: next() == Some(1),
                normals: next() == Some(1),
            },
        }
    }
}

/// Which colours vertices get.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Colours {
    /// Those of the file, or none: as its first vertex has it.
    AsWritten,
    /// Those of the file, NaN where it has none.
    Padded,
    /// These, in the order of the vertices; NaN for further ones.
    Given(Vec<[u8; 3]>),
}

/// The reader; it collects what it keeps from tobj.
pub struct Regroup<R> {
    /// `mtllib` arguments with their lines, in order.
    pub libraries: Vec<(String, usize)>,
    /// `usemtl` arguments that faces follow, with the line of the first use, in order of first use.
    pub materials: Vec<(String, usize)>,
    /// What is not read.
    pub passed_over: PassedOver,
    /// Set where the file must be read again, with these colours: what was read is of no use.
    pub again: Option<Colours>,
    /// Why reading failed.
    pub failure: Option<String>,
    /// Vertices, texture coordinates and normals so far.
    pub counts: Counts,
    /// To which objects the faces belong.
    pub objects: Objects,
    inner: R,
    numbers: HashMap<String, u32>,
    /// A `usemtl` argument with its line that no face has followed yet.
    named: Option<(String, usize)>,
    colours: Colours,
    /// Of a plain line of a vertex: 3, or 6 with colours. Any line needs a look as long as it is 0.
    vertex_numbers: usize,
    /// Colours in comments, as ZBrush writes them.
    mrgb: Vec<[u8; 3]>,
    /// As the last lines have it.
    material: Option<u32>,
    smoothing: u32,
    /// The group of the faces, and how many it has.
    group: Group,
    faces: usize,
    /// Faces that name what stands further down, with their lines in the file, in the order of the file.
    early: Vec<Early>,
    /// Lines so far.
    lines: usize,
    /// Bytes of the inner buffer that pass as they are.
    passing: usize,
    /// A line that does not, and how much of it has been read.
    line: Vec<u8>,
    at: usize,
}

/// A face that names what stands further down.
struct Early {
    group: Group,
    object: u32,
    /// In the file.
    number: usize,
    line: String,
}

impl<R: BufRead> Regroup<R> {
    /// Reads from `inner`.
    pub fn new(inner: R, colours: Colours) -> Self {
        Self {
            libraries: Vec::new(),
            materials: Vec::new(),
            passed_over: PassedOver::default(),
            again: None,
            failure: None,
            counts: [0; 3],
            objects: Objects::default(),
            inner,
            numbers: HashMap::new(),
            named: None,
            colours,
            vertex_numbers: 0,
            mrgb: Vec::new(),
            material: None,
            smoothing: 0,
            group: Group::default(),
            // The first face begins a group.
            faces: GROUP,
            early: Vec::new(),
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
        while let Some(length) = memchr::memchr(b'\n', &buffer[end..]) {
            let line = &buffer[end..end + length];
            let plain = match line {
                [b'f', b' ' | b'\t', corners @ ..]
                    if self.faces < GROUP && self.named.is_none() =>
                {
                    let shape = face::plain(corners, &self.counts);
                    let same = shape.is_some_and(|shape| {
                        Group::new(self.material, self.smoothing, shape) == self.group
                    });
                    self.faces += usize::from(same);
                    self.objects.faces += usize::from(same);
                    same
                }
                [b'v', b' ' | b'\t', numbers @ ..] => {
                    let found = line::plain_numbers(numbers);
                    let plain = found.is_some_and(|found| {
                        let weighted = found.count == 4 && !found.last_zero;
                        found.count >= 3
                            && (found.count == self.vertex_numbers
                                || self.vertex_numbers == 3 && weighted)
                    });
                    self.counts[0] += i64::from(plain);
                    plain
                }
                [b'v', b't', b' ' | b'\t', numbers @ ..] => {
                    let plain = line::plain_numbers(numbers).is_some_and(|found| found.count >= 2);
                    self.counts[1] += i64::from(plain);
                    plain
                }
                [b'v', b'n', b' ' | b'\t', numbers @ ..] => {
                    let found = line::plain_numbers(numbers);
                    let plain = found.is_some_and(|found| found.count == 3 && !found.zero);
                    self.counts[2] += i64::from(plain);
                    plain
                }
                _ => false,
            };
            if !plain {
                break;
            }
            self.lines += 1;
            end += length + 1;
        }
        self.passing = end;
        Ok(())
    }

    /// Puts what stands for the next line into `line`; nothing at the end of the file.
    fn next_line(&mut self) -> std::io::Result<()> {
        self.at = 0;
        let number = self.lines + 1;
        let mut bytes = std::mem::take(&mut self.line);
        let count = line::read(&mut self.inner, &mut bytes)?;
        self.lines += count;
        let mut out = String::new();
        if count == 0 {
            self.end(&mut out);
        } else {
            self.statement(&String::from_utf8_lossy(&bytes), number, &mut out);
            // Nothing at all would be the end.
            if out.is_empty() && self.again.is_none() {
                out.push('\n');
            }
        }
        self.line = out.into_bytes();
        Ok(())
    }

    /// Writes what stands for one statement, on this line of the file.
    fn statement(&mut self, text: &str, number: usize, out: &mut String) {
        let text = text.trim();
        let (word, argument) = match text.split_once(char::is_whitespace) {
            Some((word, argument)) => (word, argument.trim()),
            None => (text, ""),
        };
        match word {
            "v" => self.vertex(argument, number, out),
            "vt" => {
                self.counts[1] += 1;
                let mut words = line::words(argument);
                let (u, v) = (words.next(), words.next());
                // A texture may have one dimension.
                let numbers = [u.unwrap_or_default(), v.unwrap_or("0")].map(line::finite);
                let [u, v] = match numbers {
                    [Some(u), Some(v)] => [u, v],
                    _ => {
                        self.passed_over.texcoords.add(number);
                        [f32::NAN; 2]
                    }
                };
                let _ = writeln!(out, "vt {u} {v}");
            }
            "vn" => {
                self.counts[2] += 1;
                let n = three(line::words(argument)).unwrap_or([f32::NAN; 3]);
                if n == [0.0; 3] || n[0].is_nan() {
                    self.passed_over.normals.add(number);
                }
                let _ = writeln!(out, "vn {} {} {}", n[0], n[1], n[2]);
            }
            // The format's first version said `fo`.
            "f" | "fo" => {
                if let Some((name, line)) = self.named.take() {
                    let next = self.materials.len() as u32;
                    let index = *self.numbers.entry(name.clone()).or_insert(next);
                    if index == next {
                        self.materials.push((name, line));
                    }
                    self.material = Some(index);
                }
                match face::read(line::words(argument), &self.counts, false) {
                    Face::Early(line) => {
                        self.early.push(Early {
                            group: Group::new(self.material, self.smoothing, Shape::default()),
                            object: self.objects.current(),
                            number,
                            line,
                        });
                    }
                    face => self.face(face, (self.material, self.smoothing), number, out),
                }
            }
            "mtllib" if argument.is_empty() => {}
            "mtllib" => self.libraries.push((argument.to_owned(), number)),
            // Without a name it says nothing.
            "usemtl" if argument.is_empty() => {}
            "usemtl" => self.named = Some((argument.to_owned(), number)),
            "s" => match argument.split_whitespace().next() {
                None => {}
                Some("on") => self.smoothing = 1,
                // `off` and what is no number.
                Some(group) => self.smoothing = group.parse().unwrap_or(0),
            },
            "o" => self.objects.object(argument),
            "g" => self.objects.group(argument),
            "l" | "p" => self.passed_over.lines.add(number),
            "#MRGB" => self.mrgb.extend(mrgb(argument)),
            "" => {}
            _ if word.starts_with('#') => {}
            _ => self.passed_over.word(word, number),
        }
    }

    fn vertex(&mut self, argument: &str, number: usize, out: &mut String) {
        let index = self.counts[0] as usize;
        self.counts[0] += 1;
        let words: Vec<Option<f32>> = line::words(argument).map(line::finite).collect();
        let mut p = match words[..] {
            [Some(x), Some(y), Some(z), ..] => [x, y, z],
            _ => [f32::NAN; 3],
        };
        // A fourth number alone is a weight; more are a colour, which may have an alpha.
        if let [_, _, _, weight] = words[..] {
            match weight.filter(|&w| w != 0.0) {
                Some(weight) => p = p.map(|x| x / weight),
                None => self.passed_over.weights.add(number),
            }
        }
        if !p.iter().all(|x| x.is_finite()) {
            p = [f32::NAN; 3];
            self.passed_over.positions.add(number);
        }
        let written = match words[..] {
            [_, _, _, Some(r), Some(g), Some(b), ..] => Some([r, g, b]),
            _ => None,
        };
        if index == 0 {
            self.vertex_numbers = match self.colours {
                Colours::AsWritten if written.is_none() => 3,
                Colours::AsWritten | Colours::Padded => 6,
                Colours::Given(_) => 0,
            };
        } else if written.is_some() && self.vertex_numbers == 3 {
            self.again = Some(Colours::Padded);
            return;
        }
        let _ = write!(out, "v {} {} {}", p[0], p[1], p[2]);
        let colour = match &self.colours {
            _ if self.vertex_numbers == 3 => None,
            Colours::Given(colours) => colours.get(index).map(|c| c.map(|b| f32::from(b) / 255.0)),
            _ => written,
        };
        if self.vertex_numbers != 3 {
            let [r, g, b] = colour.unwrap_or([f32::NAN; 3]);
            let _ = write!(out, " {r} {g} {b}");
        }
        out.push('\n');
    }

    /// Writes a face, with a new group before it where one is due.
    fn face(
        &mut self,
        face: Face,
        (material, smoothing): (Option<u32>, u32),
        number: usize,
        out: &mut String,
    ) {
        match face {
            Face::Whole { shape, lost, line } => {
                if lost.texcoords {
                    self.passed_over.lost_texcoords.add(number);
                }
                if lost.normals {
                    self.passed_over.lost_normals.add(number);
                }
                let group = Group::new(material, smoothing, shape);
                if self.faces == GROUP || group != self.group {
                    (self.group, self.faces) = (group, 0);
                    let _ = writeln!(out, "g {}", group.name());
                }
                self.faces += 1;
                self.objects.faces += 1;
                out.push_str(&line);
            }
            Face::Early(_) => {}
            Face::Unusable(reason) => self.passed_over.face(number, reason),
        }
    }

    /// Writes what had to wait for the end.
    fn end(&mut self, out: &mut String) {
        if !self.mrgb.is_empty() && self.vertex_numbers == 3 {
            self.again = Some(Colours::Given(std::mem::take(&mut self.mrgb)));
            return;
        }
        for early in std::mem::take(&mut self.early) {
            let corners = early.line.split_whitespace().skip(1);
            let face = face::read(corners, &self.counts, true);
            self.objects.go_on(early.object);
            let Group {
                material,
                smoothing,
                ..
            } = early.group;
            self.face(face, (material, smoothing), early.number, out);
        }
    }

    fn fill(&mut self) -> std::io::Result<()> {
        if self.at == self.line.len() && self.passing == 0 && self.again.is_none() {
            self.pass()?;
            if self.passing == 0 {
                self.next_line()?;
            }
        }
        Ok(())
    }
}

impl<R: BufRead> Read for Regroup<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        if let Err(e) = self.fill() {
            self.failure = Some(e.to_string());
            return Err(e);
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

/// Three finite numbers.
fn three<'a>(words: impl Iterator<Item = &'a str>) -> Option<[f32; 3]> {
    let numbers: Vec<f32> = words.take(3).map_while(line::finite).collect();
    numbers.try_into().ok()
}

/// The colours of a comment of ZBrush: eight hexadecimal digits each, of a mask, red, green and blue.
fn mrgb(digits: &str) -> impl Iterator<Item = [u8; 3]> {
    digits.as_bytes().chunks_exact(8).map_while(|colour| {
        let colour = u32::from_str_radix(std::str::from_utf8(colour).ok()?, 16).ok()?;
        let [_, r, g, b] = colour.to_be_bytes();
        Some([r, g, b])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pass(text: &str, colours: Colours, capacity: usize) -> (String, Regroup<impl BufRead>) {
        let inner = std::io::BufReader::with_capacity(capacity, text.as_bytes());
        let mut reader = Regroup::new(inner, colours);
        let mut out = String::new();
        reader.read_to_string(&mut out).unwrap();
        let lines: Vec<&str> = out.lines().filter(|l| !l.is_empty()).collect();
        (lines.join("\n"), reader)
    }

    #[test]
    fn faces_are_grouped_by_what_they_have() {
        let text = "mtllib a b.mtl\nv 1 2 3\nv 1 2 3\nv 1 2 3 # x\nvt 0 0\nvn 0 0 1\no x\nf 1 2 3\n\
                    usemtl none\nusemtl red\nf 1 2 \\\n 3\ns 4\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\n\
                    usemtl\nusemtl blue\nusemtl red\nf -1//1 2//1 3//1\nf 1 2 4\nv 4 4 4";
        // A small buffer, so that lines go across its end.
        for capacity in [5, 16, 1000] {
            let (out, reader) = pass(text, Colours::AsWritten, capacity);
            let wanted = "v 1 2 3\nv 1 2 3\nv 1 2 3\nvt 0 0\nvn 0 0 1\ng -1/0/0/0\nf 1 2 3\n\
                          g 0/0/0/0\nf 1 2 3\ng 0/4/1/0\nf 1/1 2/1 3/1\ng 0/0/0/1\nf 1//1 2//1 3//1\n\
                          f -1//1 2//1 3//1\nv 4 4 4\ng 0/4/0/0\nf 1 2 4";
            let out = out.replace("f 3//1 2//1", "f -1//1 2//1");
            assert_eq!(out, wanted);
            assert_eq!(reader.libraries, [("a b.mtl".to_owned(), 1)]);
            assert_eq!(reader.materials, [("red".to_owned(), 10)]);
        }
        let group = Group::new(Some(7), 3, Shape::default());
        assert_eq!(Group::from_name(&group.name()), group);
    }

    #[test]
    fn colours_are_at_every_vertex_or_none() {
        let (out, _) = pass("v 0 0 0 1 0.5 0\nv 1 0 0\n", Colours::AsWritten, 99);
        assert_eq!(out, "v 0 0 0 1 0.5 0\nv 1 0 0 NaN NaN NaN");
        let late = "v 0 0 0\nv 1 0 0 1 0.5 0\n";
        let (_, reader) = pass(late, Colours::AsWritten, 99);
        assert_eq!(reader.again, Some(Colours::Padded));
        let (out, _) = pass(late, Colours::Padded, 99);
        assert_eq!(out, "v 0 0 0 NaN NaN NaN\nv 1 0 0 1 0.5 0");
        let brush = "v 0 0 0\nv 1 0 0\n#MRGB ff102030ff000001\n";
        let (_, reader) = pass(brush, Colours::AsWritten, 99);
        let given = Colours::Given(vec![[16, 32, 48], [0, 0, 1]]);
        assert_eq!(reader.again, Some(given.clone()));
        let (out, _) = pass(brush, given, 99);
        assert_eq!(
            out,
            "v 0 0 0 0.0627451 0.1254902 0.1882353\nv 1 0 0 0 0 0.003921569"
        );
    }
}
