//! Maps from the unit square to where samples are needed.

use crate::lanes::{Float, Vector, positive};
use std::f32::consts::PI;

/// A direction on the upper hemisphere with density cosθ/π per solid angle.
#[inline(always)]
pub fn cosine_hemisphere<F: Float>(u: [F; 2]) -> Vector<F> {
    let [x, y] = disk(u);
    let z2 = F::ONE - (x * x + y * y);
    Vector::new(x, y, z2.larger(F::ZERO).root())
}

/// A point in the unit disk with density 1/π per area; concentric (Shirley and Chiu 1997), so that
/// strata stay compact.
#[inline(always)]
pub fn disk<F: Float>(u: [F; 2]) -> [F; 2] {
    let centred = |u: F| F::splat(2.0) * u - F::ONE;
    let (a, b) = (centred(u[0]), centred(u[1]));
    let flat = a.magnitude().above(b.magnitude());
    // The angle to the nearer axis is at most π/4.
    let (r, other) = (F::select(flat, a, b), F::select(flat, b, a));
    let (sin, cos) = sin_cos_octant(F::splat(PI / 4.0) * (other / r));
    // In the centre the ratio is 0 by 0.
    let centre = r.equals(F::ZERO);
    let outside = |v: F| F::select(centre, F::ZERO, v);
    let (near, far) = (outside(r * cos), outside(r * sin));
    [F::select(flat, near, far), F::select(flat, far, near)]
}

/// Sine and cosine of an angle in [-π/4, π/4], to the last bit but one: Taylor series, which need no
/// reduction of the range and no call.
#[inline(always)]
fn sin_cos_octant<F: Float>(x: F) -> (F, F) {
    let of = F::splat;
    let x2 = x * x;
    let sin = of(1.0 / 362_880.0);
    let sin = sin * x2 - of(1.0 / 5040.0);
    let sin = sin * x2 + of(1.0 / 120.0);
    let sin = sin * x2 - of(1.0 / 6.0);
    let cos = of(1.0 / 40_320.0);
    let cos = cos * x2 - of(1.0 / 720.0);
    let cos = cos * x2 + of(1.0 / 24.0);
    let cos = cos * x2 - of(0.5);
    (x + x * x2 * sin, F::ONE + x2 * cos)
}

/// Barycentric coordinates (u, v) of the second and third corner, with density 2 on the triangle
/// u, v ≥ 0, u + v ≤ 1: uniform by area (Heitz 2019, continuous and compact).
#[inline(always)]
pub fn triangle<F: Float>(u: [F; 2]) -> (F, F) {
    let (a, b) = (u[0] * F::splat(0.5), u[1] * F::splat(0.5));
    let offset = b - a;
    let above = positive(offset);
    (
        F::select(above, a, a - offset),
        F::select(above, b + offset, b),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LANES;
    use wide::f32x8;

    #[test]
    fn lanes_have_the_bits_of_the_maps_one_by_one() {
        let number = |n: usize| n as f32 / 64.0;
        for n in 0..64 * 64 / LANES {
            let at = |lane| (n * LANES + lane) % 64;
            let u: [f32; LANES] = std::array::from_fn(|lane| number(at(lane)));
            let v = number(n * LANES / 64);
            let lanes = [f32x8::from(u), f32x8::splat(v)];
            let (b, c) = triangle(lanes);
            let hemisphere = cosine_hemisphere(lanes);
            for (lane, &u) in u.iter().enumerate() {
                let (b, c) = (b.as_array()[lane], c.as_array()[lane]);
                assert_eq!((b, c), triangle([u, v]));
                assert_eq!(hemisphere.lane(lane), cosine_hemisphere([u, v]).into());
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
