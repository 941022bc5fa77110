//! A choice among many lights by what they may give to a point: a tree over the lights, descended at
//! random by bounds on power, distance and direction (Conty Estevez and Kulla 2018; the bounds are those of
//! Pharr, Jakob and Humphreys 2023, section 12.6.3).

use glam::Vec3;

/// What the tree needs to know of a light.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    /// Smallest and largest coordinates.
    pub bounds: (Vec3, Vec3),
    /// Unit normal of the side that emits.
    pub normal: Vec3,
    /// Power, ≥ 0.
    pub power: f64,
}

/// The tree.
#[derive(Clone, Debug)]
pub struct LightTree {
    /// The root first; an inner node's first child follows it.
    nodes: Vec<Node>,
    /// By light: the way from the root, a bit for each step, the lowest first.
    trails: Vec<u64>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    centre: Vec3,
    /// Of the sphere around the bounds.
    radius: f32,
    /// A cone that holds all normals; its half angle's cosine and sine.
    axis: Vec3,
    cos: f32,
    sin: f32,
    power: f32,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Leaf { light: u32 },
    Inner { second: u32 },
}

impl Node {
    /// About the most that the lights of the node may give to `p`; 0 only where they give nothing.
    #[inline]
    fn importance(&self, p: Vec3) -> f32 {
        let d = p - self.centre;
        let distance2 = d.length_squared();
        // Near by, the distance to the centre says little.
        let attenuation = self.power
            / distance2
                .max(self.radius * self.radius)
                .max(f32::MIN_POSITIVE);
        if distance2 <= self.radius * self.radius {
            return attenuation;
        }
        // The cosine of the least angle between a normal and the direction to `p`: from the angle to the
        // axis the cone's half angle is taken off, and the angle under which the sphere is seen.
        let cos_axis = self.axis.dot(d) / distance2.sqrt();
        let sin_axis = (1.0 - cos_axis * cos_axis).max(0.0).sqrt();
        let sin_sphere2 = self.radius * self.radius / distance2;
        let (sin_sphere, cos_sphere) = (sin_sphere2.sqrt(), (1.0 - sin_sphere2).max(0.0).sqrt());
        let minus = |(cos_a, sin_a): (f32, f32), (cos_b, sin_b): (f32, f32)| {
            if cos_a > cos_b {
                (1.0, 0.0)
            } else {
                (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b)
            }
        };
        let least = minus((cos_axis, sin_axis), (self.cos, self.sin));
        let (cos, _) = minus(least, (cos_sphere, sin_sphere));
        // A little more, so that rounding never makes a light that gives something invisible.
        (attenuation * (cos + 1e-3)).max(0.0)
    }
}

impl LightTree {
    /// The tree over `emitters`, of which there is at least one.
    pub fn new(emitters: &[Emitter]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * emitters.len()),
            trails: vec![0; emitters.len()],
        };
        let mut order: Vec<u32> = (0..emitters.len() as u32).collect();
        tree.build(emitters, &mut order, 0, 0);
        tree
    }

    fn build(&mut self, emitters: &[Emitter], lights: &mut [u32], trail: u64, depth: u32) {
        let of = |light: &u32| &emitters[*light as usize];
        let (low, high) = lights
            .iter()
            .map(of)
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), e| {
                (low.min(e.bounds.0), high.max(e.bounds.1))
            });
        let sum: Vec3 = lights.iter().map(|l| of(l).normal).sum();
        let axis = sum.try_normalize().unwrap_or(Vec3::Z);
        let cos = lights
            .iter()
            .map(|l| of(l).normal.dot(axis))
            .fold(1.0, f32::min)
            .max(-1.0);
        let power: f64 = lights.iter().map(|l| of(l).power).sum();
        let index = self.nodes.len();
        self.nodes.push(Node {
            centre: 0.5 * (low + high),
            radius: 0.5 * (high - low).length(),
            axis,
            cos,
            sin: (1.0 - cos * cos).max(0.0).sqrt(),
            power: power as f32,
            kind: Kind::Leaf { light: lights[0] },
        });
        if let [light] = lights {
            self.trails[*light as usize] = trail;
            return;
        }
        // Two halves along the longest side.
        let size = high - low;
        let along = |l: &u32| {
            let middle = of(l).bounds.0 + of(l).bounds.1;
            match size.max_element() {
                most if size.x == most => middle.x,
                most if size.y == most => middle.y,
                _ => middle.z,
            }
        };
        lights.sort_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        let (first, second) = lights.split_at_mut(lights.len() / 2);
        self.build(emitters, first, trail, depth + 1);
        let kind = Kind::Inner {
            second: self.nodes.len() as u32,
        };
        self.nodes[index].kind = kind;
        self.build(emitters, second, trail | 1 << depth, depth + 1);
    }

    /// Probability of going on to the first child, seen from `p`; `None` where neither gives anything.
    #[inline]
    fn first(&self, p: Vec3, node: usize, second: u32) -> Option<f32> {
        let first = self.nodes[node + 1].importance(p);
        let both = first + self.nodes[second as usize].importance(p);
        (both > 0.0).then(|| first / both)
    }

    /// A light for the point `p` with `u` in [0, 1), and its probability. `None` where no light reaches it.
    #[inline]
    pub fn choose(&self, p: Vec3, mut u: f32) -> Option<(usize, f32)> {
        let (mut node, mut probability) = (0, 1.0);
        loop {
            match self.nodes[node].kind {
                Kind::Leaf { light } => return Some((light as usize, probability)),
                Kind::Inner { second } => {
                    let first = self.first(p, node, second)?;
                    if u < first {
                        u /= first;
                        probability *= first;
                        node += 1;
                    } else {
                        u = ((u - first) / (1.0 - first)).min(1.0 - f32::EPSILON);
                        probability *= 1.0 - first;
                        node = second as usize;
                    }
                }
            }
        }
    }

    /// The probability of choosing `light` for `p`.
    #[inline]
    pub fn probability(&self, light: usize, p: Vec3) -> f32 {
        let mut trail = self.trails[light];
        let (mut node, mut probability) = (0, 1.0);
        while let Kind::Inner { second } = self.nodes[node].kind {
            let Some(first) = self.first(p, node, second) else {
                return 0.0;
            };
            if trail & 1 == 0 {
                probability *= first;
                node += 1;
            } else {
                probability *= 1.0 - first;
                node = second as usize;
            }
            trail >>= 1;
        }
        probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn emitters() -> impl Strategy<Value = Vec<Emitter>> {
        let vector = || (-1f32..1.0, -1f32..1.0, -1f32..1.0).prop_map(Vec3::from);
        let emitter =
            (vector(), vector(), vector(), 0.1f64..10.0).prop_map(|(a, size, n, power)| {
                let b = a + 0.2 * size;
                Emitter {
                    bounds: (a.min(b), a.max(b)),
                    normal: n.try_normalize().unwrap_or(Vec3::X),
                    power,
                }
            });
        proptest::collection::vec(emitter, 1..40)
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 300, rng_seed: RngSeed::Fixed(5), failure_persistence: None, ..Default::default()
        })]

        #[test]
        fn probabilities_add_to_one_and_are_those_of_the_choice(
            emitters in emitters(), x in -2f32..2.0, y in -2f32..2.0, z in -2f32..2.0
        ) {
            let tree = LightTree::new(&emitters);
            let p = Vec3::new(x, y, z);
            let sum: f32 = (0..emitters.len()).map(|l| tree.probability(l, p)).sum();
            if tree.choose(p, 0.5).is_some() {
                // Branches into which nothing shines are left out of what is shared among the rest.
                prop_assert!(sum < 1.0 + 1e-4);
            }
            let mut found = 0.0;
            for i in 0..64 {
                if let Some((light, probability)) = tree.choose(p, (i as f32 + 0.5) / 64.0) {
                    prop_assert!((probability - tree.probability(light, p)).abs() <= 1e-6 * probability);
                    prop_assert!(probability > 0.0);
                    found += 1.0 / 64.0;
                }
            }
            prop_assert!((found - sum).abs() < 0.05, "{} {}", found, sum);
        }

        #[test]
        fn a_light_that_shines_on_a_point_can_be_chosen(
            emitters in emitters(), x in -2f32..2.0, y in -2f32..2.0, z in -2f32..2.0
        ) {
            let tree = LightTree::new(&emitters);
            let p = Vec3::new(x, y, z);
            for (light, e) in emitters.iter().enumerate() {
                let corners = (0..8).map(|c| Vec3::new(
                    if c & 1 == 0 { e.bounds.0.x } else { e.bounds.1.x },
                    if c & 2 == 0 { e.bounds.0.y } else { e.bounds.1.y },
                    if c & 4 == 0 { e.bounds.0.z } else { e.bounds.1.z },
                ));
                if corners.map(|c| (p - c).dot(e.normal)).any(|cos| cos > 1e-4) {
                    prop_assert!(tree.probability(light, p) > 0.0, "light {}", light);
                }
            }
        }
    }
}
