//! The isotropic GGX distribution of microfacets, sampled by visible normals (Heitz 2018).
//! All directions are local, on the upper side (`z` > 0).

use crate::warp;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Density of microfacet normals `h` per solid angle, projected area not included.
#[inline]
pub fn density(h: Vec3, alpha: f32) -> f32 {
    // 1 - z² from x and y: exact near the pole, where a small alpha has all its weight.
    let a2 = alpha * alpha;
    let t = h.z * h.z * a2 + (h.x * h.x + h.y * h.y);
    a2 / (PI * t * t)
}

/// Smith's Λ of the direction `w`.
#[inline]
fn lambda(w: Vec3, alpha: f32) -> f32 {
    let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// Share of the microfacets facing `w` that are not masked.
#[inline]
pub fn masking(w: Vec3, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(w, alpha))
}

/// Share of the microfacets seen by both directions, correlated in height. For refraction pass the
/// mirror image of the direction below.
#[inline]
pub fn masking_shadowing(wo: Vec3, wi: Vec3, alpha: f32) -> f32 {
    1.0 / (1.0 + lambda(wo, alpha) + lambda(wi, alpha))
}

/// Density of the normals `h` visible from `wo` per solid angle of `h`; what [`sample`] draws from.
#[inline]
pub fn visible_density(wo: Vec3, h: Vec3, alpha: f32) -> f32 {
    masking(wo, alpha) * density(h, alpha) * wo.dot(h).max(0.0) / wo.z
}

/// A normal visible from `wo`, unit, `z` > 0.
#[inline]
pub fn sample(wo: Vec3, alpha: f32, u: [f32; 2]) -> Vec3 {
    let stretched = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let len2 = stretched.x * stretched.x + stretched.y * stretched.y;
    let t1 = if len2 > 1e-12 {
        Vec3::new(-stretched.y, stretched.x, 0.0) / len2.sqrt()
    } else {
        Vec3::X
    };
    let t2 = stretched.cross(t1);
    let p = warp::disk(u);
    let s = 0.5 * (1.0 + stretched.z);
    let p = Vec2::new(p.x, (1.0 - s) * (1.0 - p.x * p.x).max(0.0).sqrt() + s * p.y);
    let n = p.x * t1 + p.y * t2 + (1.0 - p.length_squared()).max(0.0).sqrt() * stretched;
    Vec3::new(alpha * n.x, alpha * n.y, n.z.max(1e-6)).normalize()
}
