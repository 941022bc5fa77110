//! The gradient estimate: what one base path and its offset path add to a difference of two pixels
//! (Kettunen et al. 2015, sections 5.1 and 5.3).
//!
#![doc = include_str!("estimator.md")]

use crate::lanes::{Float, Vector, positive};

/// How the two shifts that estimate one difference, i → j and j → i, are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum Weights {
    /// The balance heuristic over both directions and both techniques.
    Mis,
    /// One half where the shift holds, 1 where it is dead (Manzi et al. 2014).
    Symmetric,
}

/// The pixels with which a pixel shares a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Neighbour {
    /// The pixel to the right.
    Right,
    /// The pixel to the left.
    Left,
    /// The pixel below.
    Down,
    /// The pixel above.
    Up,
}

impl Neighbour {
    /// All, in the order of their numbers.
    pub const ALL: [Neighbour; 4] = [
        Neighbour::Right,
        Neighbour::Left,
        Neighbour::Down,
        Neighbour::Up,
    ];

    /// Step to the neighbour in pixels, to the right and down.
    #[inline]
    pub fn step(self) -> (i32, i32) {
        [(1, 0), (-1, 0), (0, 1), (0, -1)][self as usize]
    }
}

/// A complete base path x, sampled by technique t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base<F = f32> {
    /// F = f(x)/p_t(x).
    pub value: Vector<F>,
    /// Σ_s p_s(x)/p_t(x) over the techniques s, ≥ 1.
    pub densities: F,
}

/// Its offset path y = T(x). Both 0 where the shift is dead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset<F = f32> {
    /// Y = f(y)|T'|/p_t(x).
    pub value: Vector<F>,
    /// Σ_s p_s(y)|T'|/p_t(x) over the techniques s.
    pub densities: F,
}

impl<F: Float> Offset<F> {
    /// A dead shift.
    pub const DEAD: Self = Self {
        value: Vector::ZERO,
        densities: F::ZERO,
    };
}

impl<F: Float> Base<F> {
    /// What the path adds to the primal: F weighted by the balance heuristic over the techniques.
    #[inline(always)]
    pub fn primal(&self) -> Vector<F> {
        self.value / self.densities
    }

    /// What the path adds to the difference from its own pixel to the neighbour, w·(Y − F).
    #[inline(always)]
    pub fn difference(&self, shift: &Offset<F>, weights: Weights) -> Vector<F> {
        (shift.value - self.value) * self.weight(shift, weights)
    }

    /// The weight w. Over all techniques and both directions the weights of one path pair add to 1.
    #[inline(always)]
    pub fn weight(&self, shift: &Offset<F>, weights: Weights) -> F {
        match weights {
            Weights::Mis => F::ONE / (self.densities + shift.densities),
            Weights::Symmetric => {
                let valid = positive(shift.densities);
                F::select(valid, F::splat(0.5), F::ONE) / self.densities
            }
        }
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

        /// One pair of paths, four ways to make it: two techniques in each of two pixels. From each
        /// the others are seen through ratios; the weights must add to 1.
        #[test]
        fn weights_add_to_one(
            // Densities of x and of y by light and by BSDF sampling; 0 where a segment is blocked.
            light in (0.01f32..10.0, 0.01f32..10.0),
            bsdf in (prop_oneof![Just(0.0), 0.01f32..10.0], prop_oneof![Just(0.0), 0.01f32..10.0]),
            jacobian in 0.05f32..20.0,
        ) {
            for weights in [Weights::Mis, Weights::Symmetric] {
                let mut sum = 0.0;
                for (x, y, j) in [
                    ((light.0, bsdf.0), (light.1, bsdf.1), jacobian),
                    ((light.1, bsdf.1), (light.0, bsdf.0), 1.0 / jacobian),
                ] {
                    for own in [x.0, x.1] {
                        if own == 0.0 {
                            continue;
                        }
                        let base = Base { value: Vector::ONE, densities: (x.0 + x.1) / own };
                        let shift = Offset { value: Vector::ONE, densities: (y.0 + y.1) * j / own };
                        sum += base.weight(&shift, weights);
                    }
                }
                prop_assert!((sum - 1.0).abs() < 1e-5, "{weights:?}: {sum}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(2), failure_persistence: None, ..Default::default() })]

        /// w(Y − F) lies between −F and Y, each weighted as path tracing weighs it: no sample of a difference
        /// is larger than what one of the two paths is worth to the primal of its pixel.
        #[test]
        fn differences_are_bounded_by_the_primals_of_both_paths(
            (f, y) in (0.0f32..1e6, 0.0f32..1e6),
            (own, shifted) in (1.0f32..1e4, 1e-6f32..1e6),
        ) {
            let base = Base::<f32> { value: Vector::grey(f), densities: own };
            let shift = Offset { value: Vector::grey(y), densities: shifted };
            let difference = base.difference(&shift, Weights::Mis).x;
            let (least, most) = (-f / own, y / shifted);
            prop_assert!(difference >= least * 1.0001 && difference <= most * 1.0001);

            for weights in [Weights::Mis, Weights::Symmetric] {
                let lanes = Base::<f32x8> { value: Vector::splat(base.value.into()), densities: f32x8::splat(own) };
                let there = Offset { value: Vector::splat(shift.value.into()), densities: f32x8::splat(shifted) };
                prop_assert_eq!(lanes.primal().lane(3), base.primal().into());
                prop_assert_eq!(lanes.difference(&there, weights).lane(4), base.difference(&shift, weights).into());
                let dead = lanes.difference(&Offset::DEAD, weights).lane(7);
                prop_assert_eq!(dead, base.difference(&Offset::DEAD, weights).into());
            }
        }
    }

    #[test]
    fn a_dead_shift_leaves_all_the_weight_to_its_base() {
        let base = Base::<f32> {
            value: Vector::grey(3.0),
            densities: 1.5,
        };
        for weights in [Weights::Mis, Weights::Symmetric] {
            assert_eq!(
                Vec3::from(base.difference(&Offset::DEAD, weights)),
                Vec3::splat(-2.0)
            );
        }
    }
}
