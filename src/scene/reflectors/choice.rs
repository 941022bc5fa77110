//! The choice of the reflectors by which a point is connected to a light, by what they may show it.

use super::plane::Plane;
use super::{Form, MANY, PAIRS, Reflector, Reflectors, Sequence, Targets};
use crate::bsdf::fresnel;
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, positive};
use wide::f32x8;

/// What has been chosen for eight points.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// The reflectors, in the lanes with a choice.
    pub by: [Option<Sequence>; LANES],
    /// The probabilities of the choice.
    pub probability: f32x8,
}

/// How much less a patch of nearly smooth metal is chosen where only microfacets that are turned far may show something.
const BY_CHANCE: f32 = 0.1;

/// How much less a side of glass is chosen where only other ways may show something than those through a slab across it.
const ACROSS_BY_CHANCE: f32 = 0.1;

/// Weights of singles, then of pairs, and their sum.
struct Weights {
    each: [f32x8; MANY + PAIRS],
    total: f32x8,
}

impl Reflectors {
    /// Reflectors that may show the targets to the points `from` in `lanes`, with `u` in [0, 1), and their
    /// probabilities: none where there is nothing to choose or, unless it shall be `always`, the more often the less
    /// they may show.
    pub fn choose(
        &self,
        from: Vec3x8,
        targets: &Targets<f32x8>,
        lanes: u32,
        u: f32x8,
        always: bool,
    ) -> Choice {
        let mut choice = Choice {
            by: [None; LANES],
            probability: f32x8::ZERO,
        };
        if let Some(grid) = &self.grid {
            for lane in lanes_of(lanes) {
                let (chosen, probability) = grid.choose(from.lane(lane), u.lane(lane));
                if self.one_shows(chosen, from, targets, lane) > 0.0 {
                    choice.by[lane] = Some(Sequence::of(chosen as u32));
                    choice.probability.set_lane(lane, probability);
                }
            }
            return choice;
        }
        let weights = self.weights(from, targets);
        let whole = self.whole(weights.total, always);
        let mut rest = u * whole;
        let mut open = lanes & positive(weights.total).to_bitmask();
        for (index, &weight) in weights.each.iter().take(self.candidates()).enumerate() {
            let chosen = open & rest.simd_lt(weight).to_bitmask();
            for lane in lanes_of(chosen) {
                choice.by[lane] = self.candidate(index);
                choice
                    .probability
                    .set_lane(lane, weight.lane(lane) / whole.lane(lane));
            }
            open &= !chosen;
            if open == 0 {
                break;
            }
            rest -= weight;
        }
        choice
    }

    /// The probabilities of choosing the reflectors `by`.
    pub fn probability(
        &self,
        by: &[Option<Sequence>; LANES],
        from: Vec3x8,
        targets: &Targets<f32x8>,
        always: bool,
    ) -> f32x8 {
        let number = |by: &Sequence| match *by.numbers() {
            [r] => Some(r as usize),
            [a, b] => {
                let pair = self.pairs.binary_search(&[a, b]).ok()?;
                Some(self.list.len() + pair)
            }
            _ => None,
        };
        let weights = self.grid.is_none().then(|| self.weights(from, targets));
        f32x8::from_lanes(|lane| {
            let Some(number) = by[lane].as_ref().and_then(number) else {
                return 0.0;
            };
            match (&weights, &self.grid) {
                (Some(weights), _) => {
                    let weight = weights.each[number].lane(lane);
                    if weight > 0.0 {
                        weight / self.whole(weights.total, always).lane(lane)
                    } else {
                        0.0
                    }
                }
                (None, Some(grid)) if self.one_shows(number, from, targets, lane) > 0.0 => {
                    grid.probability(number, from.lane(lane))
                }
                _ => 0.0,
            }
        })
    }

    /// What weights are divided by, whose sum this is.
    #[inline(always)]
    fn whole(&self, total: f32x8, always: bool) -> f32x8 {
        if always {
            total
        } else {
            total.larger(f32x8::splat(self.worth))
        }
    }

    fn candidates(&self) -> usize {
        self.list.len() + self.pairs.len()
    }

    fn candidate(&self, index: usize) -> Option<Sequence> {
        match index.checked_sub(self.list.len()) {
            None => Some(Sequence::of(index as u32)),
            Some(pair) => {
                let [a, b] = self.pairs[pair];
                Sequence::of(a).and(b)
            }
        }
    }

    fn weights(&self, from: Vec3x8, targets: &Targets<f32x8>) -> Weights {
        let mut weights = Weights {
            each: [f32x8::ZERO; MANY + PAIRS],
            total: f32x8::ZERO,
        };
        let mut to = weights.each.iter_mut();
        let mut put = |weight: f32x8| {
            weights.total += weight;
            if let Some(to) = to.next() {
                *to = weight;
            }
        };
        for reflector in &self.list {
            put(reflector.shows(from, targets));
        }
        for &[a, b] in &self.pairs {
            let [a, b] = [a, b].map(|r| &self.list[r as usize]);
            put(match (&a.form, &b.form) {
                (Form::Plane(first), Form::Plane(second)) => {
                    let (p, shows) = first.shows(from, &second.images(targets));
                    if shows.to_bitmask() == 0 {
                        f32x8::ZERO
                    } else {
                        let (q, too) = second.shows(p, targets);
                        let both = a.reflects(first, p - from) * b.reflects(second, q - p);
                        both.only(shows & too)
                    }
                }
                _ => f32x8::ZERO,
            });
        }
        weights
    }

    fn one_shows(&self, number: usize, from: Vec3x8, targets: &Targets<f32x8>, lane: usize) -> f32 {
        let from = Vec3x8::splat(from.lane(lane));
        let targets = targets.lane(lane);
        self.list[number].shows(from, &targets).lane(lane)
    }
}

impl Reflector {
    /// About how much of the targets it may show to the points `from`, in [0, 1]; 0 where it cannot.
    #[inline(always)]
    fn shows(&self, from: Vec3x8, targets: &Targets<f32x8>) -> f32x8 {
        let of_all = |share: f32| {
            let way = Vec3x8::splat(0.5 * (self.bounds.0 + self.bounds.1)) - from;
            let area = f32x8::splat(self.area);
            f32x8::splat(share) * area / (area + way.dot(way))
        };
        match &self.form {
            Form::Plane(plane) => {
                let (p, shows) = plane.shows(from, targets);
                let seen = self.reflects(plane, p - from).only(shows);
                // From where the plane does not show them, light is bent on its way there, or spread a little.
                if self.is_across {
                    let mut seen = seen;
                    for slab in &self.across {
                        let ways = slab.ways_by(plane, from, targets);
                        seen = seen.larger(slab.reflected(&ways).only(ways.valid));
                    }
                    seen.larger(of_all(if self.across.is_empty() { 1.0 } else { ACROSS_BY_CHANCE }))
                } else if self.alpha > 0.0 {
                    seen.larger(of_all(self.reflectance))
                } else {
                    seen
                }
            }
            Form::Curved(curved) => match &curved.patch {
                None => of_all(self.reflectance),
                Some(patch) => {
                    let seen = of_all(self.reflectance).only(patch.shows(from, targets));
                    if self.alpha > 0.0 {
                        seen.larger(of_all(BY_CHANCE * self.reflectance))
                    } else {
                        seen
                    }
                }
            },
        }
    }

    /// About what a plane reflects of light that comes along `way`.
    #[inline(always)]
    fn reflects(&self, plane: &Plane, way: Vec3x8) -> f32x8 {
        let least = f32x8::splat(self.reflectance);
        if self.is_metal {
            return least;
        }
        let cos = Vec3x8::splat(plane.normal).dot(way.normalize()).abs();
        least + (f32x8::ONE - least) * fresnel::fifth_power(f32x8::ONE - cos)
    }
}
