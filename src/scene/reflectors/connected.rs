//! What of the triangles of a mesh is connected.

use crate::scene::mesh::Mesh;
use crate::scene::place::{Place, place};
use glam::Vec3;
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

/// Triangles of one material that are connected: in a plane, or curved by the normals of their corners.
pub(super) struct Surface {
    pub(super) triangles: Vec<u32>,
    pub(super) is_plane: bool,
}

/// The surfaces that `members` make, planes each for itself; `edges` are those of `members`.
pub(super) fn surfaces(mesh: &Mesh, members: &[u32], edges: &Edges) -> Vec<Surface> {
    let flat: Vec<bool> = members.iter().map(|&t| is_flat(mesh, t)).collect();
    let mut groups = Groups::new(members.len());
    for sharing in edges.shared() {
        for pair in sharing.windows(2) {
            let [a, b] = [pair[0].1 as usize, pair[1].1 as usize];
            let [ta, tb] = [members[a], members[b]];
            let same = mesh.material_of[ta as usize] == mesh.material_of[tb as usize];
            let level = || normal(mesh, ta).dot(normal(mesh, tb)).abs() > LEVEL;
            if same && flat[a] == flat[b] && (!flat[a] || level()) {
                groups.join(a, b);
            }
        }
    }
    let mut surfaces: Vec<Surface> = Vec::new();
    let mut number = HashMap::new();
    for (index, &t) in members.iter().enumerate() {
        let next = surfaces.len();
        let at = *number.entry(groups.find(index)).or_insert(next);
        if at == next {
            surfaces.push(Surface {
                triangles: Vec::new(),
                is_plane: flat[index],
            });
        }
        surfaces[at].triangles.push(t);
    }
    surfaces
}

/// The areas of the planes among triangles.
pub fn planes(mesh: &Mesh, members: &[u32]) -> Vec<f32> {
    // What is curved may be large.
    let flat = members.iter().copied().filter(|&t| is_flat(mesh, t));
    let flat: Vec<u32> = flat.collect();
    let surfaces = surfaces(mesh, &flat, &Edges::new(mesh, &flat));
    let area = |surface: &Surface| surface.triangles.iter().map(|&t| mesh.area(t)).sum();
    surfaces.iter().map(area).collect()
}

/// Flat triangles with this cosine between their planes are in one.
pub(super) const LEVEL: f32 = 1.0 - 1e-6;

/// Whether a triangle is shaded as flat, or nearly so.
fn is_flat(mesh: &Mesh, triangle: u32) -> bool {
    let ng = normal(mesh, triangle);
    let level = |n: &Vec3| n.dot(ng) > LEVEL;
    mesh.corner_normals(triangle)
        .is_none_or(|corners| corners.iter().all(level))
}

/// The geometric normal.
pub(super) fn normal(mesh: &Mesh, triangle: u32) -> Vec3 {
    mesh.point(triangle, 1.0 / 3.0, 1.0 / 3.0).ng
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
