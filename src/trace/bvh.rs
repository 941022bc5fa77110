//! The pure-Rust backend: a compressed wide BVH (obvhs).

use super::rays::{AnyBatch, ClosestBatch, Hit, Ray};
use super::{RayKind, TraversalMode, Traverse};
use crate::scene::mesh::Mesh;
use glam::Vec3A;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::{BvhBuildParams, triangle::Triangle};
use std::sync::Arc;
use std::time::Duration;

/// A tree over the triangles, and the triangles in the tree's order.
pub struct Bvh {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
    /// The mesh, if it has triangles with holes.
    cutouts: Option<Arc<Mesh>>,
}

impl Bvh {
    /// Builds the tree; slow and good, on one thread.
    pub fn new(mesh: &Arc<Mesh>) -> Self {
        let triangles: Vec<Triangle> = (0..mesh.triangles.len() as u32)
            .map(|t| {
                let [v0, v1, v2] = mesh.corners(t).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let tree = build_cwbvh_from_tris(
            &triangles,
            BvhBuildParams::slow_build(),
            &mut Duration::default(),
        );
        let triangles = tree
            .primitive_indices
            .iter()
            .map(|&i| (&triangles[i as usize]).into())
            .collect();
        Self {
            tree,
            triangles,
            cutouts: mesh.cutouts.is_some().then(|| mesh.clone()),
        }
    }

    /// The distance of the hit on a triangle, infinite where it is none, or on a hole.
    #[inline]
    fn closed(&self, mesh: &Mesh, ray: &obvhs::ray::Ray, id: usize) -> f32 {
        let t = self.triangles[id].intersect(ray);
        if t < f32::INFINITY {
            let uv = self.triangles[id].compute_barycentric(ray);
            if mesh.is_open(self.tree.primitive_indices[id], uv.x, uv.y) {
                return f32::INFINITY;
            }
        }
        t
    }

    fn ray(ray: &Ray) -> obvhs::ray::Ray {
        obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), 0.0, ray.length)
    }
}

impl Traverse for Bvh {
    fn mode(&self, _: RayKind) -> TraversalMode {
        TraversalMode::SINGLE
    }

    fn modes(&self) -> &'static [TraversalMode] {
        &[TraversalMode::SINGLE]
    }

    fn memory(&self) -> usize {
        size_of_val(&self.tree.nodes[..])
            + size_of_val(&self.tree.primitive_indices[..])
            + size_of_val(&self.triangles[..])
    }

    fn closest_by(&self, batch: &mut ClosestBatch, _: TraversalMode) {
        batch.trace_each(|ray| {
            let ray = Self::ray(&ray);
            let mut hit = RayHit::none();
            let found = match &self.cutouts {
                None => self
                    .tree
                    .ray_traverse(ray, &mut hit, |ray, id| self.triangles[id].intersect(ray)),
                Some(mesh) => self
                    .tree
                    .ray_traverse(ray, &mut hit, |ray, id| self.closed(mesh, ray, id)),
            };
            found.then(|| {
                let uv = self.triangles[hit.primitive_id as usize].compute_barycentric(&ray);
                Hit {
                    triangle: self.tree.primitive_indices[hit.primitive_id as usize],
                    u: uv.x,
                    v: uv.y,
                    t: hit.t,
                }
            })
        });
    }

    fn any_by(&self, batch: &mut AnyBatch, _: TraversalMode) {
        batch.trace_each(|ray| {
            let ray = Self::ray(&ray);
            !match &self.cutouts {
                None => self
                    .tree
                    .ray_traverse_miss(ray, |ray, id| self.triangles[id].intersect(ray)),
                Some(mesh) => self
                    .tree
                    .ray_traverse_miss(ray, |ray, id| self.closed(mesh, ray, id)),
            }
        });
    }
}
