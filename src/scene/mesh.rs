//! Triangles, their materials and their normals.

use super::material::Material;
use super::texture::Texture;
use crate::geometry::offset_distance;
use crate::lanes::{LANES, Vec3x8, positive, set_lanes};
use crate::load::obj::{NONE, ObjFile};
use glam::{Vec2, Vec3};
use serde::Serialize;
use wide::f32x8;
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
    /// Normals of each triangle's corners, or [`NONE`] for a flat triangle; empty where all are.
    normal_triangles: Vec<[u32; 3]>,
    /// Texture coordinates.
    texcoords: Vec<Vec2>,
    /// Texture coordinates of each triangle's corners, or [`NONE`]; empty where nothing is textured.
    texcoord_triangles: Vec<[u32; 3]>,
    /// Linear colours of vertices, NaN where one has none; empty where none has any.
    colours: Vec<Vec3>,
    /// Material of each triangle.
    pub material_of: Vec<u32>,
    /// Object of each triangle; empty where nobody asked for them.
    pub object_of: Vec<u32>,
    /// The triangles with holes, if there are any.
    pub cutouts: Option<Cutouts>,
    /// Smallest and largest coordinates of the triangles.
    pub bounds: (Vec3, Vec3),
}

/// Triangles of which a texture cuts parts out. They are the last ones of the mesh, so that all others are
/// traced without asking.
#[derive(Debug)]
pub struct Cutouts {
    /// The first of them.
    pub first: u32,
    /// Opacity by material; open below a half.
    opacity: Vec<Option<Texture>>,
}

impl Cutouts {
    /// The opacity of a material.
    pub fn opacity(&self, material: u32) -> Option<&Texture> {
        self.opacity[material as usize].as_ref()
    }
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

/// [`SurfacePoint`] in lanes.
#[derive(Clone, Copy, Debug)]
pub struct PointsX8 {
    /// Where they are.
    pub position: Vec3x8,
    /// Geometric normals.
    pub ng: Vec3x8,
    /// Shading normals.
    pub ns: Vec3x8,
    /// Distances by which rays start off the surfaces.
    pub offset: f32x8,
}

/// Least cosine between a shading normal and the geometric one.
pub const SHALLOWEST: f32 = 1e-3;

impl Mesh {
    /// How many triangles are shaded by normals of their corners.
    pub fn smooth_triangles(&self) -> usize {
        let normals = self.normal_triangles.iter();
        normals.filter(|corners| corners[0] != NONE).count()
    }

    /// Takes over what was read. A triangle with a normal that is zero or not finite, or that points
    /// to the other side, is flat. `opacity` are the materials' textures of opacity.
    pub fn new(mut obj: ObjFile, opacity: Vec<Option<Texture>>) -> Self {
        let cutouts = cutouts_last(&mut obj, opacity);
        let ObjFile {
            mut positions,
            triangles,
            normals,
            mut normal_triangles,
            mut texcoords,
            texcoord_triangles,
            colours,
            material_of,
            object_of,
            ..
        } = obj;
        for uv in texcoords.iter_mut().filter(|uv| !uv.is_finite()) {
            *uv = Vec2::ZERO;
        }
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
                .any(|&c| c == NONE || normals[c as usize] == Vec3::ZERO)
            {
                *corners = [NONE; 3];
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
            texcoords,
            texcoord_triangles,
            colours,
            material_of,
            object_of,
            cutouts,
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
            None | Some(&[NONE, ..]) => ng,
            Some(corners) => {
                let [na, nb, nc] = corners.map(|i| self.normals[i as usize]);
                let ns = (na * w + nb * u + nc * v).normalize_or(ng);
                if ns.dot(ng) > SHALLOWEST { ns } else { ng }
            }
        };
        SurfacePoint {
            position,
            ng,
            ns,
            offset: offset_distance(extent),
        }
    }

    /// [`Mesh::point`] in lanes.
    #[inline(always)]
    pub fn points(&self, triangles: &[u32; LANES], u: f32x8, v: f32x8) -> PointsX8 {
        let mut corners = [[0; 3]; LANES];
        for (corners, &triangle) in corners.iter_mut().zip(triangles) {
            *corners = self.triangles[triangle as usize];
        }
        let corner =
            |i: usize| Vec3x8::from_lanes(|lane| self.positions[corners[lane][i] as usize]);
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let w = f32x8::ONE - u - v;
        let n = (b - a).cross(c - a);
        let length2 = n.dot(n);
        let ng = n / length2.sqrt();
        let mut points = PointsX8 {
            position: a * w + b * u + c * v,
            ng,
            ns: ng,
            offset: offset_distance(a.abs().max(b.abs()).max(c.abs()).max_element()),
        };
        if !self.normal_triangles.is_empty() {
            let mut corners = [[0; 3]; LANES];
            for (corners, &triangle) in corners.iter_mut().zip(triangles) {
                *corners = self.normal_triangles[triangle as usize];
            }
            // Flat triangles get 0, which gives way to the geometric normal.
            let normal = |i: usize| {
                Vec3x8::from_lanes(|lane| {
                    let index = corners[lane][i] as usize;
                    self.normals.get(index).copied().unwrap_or_default()
                })
            };
            let ns = normal(0) * w + normal(1) * u + normal(2) * v;
            let per_length = ns.length_recip();
            let ns = ns * per_length;
            let steep = ns.dot(ng).simd_gt(f32x8::splat(SHALLOWEST));
            points.ns = Vec3x8::select(
                per_length.is_finite() & positive(per_length) & steep,
                ns,
                ng,
            );
        }
        // Triangles whose normal needs more care.
        let well_scaled =
            length2.simd_gt(f32x8::splat(SCALED.0)) & length2.simd_lt(f32x8::splat(SCALED.1));
        for lane in set_lanes(!well_scaled) {
            let (u, v) = (u.as_array()[lane], v.as_array()[lane]);
            let point = self.point(triangles[lane], u, v);
            points.ng.set(lane, point.ng);
            points.ns.set(lane, point.ns);
        }
        points
    }

    /// The unit normals of a triangle's corners; `None` where it is flat.
    #[inline]
    pub fn corner_normals(&self, triangle: u32) -> Option<[Vec3; 3]> {
        match self.normal_triangles.get(triangle as usize) {
            None | Some(&[NONE, ..]) => None,
            Some(corners) => Some(corners.map(|i| self.normals[i as usize])),
        }
    }

    /// How the shading normal at a point of a triangle changes where the point moves by each of `steps` in the
    /// triangle's plane.
    pub fn normal_change(&self, triangle: u32, [u, v]: [f32; 2], steps: [Vec3; 2]) -> [Vec3; 2] {
        let Some([na, nb, nc]) = self.corner_normals(triangle) else {
            return [Vec3::ZERO; 2];
        };
        let [a, b, c] = self.corners(triangle);
        let (e1, e2) = (b - a, c - a);
        let sum = na * (1.0 - u - v) + nb * u + nc * v;
        let per_length = sum.length_recip();
        let ns = sum * per_length;
        let steep = ns.dot(unit_normal(e1, e2)) > SHALLOWEST;
        if !steep {
            // Shaded as flat.
            return [Vec3::ZERO; 2];
        }
        let (d11, d12, d22) = (e1.dot(e1), e1.dot(e2), e2.dot(e2));
        let determinant = d11 * d22 - d12 * d12;
        steps.map(|step| {
            let (s1, s2) = (e1.dot(step), e2.dot(step));
            let du = (s1 * d22 - s2 * d12) / determinant;
            let dv = (s2 * d11 - s1 * d12) / determinant;
            let change = ((nb - na) * du + (nc - na) * dv) * per_length;
            change - ns * ns.dot(change)
        })
    }

    /// Texture coordinates of a triangle's corners; `None` where it has none.
    #[inline]
    pub fn corner_texcoords(&self, triangle: u32) -> Option<[Vec2; 3]> {
        match self.texcoord_triangles.get(triangle as usize) {
            None | Some(&[NONE, ..]) => None,
            Some(corners) => Some(corners.map(|i| self.texcoords[i as usize])),
        }
    }

    /// Texture coordinates at a point of a triangle; 0 where it has none.
    #[inline]
    pub fn texcoord(&self, triangle: u32, u: f32, v: f32) -> Vec2 {
        self.corner_texcoords(triangle)
            .map_or(Vec2::ZERO, |[a, b, c]| a * (1.0 - u - v) + b * u + c * v)
    }

    /// The colour at a point of a triangle; `None` where not all of its corners have one.
    #[inline]
    pub fn colour(&self, triangle: u32, u: f32, v: f32) -> Option<Vec3> {
        let corners = self.triangles[triangle as usize];
        let [a, b, c] = corners.map(|i| self.colours.get(i as usize).copied().unwrap_or(Vec3::NAN));
        Some(a * (1.0 - u - v) + b * u + c * v).filter(|colour| colour.is_finite())
    }

    /// How the position changes with each texture coordinate. `None` where these do not span the triangle.
    pub fn tangents(&self, triangle: u32) -> Option<(Vec3, Vec3)> {
        let [a, b, c] = self.corner_texcoords(triangle)?;
        let [pa, pb, pc] = self.corners(triangle);
        let ((u1, u2), (e1, e2)) = ((b - a, c - a), (pb - pa, pc - pa));
        let determinant = u1.perp_dot(u2);
        let along = (e1 * u2.y - e2 * u1.y) / determinant;
        let up = (e2 * u1.x - e1 * u2.x) / determinant;
        (along.is_finite() && up.is_finite()).then_some((along, up))
    }

    /// Whether a texture cuts out this point of a triangle.
    #[inline]
    pub fn is_open(&self, triangle: u32, u: f32, v: f32) -> bool {
        match &self.cutouts {
            Some(cutouts) if triangle >= cutouts.first => {
                let material = self.material_of[triangle as usize];
                cutouts
                    .opacity(material)
                    .is_some_and(|opacity| opacity.value(self.texcoord(triangle, u, v)) < 0.5)
            }
            _ => false,
        }
    }

    /// Whether a texture cuts something out of the triangle.
    pub fn has_holes(&self, triangle: u32) -> bool {
        self.cutouts.as_ref().is_some_and(|c| triangle >= c.first)
    }

    /// Those of `materials` that a triangle has.
    pub fn materials_in_use<'a>(
        &self,
        materials: &'a [Material],
    ) -> impl Iterator<Item = &'a Material> {
        let mut used = vec![false; materials.len()];
        for &material in &self.material_of {
            used[material as usize] = true;
        }
        std::iter::zip(materials, used).filter_map(|(material, used)| used.then_some(material))
    }

    /// How many triangles of each of `materials` lack texture coordinates.
    pub fn without_texcoords(&self, materials: usize) -> Vec<usize> {
        let mut counts = vec![0; materials];
        for (triangle, &material) in self.material_of.iter().enumerate() {
            let lacks = self.corner_texcoords(triangle as u32).is_none();
            counts[material as usize] += usize::from(lacks);
        }
        counts
    }

    /// The area of a triangle.
    pub fn area(&self, triangle: u32) -> f32 {
        let [a, b, c] = self.corners(triangle).map(|p| p.as_dvec3());
        (0.5 * (b - a).cross(c - a).length()) as f32
    }

    pub(super) fn hash_into(&self, hasher: &mut Xxh3) {
        let vectors = [&self.positions, &self.normals, &self.colours];
        for x in vectors.into_iter().flatten().flat_map(Vec3::to_array) {
            hasher.update(&x.to_le_bytes());
        }
        for x in self.texcoords.iter().flat_map(Vec2::to_array) {
            hasher.update(&x.to_le_bytes());
        }
        let corners = [
            &self.triangles,
            &self.normal_triangles,
            &self.texcoord_triangles,
        ];
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
        if let Some(cutouts) = &self.cutouts {
            hash_bytes(hasher, &(cutouts.first, &cutouts.opacity));
        }
    }
}

/// Adds a value by its bytes: the names of its fields do not matter.
pub(super) fn hash_bytes(hasher: &mut Xxh3, value: &impl Serialize) {
    let bytes = postcard::to_stdvec(value).expect("the types here have no length that is unknown");
    hasher.update(&bytes);
}

/// Moves the triangles with holes to the end, in their order.
fn cutouts_last(obj: &mut ObjFile, opacity: Vec<Option<Texture>>) -> Option<Cutouts> {
    let has_holes = |&t: &usize| opacity[obj.material_of[t] as usize].is_some();
    let (holes, rest): (Vec<usize>, Vec<usize>) = if opacity.iter().any(Option::is_some) {
        (0..obj.triangles.len()).partition(has_holes)
    } else {
        return None;
    };
    if holes.is_empty() {
        return None;
    }
    let first = rest.len() as u32;
    let order: Vec<usize> = rest.into_iter().chain(holes).collect();
    fn reorder<T: Copy>(list: &mut Vec<T>, order: &[usize]) {
        if !list.is_empty() {
            *list = order.iter().map(|&t| list[t]).collect();
        }
    }
    reorder(&mut obj.triangles, &order);
    reorder(&mut obj.normal_triangles, &order);
    reorder(&mut obj.texcoord_triangles, &order);
    reorder(&mut obj.material_of, &order);
    reorder(&mut obj.object_of, &order);
    Some(Cutouts { first, opacity })
}

/// Between these squares of lengths a vector can be normalised as it is.
const SCALED: (f32, f32) = (1e-30, 1e30);

/// The unit normal of a triangle with these edges; scaled first, since the cross product of two short
/// edges underflows.
#[inline]
fn unit_normal(e1: Vec3, e2: Vec3) -> Vec3 {
    let n = e1.cross(e2);
    let length2 = n.length_squared();
    if length2 > SCALED.0 && length2 < SCALED.1 {
        n / length2.sqrt()
    } else {
        e1.as_dvec3()
            .cross(e2.as_dvec3())
            .normalize_or_zero()
            .as_vec3()
    }
}
