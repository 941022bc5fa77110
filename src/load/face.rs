//! Face lines of an OBJ file: which of the things that they name are there.

use std::fmt::Write;

/// How many vertices, texture coordinates and normals there are so far.
pub type Counts = [i64; 3];

/// What the corners of a face name beside vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// Texture coordinates.
    pub texcoords: bool,
    /// Normals.
    pub normals: bool,
}

/// What a face line says.
#[derive(Debug, PartialEq, Eq)]
pub enum Face {
    /// A face whose vertices are there.
    Whole {
        /// What all of its corners have.
        shape: Shape,
        /// Whether they name texture coordinates or normals that are not there, which are left out.
        lost: Shape,
        /// The line without what is lost.
        line: String,
    },
    /// It names what may stand further down: the line, counted from the front.
    Early(String),
    /// Why there is no face.
    Unusable(String),
}

/// The shape of a face of which nothing must be changed; `line` is without its first word.
#[inline]
pub fn plain(line: &[u8], counts: &Counts) -> Option<Shape> {
    let mut shape = Shape::default();
    let (mut at, mut corners) = (0, 0);
    loop {
        while line.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        if at == line.len() {
            return (corners >= 3).then_some(shape);
        }
        let mut corner = Shape::default();
        index(line, &mut at, counts[0])?;
        if line.get(at) == Some(&b'/') {
            at += 1;
            if line.get(at) != Some(&b'/') {
                index(line, &mut at, counts[1])?;
                corner.texcoords = true;
            }
            if line.get(at) == Some(&b'/') {
                at += 1;
                index(line, &mut at, counts[2])?;
                corner.normals = true;
            }
        }
        if line.get(at).is_some_and(|b| !b.is_ascii_whitespace()) {
            return None;
        }
        if corners == 0 {
            shape = corner;
        } else if shape != corner {
            return None;
        }
        corners += 1;
    }
}

/// Passes over a whole number that names one of `count` things.
#[inline]
fn index(line: &[u8], at: &mut usize, count: i64) -> Option<()> {
    let negative = line.get(*at) == Some(&b'-');
    *at += usize::from(negative);
    let first = *at;
    let mut number = 0i64;
    while let Some(digit @ b'0'..=b'9') = line.get(*at) {
        number = number * 10 + i64::from(digit - b'0');
        *at += 1;
        // So that it cannot overflow.
        if *at - first > 12 {
            return None;
        }
    }
    (*at > first && (1..=count).contains(&number)).then_some(())
}

/// What a corner names.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Named {
    Nothing,
    /// From 1.
    There(i64),
    /// Not yet.
    Early(i64),
    Absent(i64),
}

/// Reads the corners of a face. With `at_end` nothing more follows in the file.
pub fn read<'a>(corners: impl Iterator<Item = &'a str>, counts: &Counts, at_end: bool) -> Face {
    let mut face: Vec<[Named; 3]> = Vec::new();
    for corner in corners {
        let mut named = [Named::Nothing; 3];
        for (kind, part) in corner.split('/').take(3).enumerate() {
            if part.is_empty() {
                continue;
            }
            let digits = part.strip_prefix(['-', '+']).unwrap_or(part);
            if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit()) {
                return Face::Unusable(format!("its index is not a whole number: '{corner}'"));
            }
            // Too many digits are too large a number.
            let index = part.parse().unwrap_or(i64::MAX);
            let count = counts[kind];
            named[kind] = match index {
                0 => Named::Absent(0),
                1.. if index <= count => Named::There(index),
                1.. if !at_end && index < i64::MAX => Named::Early(index),
                ..0 if index.saturating_add(count) >= 0 => Named::There(index + count + 1),
                _ => Named::Absent(index),
            };
        }
        match named[0] {
            Named::There(_) | Named::Early(_) => face.push(named),
            Named::Nothing => {
                return Face::Unusable(format!("its corner names no vertex: '{corner}'"));
            }
            Named::Absent(index) => {
                return Face::Unusable(format!("it names vertex {index}, of {}", counts[0]));
            }
        }
    }
    if face.len() < 3 {
        return Face::Unusable("it has fewer than three corners".into());
    }
    let early = face.iter().flatten().any(|n| matches!(n, Named::Early(_)));
    let all = |kind: usize| face.iter().all(|c| matches!(c[kind], Named::There(_)));
    let any = |kind: usize| face.iter().any(|c| c[kind] != Named::Nothing);
    let shape = Shape {
        texcoords: all(1),
        normals: all(2),
    };
    let mut line = String::from("f");
    for corner in &face {
        let number = |kind: usize| match corner[kind] {
            Named::Nothing => String::new(),
            Named::There(index) | Named::Early(index) => index.to_string(),
            Named::Absent(_) => "0".into(),
        };
        let _ = match (early || shape.texcoords, early || shape.normals) {
            (false, false) => write!(line, " {}", number(0)),
            (true, false) => write!(line, " {}/{}", number(0), number(1)),
            (false, true) => write!(line, " {}//{}", number(0), number(2)),
            (true, true) => write!(line, " {}/{}/{}", number(0), number(1), number(2)),
        };
    }
    if early {
        return Face::Early(line);
    }
    line.push('\n');
    let lost = Shape {
        texcoords: any(1) && !shape.texcoords,
        normals: any(2) && !shape.normals,
    };
    Face::Whole { shape, lost, line }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS: Counts = [9, 5, 2];

    fn whole(text: &str) -> Option<(Shape, Shape, String)> {
        match read(text.split_whitespace(), &COUNTS, false) {
            Face::Whole { shape, lost, line } => Some((shape, lost, line)),
            _ => None,
        }
    }

    fn shape(texcoords: bool, normals: bool) -> Shape {
        Shape { texcoords, normals }
    }

    #[test]
    fn plain_faces_are_read_as_all_others() {
        for (line, want) in [
            ("1 2 3", shape(false, false)),
            (" 1/1  2/2\t3/3 4/5\r", shape(true, false)),
            ("1//1 2//2 9//1", shape(false, true)),
            ("-9/-5/-2 -1/-1/-1 1/1/1", shape(true, true)),
        ] {
            assert_eq!(plain(line.as_bytes(), &COUNTS), Some(want));
            let (read, lost, _) = whole(line).unwrap();
            assert_eq!((read, lost), (want, Shape::default()));
        }
        for line in [
            "1 2",
            "1 2 10",
            "1 2 0",
            "1 2 -10",
            "1/6 2/1 3/1",
            "1//3 2//1 3//1",
            "1/1 2 3",
            "1/ 2/ 3/",
            "1 2 x",
            "1 2 3.0",
            "1/1/1/1 2/1/1/1 3/1/1/1",
            "1 2 3 # x",
            "/1 /2 /3",
            "1 2 99999999999999",
        ] {
            assert_eq!(plain(line.as_bytes(), &COUNTS), None, "{line}");
        }
    }

    #[test]
    fn what_is_not_there_is_left_out() {
        for (text, want, lost, line) in [
            (
                "-1 -2 1",
                shape(false, false),
                shape(false, false),
                "f 9 8 1\n",
            ),
            (
                "1/0/1 2/1/1 3/2/1",
                shape(false, true),
                shape(true, false),
                "f 1//1 2//1 3//1\n",
            ),
            (
                "1/1/-3 2/1/1 3/2/1",
                shape(true, false),
                shape(false, true),
                "f 1/1 2/1 3/2\n",
            ),
            (
                "1/1 2 3/1",
                shape(false, false),
                shape(true, false),
                "f 1 2 3\n",
            ),
            (
                "1/ 2// 3",
                shape(false, false),
                shape(false, false),
                "f 1 2 3\n",
            ),
            (
                "1/1/1/7 2/1/1 3/1/1",
                shape(true, true),
                shape(false, false),
                "f 1/1/1 2/1/1 3/1/1\n",
            ),
        ] {
            assert_eq!(
                whole(text).unwrap(),
                (want, lost, line.to_owned()),
                "{text}"
            );
        }
        for (text, reason) in [
            ("1 2", "three corners"),
            ("1 2 0", "vertex 0"),
            ("1 2 -10", "vertex -10, of 9"),
            ("1 2 3.5", "'3.5'"),
            ("1 2 /1", "'/1'"),
            ("1 2 99999999999999999999", "vertex"),
        ] {
            match read(text.split_whitespace(), &COUNTS, false) {
                Face::Unusable(why) => assert!(why.contains(reason), "{text}: {why}"),
                other => panic!("{text}: {other:?}"),
            }
        }
    }

    #[test]
    fn what_may_still_come_is_waited_for() {
        let early = |text: &str| match read(text.split_whitespace(), &COUNTS, false) {
            Face::Early(line) => line,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(early("-1/-1/-1 -2/1/9 10/7/1"), "f 9/5/2 8/1/9 10/7/1");
        let line = early("1//3 -1//-9 10");
        // At the end it is there or not.
        let at_end = |counts| read(line.split_whitespace().skip(1), &counts, true);
        assert!(matches!(at_end(COUNTS), Face::Unusable(_)));
        match at_end([10, 5, 3]) {
            Face::Whole { shape, lost, line } => {
                assert_eq!((shape.normals, lost.normals), (false, true));
                assert_eq!(line, "f 1 9 10\n");
            }
            other => panic!("{other:?}"),
        }
    }
}
