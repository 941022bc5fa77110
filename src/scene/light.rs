//! Light sources: triangles that emit, chosen in proportion to their power, and the environment's map.

use super::Scene;
use super::alias::Alias;
use super::environment::SkySample;
use super::light_grid::{Emitter, LightGrid};
use super::material::Material;
use super::mesh::Mesh;
use super::reflectors::Target;
use crate::lanes::{Float, LANES, Vec3x8, lanes_of};
use crate::warp;
use glam::Vec3;
use wide::f32x8;

/// What is sampled as a light.
#[derive(Debug, Default)]
pub struct Lights {
    /// In the order of their triangles.
    triangles: Vec<LightTriangle>,
    choice: Choice,
    /// Probability of sampling the environment's map in place of a triangle; 0 where there is none.
    sky: f32,
    /// Whether there are but a few triangles with one radiance each.
    plain: bool,
}

/// How one of the triangles is chosen.
#[derive(Debug)]
enum Choice {
    /// By power.
    Power(Alias),
    /// By what it may give to the point that is lit.
    Place(LightGrid),
}

impl Default for Choice {
    fn default() -> Self {
        Choice::Power(Alias::default())
    }
}

/// From this many emitting triangles on the choice is by place.
const MANY: usize = 64;

#[derive(Clone, Copy, Debug)]
struct LightTriangle {
    corners: [Vec3; 3],
    ng: Vec3,
    /// Where it is not textured.
    radiance: Vec3,
    /// Density of sampled points per area, over all lights; with a choice by place, once the triangle is chosen.
    density: f32,
    offset: f32,
    triangle: u32,
    textured: bool,
}

/// Sampled points on lights, or directions to the environment.
#[derive(Clone, Copy, Debug)]
pub struct LightSamplesX8 {
    /// Where they are; of samples of the sky their directions.
    pub position: Vec3x8,
    /// The sides that emit.
    pub ng: Vec3x8,
    /// Radiance emitted to those sides, or from those directions.
    pub radiance: Vec3x8,
    /// Densities per area, or per solid angle, over all lights.
    pub density: f32x8,
    /// Distances by which rays end before the surfaces.
    pub offset: f32x8,
    /// Where there is a sample.
    pub holds: f32x8,
    /// The triangles; nothing for samples of the sky.
    triangle: [u32; LANES],
    /// A bit for each lane with a sample of the sky.
    pub sky: u32,
}

/// A point on a light, or a direction to the environment's map, however it was found.
#[derive(Clone, Copy, Debug)]
pub struct LightEnd {
    /// Where it is.
    pub target: Target,
    /// Radiance from there.
    pub radiance: Vec3,
    /// Its triangle, if it is on one.
    pub triangle: Option<u32>,
}

/// Probability of the environment where there are emitting triangles too. Which of them gives more light
/// differs from point to point.
const SKY_AMONG_LIGHTS: f32 = 0.5;

impl Lights {
    /// The lights among the triangles of `mesh`, beside the environment's map if `has_map`.
    pub fn new(mesh: &Mesh, materials: &[Material], has_map: bool) -> Self {
        let mut triangles = Vec::new();
        let mut powers = Vec::new();
        for (index, &material) in mesh.material_of.iter().enumerate() {
            let material = &materials[material as usize];
            let Some(radiance) = material.emission else {
                continue;
            };
            let index = index as u32;
            let textured = material.emission_map().is_some() || mesh.has_holes(index);
            let mean = if textured {
                mean_radiance(mesh, material, index)
            } else {
                radiance
            };
            let point = mesh.point(index, 1.0 / 3.0, 1.0 / 3.0);
            // Power is area times weight.
            powers.push(f64::from(mesh.area(index)) * f64::from(weight(mean)));
            triangles.push(LightTriangle {
                corners: mesh.corners(index),
                ng: point.ng,
                radiance,
                density: weight(mean),
                offset: point.offset,
                triangle: index,
                textured,
            });
        }
        let total: f64 = powers.iter().sum();
        if total <= 0.0 {
            return Self {
                sky: if has_map { 1.0 } else { 0.0 },
                plain: !has_map,
                ..Self::default()
            };
        }
        let sky = if has_map { SKY_AMONG_LIGHTS } else { 0.0 };
        let choice = if triangles.len() < MANY {
            for light in &mut triangles {
                light.density = (f64::from(light.density) / total * f64::from(1.0 - sky)) as f32;
            }
            Choice::Power(Alias::new(&powers))
        } else {
            for light in &mut triangles {
                let per_area = (1.0 - sky) / mesh.area(light.triangle);
                // What is too small for its area to be a number is not sampled.
                light.density = if per_area.is_finite() { per_area } else { 0.0 };
            }
            let emitters: Vec<Emitter> = std::iter::zip(&triangles, &powers)
                .map(|(light, &power)| Emitter {
                    bounds: light.bounds(),
                    normal: light.ng,
                    power,
                })
                .collect();
            Choice::Place(LightGrid::new(&emitters, mesh.bounds))
        };
        let plain = matches!(choice, Choice::Power(_))
            && sky == 0.0
            && triangles.iter().all(|light| !light.textured);
        Self {
            triangles,
            choice,
            sky,
            plain,
        }
    }

    /// Whether nothing is sampled as a light.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.sky == 0.0
    }

    /// Number of emitting triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Density per area with which a point on this triangle is sampled for the point `from`; 0 where it
    /// does not emit.
    #[inline]
    pub fn density(&self, triangle: u32, from: Vec3) -> f32 {
        let found = self
            .triangles
            .binary_search_by_key(&triangle, |t| t.triangle);
        match (found, &self.choice) {
            (Err(_), _) => 0.0,
            (Ok(light), Choice::Power(_)) => self.triangles[light].density,
            (Ok(light), Choice::Place(grid)) => {
                self.triangles[light].density * grid.probability(light, from)
            }
        }
    }

    /// A triangle for the point `from`, and its probability, which may be inside its density; with `u` from
    /// [`Lights::sky`] to 1.
    #[inline]
    fn choose(&self, from: Vec3, u: f32) -> (usize, f32) {
        let u = (u - self.sky) / (1.0 - self.sky);
        match &self.choice {
            Choice::Power(table) => (table.choose(u), 1.0),
            Choice::Place(grid) => grid.choose(from, u),
        }
    }

    /// Whether there are but a few triangles with one radiance each.
    pub fn are_plain(&self) -> bool {
        self.plain
    }

    /// Whether the density depends on the point that is lit.
    #[inline]
    pub fn depend_on_place(&self) -> bool {
        matches!(self.choice, Choice::Place(_))
    }

    /// Probability of sampling the environment's map.
    #[inline]
    pub fn sky(&self) -> f32 {
        self.sky
    }
}

impl Scene {
    /// Draws points on lights that may light the points `from` in `lanes`, or directions to the environment, with `u`
    /// in [0, 1)³: the light (0) and the point on it (1, 2). There must be a light. It does not hold where no light
    /// comes from there. `PLAIN`: the lights are plain.
    #[inline(always)]
    pub fn sample_lights<const PLAIN: bool>(
        &self,
        from: Vec3x8,
        lanes: u32,
        u: [f32x8; 3],
    ) -> LightSamplesX8 {
        let lights = &self.lights;
        match &lights.choice {
            Choice::Power(table) if PLAIN || lights.plain => {
                let mut chosen = [&lights.triangles[0]; LANES];
                for (light, &u) in chosen.iter_mut().zip(u[0].as_array()) {
                    *light = &lights.triangles[table.choose(u)];
                }
                LightSamplesX8::new(&chosen, f32x8::ONE, [u[1], u[2]])
            }
            _ if PLAIN => panic!("the lights are plain"),
            _ => self.sample_lights_among_many(from, lanes, u),
        }
    }

    /// Density of light sampling at the point `from`: per area at the point on a light, or per solid angle.
    #[inline]
    pub fn light_density(&self, end: &LightEnd, from: Vec3) -> f32 {
        match (end.triangle, end.target) {
            (Some(triangle), _) => self.lights.density(triangle, from),
            (None, Target::Direction(direction)) => {
                let map = self.environment.map();
                map.map_or(0.0, |map| self.lights.sky() * map.density(direction))
            }
            (None, Target::Point { .. }) => 0.0,
        }
    }

    // Not inlined: scenes with a few lamps shall not have it in their loops.
    #[inline(never)]
    fn sample_lights_among_many(&self, from: Vec3x8, lanes: u32, u: [f32x8; 3]) -> LightSamplesX8 {
        let lights = &self.lights;
        let mut chosen = [&LightTriangle::NONE; LANES];
        let mut probability = f32x8::ONE;
        // Samples of the sky and radiance of what is textured are taken one by one.
        let (mut sky, mut textured) = (0, 0);
        for lane in lanes_of(lanes) {
            let u0 = u[0].lane(lane);
            if u0 < lights.sky {
                sky |= 1 << lane;
                continue;
            }
            let (light, p) = lights.choose(from.lane(lane), u0);
            chosen[lane] = &lights.triangles[light];
            probability.set_lane(lane, p);
            textured |= u32::from(chosen[lane].textured) << lane;
        }
        let mut samples = LightSamplesX8::new(&chosen, probability, [u[1], u[2]]);
        for lane in lanes_of(sky) {
            let direction = [u[1], u[2]].map(|u| u.lane(lane));
            let sample = self.environment.map().and_then(|map| map.sample(direction));
            samples.set_sky(lane, sample, lights.sky);
        }
        for lane in lanes_of(textured) {
            let (b, c) = warp::triangle([u[1], u[2]].map(|u| u.lane(lane)));
            match self.textured_radiance(chosen[lane], b, c) {
                Some(radiance) => samples.radiance.set(lane, radiance),
                None => samples.holds.set_lane(lane, 0.0),
            }
        }
        samples
    }

    #[cold]
    #[inline(never)]
    fn textured_radiance(&self, light: &LightTriangle, b: f32, c: f32) -> Option<Vec3> {
        let material = self.mesh.material_of[light.triangle as usize];
        let material = &self.materials[material as usize];
        let radiance = material.radiance(&self.mesh, light.triangle, b, c);
        (radiance != Vec3::ZERO && !self.mesh.is_open(light.triangle, b, c)).then_some(radiance)
    }
}

impl LightSamplesX8 {
    /// In no lane.
    pub const NONE: Self = Self {
        position: Vec3x8::ZERO,
        ng: Vec3x8::ZERO,
        radiance: Vec3x8::ZERO,
        density: f32x8::ONE,
        offset: f32x8::ZERO,
        holds: f32x8::ZERO,
        triangle: [0; LANES],
        sky: 0,
    };

    /// Points on the triangles `chosen` with these probabilities, which may be inside their densities.
    #[inline(always)]
    fn new(chosen: &[&LightTriangle; LANES], probability: f32x8, u: [f32x8; 2]) -> Self {
        let corner = |i: usize| Vec3x8::from_lanes(|lane| chosen[lane].corners[i]);
        let (b, c) = warp::triangle(u);
        let density = f32x8::from_lanes(|lane| chosen[lane].density);
        Self {
            position: corner(0) * (f32x8::ONE - b - c) + corner(1) * b + corner(2) * c,
            ng: Vec3x8::from_lanes(|lane| chosen[lane].ng),
            radiance: Vec3x8::from_lanes(|lane| chosen[lane].radiance),
            density: density * probability,
            offset: f32x8::from_lanes(|lane| chosen[lane].offset),
            holds: density.simd_ne(f32x8::ZERO),
            sky: 0,
            triangle: chosen.map(|light| light.triangle),
        }
    }

    /// Puts a sample of the sky into a lane; `chosen` is the probability with which the sky is sampled.
    fn set_sky(&mut self, lane: usize, sample: Option<SkySample>, chosen: f32) {
        let holds = if sample.is_some() { u32::MAX } else { 0 };
        self.holds.set_lane(lane, f32::from_bits(holds));
        if let Some(sample) = sample {
            self.position.set(lane, sample.direction);
            self.radiance.set(lane, sample.radiance);
            self.density.set_lane(lane, sample.density * chosen);
            self.sky |= 1 << lane;
        }
    }

    /// The sample in a lane, if it holds.
    pub fn lane(&self, lane: usize) -> Option<LightEnd> {
        let is_sky = self.sky >> lane & 1 == 1;
        let position = self.position.lane(lane);
        let target = if is_sky {
            Target::Direction(position)
        } else {
            Target::Point {
                position,
                ng: self.ng.lane(lane),
                offset: self.offset.lane(lane),
            }
        };
        (self.holds.to_bitmask() >> lane & 1 == 1).then(|| LightEnd {
            target,
            radiance: self.radiance.lane(lane),
            triangle: (!is_sky).then_some(self.triangle[lane]),
        })
    }

    /// The densities with which light sampling at other points has the samples, in `lanes`, over those that they have.
    #[inline(never)]
    pub fn relative_density(&self, scene: &Scene, from: Vec3x8, lanes: u32) -> f32x8 {
        let mut relative = f32x8::ONE;
        for lane in lanes_of(lanes & !self.sky) {
            let density = scene.lights.density(self.triangle[lane], from.lane(lane));
            relative.set_lane(lane, density / self.density.lane(lane));
        }
        relative
    }
}

impl LightTriangle {
    /// None, in the place of one.
    const NONE: Self = Self {
        corners: [Vec3::ZERO; 3],
        ng: Vec3::ZERO,
        radiance: Vec3::ZERO,
        density: 0.0,
        offset: 0.0,
        triangle: 0,
        textured: false,
    };

    fn bounds(&self) -> (Vec3, Vec3) {
        let [a, b, c] = self.corners;
        (a.min(b).min(c), a.max(b).max(c))
    }
}

/// What a light is chosen by: the mean of its channels, so that light of any colour is sampled.
fn weight(radiance: Vec3) -> f32 {
    (radiance.x + radiance.y + radiance.z) / 3.0
}

/// The mean radiance of a textured triangle, of points spread over it. Where they all miss the light,
/// sampling by BSDF alone finds it.
fn mean_radiance(mesh: &Mesh, material: &Material, triangle: u32) -> Vec3 {
    const SIDE: usize = 8;
    let mut sum = Vec3::ZERO;
    for i in 0..SIDE * SIDE {
        let u = [i % SIDE, i / SIDE].map(|k| (k as f32 + 0.5) / SIDE as f32);
        let (b, c) = warp::triangle(u);
        if !mesh.is_open(triangle, b, c) {
            sum += material.radiance(mesh, triangle, b, c);
        }
    }
    sum / (SIDE * SIDE) as f32
}
