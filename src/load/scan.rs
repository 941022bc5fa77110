//! The line of the first face without area in an OBJ file, which the parser (tobj) does not tell: looked for
//! once it is known that there is one.

use super::face::{self, Face};
use super::line;
use super::polygon::Triangulator;
use glam::Vec3;
use std::io::BufRead;

/// The first line with a face without area.
pub fn first_without_area(mut reader: impl BufRead) -> Option<usize> {
    let mut positions: Vec<Vec3> = Vec::new();
    let mut triangulator = Triangulator::new();
    let mut buffer = Vec::new();
    let mut next = 1;
    loop {
        let number = next;
        next += line::read(&mut reader, &mut buffer).ok()?;
        if next == number {
            return None;
        }
        let line = String::from_utf8_lossy(&buffer);
        let mut words = line::words(&line);
        match words.next() {
            Some("v") => {
                let p: Vec<f32> = words.take(3).map_while(line::finite).collect();
                positions.push(p.try_into().map_or(Vec3::NAN, Vec3::from_array));
            }
            Some("f" | "fo") => {
                let counts = [positions.len() as i64, 0, 0];
                let corners = words.map(|w| w.split('/').next().unwrap_or_default());
                let Face::Whole { line, .. } = face::read(corners, &counts, true) else {
                    continue;
                };
                let corners = line.split_whitespace().skip(1);
                let corners = corners.filter_map(|c| c.parse::<usize>().ok());
                if triangulator
                    .cut(corners.map(|c| positions[c - 1]))
                    .is_some_and(<[_]>::is_empty)
                {
                    return Some(number);
                }
            }
            _ => {}
        }
    }
}
