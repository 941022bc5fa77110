//! Sampling of lights: points on them, directions to what is far, and the densities of both.

use super::Scene;
use super::light::{Choice, Kind, NearLight, Source};
use super::reflectors::Target;
use crate::lanes::{Float, LANES, Vec3x8, lanes_of, mask_of, positive};
use crate::warp;
use glam::Vec3;
use wide::f32x8;

/// Sampled points on lights, or directions to the environment.
#[derive(Clone, Copy, Debug)]
pub struct LightSamplesX8 {
    /// Where they are; of what is far the directions.
    pub position: Vec3x8,
    /// The sides that emit.
    pub ng: Vec3x8,
    /// Radiance emitted to those sides, or from those directions; of points the intensity, of directional lights the
    /// irradiance.
    pub radiance: Vec3x8,
    /// Densities per area, or per solid angle, over all lights; of lights without extent probabilities.
    pub density: f32x8,
    /// Distances by which rays end before the surfaces.
    pub offset: f32x8,
    /// Where there is a sample.
    pub valid: f32x8,
    /// Numbers of the lights, among those of their kind.
    light: [u32; LANES],
    /// A bit for each lane whose light is far: the sky, or directional.
    pub far: u32,
    /// A bit for each lane whose light has no extent.
    pub punctual: u32,
}

/// A point on a light, or a direction to what is far, however it was found.
#[derive(Clone, Copy, Debug)]
pub struct LightEnd {
    /// Where it is.
    pub target: Target,
    /// Radiance from there; of a point its intensity, of a directional light its irradiance.
    pub radiance: Vec3,
    /// Which light it is.
    pub source: Source,
}

impl Scene {
    /// Draws points on lights that may light the points `from` in `lanes`, or directions to the environment, with `u`
    /// in [0, 1)³: the light (0) and the point on it (1, 2). There must be a light. A sample is not valid where no light
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
            Choice::Power(table) if PLAIN || lights.are_plain() => {
                let (mut number, mut chosen) = ([0; LANES], [&NearLight::NONE; LANES]);
                for (lane, &u) in u[0].as_array().iter().enumerate() {
                    number[lane] = table.choose(u) as u32;
                    chosen[lane] = &lights.near[number[lane] as usize];
                }
                LightSamplesX8::new(number, &chosen, f32x8::ONE, [u[1], u[2]])
            }
            _ if PLAIN => panic!("the lights are plain"),
            _ => self.sample_lights_among_many(from, lanes, u),
        }
    }

    /// Density of light sampling at the point `from`: per area at the point on a light, per solid angle of the sky, or
    /// the probability of a light without extent.
    #[inline]
    pub fn light_density(&self, end: &LightEnd, from: Vec3) -> f32 {
        match (end.source, end.target) {
            (Source::Near(light), _) => self.lights.density_of_near(light, from),
            (Source::Directional(_), _) => self.lights.far.each(),
            (Source::Sky, Target::Direction(direction)) => {
                let map = self.environment.map();
                map.map_or(0.0, |map| self.lights.sky() * map.density(direction))
            }
            (Source::Sky, _) => 0.0,
        }
    }

    // Not inlined: scenes with a few lamps shall not have it in their loops.
    #[inline(never)]
    fn sample_lights_among_many(&self, from: Vec3x8, lanes: u32, u: [f32x8; 3]) -> LightSamplesX8 {
        let lights = &self.lights;
        let mut number = [0; LANES];
        let mut chosen = [&NearLight::NONE; LANES];
        let mut probability = f32x8::ONE;
        // Directional lights and radiance of what is textured are taken one by one.
        let (mut far, mut textured, mut points) = (0, 0, 0);
        for lane in lanes_of(lanes) {
            let u0 = u[0].lane(lane);
            if u0 < lights.far.share {
                far |= 1 << lane;
                continue;
            }
            let (light, p) = lights.choose_near(from.lane(lane), u0);
            number[lane] = light as u32;
            chosen[lane] = &lights.near[light];
            probability.set_lane(lane, p);
            textured |= u32::from(chosen[lane].kind == Kind::Textured) << lane;
            points |= u32::from(matches!(chosen[lane].kind, Kind::Point(_))) << lane;
        }
        let mut samples = LightSamplesX8::new(number, &chosen, probability, [u[1], u[2]]);
        samples.punctual = points;
        let mut sky = 0;
        for lane in lanes_of(far) {
            match lights.far.choose(u[0].lane(lane) / lights.far.share) {
                Source::Directional(light) => {
                    let sun = &lights.punctual.directional[light as usize];
                    samples.position.set(lane, sun.direction);
                    samples.radiance.set(lane, sun.irradiance);
                    samples.light[lane] = light;
                    samples.punctual |= 1 << lane;
                }
                _ => sky |= 1 << lane,
            }
        }
        if far != 0 {
            let each = f32x8::splat(lights.far.each());
            samples.density = mask_of(far).select(each, samples.density);
            samples.valid |= mask_of(far);
            samples.far = far;
        }
        if sky != 0
            && let Some(map) = self.environment.map()
        {
            let drawn = map.sample([u[1], u[2]], sky);
            let lanes = mask_of(sky);
            let select = |to: &mut Vec3x8, from| *to = Vec3x8::select(lanes, from, *to);
            select(&mut samples.position, drawn.direction);
            select(&mut samples.radiance, drawn.radiance);
            samples.density = lanes.select(samples.density * drawn.density, samples.density);
            samples.valid &= !lanes | positive(drawn.density);
        }
        for lane in lanes_of(textured) {
            let (b, c) = warp::triangle([u[1], u[2]].map(|u| u.lane(lane)));
            match self.textured_radiance(chosen[lane], b, c) {
                Some(radiance) => samples.radiance.set(lane, radiance),
                None => samples.valid.set_lane(lane, 0.0),
            }
        }
        samples
    }

    /// The share of its intensity that a light sends in the unit direction `direction`, in [0, 1].
    #[inline]
    pub fn falloff(&self, source: Source, direction: Vec3) -> f32 {
        let Source::Near(light) = source else {
            return 1.0;
        };
        match self.lights.near[light as usize].kind {
            Kind::Point(number) => self.lights.punctual.points[number as usize].falloff(direction),
            Kind::Plain | Kind::Textured => 1.0,
        }
    }

    #[cold]
    #[inline(never)]
    fn textured_radiance(&self, light: &NearLight, b: f32, c: f32) -> Option<Vec3> {
        let material = self.mesh.material_of[light.triangle as usize];
        let material = &self.materials[material as usize];
        let radiance = material.radiance(&self.mesh, light.triangle, b, c);
        (radiance != Vec3::ZERO && !self.mesh.is_open(light.triangle, b, c)).then_some(radiance)
    }
}

impl LightEnd {
    /// Whether rays can meet it.
    pub fn has_extent(&self) -> bool {
        !matches!(self.target, Target::Point(_)) && !matches!(self.source, Source::Directional(_))
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
        valid: f32x8::ZERO,
        light: [0; LANES],
        far: 0,
        punctual: 0,
    };

    /// Points on the lights `chosen` with these numbers and probabilities, which may be inside their densities.
    #[inline(always)]
    fn new(
        light: [u32; LANES],
        chosen: &[&NearLight; LANES],
        probability: f32x8,
        u: [f32x8; 2],
    ) -> Self {
        let corner = |i: usize| Vec3x8::from_lanes(|lane| chosen[lane].corners[i]);
        let (b, c) = warp::triangle(u);
        let density = f32x8::from_lanes(|lane| chosen[lane].density);
        Self {
            position: corner(0) * (f32x8::ONE - b - c) + corner(1) * b + corner(2) * c,
            ng: Vec3x8::from_lanes(|lane| chosen[lane].ng),
            radiance: Vec3x8::from_lanes(|lane| chosen[lane].radiance),
            density: density * probability,
            offset: f32x8::from_lanes(|lane| chosen[lane].offset),
            valid: density.simd_ne(f32x8::ZERO),
            light,
            far: 0,
            punctual: 0,
        }
    }

    /// Which light the sample in a lane is of.
    fn source(&self, lane: usize) -> Source {
        let light = self.light[lane];
        match (self.far >> lane & 1, self.punctual >> lane & 1) {
            (0, _) => Source::Near(light),
            (_, 0) => Source::Sky,
            _ => Source::Directional(light),
        }
    }

    /// The sample in a lane, if there is one.
    pub fn lane(&self, lane: usize) -> Option<LightEnd> {
        let position = self.position.lane(lane);
        let source = self.source(lane);
        let is_point = self.punctual >> lane & 1 == 1;
        let target = match source {
            Source::Directional(_) | Source::Sky => Target::Direction(position),
            Source::Near(_) if is_point => Target::Point(position),
            Source::Near(_) => Target::Surface {
                position,
                ng: self.ng.lane(lane),
                offset: self.offset.lane(lane),
            },
        };
        (self.valid.to_bitmask() >> lane & 1 == 1).then(|| LightEnd {
            target,
            radiance: self.radiance.lane(lane),
            source,
        })
    }

    /// The densities with which light sampling at other points has the samples, in `lanes`, over those that they have.
    #[inline(never)]
    pub fn relative_density(&self, scene: &Scene, from: Vec3x8, lanes: u32) -> f32x8 {
        let mut relative = f32x8::ONE;
        for lane in lanes_of(lanes & !self.far) {
            let density = scene
                .lights
                .density_of_near(self.light[lane], from.lane(lane));
            relative.set_lane(lane, density / self.density.lane(lane));
        }
        relative
    }

    /// The shares of their intensities that points send to `from`, over distance squared: what their light is multiplied
    /// by; in `lanes`.
    #[inline(never)]
    pub fn per_distance_squared(&self, scene: &Scene, from: Vec3x8, lanes: u32) -> f32x8 {
        let mut factor = f32x8::ZERO;
        for lane in lanes_of(lanes) {
            let d = from.lane(lane) - self.position.lane(lane);
            let squared = d.length_squared();
            let falloff = scene.falloff(self.source(lane), d / squared.sqrt());
            factor.set_lane(lane, falloff / squared);
        }
        factor
    }
}
