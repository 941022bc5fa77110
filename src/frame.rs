//! Local shading frames, and ray origins that leave a surface without hitting it again.

use crate::lanes::{Vec3x8, negative};
use glam::Vec3;
use wide::f32x8;

/// An orthonormal, right-handed frame around a unit normal. In local coordinates `z` is along the
/// normal, so the cosine to it is the `z` component.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// The normal.
    pub n: Vec3,
}

impl Frame {
    /// The frame of the unit vector `n` (Frisvad 2012).
    ///
    /// The half-vector copy carries directions from one frame to a neighbouring one, so the tangents
    /// must vary smoothly with `n`. They do, except across the small circle `n.z = -0.9`: the usual
    /// switch at `n.z = 0` (Duff et al. 2017) would put the seam across the middle of objects.
    #[inline]
    pub fn new(n: Vec3) -> Self {
        let sign = if n.z < -0.9 { -1.0 } else { 1.0 };
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// World to local coordinates.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world coordinates.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

/// [`Frame`] in lanes.
#[derive(Clone, Copy, Debug)]
pub struct FrameX8 {
    s: Vec3x8,
    t: Vec3x8,
    n: Vec3x8,
}

impl FrameX8 {
    /// [`Frame::new`] in lanes.
    #[inline(always)]
    pub fn new(n: Vec3x8) -> Self {
        let one = f32x8::ONE;
        let sign = n.z.simd_lt(f32x8::splat(-0.9)).select(-one, one);
        let a = -one / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3x8 {
                x: one + sign * n.x * n.x * a,
                y: sign * b,
                z: -sign * n.x,
            },
            t: Vec3x8 {
                x: b,
                y: sign + n.y * n.y * a,
                z: -n.y,
            },
            n,
        }
    }

    /// Local to world coordinates.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3x8) -> Vec3x8 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

/// How far, relative to the largest coordinate of the triangle, a ray's origin is moved off it:
/// 16 times the rounding unit of a coordinate, which covers the interpolation of the hit point and the
/// distance computed by the next intersection. Relative, so that scenes of any scale look alike.
const OFFSET: f32 = 16.0 * f32::EPSILON;

/// The distance by which rays leaving a triangle start off its plane; `extent` is the largest
/// absolute coordinate of its corners.
#[inline]
pub fn offset_distance(extent: f32) -> f32 {
    OFFSET * extent
}

/// The origin of a ray that leaves the surface point `p` with unit geometric normal `ng` in the
/// direction `towards`, moved by `distance` to the side that the ray goes to.
#[inline]
pub fn offset_origin(p: Vec3, ng: Vec3, distance: f32, towards: Vec3) -> Vec3 {
    let side = if ng.dot(towards) >= 0.0 {
        distance
    } else {
        -distance
    };
    p + ng * side
}

/// [`offset_distance`] in lanes.
#[inline(always)]
pub fn offset_distance_x8(extent: f32x8) -> f32x8 {
    f32x8::splat(OFFSET) * extent
}

/// [`offset_origin`] in lanes.
#[inline(always)]
pub fn offset_origin_x8(p: Vec3x8, ng: Vec3x8, distance: f32x8, towards: Vec3x8) -> Vec3x8 {
    let side = negative(ng.dot(towards)).select(-distance, distance);
    p + ng * side
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Default::default() })]

        #[test]
        fn frames_are_orthonormal_and_right_handed(x in -1f32..1.0, y in -1f32..1.0, z in -1f32..1.0) {
            prop_assume!(Vec3::new(x, y, z).length() > 1e-3);
            let n = Vec3::new(x, y, z).normalize();
            let f = Frame::new(n);
            for (a, b, want) in [(f.s, f.s, 1.0), (f.t, f.t, 1.0), (f.s, f.t, 0.0), (f.s, n, 0.0), (f.t, n, 0.0)] {
                prop_assert!((a.dot(b) - want).abs() < 2e-6);
            }
            prop_assert!((f.s.cross(f.t) - n).length() < 4e-6);
            let v = Vec3::new(0.3, -0.5, 0.8);
            prop_assert!((f.to_world(f.to_local(v)) - v).length() < 4e-6);

            let lanes = FrameX8::new(Vec3x8::splat(n));
            prop_assert_eq!(lanes.to_world(Vec3x8::splat(v)).lane(5), f.to_world(v));
            let origin = offset_origin_x8(Vec3x8::splat(v), Vec3x8::splat(n), f32x8::splat(0.1), Vec3x8::splat(v));
            prop_assert_eq!(origin.lane(2), offset_origin(v, n, 0.1, v));
        }
    }

    #[test]
    fn tangents_vary_smoothly_across_the_equator() {
        let (above, below) = (Vec3::new(0.6, 0.8, 1e-4), Vec3::new(0.6, 0.8, -1e-4));
        let (f, g) = (Frame::new(above.normalize()), Frame::new(below.normalize()));
        assert!((f.s - g.s).length() < 1e-3 && (f.t - g.t).length() < 1e-3);
    }
}
