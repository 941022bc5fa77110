//! Maps from the unit square to where samples are needed.

use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// A direction on the upper hemisphere with density cosθ/π per solid angle.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = disk(u);
    Vec3::new(d.x, d.y, (1.0 - d.length_squared()).max(0.0).sqrt())
}

/// A point in the unit disk with density 1/π per area; concentric (Shirley and Chiu 1997), so that
/// strata stay compact.
#[inline]
pub fn disk(u: [f32; 2]) -> Vec2 {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        return Vec2::ZERO;
    }
    let (r, phi) = if a.abs() > b.abs() {
        (a, PI / 4.0 * (b / a))
    } else {
        (b, PI / 2.0 - PI / 4.0 * (a / b))
    };
    let (sin, cos) = phi.sin_cos();
    Vec2::new(r * cos, r * sin)
}

/// Barycentric coordinates (u, v) of the second and third corner, with density 2 on the triangle
/// u, v ≥ 0, u + v ≤ 1: uniform by area (Heitz 2019, continuous and compact).
#[inline]
pub fn triangle(u: [f32; 2]) -> (f32, f32) {
    let (mut a, mut b) = (u[0] * 0.5, u[1] * 0.5);
    let offset = b - a;
    if offset > 0.0 {
        b += offset;
    } else {
        a -= offset;
    }
    (a, b)
}
