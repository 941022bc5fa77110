//! The exact line of a defect in an OBJ file, which the parser (tobj) does not tell: looked for once it is
//! known that there is one.

use super::line;
use std::io::BufRead;

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// A line that is malformed, a coordinate that is not finite, or a face with an index out of range.
    Broken,
    /// A face without area.
    NoArea,
    /// A normal that is zero or not finite.
    BadNormal,
}

/// The first line with the defect, and what is wrong with it.
pub fn locate(mut reader: impl BufRead, wanted: Defect) -> Option<(usize, String)> {
    let mut before = Before::default();
    let mut buffer = Vec::new();
    let mut next = 1;
    loop {
        let number = next;
        next += line::read(&mut reader, &mut buffer).ok()?;
        if next == number {
            break;
        }
        line::tidy(&mut buffer);
        let line = String::from_utf8_lossy(&buffer);
        match before.read(&line) {
            Err((defect, what)) if defect == wanted => return Some((number, what)),
            _ => {}
        }
    }
    None
}

/// What the lines before had.
#[derive(Default)]
struct Before {
    positions: Vec<[f32; 3]>,
    texcoords: usize,
    normals: usize,
}

impl Before {
    /// Takes in a line, or says what is wrong with it.
    fn read(&mut self, line: &str) -> std::result::Result<(), (Defect, String)> {
        let broken = |what: &str| (Defect::Broken, what.to_owned());
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let p = floats::<3>(&mut words)
                    .ok_or_else(|| broken("a vertex needs three numbers"))?;
                let weight = words.next().map_or(Ok(1.0), str::parse::<f32>);
                let Some(weight) = weight.ok().filter(|w| w.is_normal()) else {
                    return Err(broken("a vertex's weight must be a number other than 0"));
                };
                let p = p.map(|x| x / weight);
                self.positions.push(p);
                if !p.iter().all(|x| x.is_finite()) {
                    return Err(broken("a vertex coordinate is not a finite number"));
                }
            }
            Some("vn") => {
                self.normals += 1;
                let n = floats::<3>(&mut words)
                    .ok_or_else(|| broken("a normal needs three numbers"))?;
                if n == [0.0; 3] || !n.iter().all(|x| x.is_finite()) {
                    return Err((Defect::BadNormal, "a normal is zero or not finite".into()));
                }
            }
            Some("vt") => {
                self.texcoords += 1;
                floats::<2>(&mut words)
                    .ok_or_else(|| broken("a texture coordinate needs two numbers"))?;
            }
            Some("f") => {
                let counts = [self.positions.len(), self.texcoords, self.normals];
                let corners = face(words, counts).map_err(|what| (Defect::Broken, what))?;
                let at = |i: usize| glam::Vec3::from(self.positions[corners[i]]).as_dvec3();
                let flat = (2..corners.len())
                    .any(|i| (at(i - 1) - at(0)).cross(at(i) - at(0)).length() == 0.0);
                if flat {
                    return Err((Defect::NoArea, "a face has no area".into()));
                }
            }
            Some("usemtl") if words.next().is_none() => {
                return Err(broken("usemtl needs a name"));
            }
            _ => {}
        }
        Ok(())
    }
}

fn floats<const N: usize>(words: &mut std::str::SplitWhitespace) -> Option<[f32; N]> {
    let mut out = [0.0; N];
    for x in &mut out {
        *x = words.next()?.parse().ok()?;
    }
    Some(out)
}

/// The position indices of a face, from 0; `counts` are the positions, texture coordinates and normals
/// so far.
fn face(
    words: std::str::SplitWhitespace,
    counts: [usize; 3],
) -> std::result::Result<Vec<usize>, String> {
    const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];
    let mut corners = Vec::new();
    for word in words {
        let mut first = None;
        for (kind, part) in word.split('/').enumerate() {
            if kind >= 3 {
                return Err(format!("a face corner has too many parts: '{word}'"));
            }
            if part.is_empty() {
                continue;
            }
            let index: i64 = part
                .parse()
                .map_err(|_| format!("a face index is not a whole number: '{word}'"))?;
            let count = counts[kind];
            let from_zero = if index < 0 {
                count as i64 + index
            } else {
                index - 1
            };
            if from_zero < 0 || from_zero >= count as i64 {
                return Err(format!(
                    "a face names {} {index}, of {count} so far",
                    KINDS[kind]
                ));
            }
            if kind == 0 {
                first = Some(from_zero as usize);
            }
        }
        corners.push(first.ok_or_else(|| format!("a face corner names no vertex: '{word}'"))?);
    }
    if corners.len() < 3 {
        return Err("a face needs at least three corners".into());
    }
    Ok(corners)
}
