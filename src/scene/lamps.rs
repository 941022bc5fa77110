//! Lamps shine on the side of their normals, where these agree with one another: programs that mirror objects
//! keep the normals and turn the corners round. Those that lie on other faces, such as their own backs, are seen
//! from where they shine.

use super::material::Material;
use super::place::{Place, place};
use crate::geometry::offset_distance;
use crate::load::obj::{NONE, ObjFile};
use glam::{DVec3, Vec3};
use std::collections::{HashMap, HashSet};

/// How far lamps are lifted off what they lie on, in distances by which rays start off surfaces.
const LIFT: f32 = 8.0;
/// Triangles with this sine between their planes are in one.
const LEVEL: f64 = 1e-4;

/// Turns the corners of emitting triangles whose normals all look to the other side.
pub fn face_normals(obj: &mut ObjFile, materials: &[Material]) {
    if obj.normal_triangles.is_empty() || materials.iter().all(|m| m.emission.is_none()) {
        return;
    }
    for t in 0..obj.triangles.len() {
        let emits = materials[obj.material_of[t] as usize].emission.is_some();
        if !emits || !is_turned(obj, t) {
            continue;
        }
        for list in [
            &mut obj.triangles,
            &mut obj.normal_triangles,
            &mut obj.texcoord_triangles,
        ] {
            if let Some(corners) = list.get_mut(t) {
                corners.swap(1, 2);
            }
        }
    }
}

/// Lifts emitting triangles that lie on others which face the other way, such as the back of a lamp: rays would
/// meet one or the other by chance. Of emitting triangles that are there twice the second is taken away.
pub fn part(obj: &mut ObjFile, materials: &[Material]) {
    let emits = |obj: &ObjFile, t: usize| materials[obj.material_of[t] as usize].emission.is_some();
    let lamps = (0..obj.triangles.len()).filter(|&t| emits(obj, t));
    let lamps: Vec<usize> = lamps.collect();
    if lamps.is_empty() {
        return;
    }

    // Copies.
    let mut seen = HashSet::new();
    let mut copies = HashSet::new();
    for &t in &lamps {
        let mut places = obj.triangles[t].map(|i| place(obj.positions[i as usize]));
        // The same turn, whichever corner is first.
        let least = (0..3).min_by_key(|&c| places[c]).unwrap_or(0);
        places.rotate_left(least);
        if !seen.insert(places) {
            copies.insert(t);
        }
    }

    // What lies on others. Those in one plane that share an edge, on the same side of it, overlap.
    let mut edges: HashMap<[Place; 2], Vec<usize>> = HashMap::new();
    for &t in &lamps {
        for (_, edge) in edges_of(obj, t) {
            edges.entry(edge).or_default().push(t);
        }
    }
    let mut lifted = HashSet::new();
    for t in 0..obj.triangles.len() {
        for (corner, edge) in edges_of(obj, t) {
            for &lamp in edges.get(&edge).into_iter().flatten() {
                if lamp != t && lies_on_back(obj, lamp, t, corner) {
                    lifted.insert(lamp);
                }
            }
        }
    }
    for &t in &lamps {
        if !lifted.contains(&t) {
            continue;
        }
        let corners = obj.triangles[t].map(|i| obj.positions[i as usize]);
        let extent = corners.map(|p| p.abs().max_element());
        let lift = LIFT * offset_distance(extent.into_iter().fold(0.0, f32::max));
        let up = (normal(corners) * f64::from(lift)).as_vec3();
        for (c, corner) in corners.into_iter().enumerate() {
            let old = obj.triangles[t][c] as usize;
            obj.triangles[t][c] = obj.positions.len() as u32;
            obj.positions.push(corner + up);
            if let Some(&colour) = obj.colours.get(old) {
                obj.colours.push(colour);
            }
        }
    }
    if !copies.is_empty() {
        retain(obj, |t| !copies.contains(&t));
    }
}

/// The edges of a triangle as keys, each with the corner that is not on it.
fn edges_of(obj: &ObjFile, triangle: usize) -> [(usize, [Place; 2]); 3] {
    let places = obj.triangles[triangle].map(|i| place(obj.positions[i as usize]));
    [0, 1, 2].map(|c| {
        let (a, b) = (places[(c + 1) % 3], places[(c + 2) % 3]);
        (c, [a.min(b), a.max(b)])
    })
}

/// Whether `lamp` and the triangle `t`, which share the edge that is opposite to this corner of `t`, overlap and
/// face away from each other.
fn lies_on_back(obj: &ObjFile, lamp: usize, t: usize, corner: usize) -> bool {
    let corners = |t: usize| obj.triangles[t].map(|i| obj.positions[i as usize]);
    let (front, own) = (normal(corners(lamp)), corners(t));
    let [apex, a, b] = [0, 1, 2].map(|c| own[(corner + c) % 3].as_dvec3());
    let along = b - a;
    let Some(far) = corners(lamp)
        .map(|p| p.as_dvec3())
        .into_iter()
        .find(|&p| p != a && p != b)
    else {
        return false;
    };
    // From the edge to the corners, in the plane of the lamp.
    let inwards = |p: DVec3| front.cross(along).dot(p - a);
    let level = front.dot(apex - a).abs() <= LEVEL * (apex - a).length();
    level && inwards(far) * inwards(apex) > 0.0 && normal(own).dot(front) < 0.0
}

/// The unit normal of a triangle.
fn normal(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}

/// Keeps the triangles of which `keep` says so.
fn retain(obj: &mut ObjFile, keep: impl Fn(usize) -> bool) {
    fn of<T>(list: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
        let mut t = 0;
        list.retain(|_| {
            t += 1;
            keep(t - 1)
        });
    }
    of(&mut obj.triangles, &keep);
    of(&mut obj.normal_triangles, &keep);
    of(&mut obj.texcoord_triangles, &keep);
    of(&mut obj.smoothing_of, &keep);
    of(&mut obj.material_of, &keep);
    of(&mut obj.object_of, &keep);
}

/// Whether the normals of all corners look away from the front of a triangle.
fn is_turned(obj: &ObjFile, triangle: usize) -> bool {
    let normals = obj.normal_triangles[triangle];
    let [a, b, c] = obj.triangles[triangle].map(|i| obj.positions[i as usize].as_dvec3());
    let front = (b - a).cross(c - a);
    let looks_away = |n: u32| obj.normals[n as usize].as_dvec3().dot(front) < 0.0;
    normals.iter().all(|&n| n != NONE && looks_away(n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::mtl::MtlMaterial;
    use crate::scene::remarks::Remarks;

    /// A square at height 1 for each turn and material, where material 1 emits.
    fn squares(faces: &[([u32; 4], u32)]) -> (ObjFile, Vec<Material>) {
        let materials = [None, Some([1.0; 3])].map(|ke| MtlMaterial {
            ke,
            ..Default::default()
        });
        let read = |m| Material::from_mtl(m, None, 0.01, &mut Remarks::default());
        let materials_read = materials.iter().map(read).collect();
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let mut obj = ObjFile {
            positions: corners.map(|(x, z)| Vec3::new(x, 1.0, z)).to_vec(),
            materials: materials.into(),
            ..Default::default()
        };
        for &([a, b, c, d], material) in faces {
            obj.triangles.extend([[a, b, c], [a, c, d]]);
            obj.material_of.extend([material; 2]);
        }
        (obj, materials_read)
    }

    fn heights(obj: &ObjFile, t: usize) -> [f32; 3] {
        obj.triangles[t].map(|i| obj.positions[i as usize].y)
    }

    #[test]
    fn lamps_on_backs_are_lifted_where_they_shine() {
        // Downwards and upwards, cut along other diagonals.
        let (down, up) = ([0, 1, 2, 3], [0, 3, 2, 1]);
        for up in [up, [3, 2, 1, 0]] {
            let (mut obj, materials) = squares(&[(down, 1), (up, 1)]);
            part(&mut obj, &materials);
            assert_eq!(obj.triangles.len(), 4);
            for t in 0..2 {
                assert!(heights(&obj, t).iter().all(|&y| y < 1.0 && y > 0.999));
                assert!(heights(&obj, t + 2).iter().all(|&y| y > 1.0 && y < 1.001));
            }
            // On a back that is dark.
            let (mut obj, materials) = squares(&[(down, 1), (up, 0)]);
            part(&mut obj, &materials);
            assert!(heights(&obj, 0)[0] < 1.0 && heights(&obj, 2) == [1.0; 3]);
        }
        // Beside others, or twice: as they are, once.
        let (mut obj, materials) = squares(&[(down, 1), ([1, 2, 3, 0], 1), (down, 1)]);
        part(&mut obj, &materials);
        assert!(obj.triangles.len() == 4 && obj.positions.len() == 4);
    }
}
