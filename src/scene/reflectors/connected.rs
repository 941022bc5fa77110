//! What of the triangles of a mesh is connected.

use crate::scene::mesh::Mesh;
use crate::scene::place::{Place, place};
use std::collections::HashMap;

/// The edges of triangles, in order, so that those in one place stand together.
pub(super) struct Edges(Vec<([u32; 2], u32)>);

impl Edges {
    /// Those of `members`, by their places in that list.
    pub(super) fn new(mesh: &Mesh, members: &[u32]) -> Self {
        let mut numbers: HashMap<Place, u32> = HashMap::new();
        let mut edges = Vec::with_capacity(3 * members.len());
        for (index, &t) in members.iter().enumerate() {
            let [a, b, c] = mesh.corners(t).map(|p| {
                let next = numbers.len() as u32;
                *numbers.entry(place(p)).or_insert(next)
            });
            for [a, b] in [[a, b], [b, c], [c, a]] {
                edges.push(([a.min(b), a.max(b)], index as u32));
            }
        }
        edges.sort_unstable();
        Self(edges)
    }

    /// For each edge the triangles that share it.
    pub(super) fn shared(&self) -> impl Iterator<Item = &[([u32; 2], u32)]> {
        self.0.chunk_by(|a, b| a.0 == b.0)
    }
}

/// Groups of things that belong together.
pub(super) struct Groups(Vec<usize>);

impl Groups {
    pub(super) fn new(len: usize) -> Self {
        Self((0..len).collect())
    }

    pub(super) fn find(&mut self, mut index: usize) -> usize {
        while self.0[index] != index {
            self.0[index] = self.0[self.0[index]];
            index = self.0[index];
        }
        index
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        // The first of a group stands for it.
        self.0[a.max(b)] = a.min(b);
    }
}
