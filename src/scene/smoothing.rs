//! Normals of smoothing groups, where a file gives none.

use crate::load::obj::{NONE, ObjFile};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Gives the triangles of smoothing groups normals: at each place the mean over the group's triangles there,
/// weighted by their angles, so that it does not depend on how faces are cut. Corners in one place count as one,
/// also where the file has them twice: programs double them along the seams of textures.
pub fn add_normals(obj: &mut ObjFile) {
    if obj.smoothing_of.iter().all(|&group| group == 0) {
        return;
    }
    if obj.normal_triangles.is_empty() {
        obj.normal_triangles = vec![[NONE; 3]; obj.triangles.len()];
    }
    let first = obj.normals.len() as u32;
    let mut numbers: HashMap<([u32; 3], u32), u32> = HashMap::new();
    let mut sums: Vec<DVec3> = Vec::new();
    for t in 0..obj.triangles.len() {
        let group = obj.smoothing_of[t];
        if group == 0 || obj.normal_triangles[t] != [NONE; 3] {
            continue;
        }
        let corners = obj.triangles[t].map(|i| obj.positions[i as usize]);
        let p = corners.map(|p| p.as_dvec3());
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        for (c, corner) in corners.into_iter().enumerate() {
            // The sum has no -0, which would be another place than 0.
            let place = (corner + Vec3::ZERO).to_array().map(f32::to_bits);
            let next = sums.len() as u32;
            let number = *numbers.entry((place, group)).or_insert(next);
            if number == next {
                sums.push(DVec3::ZERO);
            }
            let angle = (p[(c + 1) % 3] - p[c]).angle_between(p[(c + 2) % 3] - p[c]);
            sums[number as usize] += normal * angle;
            obj.normal_triangles[t][c] = first + number;
        }
    }
    obj.normals.extend(sums.iter().map(|n| n.as_vec3()));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sides of a roof with a doubled ridge: one group makes the ridge look upwards, two keep the edge.
    #[test]
    fn normals_are_shared_within_a_group() {
        let roof = |groups: [u32; 2]| {
            let mut obj = ObjFile {
                positions: vec![
                    Vec3::new(-1.0, 0.0, 0.0),
                    Vec3::new(-1.0, 0.0, 1.0),
                    Vec3::new(0.0, 1.0, 0.0),
                    Vec3::new(-0.0, 1.0, 0.0),
                    Vec3::new(1.0, 0.0, 1.0),
                    Vec3::new(1.0, 0.0, 0.0),
                ],
                triangles: vec![[0, 1, 2], [3, 4, 5]],
                material_of: vec![0, 0],
                smoothing_of: groups.to_vec(),
                ..Default::default()
            };
            add_normals(&mut obj);
            [(0, 2), (1, 0)].map(|(t, c): (usize, usize)| {
                let corners = obj.normal_triangles.get(t)?;
                obj.normals.get(corners[c] as usize).map(|n| n.normalize())
            })
        };
        let up = |n: Option<Vec3>| n.is_some_and(|n| n.x.abs() < 1e-6 && n.y > 0.0);
        assert!(roof([3, 3]).into_iter().all(up));
        let [left, right] = roof([1, 2]);
        assert!(left.is_some_and(|n| n.x < -0.5) && right.is_some_and(|n| n.x > 0.5));
        assert_eq!(roof([0, 0]), [None, None]);
    }
}
