//! Reflectors that are sides of closed bodies: they are seen from outside alone.

use super::connected::{Edges, Groups, LEVEL};
use super::{Form, MANY, Reflector};
use crate::scene::mesh::Mesh;
use std::collections::BTreeMap;

/// A side of a closed body.
pub(super) struct Side {
    pub(super) reflector: u32,
    /// The number of the body; its sides are together.
    pub(super) body: usize,
    /// 1 where outside is the side of the normals, else -1.
    pub(super) outside: f32,
    /// Whether it is a plane, and most of the body's other planes are across it.
    pub(super) is_across: bool,
}

/// What is a side of a closed body: what is curved, and planes beyond which nothing bulges.
pub(super) fn outsides(
    mesh: &Mesh,
    members: &[u32],
    edges: &Edges,
    of_triangle: &[u32],
    list: &[Reflector],
) -> Vec<Side> {
    let mut bodies = Groups::new(members.len());
    for sharing in edges.shared() {
        let pairs = sharing.windows(2);
        pairs.for_each(|pair| bodies.join(pair[0].1 as usize, pair[1].1 as usize));
    }
    let mut is_closed = vec![true; members.len()];
    for sharing in edges.shared() {
        let body = bodies.find(sharing[0].1 as usize);
        is_closed[body] &= sharing.len() == 2;
    }
    let mut parts: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for (index, &t) in members.iter().enumerate() {
        let body = bodies.find(index);
        if is_closed[body] {
            parts.entry(body).or_default().push(t);
        }
    }
    let mut found = Vec::new();
    for (&body, part) in &parts {
        let mut planes: Vec<u32> = part.iter().map(|&t| of_triangle[t as usize]).collect();
        planes.sort_unstable();
        planes.dedup();
        // Of bodies with many sides each plane matters little.
        if planes.len() > MANY {
            continue;
        }
        let volume = |&t: &u32| {
            let [a, b, c] = mesh.corners(t).map(|p| p.as_dvec3());
            a.dot(b.cross(c))
        };
        let outside = if part.iter().map(volume).sum::<f64>() < 0.0 {
            -1.0
        } else {
            1.0
        };
        for &reflector in &planes {
            let Form::Plane(plane) = &list[reflector as usize].form else {
                found.push(Side {
                    reflector,
                    body,
                    outside,
                    is_across: false,
                });
                continue;
            };
            let heights = part.iter().flat_map(|&t| mesh.corners(t));
            let heights = heights.map(|p| plane.height(p) * outside);
            let bounds = heights.fold((0f32, 0f32), |(low, high), h| (low.min(h), high.max(h)));
            if bounds.1 < 1e-3 * (bounds.1 - bounds.0) {
                let others = planes.iter().filter(|&&r| r != reflector);
                let across = others.map(|&r| match &list[r as usize] {
                    Reflector {
                        form: Form::Plane(other),
                        area,
                        ..
                    } => area.copysign(LEVEL - plane.normal.dot(other.normal).abs()),
                    _ => 0.0,
                });
                found.push(Side {
                    reflector,
                    body,
                    outside,
                    is_across: across.sum::<f32>() > 0.0,
                });
            }
        }
    }
    found
}
