//! Normals where a file gives none: of smoothing groups, and over edges that are not sharp.

use super::place::{Place, place};
use crate::load::obj::{NONE, ObjFile};
use glam::DVec3;
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
    let mut numbers: HashMap<(Place, u32), u32> = HashMap::new();
    let mut sums: Vec<DVec3> = Vec::new();
    for t in 0..obj.triangles.len() {
        let group = obj.smoothing_of[t];
        if group == 0 || obj.normal_triangles[t] != [NONE; 3] {
            continue;
        }
        let corners = obj.triangles[t].map(|i| obj.positions[i as usize]);
        let p = corners.map(|p| p.as_dvec3());
        let normal = unit_normal(&p);
        for (c, corner) in corners.into_iter().enumerate() {
            let next = sums.len() as u32;
            let number = *numbers.entry((place(corner), group)).or_insert(next);
            if number == next {
                sums.push(DVec3::ZERO);
            }
            sums[number as usize] += normal * angle(&p, c);
            obj.normal_triangles[t][c] = first + number;
        }
    }
    obj.normals.extend(sums.iter().map(|n| n.as_vec3()));
}

/// Gives triangles that have neither normals nor a smoothing group normals over edges at which their planes meet
/// at less than `degrees`: at each corner the mean of the triangles that are reached over such edges, weighted
/// by their angles. Edges of more than two triangles are sharp.
pub fn smooth_edges(obj: &mut ObjFile, degrees: f32) {
    let is_open = |t: usize| {
        let flat = |list: &[[u32; 3]]| list.get(t).is_none_or(|corners| *corners == [NONE; 3]);
        flat(&obj.normal_triangles) && obj.smoothing_of.get(t).is_none_or(|&group| group == 0)
    };
    let open: Vec<usize> = (0..obj.triangles.len()).filter(|&t| is_open(t)).collect();
    if open.is_empty() {
        return;
    }

    // Places, triangles and edges.
    let mut numbers: HashMap<Place, u32> = HashMap::new();
    let mut corners: Vec<[u32; 3]> = Vec::with_capacity(open.len());
    let mut points: Vec<[DVec3; 3]> = Vec::with_capacity(open.len());
    for &t in &open {
        let at = obj.triangles[t].map(|i| obj.positions[i as usize]);
        corners.push(at.map(|p| {
            let next = numbers.len() as u32;
            *numbers.entry(place(p)).or_insert(next)
        }));
        points.push(at.map(|p| p.as_dvec3()));
    }
    let normals: Vec<DVec3> = points.iter().map(unit_normal).collect();
    let mut edges: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
    for (t, corners) in corners.iter().enumerate() {
        for c in 0..3 {
            let (a, b) = (corners[c], corners[(c + 1) % 3]);
            let sides = edges.entry((a.min(b), a.max(b))).or_default();
            sides.push((3 * t + c) as u32);
        }
    }

    // Corners that share a normal.
    let mut sets = Sets::new(3 * open.len());
    let sharp = f64::from(degrees).to_radians().cos();
    for sides in edges.into_values() {
        let [side, other] = sides[..] else {
            continue;
        };
        let ([t, o], [c, d]) = ([side / 3, other / 3], [side % 3, other % 3]);
        // Neighbours that turn alike run along their edge in opposite directions.
        let (a, b) = (
            corners[t as usize][c as usize],
            corners[o as usize][d as usize],
        );
        if a == b || normals[t as usize].dot(normals[o as usize]) <= sharp {
            continue;
        }
        sets.unite(3 * t + c, 3 * o + (d + 1) % 3);
        sets.unite(3 * t + (c + 1) % 3, 3 * o + d);
    }

    // Their sums.
    if obj.normal_triangles.is_empty() {
        obj.normal_triangles = vec![[NONE; 3]; obj.triangles.len()];
    }
    let first = obj.normals.len() as u32;
    let mut sums: Vec<DVec3> = Vec::new();
    let mut number_of: Vec<u32> = vec![NONE; 3 * open.len()];
    for (n, &t) in open.iter().enumerate() {
        for c in 0..3 {
            let number = &mut number_of[sets.root((3 * n + c) as u32) as usize];
            if *number == NONE {
                *number = sums.len() as u32;
                sums.push(DVec3::ZERO);
            }
            sums[*number as usize] += normals[n] * angle(&points[n], c);
            obj.normal_triangles[t][c] = first + *number;
        }
    }
    obj.normals.extend(sums.iter().map(|n| n.as_vec3()));
}

fn unit_normal(p: &[DVec3; 3]) -> DVec3 {
    (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero()
}

/// The angle at a corner of a triangle.
fn angle(p: &[DVec3; 3], corner: usize) -> f64 {
    let towards = |other: usize| p[(corner + other) % 3] - p[corner];
    towards(1).angle_between(towards(2))
}

/// Disjoint sets of numbers.
struct Sets {
    parents: Vec<u32>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    fn root(&mut self, mut n: u32) -> u32 {
        while self.parents[n as usize] != n {
            let grandparent = self.parents[self.parents[n as usize] as usize];
            self.parents[n as usize] = grandparent;
            n = grandparent;
        }
        n
    }

    /// The root is the smallest number, whatever the order.
    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

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

    /// A prism of `sides` rectangles, open at its ends, with corners of its own for each.
    fn prism(sides: usize) -> ObjFile {
        let mut obj = ObjFile::default();
        let corner = |i: usize, z: f32| {
            let (sin, cos) = (std::f64::consts::TAU * (i % sides) as f64 / sides as f64).sin_cos();
            Vec3::new(cos as f32, sin as f32, z)
        };
        for i in 0..sides {
            let first = obj.positions.len() as u32;
            obj.positions.extend([
                corner(i, 0.0),
                corner(i + 1, 0.0),
                corner(i + 1, 1.0),
                corner(i, 1.0),
            ]);
            obj.triangles
                .extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|c| first + c)));
            obj.material_of.extend([0, 0]);
        }
        obj
    }

    #[test]
    fn edges_are_smooth_up_to_an_angle() {
        // Its edges bend by 30°.
        let mut round = prism(12);
        smooth_edges(&mut round, 31.0);
        for (corners, normals) in round.triangles.iter().zip(&round.normal_triangles) {
            for (&p, &n) in corners.iter().zip(normals) {
                let outwards = round.positions[p as usize] * Vec3::new(1.0, 1.0, 0.0);
                let normal = round.normals[n as usize].normalize();
                assert!((normal - outwards).length() < 1e-6, "{normal} {outwards}");
            }
        }
        let mut flat = prism(12);
        smooth_edges(&mut flat, 29.0);
        for t in 0..flat.triangles.len() {
            let p = flat.triangles[t].map(|i| flat.positions[i as usize].as_dvec3());
            for n in flat.normal_triangles[t] {
                let normal = flat.normals[n as usize].as_dvec3().normalize();
                assert!((normal - unit_normal(&p)).length() < 1e-6);
            }
        }
        // What has normals keeps them; a third side makes an edge sharp.
        let mut given = prism(12);
        given.smoothing_of = vec![1; 24];
        smooth_edges(&mut given, 60.0);
        assert!(given.normals.is_empty());
        let mut fins = prism(3);
        let fin = fins.triangles[0];
        fins.triangles.push(fin);
        smooth_edges(&mut fins, 170.0);
        let normal = |t: usize, c: usize| fins.normals[fins.normal_triangles[t][c] as usize];
        let p = fin.map(|i| fins.positions[i as usize].as_dvec3());
        assert!((normal(6, 1).normalize().as_dvec3() - unit_normal(&p)).length() < 1e-6);
    }
}
