//! Objects of an OBJ file: what stands after `o`, or after `g` where a file has no `o`, and the faces that follow.

use std::collections::HashMap;

/// The objects, and where in the order of the faces each begins.
#[derive(Debug)]
pub struct Objects {
    /// Faces so far.
    pub faces: usize,
    names: Vec<String>,
    numbers: HashMap<String, u32>,
    /// The first face of each run of faces of one object, and the object.
    runs: Vec<(usize, u32)>,
    has_objects: bool,
}

/// The object of faces before any is named, as the format has it.
const DEFAULT: &str = "default";

impl Default for Objects {
    fn default() -> Self {
        Self {
            faces: 0,
            names: vec![DEFAULT.to_owned()],
            numbers: HashMap::from([(DEFAULT.to_owned(), 0)]),
            runs: vec![(0, 0)],
            has_objects: false,
        }
    }
}

impl Objects {
    /// `o`: the faces that follow belong to the object `name`.
    pub fn object(&mut self, name: &str) {
        if !self.has_objects {
            // Groups of the file are parts of objects.
            *self = Self {
                faces: self.faces,
                has_objects: true,
                ..Self::default()
            };
        }
        self.name(name);
    }

    /// `g`: the faces that follow belong to this group, which is an object where the file has none.
    pub fn group(&mut self, name: &str) {
        if !self.has_objects {
            self.name(name);
        }
    }

    fn name(&mut self, name: &str) {
        let name = if name.is_empty() { DEFAULT } else { name };
        let number = match self.numbers.get(name) {
            Some(&number) => number,
            None => {
                let next = self.names.len() as u32;
                self.names.push(name.to_owned());
                self.numbers.insert(name.to_owned(), next);
                next
            }
        };
        self.go_on(number);
    }

    /// The object of the faces that follow.
    pub fn current(&self) -> u32 {
        self.runs.last().map_or(0, |run| run.1)
    }

    /// The faces that follow belong to this object.
    pub fn go_on(&mut self, number: u32) {
        if self.runs.last().is_some_and(|run| run.0 == self.faces) {
            self.runs.pop();
        }
        if self.runs.is_empty() || self.current() != number {
            self.runs.push((self.faces, number));
        }
    }

    /// The names, and the object of each face in their order.
    pub fn into_names(self) -> (Vec<String>, impl Iterator<Item = u32>) {
        let ends = self.runs.iter().skip(1).map(|run| run.0);
        let ends: Vec<usize> = ends.chain([self.faces]).collect();
        let runs = self.runs.into_iter().zip(ends);
        let of_faces = runs.flat_map(|((first, object), end)| (first..end).map(move |_| object));
        (self.names, of_faces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(lines: &[(&str, &str, usize)]) -> Vec<String> {
        let mut objects = Objects::default();
        for &(word, name, faces) in lines {
            match word {
                "o" => objects.object(name),
                _ => objects.group(name),
            }
            objects.faces += faces;
        }
        let (names, of_faces) = objects.into_names();
        of_faces.map(|o| names[o as usize].clone()).collect()
    }

    #[test]
    fn objects_are_told_apart_by_o_or_else_by_g() {
        let groups = [("g", "a", 2), ("g", "", 1), ("g", "b c", 0), ("g", "a", 1)];
        assert_eq!(of(&groups), ["a", "a", "default", "a"]);
        let both = [("o", "x", 1), ("g", "a", 1), ("o", "y", 2), ("o", "x", 1)];
        assert_eq!(of(&both), ["x", "x", "y", "y", "x"]);
        // Faces before the first object.
        let late = [("g", "a", 2), ("o", "x", 1)];
        assert_eq!(of(&late), ["default", "default", "x"]);
    }
}
