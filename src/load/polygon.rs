//! Faces cut into triangles: fans where these lie inside the face, as in convex ones; else by clipping ears in
//! the plane of the face. Holes that are joined to the outline by a doubled edge stay open.

use earcut::Earcut;
use glam::{DVec2, DVec3, Vec3};

/// Part of a face's area that rounding errors may make at corners on a straight line: its fan may spill over so
/// much, and triangles of that size may be left out where they turn back.
const SPILL: f64 = 1e-6;

/// Cuts faces into triangles; keeps its memory from face to face.
pub struct Triangulator {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    earcut: Earcut<f64>,
    indices: Vec<u32>,
}

impl Triangulator {
    /// With nothing in it.
    pub fn new() -> Self {
        Self {
            points: Vec::new(),
            triangles: Vec::new(),
            earcut: Earcut::new(),
            indices: Vec::new(),
        }
    }

    /// The triangles of the face with these corners, all with area, in the order of the corners and turning as
    /// these do. `None` where a corner is not finite.
    #[inline]
    pub fn cut(&mut self, corners: impl Iterator<Item = Vec3>) -> Option<&[[u32; 3]]> {
        self.points.clear();
        self.points.extend(corners.map(|p| p.as_dvec3()));
        self.triangles.clear();
        match self.points[..] {
            [a, b, c] => self.push_with_area([0, 1, 2], (b - a).cross(c - a)),
            [a, b, c, d] => {
                let fan = [(b - a).cross(c - a), (c - a).cross(d - a)];
                let other = [(c - b).cross(d - b), (d - b).cross(a - b)];
                if fan[0].dot(fan[1]) >= 0.0 {
                    self.push_with_area([0, 1, 2], fan[0]);
                    self.push_with_area([0, 2, 3], fan[1]);
                } else if other[0].dot(other[1]) > 0.0 {
                    self.push_with_area([1, 2, 3], other[0]);
                    self.push_with_area([1, 3, 0], other[1]);
                } else {
                    self.cut_polygon();
                }
            }
            _ => self.cut_polygon(),
        }
        // A triangle with area has finite corners.
        let finite = !self.triangles.is_empty() || self.points.iter().all(|p| p.is_finite());
        finite.then_some(&self.triangles[..])
    }

    /// `area`: any multiple of the area, along the normal.
    #[inline]
    fn push_with_area(&mut self, triangle: [u32; 3], area: DVec3) {
        if area.length().is_normal() {
            self.triangles.push(triangle);
        }
    }

    #[cold]
    fn cut_polygon(&mut self) {
        let points = &self.points;
        if points.len() < 3 || !points.iter().all(|p| p.is_finite()) {
            return;
        }
        // The area and the plane of the face (Newell): the sum of the fan's triangles.
        let fan_area = |i: usize| (points[i] - points[0]).cross(points[i + 1] - points[0]);
        let fan = || (1..points.len() - 1).map(fan_area);
        let newell: DVec3 = fan().sum();
        let spilled: f64 = fan().map(|area| (-area.dot(newell)).max(0.0)).sum();
        if spilled <= SPILL * newell.length_squared() && newell != DVec3::ZERO {
            for i in 1..points.len() - 1 {
                let area = fan_area(i);
                if area.length().is_normal() && area.dot(newell) > 0.0 {
                    self.triangles.push([0, i as u32, i as u32 + 1]);
                }
            }
            return;
        }
        // Where parts that turn both ways cancel, any of them has the plane.
        let normal = if newell.length().is_normal() {
            newell
        } else {
            let larger = |a: DVec3, b: DVec3| if b.length() > a.length() { b } else { a };
            fan().fold(DVec3::ZERO, larger)
        };
        if !normal.length().is_normal() {
            return;
        }

        // Seen along the axis nearest to the normal, coordinates keep their bits: corners that are doubled or
        // lie on a line stay so.
        let axis = normal.abs().max_position();
        let flip = normal[axis] < 0.0;
        let flat = |p: DVec3| {
            let (x, y) = (p[(axis + 1) % 3], p[(axis + 2) % 3]);
            if flip { [y, x] } else { [x, y] }
        };
        self.indices.clear();
        let flat_points = points.iter().map(|&p| flat(p));
        self.earcut.earcut(flat_points, &[], &mut self.indices);
        for triangle in self.indices.as_chunks::<3>().0 {
            let [i, mut j, mut k] = *triangle;
            let [p, q, r] = triangle.map(|i| DVec2::from(flat(points[i as usize])));
            if (q - p).perp_dot(r - p) < 0.0 {
                (j, k) = (k, j);
            }
            let [a, b, c] = [i, j, k].map(|i| points[i as usize]);
            let area = (b - a).cross(c - a);
            let sliver = area.length() <= SPILL * normal.length() && area.dot(normal) <= 0.0;
            if area.length().is_normal() && !sliver {
                self.triangles.push([i, j, k]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[Vec3]) -> Vec<[u32; 3]> {
        let mut triangulator = Triangulator::new();
        // What went before leaves nothing behind.
        triangulator.cut([Vec3::ZERO, Vec3::X, Vec3::Y].into_iter());
        triangulator.cut(points.iter().copied()).unwrap().to_vec()
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|&[x, y]| Vec3::new(x, y, 0.0)).collect()
    }

    fn area_vector(points: &[Vec3], [a, b, c]: [u32; 3]) -> DVec3 {
        let [a, b, c] = [a, b, c].map(|i| points[i as usize].as_dvec3());
        0.5 * (b - a).cross(c - a)
    }

    /// Sum of the areas, which is more than the polygon's where triangles overlap or spill.
    fn area(points: &[Vec3]) -> f64 {
        let triangles = cut(points);
        triangles
            .iter()
            .map(|&t| area_vector(points, t).length())
            .sum()
    }

    #[test]
    fn convex_faces_are_fans() {
        let corner = |i: usize| Vec3::from_array([(i as f32).cos(), 1.0, (i as f32).sin()]);
        for corners in 3..7 {
            let points: Vec<Vec3> = (0..corners).map(corner).collect();
            let fan: Vec<[u32; 3]> = (1..corners as u32 - 1).map(|i| [0, i, i + 1]).collect();
            assert_eq!(cut(&points), fan);
        }
        // A corner on a straight edge; the fan's first triangle has no area.
        let points = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
        assert_eq!(cut(&points), [[0, 2, 3], [0, 3, 4]]);
        // A saddle.
        let saddle = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.5), Vec3::Y];
        assert_eq!(cut(&saddle), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn quads_are_cut_inside() {
        let arrow = [[-1.0, -1.0], [0.0, -0.4], [1.0, -1.0], [0.0, 1.0]];
        for first in 0..4 {
            let points: Vec<[f32; 2]> = (0..4).map(|i| arrow[(first + i) % 4]).collect();
            assert!((area(&flat(&points)) - 1.4).abs() < 1e-6, "{first}");
        }
        // Crossing itself: nothing outside of its hull, and no panic.
        let crossed = flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
        assert!(area(&crossed) <= 1.0);
        // Corners in one place.
        let doubled = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        assert_eq!(cut(&doubled), [[0, 2, 3]]);
        assert!(cut(&flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])).is_empty());
    }

    /// Every corner first, both ways round, on planes of any direction.
    #[test]
    fn concave_faces_and_holes_have_their_area() {
        let u = flat(&[
            [-1.0, -1.0],
            [1.0, -1.0],
            [1.0, 1.0],
            [0.6, 1.0],
            [0.6, -0.6],
            [-0.6, -0.6],
            [-0.6, 1.0],
            [-1.0, 1.0],
        ]);
        let wall = flat(&[
            [-1.0, -1.0],
            [1.0, -1.0],
            [1.0, 1.0],
            [-1.0, 1.0],
            [-1.0, -1.0],
            [-0.5, -0.5],
            [-0.5, 0.5],
            [0.5, 0.5],
            [0.5, -0.5],
            [-0.5, -0.5],
        ]);
        // Two windows, reached from two corners.
        let two_windows = flat(&[
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [0.0, 0.0],
            [6.0, 0.0],
            [5.0, 1.0],
            [4.0, 1.0],
            [4.0, 2.0],
            [5.0, 2.0],
            [5.0, 1.0],
            [6.0, 0.0],
            [6.0, 3.0],
            [0.0, 3.0],
        ]);
        for (points, want) in [(u, 2.08), (wall, 3.0), (two_windows, 16.0)] {
            for first in 0..points.len() {
                for turn in [Vec3::Z, Vec3::X, Vec3::Y, Vec3::new(0.48, -0.6, 0.64)] {
                    let turn = glam::Quat::from_rotation_arc(Vec3::Z, turn);
                    let mut face = points.clone();
                    face.rotate_left(first);
                    face.iter_mut().for_each(|p| *p = turn * *p);
                    for reversed in [false, true] {
                        if reversed {
                            face.reverse();
                        }
                        assert!((area(&face) / want - 1.0).abs() < 1e-5, "{first} {face:?}");
                        // All turn as the face does.
                        let normal = turn * if reversed { Vec3::NEG_Z } else { Vec3::Z };
                        for t in cut(&face) {
                            let area = area_vector(&face, t);
                            assert!(area.dot(normal.as_dvec3()) > 0.0, "{t:?} {area} {face:?}");
                        }
                    }
                }
            }
        }
    }

    /// Which would take minutes, were the time quadratic in the corners.
    #[test]
    fn a_gear_has_a_hundred_thousand_corners() {
        let corners = 100_000;
        let corner = |i: usize| {
            let (sin, cos) = (std::f32::consts::TAU * i as f32 / corners as f32).sin_cos();
            let radius = if i % 4 < 2 { 1.0 } else { 0.9 };
            Vec3::new(radius * cos, radius * sin, 0.0)
        };
        let points: Vec<Vec3> = (0..corners).map(corner).collect();
        let area = area(&points);
        let want = std::f64::consts::PI * (1.0 + 0.81) / 2.0;
        assert!((area / want - 1.0).abs() < 0.01, "{area}");
    }

    #[test]
    fn corners_that_are_not_finite_are_told() {
        let mut triangulator = Triangulator::new();
        for corners in 3..7 {
            let points = (0..corners).map(|i| Vec3::new(i as f32, (i * i) as f32, f32::NAN));
            assert!(triangulator.cut(points).is_none());
        }
    }
}
