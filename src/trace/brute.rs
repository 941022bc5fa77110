//! The oracle for tests: every ray against every triangle, in double precision.

use super::rays::{AnyBatch, ClosestBatch, Hit, Ray};
use super::{RayKind, TraversalMode, Traverse};
use crate::scene::mesh::Mesh;
use std::sync::Arc;

/// No tree at all.
pub struct Brute(pub Arc<Mesh>);

impl Brute {
    fn hits(&self, ray: Ray) -> impl Iterator<Item = Hit> + '_ {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        (0..self.0.triangles.len() as u32).filter_map(move |triangle| {
            // Möller and Trumbore 1997.
            let [a, b, c] = self.0.corners(triangle).map(|p| p.as_dvec3());
            let (e1, e2) = (b - a, c - a);
            let p = d.cross(e2);
            let det = e1.dot(p);
            let s = o - a;
            let q = s.cross(e1);
            let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
            let inside = det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            let hit = Hit {
                triangle,
                u: u as f32,
                v: v as f32,
                t: t as f32,
            };
            let hits = inside && t >= 0.0 && t <= f64::from(ray.length);
            (hits && !self.0.is_open(triangle, hit.u, hit.v)).then_some(hit)
        })
    }
}

impl Traverse for Brute {
    fn mode(&self, _: RayKind) -> TraversalMode {
        TraversalMode::SINGLE
    }

    fn modes(&self) -> &'static [TraversalMode] {
        &[TraversalMode::SINGLE]
    }

    fn memory(&self) -> usize {
        0
    }

    fn closest_by(&self, batch: &mut ClosestBatch, _: TraversalMode) {
        batch.trace_each(|ray| self.hits(ray).min_by(|a, b| a.t.total_cmp(&b.t)));
    }

    fn any_by(&self, batch: &mut AnyBatch, _: TraversalMode) {
        batch.trace_each(|ray| self.hits(ray).next().is_some());
    }
}
