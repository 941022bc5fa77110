//! A choice among many lights by what they may give to a point. Space is divided into cells; each knows the
//! lights that matter most to it. One of those is chosen, or now and then any light by power, so that none
//! is left out and a choice takes constant time. (A tree of bounds, descended at every point, gives better
//! choices, but takes longer than it saves: base and offset paths ask for many probabilities.)

use super::alias::{Alias, Bin};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// What the grid needs to know of a light.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    /// Smallest and largest coordinates.
    pub bounds: (Vec3, Vec3),
    /// Unit normal of the side that emits; without one it shines to all sides.
    pub normal: Option<Vec3>,
    /// Power, ≥ 0.
    pub power: f64,
}

/// The grid.
#[derive(Debug)]
pub struct LightGrid {
    low: Vec3,
    /// Cells for a unit of length, along each axis.
    per_length: Vec3,
    counts: [usize; 3],
    cells: Vec<Cell>,
    /// What the cells know, one after the other: a choice shall touch as little memory as may be.
    known: Vec<Known>,
    /// The numbers of their lights once more, close together, to search among.
    numbers: Vec<u32>,
    /// The choice among all lights, and their shares of the power.
    all: Alias,
    shares: Vec<f32>,
}

/// What matters to a cell.
#[derive(Debug)]
struct Cell {
    /// Probability of choosing among the lights that it knows rather than among all.
    near: f32,
    /// Those lights, in [`LightGrid::known`].
    known: Range<u32>,
}

/// A light that a cell knows; they are in ascending order.
#[derive(Debug)]
struct Known {
    /// For the choice among them.
    bin: Bin,
    light: u32,
    /// Its probability once the choice is among them.
    share: f32,
}

/// Lights that a cell knows.
const NEAR: usize = 64;
/// Most cells, and most pairs of a cell and a light: what making the grid may cost.
const CELLS: f64 = 32_768.0;
const PAIRS: f64 = 134_217_728.0;
/// Least probability of choosing among all lights.
const ALL: f32 = 0.05;

impl LightGrid {
    /// The grid over a scene with these bounds. There is at least one emitter with power.
    pub fn new(emitters: &[Emitter], (low, high): (Vec3, Vec3)) -> Self {
        let cells = (PAIRS / emitters.len() as f64).clamp(64.0, CELLS);
        let size = (high - low).max(Vec3::splat(1e-3 * (high - low).max_element()));
        // Cells as cubic as may be.
        let volume = f64::from(size.x) * f64::from(size.y) * f64::from(size.z);
        let side = (volume / cells).cbrt() as f32;
        let counts = size
            .to_array()
            .map(|s| ((s / side).round() as usize).max(1));
        let count = Vec3::new(counts[0] as f32, counts[1] as f32, counts[2] as f32);
        let step = size / count;
        let radius = 0.5 * step.length();
        let powers: Vec<f64> = emitters.iter().map(|e| e.power).collect();
        let total: f64 = powers.iter().sum();
        let knowledge: Vec<(f32, Vec<Known>)> = (0..counts.iter().product())
            .into_par_iter()
            .map(|index: usize| {
                let (x, rest) = (index % counts[0], index / counts[0]);
                let (y, z) = (rest % counts[1], rest / counts[1]);
                let place = Vec3::new(x as f32, y as f32, z as f32) + 0.5;
                know(emitters, low + step * place, radius)
            })
            .collect();
        let (mut cells, mut known) = (Vec::with_capacity(knowledge.len()), Vec::new());
        for (near, lights) in knowledge {
            let first = known.len() as u32;
            known.extend(lights);
            cells.push(Cell {
                near,
                known: first..known.len() as u32,
            });
        }
        Self {
            low,
            per_length: count / size,
            counts,
            cells,
            numbers: known.iter().map(|k: &Known| k.light).collect(),
            known,
            all: Alias::new(&powers),
            shares: powers.iter().map(|p| (p / total) as f32).collect(),
        }
    }

    /// The cell of a point; outside of the grid the nearest one.
    #[inline]
    fn cell(&self, p: Vec3) -> &Cell {
        let place = (p - self.low) * self.per_length;
        // A cast of what is negative or not a number is 0.
        let along = |axis: usize| (place[axis] as usize).min(self.counts[axis] - 1);
        &self.cells[along(0) + self.counts[0] * (along(1) + self.counts[1] * along(2))]
    }

    /// The lights that a cell knows.
    #[inline]
    fn known(&self, cell: &Cell) -> &[Known] {
        &self.known[cell.known.start as usize..cell.known.end as usize]
    }

    /// A light for the point `p` with `u` in [0, 1), and its probability.
    #[inline]
    pub fn choose(&self, p: Vec3, u: f32) -> (usize, f32) {
        let cell = self.cell(p);
        if u < cell.near {
            let known = self.known(cell);
            let chosen = &known[Bin::choose(known, |k| k.bin, u / cell.near)];
            let light = chosen.light as usize;
            return (light, self.both_ways(cell, light, chosen.share));
        }
        let u = (u - cell.near) / (1.0 - cell.near);
        let light = self.all.choose(u.min(1.0 - f32::EPSILON));
        (light, self.probability_in(cell, light))
    }

    /// The probability of choosing `light` for `p`.
    #[inline]
    pub fn probability(&self, light: usize, p: Vec3) -> f32 {
        self.probability_in(self.cell(p), light)
    }

    #[inline]
    fn probability_in(&self, cell: &Cell, light: usize) -> f32 {
        // All at once: the steps of a binary search would each wait for memory.
        let first = cell.known.start as usize;
        let numbers = &self.numbers[first..cell.known.end as usize];
        let smaller = numbers.iter().map(|&n| u32::from(n < light as u32));
        let place = smaller.sum::<u32>() as usize;
        let share = match numbers.get(place) {
            Some(&number) if number == light as u32 => self.known[first + place].share,
            _ => 0.0,
        };
        self.both_ways(cell, light, share)
    }

    /// The probability of a light which has this share of those that the cell knows.
    #[inline]
    fn both_ways(&self, cell: &Cell, light: usize, share: f32) -> f32 {
        cell.near * share + (1.0 - cell.near) * self.shares[light]
    }
}

/// What the cell around `centre` within `radius` knows: the probability of choosing among lights, and these.
fn know(emitters: &[Emitter], centre: Vec3, radius: f32) -> (f32, Vec<Known>) {
    let mut all: Vec<(f32, u32)> = (0..)
        .zip(emitters)
        .map(|(light, e)| (e.importance(centre, radius), light))
        .collect();
    let whole: f64 = all.iter().map(|a| f64::from(a.0)).sum();
    if all.len() > NEAR {
        // By importance, then by number.
        let order = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        all.select_nth_unstable_by(NEAR - 1, order);
        all.truncate(NEAR);
    }
    all.sort_unstable_by_key(|a| a.1);
    let weights: Vec<f64> = all.iter().map(|a| f64::from(a.0)).collect();
    let sum: f64 = weights.iter().sum();
    if sum <= 0.0 {
        // Nothing is known here: all lights by power.
        return (0.0, Vec::new());
    }
    let bins = Alias::new(&weights).into_bins();
    let known = bins.into_iter().zip(&all).zip(&weights);
    let known = known.map(|((bin, &(_, light)), weight)| Known {
        bin,
        light,
        share: (weight / sum) as f32,
    });
    (((sum / whole) as f32).min(1.0 - ALL), known.collect())
}

impl Emitter {
    /// About what the light gives to the points within `radius` of `centre`: power over distance squared,
    /// times the cosine at the light, generously.
    fn importance(&self, centre: Vec3, radius: f32) -> f32 {
        let (low, high) = self.bounds;
        let reach = radius.max(0.5 * (high - low).length());
        let d = centre - 0.5 * (low + high);
        let distance = d.length().max(reach);
        let cos = match self.normal {
            Some(normal) => (normal.dot(d) + reach) / distance,
            None => 1.0,
        };
        self.power as f32 * cos.clamp(0.02, 1.0) / (distance * distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn emitters() -> impl Strategy<Value = Vec<Emitter>> {
        let vector = || (-1f32..1.0, -1f32..1.0, -1f32..1.0).prop_map(Vec3::from);
        let emitter = (vector(), vector(), vector(), 0f64..10.0).prop_map(|(a, size, n, power)| {
            let b = a + 0.2 * size;
            Emitter {
                bounds: (a.min(b), a.max(b)),
                normal: n.try_normalize(),
                power: power + 1e-3,
            }
        });
        proptest::collection::vec(emitter, 1..200)
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 20, rng_seed: RngSeed::Fixed(5), failure_persistence: None, ..Default::default()
        })]

        #[test]
        fn probabilities_are_those_of_the_choice(
            emitters in emitters(), x in -2f32..2.0, y in -2f32..2.0, z in -2f32..2.0
        ) {
            let grid = LightGrid::new(&emitters, (Vec3::NEG_ONE, Vec3::ONE));
            let p = Vec3::new(x, y, z);
            let expected: Vec<f32> = (0..emitters.len()).map(|l| grid.probability(l, p)).collect();
            prop_assert!(expected.iter().all(|&p| p > 0.0));
            prop_assert!((expected.iter().sum::<f32>() - 1.0).abs() < 1e-4);
            let mut found = vec![0.0; emitters.len()];
            const STEPS: usize = 1 << 14;
            for i in 0..STEPS {
                let (light, probability) = grid.choose(p, (i as f32 + 0.5) / STEPS as f32);
                prop_assert_eq!(probability, expected[light]);
                found[light] += 1.0 / STEPS as f32;
            }
            // Two tables, of which each interval begins and ends somewhere between two steps.
            for (found, expected) in found.iter().zip(&expected) {
                let bins = 2.0 * (NEAR + emitters.len()) as f32;
                prop_assert!((found - expected).abs() < bins / STEPS as f32, "{} {}", found, expected);
            }
        }
    }
}
