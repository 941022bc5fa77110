//! Which surfaces of transparent materials are panes: glass on an open sheet, which has a border, is thin, and
//! what closes around a space is a body of glass.
//!
//! Surfaces are told by their corners' positions, so that corners written twice, for normals or texture
//! coordinates, are one. A crack does not open a body: what counts is the area of the holes that borders
//! enclose, which is 0 for edges along which two parts lie on each other.

use super::material::Material;
use super::place::place;
use crate::load::obj::ObjFile;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// A surface is open where its holes have more than this share of its area. A ball without one of a hundred
/// triangles is a ball, a glass without thickness, ten times as high as it is wide, is a sheet.
const OPEN: f64 = 0.02;

/// Makes transparent materials thin where they are on open sheets. One that has both becomes two of the same
/// name, in `obj` as well.
pub fn make_thin(obj: &mut ObjFile, materials: &mut Vec<Material>, roughness_threshold: f32) {
    let thin: Vec<Option<Material>> = materials
        .iter()
        .map(|m| m.thin(roughness_threshold))
        .collect();
    let is_transparent = |&t: &usize| thin[obj.material_of[t] as usize].is_some();
    let transparent: Vec<usize> = if thin.iter().any(Option::is_some) {
        (0..obj.triangles.len()).filter(is_transparent).collect()
    } else {
        return;
    };
    let is_sheet = on_sheets(
        &obj.positions,
        transparent.iter().map(|&t| obj.triangles[t]),
    );
    // Bodies keep their material; where there are none, the sheets may have its place.
    let mut has_bodies = vec![false; thin.len()];
    let mut has_sheets = vec![false; thin.len()];
    for (&t, &sheet) in transparent.iter().zip(&is_sheet) {
        let has = if sheet {
            &mut has_sheets
        } else {
            &mut has_bodies
        };
        has[obj.material_of[t] as usize] = true;
    }
    let mut place: Vec<u32> = (0..thin.len() as u32).collect();
    for (index, thin) in thin.into_iter().enumerate() {
        match thin {
            Some(thin) if has_sheets[index] && has_bodies[index] => {
                place[index] = materials.len() as u32;
                materials.push(thin);
                obj.materials.push(obj.materials[index].clone());
            }
            Some(thin) if has_sheets[index] => materials[index] = thin,
            _ => {}
        }
    }
    for (&t, _) in transparent.iter().zip(&is_sheet).filter(|(_, s)| **s) {
        obj.material_of[t] = place[obj.material_of[t] as usize];
    }
}

/// Of each triangle whether it is part of an open sheet.
fn on_sheets(positions: &[Vec3], triangles: impl Iterator<Item = [u32; 3]>) -> Vec<bool> {
    let mut surface = Surface::default();
    let faces: Vec<u32> = triangles
        .map(|t| surface.add(t.map(|corner| positions[corner as usize])))
        .collect();
    let is_open = surface.open_faces();
    faces.iter().map(|&face| is_open[face as usize]).collect()
}

/// Triangles on corners told by their positions.
#[derive(Default)]
struct Surface {
    corners: Vec<DVec3>,
    corner_at: HashMap<[u32; 3], u32>,
    faces: Vec<[u32; 3]>,
    /// Faces by their corners in order: both sides of a doubled face are one.
    face_on: HashMap<[u32; 3], u32>,
}

/// A side of a face.
struct Edge {
    /// Corners, the lower number first.
    ends: [u32; 2],
    face: u32,
    /// Whether the face goes from the second to the first.
    backwards: bool,
}

impl Surface {
    /// The number of the face with these corners.
    fn add(&mut self, triangle: [Vec3; 3]) -> u32 {
        let face = triangle.map(|p| {
            *self.corner_at.entry(place(p)).or_insert_with(|| {
                self.corners.push(p.as_dvec3());
                self.corners.len() as u32 - 1
            })
        });
        let mut key = face;
        key.sort_unstable();
        *self.face_on.entry(key).or_insert_with(|| {
            self.faces.push(face);
            self.faces.len() as u32 - 1
        })
    }

    /// Of each face whether it is part of an open sheet.
    fn open_faces(&self) -> Vec<bool> {
        let edges = self.edges();
        let edges = || edges.chunk_by(|a, b| a.ends == b.ends);

        // Faces hang together along edges; what has no border is closed.
        let mut parts = Parts::new(self.faces.len());
        for edge in edges() {
            for other in &edge[1..] {
                // Two faces with one winding pass their edge in opposite directions.
                let turned = edge.len() == 2 && edge[0].backwards == other.backwards;
                parts.join(edge[0].face, other.face, turned);
            }
        }
        let mut has_border = vec![false; self.faces.len()];
        for edge in edges().filter(|edge| edge.len() == 1) {
            has_border[parts.find(edge[0].face).0 as usize] = true;
        }

        // Parts with borders hang together at corners too, where they do not share the edges between.
        let mut patches = Parts::new(self.corners.len());
        for (face, corners) in self.faces.iter().enumerate() {
            if has_border[parts.find(face as u32).0 as usize] {
                patches.join(corners[0], corners[1], false);
                patches.join(corners[0], corners[2], false);
            }
        }

        // The area of the holes: of each connected border ½ Σ a × b over its edges from a to b, with the faces
        // of one part wound in one way.
        let mut borders = Parts::new(self.corners.len());
        for edge in edges().filter(|edge| edge.len() == 1) {
            let [a, b] = edge[0].ends;
            borders.join(a, b, false);
        }
        let mut holes = vec![DVec3::ZERO; self.corners.len()];
        for edge in edges().filter(|edge| edge.len() == 1) {
            let ends = edge[0].ends;
            let border = borders.find(ends[0]).0;
            let [a, b] = ends.map(|end| self.corners[end as usize] - self.corners[border as usize]);
            let turned = edge[0].backwards != parts.find(edge[0].face).1;
            holes[border as usize] += 0.5 * if turned { b.cross(a) } else { a.cross(b) };
        }
        let (mut hole, mut area) = (vec![0.0; holes.len()], vec![0.0; holes.len()]);
        for (border, vector) in holes.iter().enumerate() {
            hole[patches.find(border as u32).0 as usize] += vector.length();
        }
        for (face, corners) in self.faces.iter().enumerate() {
            if has_border[parts.find(face as u32).0 as usize] {
                area[patches.find(corners[0]).0 as usize] += 0.5 * self.normal(corners).length();
            }
        }

        let flat = self.flat_parts(&mut parts);
        let faces = self.faces.iter().enumerate();
        faces
            .map(|(face, corners)| {
                let part = parts.find(face as u32).0 as usize;
                let patch = patches.find(corners[0]).0 as usize;
                if has_border[part] {
                    hole[patch] > OPEN * area[patch]
                } else {
                    flat[part]
                }
            })
            .collect()
    }

    /// All sides of all faces, those between the same corners one after the other.
    fn edges(&self) -> Vec<Edge> {
        let mut edges: Vec<Edge> = Vec::with_capacity(3 * self.faces.len());
        for (face, &[a, b, c]) in self.faces.iter().enumerate() {
            edges.extend([[a, b], [b, c], [c, a]].map(|[from, to]| Edge {
                ends: [from.min(to), from.max(to)],
                face: face as u32,
                backwards: from > to,
            }));
        }
        edges.sort_unstable_by_key(|edge| (edge.ends, edge.face));
        edges
    }

    fn normal(&self, face: &[u32; 3]) -> DVec3 {
        let [a, b, c] = face.map(|corner| self.corners[corner as usize]);
        (b - a).cross(c - a)
    }

    /// Of each part, by its number, whether all of it lies in one plane: such bodies have no inside.
    fn flat_parts(&self, parts: &mut Parts) -> Vec<bool> {
        let part_of: Vec<usize> = (0..self.faces.len() as u32)
            .map(|face| parts.find(face).0 as usize)
            .collect();
        let mut largest = vec![(DVec3::ZERO, DVec3::ZERO); self.faces.len()];
        for (face, &part) in self.faces.iter().zip(&part_of) {
            let normal = self.normal(face);
            if normal.length_squared() > largest[part].1.length_squared() {
                largest[part] = (self.corners[face[0] as usize], normal);
            }
        }
        let mut flat = vec![true; self.faces.len()];
        for (face, &part) in self.faces.iter().zip(&part_of) {
            let (point, normal) = largest[part];
            flat[part] &= face.iter().all(|&corner| {
                let from = self.corners[corner as usize] - point;
                from.dot(normal).abs() <= 1e-5 * from.length() * normal.length()
            });
        }
        flat
    }
}

/// Sets of numbers that hang together, each with a sign against the others of its set (a disjoint-set forest).
struct Parts(Vec<(u32, bool)>);

impl Parts {
    fn new(count: usize) -> Self {
        Self((0..count as u32).map(|i| (i, false)).collect())
    }

    /// The number of the set of `i`, and whether `i` is turned against it.
    fn find(&mut self, i: u32) -> (u32, bool) {
        let (mut root, mut turned) = (i, false);
        while self.0[root as usize].0 != root {
            let (above, flip) = self.0[root as usize];
            (root, turned) = (above, turned != flip);
        }
        // All on the way hang at the root from now on.
        let (mut at, mut rest) = (i, turned);
        while at != root {
            let (above, flip) = std::mem::replace(&mut self.0[at as usize], (root, rest));
            (at, rest) = (above, rest != flip);
        }
        (root, turned)
    }

    /// Joins the sets of `a` and `b`, which are turned against each other or not.
    fn join(&mut self, a: u32, b: u32, turned: bool) {
        let ((a, a_turned), (b, b_turned)) = (self.find(a), self.find(b));
        if a != b {
            let turned = turned != (a_turned != b_turned);
            self.0[a.max(b) as usize] = (a.min(b), turned);
        }
    }
}
