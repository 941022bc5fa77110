//! Lamps shine on the side of their normals, where these agree with one another: programs that mirror objects
//! keep the normals and turn the corners round.

use super::material::Material;
use crate::load::obj::{NONE, ObjFile};

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

/// Whether the normals of all corners look away from the front of a triangle.
fn is_turned(obj: &ObjFile, triangle: usize) -> bool {
    let normals = obj.normal_triangles[triangle];
    let [a, b, c] = obj.triangles[triangle].map(|i| obj.positions[i as usize].as_dvec3());
    let front = (b - a).cross(c - a);
    let looks_away = |n: u32| obj.normals[n as usize].as_dvec3().dot(front) < 0.0;
    normals.iter().all(|&n| n != NONE && looks_away(n))
}
