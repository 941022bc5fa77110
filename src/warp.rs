//! Maps from the unit square to where samples are needed.

use crate::lanes::{Vec3x8, positive};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use wide::f32x8;

/// A direction on the upper hemisphere with density cosθ/π per solid angle.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = disk(u);
    Vec3::new(d.x, d.y, (1.0 - d.length_squared()).max(0.0).sqrt())
}

/// [`cosine_hemisphere`] in lanes.
#[inline(always)]
pub fn cosine_hemisphere_x8(u: [f32x8; 2]) -> Vec3x8 {
    let [x, y] = disk_x8(u);
    let z2 = f32x8::ONE - (x * x + y * y);
    Vec3x8 {
        x,
        y,
        z: z2.fast_max(f32x8::ZERO).sqrt(),
    }
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

/// [`disk`] in lanes.
#[inline(always)]
fn disk_x8(u: [f32x8; 2]) -> [f32x8; 2] {
    let [a, b] = u.map(|u| f32x8::splat(2.0) * u - f32x8::ONE);
    let flat = a.abs().simd_gt(b.abs());
    let (r, other) = (flat.select(a, b), flat.select(b, a));
    let (sin, cos) = sin_cos_octant_x8(f32x8::splat(PI / 4.0) * (other / r));
    // In the centre the ratio is 0 by 0.
    let centre = r.simd_eq(f32x8::ZERO);
    let [near, far] = [r * cos, r * sin].map(|v| centre.select(f32x8::ZERO, v));
    [flat.select(near, far), flat.select(far, near)]
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

/// [`sin_cos_octant`] in lanes.
#[inline(always)]
fn sin_cos_octant_x8(x: f32x8) -> (f32x8, f32x8) {
    let of = f32x8::splat;
    let x2 = x * x;
    let sin = of(1.0 / 362_880.0);
    let sin = sin * x2 - of(1.0 / 5040.0);
    let sin = sin * x2 + of(1.0 / 120.0);
    let sin = sin * x2 - of(1.0 / 6.0);
    let cos = of(1.0 / 40_320.0);
    let cos = cos * x2 - of(1.0 / 720.0);
    let cos = cos * x2 + of(1.0 / 24.0);
    let cos = cos * x2 - of(0.5);
    (x + x * x2 * sin, f32x8::ONE + x2 * cos)
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

/// [`triangle`] in lanes.
#[inline(always)]
pub fn triangle_x8(u: [f32x8; 2]) -> (f32x8, f32x8) {
    let [a, b] = u.map(|u| u * f32x8::splat(0.5));
    let offset = b - a;
    let above = positive(offset);
    (above.select(a, a - offset), above.select(b + offset, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LANES;

    #[test]
    fn lanes_have_the_bits_of_the_maps_one_by_one() {
        let number = |n: usize| n as f32 / 64.0;
        for n in 0..64 * 64 / LANES {
            let at = |lane| (n * LANES + lane) % 64;
            let u: [f32; LANES] = std::array::from_fn(|lane| number(at(lane)));
            let v = number(n * LANES / 64);
            let lanes = [f32x8::from(u), f32x8::splat(v)];
            let (b, c) = triangle_x8(lanes);
            let hemisphere = cosine_hemisphere_x8(lanes);
            for (lane, &u) in u.iter().enumerate() {
                let (b, c) = (b.as_array()[lane], c.as_array()[lane]);
                assert_eq!((b, c), triangle([u, v]));
                assert_eq!(hemisphere.lane(lane), cosine_hemisphere([u, v]));
            }
        }
    }

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
