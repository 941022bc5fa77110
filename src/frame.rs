//! Local shading frames.

use crate::lanes::{Float, Vector};

/// An orthonormal, right-handed frame around a unit normal. In local coordinates `z` is along the
/// normal, so the cosine to it is the `z` component.
#[derive(Clone, Copy, Debug)]
pub struct Frame<F = f32> {
    /// First tangent.
    pub s: Vector<F>,
    /// Second tangent.
    pub t: Vector<F>,
    /// The normal.
    pub n: Vector<F>,
}

/// Where the tangents jump: at this `z` of the normal.
const SEAM: f32 = -0.9;

impl<F: Float> Frame<F> {
    /// The frame of the unit vector `n` (Frisvad 2012).
    ///
    /// The half-vector copy carries directions from one frame to a neighbouring one, so the tangents
    /// must vary smoothly with `n`. They do, except across the small circle `n.z = -0.9`: the usual
    /// switch at `n.z = 0` (Duff et al. 2017) would put the seam across the middle of objects.
    #[inline(always)]
    pub fn new(n: Vector<F>) -> Self {
        let one = F::ONE;
        let sign = F::select(n.z.below(F::splat(SEAM)), -one, one);
        let a = -one / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vector::new(one + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vector::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// How the axes change when the normal changes by `by`.
    #[inline(always)]
    pub fn change(&self, by: Vector<F>) -> Self {
        let (n, one) = (self.n, F::ONE);
        let sign = F::select(n.z.below(F::splat(SEAM)), -one, one);
        let a = -one / (sign + n.z);
        let a_by = a * a * by.z;
        let b_by = (by.x * n.y + n.x * by.y) * a + n.x * n.y * a_by;
        let square = |x: F, x_by: F| (x + x) * x_by * a + x * x * a_by;
        Self {
            s: Vector::new(sign * square(n.x, by.x), sign * b_by, -sign * by.x),
            t: Vector::new(b_by, square(n.y, by.y), -by.y),
            n: by,
        }
    }

    /// World to local coordinates.
    #[inline(always)]
    pub fn to_local(&self, v: Vector<F>) -> Vector<F> {
        Vector::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world coordinates.
    #[inline(always)]
    pub fn to_world(&self, v: Vector<F>) -> Vector<F> {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use wide::f32x8;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Default::default() })]

        #[test]
        fn frames_are_orthonormal_and_right_handed(x in -1f32..1.0, y in -1f32..1.0, z in -1f32..1.0) {
            prop_assume!(Vec3::new(x, y, z).length() > 1e-3);
            let n = Vec3::new(x, y, z).normalize();
            let f = Frame::<f32>::new(n.into());
            let [s, t] = [f.s, f.t].map(Vec3::from);
            for (a, b, want) in [(s, s, 1.0), (t, t, 1.0), (s, t, 0.0), (s, n, 0.0), (t, n, 0.0)] {
                prop_assert!((a.dot(b) - want).abs() < 2e-6);
            }
            prop_assert!((s.cross(t) - n).length() < 4e-6);
            let v = Vec3::new(0.3, -0.5, 0.8);
            prop_assert!((Vec3::from(f.to_world(f.to_local(v.into()))) - v).length() < 4e-6);

            let (ns, vs) = (Vector::<f32x8>::splat(n), Vector::splat(v));
            let lanes = Frame::new(ns);
            prop_assert_eq!(lanes.to_world(vs).lane(5), f.to_world(v.into()).into());
            prop_assert_eq!(lanes.to_local(vs).lane(6), f.to_local(v.into()).into());
        }
    }

    #[test]
    fn frames_change_as_they_do_numerically() {
        let step = 1e-3;
        for n in [[0.6, 0.8, 0.1], [0.2, -0.3, 0.9], [-0.1, 0.2, -0.98]] {
            let n = Vec3::from_array(n).normalize();
            let frame = Frame::<f32>::new(n.into());
            let (a, b) = n.any_orthonormal_pair();
            for across in [a, b] {
                let at = |step: f32| Frame::<f32>::new((n + across * step).normalize().into());
                let (there, here) = (at(step), at(-step));
                let change = frame.change(across.into());
                for (a, b, c) in [
                    (there.s, here.s, change.s),
                    (there.t, here.t, change.t),
                    (there.n, here.n, change.n),
                ] {
                    let numeric = Vec3::from(a - b) / (2.0 * step);
                    assert!((numeric - Vec3::from(c)).length() < 2e-3, "{n}");
                }
            }
        }
    }

    #[test]
    fn tangents_vary_smoothly_across_the_equator() {
        let (above, below) = (Vec3::new(0.6, 0.8, 1e-4), Vec3::new(0.6, 0.8, -1e-4));
        let (f, g) = (
            Frame::<f32>::new(above.normalize().into()),
            Frame::<f32>::new(below.normalize().into()),
        );
        assert!(Vec3::from(f.s - g.s).length() < 1e-3 && Vec3::from(f.t - g.t).length() < 1e-3);
    }
}
