//! Triangles, their materials and their normals.

use crate::frame::offset_distance;
use crate::load::obj::{NO_NORMAL, ObjFile};
use glam::Vec3;
use xxhash_rust::xxh3::Xxh3;

/// All triangles of a scene.
#[derive(Debug)]
pub struct Mesh {
    /// Vertex positions, and one more at the end that no triangle uses: Embree reads 16 bytes at each.
    pub positions: Vec<Vec3>,
    /// Corners of each triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit vertex normals.
    normals: Vec<Vec3>,
    /// Normals of each triangle's corners, or [`NO_NORMAL`] for a flat triangle; empty where all are.
    normal_triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub material_of: Vec<u32>,
    /// Smallest and largest coordinates of the triangles.
    pub bounds: (Vec3, Vec3),
}

/// A point on a triangle.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Where it is.
    pub position: Vec3,
    /// Geometric normal, unit, on the side from which the winding is counter-clockwise.
    pub ng: Vec3,
    /// Shading normal, unit, within 90° of `ng`.
    pub ns: Vec3,
    /// Distance by which rays start off the surface.
    pub offset: f32,
}

impl Mesh {
    /// Takes over what was read. A triangle with a normal that is zero or not finite, or that points
    /// to the other side, is flat.
    pub fn new(obj: ObjFile) -> Self {
        let ObjFile {
            mut positions,
            triangles,
            normals,
            mut normal_triangles,
            material_of,
            ..
        } = obj;
        let normals: Vec<Vec3> = normals
            .into_iter()
            .map(|n| {
                n.as_dvec3()
                    .try_normalize()
                    .map_or(Vec3::ZERO, |n| n.as_vec3())
            })
            .collect();
        for corners in &mut normal_triangles {
            if corners
                .iter()
                .any(|&c| c == NO_NORMAL || normals[c as usize] == Vec3::ZERO)
            {
                *corners = [NO_NORMAL; 3];
            }
        }
        let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &corner in triangles.iter().flatten() {
            let p = positions[corner as usize];
            bounds = (bounds.0.min(p), bounds.1.max(p));
        }
        positions.push(Vec3::ZERO);
        Self {
            positions,
            triangles,
            normals,
            normal_triangles,
            material_of,
            bounds,
        }
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// The point with barycentric coordinates `u`, `v` of the second and third corner.
    #[inline]
    pub fn point(&self, triangle: u32, u: f32, v: f32) -> SurfacePoint {
        let [a, b, c] = self.corners(triangle);
        let w = 1.0 - u - v;
        let position = a * w + b * u + c * v;
        let (e1, e2) = (b - a, c - a);
        let ng = unit_normal(e1, e2);
        let extent = a.abs().max(b.abs()).max(c.abs()).max_element();
        let ns = match self.normal_triangles.get(triangle as usize) {
            None | Some(&[NO_NORMAL, ..]) => ng,
            Some(corners) => {
                let [na, nb, nc] = corners.map(|i| self.normals[i as usize]);
                let ns = (na * w + nb * u + nc * v).normalize_or(ng);
                if ns.dot(ng) > 1e-3 { ns } else { ng }
            }
        };
        SurfacePoint {
            position,
            ng,
            ns,
            offset: offset_distance(extent),
        }
    }

    /// The area of a triangle.
    pub fn area(&self, triangle: u32) -> f32 {
        let [a, b, c] = self.corners(triangle).map(|p| p.as_dvec3());
        (0.5 * (b - a).cross(c - a).length()) as f32
    }

    pub(super) fn hash_into(&self, hasher: &mut Xxh3) {
        let vectors = [&self.positions, &self.normals];
        for x in vectors.into_iter().flatten().flat_map(Vec3::to_array) {
            hasher.update(&x.to_le_bytes());
        }
        let corners = [&self.triangles, &self.normal_triangles];
        let corners_of = corners.into_iter().flatten().flatten();
        for i in corners_of.chain(&self.material_of) {
            hasher.update(&i.to_le_bytes());
        }
        // Where one list ends and the next begins.
        let lengths = vectors
            .map(Vec::len)
            .into_iter()
            .chain(corners.map(Vec::len));
        lengths.for_each(|n| hasher.update(&(n as u64).to_le_bytes()));
    }
}

/// The unit normal of a triangle with these edges; scaled first, since the cross product of two short
/// edges underflows.
#[inline]
fn unit_normal(e1: Vec3, e2: Vec3) -> Vec3 {
    let n = e1.cross(e2);
    let length2 = n.length_squared();
    if length2 > 1e-30 && length2 < 1e30 {
        n / length2.sqrt()
    } else {
        e1.as_dvec3()
            .cross(e2.as_dvec3())
            .normalize_or_zero()
            .as_vec3()
    }
}
