//! The choice of the reflectors by which a point is connected to a light, by what they may show it.

use super::course::COURSES;
use super::plane::Plane;
use super::{Form, MANY, PAIRS, Reflector, Reflectors, Sequence, Targets};
use crate::bsdf::fresnel;
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, positive};
use glam::Vec3;
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

/// How much less a side of glass is chosen where only other ways may show something than those by courses inside a slab.
const ACROSS_BY_CHANCE: f32 = 0.1;

/// Most singles, pairs and courses.
const CANDIDATES: usize = MANY + PAIRS + COURSES;

/// Weights of singles, then of pairs, then of courses, and their sum.
struct Weights {
    each: [f32x8; CANDIDATES],
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
                choice.by[lane] = self.candidate(index, from.lane(lane), &targets.single(lane));
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
        let weights = self.grid.is_none().then(|| self.weights(from, targets));
        f32x8::from_lanes(|lane| {
            let Some((by, number)) = by[lane].and_then(|by| Some((by, self.number(&by)?))) else {
                return 0.0;
            };
            match (&weights, &self.grid) {
                (Some(weights), _) => {
                    let weight = weights.each[number].lane(lane);
                    // A course may go by the same in another order.
                    let from = from.lane(lane);
                    let is_it = || self.candidate(number, from, &targets.single(lane)) == Some(by);
                    if weight > 0.0 && is_it() {
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

    /// The place among the candidates of what goes by these reflectors, if it is one.
    fn number(&self, by: &Sequence) -> Option<usize> {
        let singles = self.list.len();
        if let &[r] = by.numbers() {
            return Some(r as usize);
        }
        let course = || self.courses.iter().position(|c| c.has(by.numbers()));
        let pair = by.numbers().try_into().ok();
        match pair.and_then(|pair: [u32; 2]| self.pairs.binary_search(&pair).ok()) {
            Some(pair) => Some(singles + pair),
            None => Some(singles + self.pairs.len() + course()?),
        }
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
        self.list.len() + self.pairs.len() + self.courses.len()
    }

    /// What a candidate is for a point and a target; of courses the way that there is tells.
    fn candidate(&self, index: usize, from: Vec3, target: &Targets<f32>) -> Option<Sequence> {
        let Some(index) = index.checked_sub(self.list.len()) else {
            return Some(Sequence::of(index as u32));
        };
        match index.checked_sub(self.pairs.len()) {
            None => {
                let [a, b] = self.pairs[index];
                Sequence::of(a).and(b)
            }
            Some(index) => self.courses[index].sequence(from, target),
        }
    }

    fn weights(&self, from: Vec3x8, targets: &Targets<f32x8>) -> Weights {
        let mut weights = Weights {
            each: [f32x8::ZERO; CANDIDATES],
            total: f32x8::ZERO,
        };
        let mut to = weights.each.iter_mut();
        let mut put = |weight: f32x8| {
            weights.total += weight;
            if let Some(to) = to.next() {
                *to = weight;
            }
        };
        for (number, reflector) in (0..).zip(&self.list) {
            put(reflector.shows(number, from, targets));
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
        for course in &self.courses {
            let ways = course.ways(from, targets);
            put(ways.reflected.only(ways.valid));
        }
        weights
    }

    fn one_shows(&self, number: usize, from: Vec3x8, targets: &Targets<f32x8>, lane: usize) -> f32 {
        let from = Vec3x8::splat(from.lane(lane));
        let targets = targets.lane(lane);
        self.list[number]
            .shows(number as u32, from, &targets)
            .lane(lane)
    }
}

impl Reflector {
    /// About how much of the targets it may show to the points `from`, in [0, 1]; 0 where it cannot.
    #[inline(always)]
    fn shows(&self, number: u32, from: Vec3x8, targets: &Targets<f32x8>) -> f32x8 {
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
                let seen = seen.larger(self.shows_inside(number, from, targets));
                if self.is_across {
                    let by_chance = if self.courses.is_empty() {
                        1.0
                    } else {
                        ACROSS_BY_CHANCE
                    };
                    seen.larger(of_all(by_chance))
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
        if self.is_metal {
            return f32x8::splat(self.reflectance);
        }
        let cos = Vec3x8::splat(plane.normal).dot(way.normalize()).abs();
        fresnel::schlick_grey(self.reflectance, cos)
    }
}
