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
    // The angle to the nearer axis is at most π/4.
    let (r, ratio, steep) = if a.abs() > b.abs() {
        (a, b / a, false)
    } else {
        (b, a / b, true)
    };
    let (sin, cos) = sin_cos_octant(PI / 4.0 * ratio);
    let (near, far) = (r * cos, r * sin);
    if steep {
        Vec2::new(far, near)
    } else {
        Vec2::new(near, far)
    }
}

/// Sine and cosine of an angle in [-π/4, π/4], to the last bit but one: Taylor series, which need no
/// reduction of the range and no call.
#[inline]
fn sin_cos_octant(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = 1.0 / 362_880.0;
    let sin = sin * x2 - 1.0 / 5040.0;
    let sin = sin * x2 + 1.0 / 120.0;
    let sin = sin * x2 - 1.0 / 6.0;
    let cos = 1.0 / 40_320.0;
    let cos = cos * x2 - 1.0 / 720.0;
    let cos = cos * x2 + 1.0 / 24.0;
    let cos = cos * x2 - 0.5;
    (x + x * x2 * sin, 1.0 + x2 * cos)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_right_to_the_last_bits() {
        for n in -1000..=1000 {
            let x = PI / 4.0 * n as f32 / 1000.0;
            let (sin, cos) = sin_cos_octant(x);
            let (true_sin, true_cos) = f64::from(x).sin_cos();
            assert!((f64::from(sin) - true_sin).abs() < 1e-7, "sin {x}");
            assert!((f64::from(cos) - true_cos).abs() < 1e-7, "cos {x}");
        }
    }
}
