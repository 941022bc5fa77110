//! What of an OBJ file is passed over: counted, with the first line of each kind, and told in one warning each.

use crate::error::{Result, Warnings};
use std::path::Path;

/// How often something was met, and on which line first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// How often.
    pub count: usize,
    /// The first line, from 1.
    pub line: usize,
}

impl Tally {
    /// Counts one on this line.
    pub fn add(&mut self, line: usize) {
        if self.count == 0 {
            self.line = line;
        }
        self.count += 1;
    }
}

/// What was passed over.
#[derive(Debug, Default)]
pub struct PassedOver {
    /// `v` whose coordinates are no finite numbers.
    pub positions: Tally,
    /// `v` with a weight that is 0 or no finite number.
    pub weights: Tally,
    /// `vn` that are zero or no finite numbers.
    pub normals: Tally,
    /// `vt` that are no finite numbers.
    pub texcoords: Tally,
    /// Faces that cannot be used.
    pub faces: Tally,
    /// Why the first of them cannot.
    pub reason: String,
    /// Faces that name normals that are not there.
    pub lost_normals: Tally,
    /// Faces that name texture coordinates that are not there.
    pub lost_texcoords: Tally,
    /// Lines and points.
    pub lines: Tally,
    /// Words that mean nothing here, in the order of their first lines.
    words: Vec<(String, Tally)>,
    /// Further ones.
    other_words: Tally,
}

/// Words of free-form curves and surfaces beside those that make them, and of how things are to be drawn:
/// nothing is missing in the picture without them.
const SILENT: [&str; 25] = [
    "vp",
    "cstype",
    "deg",
    "bmat",
    "step",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "maplib",
    "usemap",
    "g",
    "o",
];
/// So many words are told apart.
const WORDS: usize = 6;

impl PassedOver {
    /// Counts a face that cannot be used.
    pub fn face(&mut self, line: usize, reason: String) {
        if self.faces.count == 0 {
            self.reason = reason;
        }
        self.faces.add(line);
    }

    /// Counts a statement whose word is not one of those that are read.
    pub fn word(&mut self, word: &str, line: usize) {
        if SILENT.contains(&word) {
            return;
        }
        let known = self.words.iter().position(|(w, _)| w == word);
        match known {
            Some(index) => self.words[index].1.add(line),
            None if self.words.len() < WORDS => {
                let mut tally = Tally::default();
                tally.add(line);
                self.words.push((word.to_owned(), tally));
            }
            None => self.other_words.add(line),
        }
    }

    /// One warning for each kind. `hollow` faces have a corner that is not finite.
    pub fn tell(&self, path: &Path, hollow: usize, warnings: &mut Warnings) -> Result<()> {
        let mut tell = |tally: Tally, what: &str| {
            let Tally { count, line } = tally;
            if count == 0 {
                return Ok(());
            }
            warnings.push(format!("{}:{line}: {count} {what}", path.display()))
        };
        tell(
            self.positions,
            &format!(
                "vertices have coordinates that are no finite numbers; {hollow} faces with them are left out"
            ),
        )?;
        tell(
            self.weights,
            "weights of vertices are 0 or no numbers and ignored",
        )?;
        tell(
            self.faces,
            &format!("faces are left out; of the first, {}", self.reason),
        )?;
        tell(
            self.normals,
            "normals are zero or not finite; their triangles use the geometric normal",
        )?;
        tell(
            self.texcoords,
            "texture coordinates are no finite numbers; their triangles have none",
        )?;
        tell(
            self.lost_normals,
            "faces name normals that are not there; they are flat",
        )?;
        tell(
            self.lost_texcoords,
            "faces name texture coordinates that are not there; they have none",
        )?;
        for (word, tally) in &self.words {
            let word: String = word.escape_debug().take(30).collect();
            let what = match &*word {
                "curv" | "curv2" => "free-form curves are left out: only faces are rendered".into(),
                "surf" => "free-form surfaces are left out: only faces are rendered".into(),
                _ => format!("lines of '{word}' are not understood and left out"),
            };
            tell(*tally, &what)?;
        }
        tell(
            self.other_words,
            "lines of other words are not understood and left out",
        )?;
        // People leave loose edges in models.
        if self.lines.count > 0 {
            let Tally { count, line } = self.lines;
            warnings.note(format!(
                "{}:{line}: {count} lines and points (l, p) are left out: only faces are rendered",
                path.display()
            ));
        }
        Ok(())
    }

    /// What to add to the message that there are no faces; empty if nothing.
    pub fn why_no_faces(&self, vertices: i64) -> String {
        if self.faces.count > 0 {
            let Tally { count, line } = self.faces;
            format!("; of the first of {count}, on line {line}, {}", self.reason)
        } else if self.positions.count > 0 {
            let Tally { count, line } = self.positions;
            format!(
                "; {count} vertices, the first on line {line}, have coordinates that are no finite numbers"
            )
        } else if self.words.iter().any(|(word, _)| word == "surf") {
            "; its free-form surfaces must be made polygons where it comes from".into()
        } else if vertices > 0 {
            format!("; it has {vertices} vertices: points are not rendered")
        } else if self.words.len() == WORDS {
            "; it does not look like an OBJ file".into()
        } else {
            String::new()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_told_once_with_its_first_line() {
        let mut passed = PassedOver::default();
        for line in [4, 7, 9] {
            passed.normals.add(line);
            passed.word("surf", line + 1);
            passed.word("lod", 1);
        }
        passed.face(12, "it names vertex 9, of 4".into());
        passed.face(13, "it has fewer than three corners".into());
        for i in 0..10 {
            passed.word(&format!("word{i}"), 20 + i);
        }
        passed.lines.add(3);
        let mut warnings = Warnings::new(false);
        passed.tell(Path::new("a.obj"), 0, &mut warnings).unwrap();
        let list = warnings.list();
        assert_eq!(list.len(), 2 + WORDS + 2);
        assert!(list[0].starts_with("a.obj:12: 2 faces") && list[0].ends_with("vertex 9, of 4"));
        assert!(list[1].starts_with("a.obj:4: 3 normals"));
        assert!(list[2].starts_with("a.obj:5: 3 free-form surfaces"));
        assert!(list[3].contains(":20: 1 lines of 'word0'"));
        assert!(list[8].contains(":25: 5 lines of other words"));
        assert!(list[9].contains(":3: 1 lines and points"));
        assert!(
            passed
                .tell(Path::new("a"), 0, &mut Warnings::new(true))
                .is_err()
        );
    }
}
