//! Plain paths through scenes in which everything is diffuse: the light step and the bounce step of eight
//! paths at once, in the lanes of vectors.
//!
//! The same steps as in `light` and `bounce`, without offset paths, and the same bits.

use super::bounce::{ByLight, radiance};
use super::{Context, Counts, ROULETTE_FROM, trace_any, trace_closest};
use crate::bsdf::lambert::{self, EvalX8};
use crate::frame::{FrameX8, offset_origin_x8};
use crate::lanes::{LANES, Vec3x8, from_lanes, lanes_of, negative, positive};
use crate::sampler::{self, Dimension, Sampler};
use crate::scene::Scene;
use crate::shift::solid_angle_per_area_x8;
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch, HitsX8, Ray};
use crate::vertex::{End, Vertex};
use glam::Vec3;
use wide::f32x8;

/// Plain paths at one vertex, with the buffers for their next steps.
#[derive(Default)]
pub(super) struct DiffusePaths {
    paths: Vec<PathBlock>,
    /// Lanes of `paths` in use.
    len: usize,
    /// Paths on their way to the next vertex, one for each ray of `bounce`.
    flights: Vec<FlightBlock>,
    /// Random numbers for one step of each path.
    numbers: Vec<[f32x8; 4]>,
    /// What arrives from a light if the ray of `shadow` is free.
    lit: Vec<Lit>,
    bounce: ClosestBatch,
    shadow: AnyBatch,
    /// The light of each path, in the order in which they were pushed.
    pub(super) gathered: Vec<Vec3>,
    pub(super) counts: Counts,
}

/// Eight paths at their current vertices x_k.
#[derive(Clone, Default)]
struct PathBlock {
    position: Vec3x8,
    /// Geometric normal.
    ng: Vec3x8,
    /// The normal to shade with, as seen from where the path came from.
    normal: Vec3x8,
    /// Its cosine to the direction where the path came from.
    cos_o: f32x8,
    offset: f32x8,
    albedo: Vec3x8,
    survival: f32x8,
    /// f/p up to x_k, the scattering there excluded.
    throughput: Vec3x8,
    sampler: [Sampler; LANES],
    /// Indices into what is gathered.
    index: [u32; LANES],
    /// A bit for each lane that holds a path.
    alive: u32,
    /// A bit for each lane where both normals are on the side where the path came from.
    agrees: u32,
}

/// Eight paths between their vertices.
#[derive(Clone, Default)]
struct FlightBlock {
    /// Where they left.
    from: Vec3x8,
    /// f/p up to the next vertex.
    throughput: Vec3x8,
    /// Density of the direction, roulette included.
    pdf: f32x8,
    sampler: [Sampler; LANES],
    index: [u32; LANES],
}

struct Lit {
    light: Vec3,
    index: u32,
}

impl DiffusePaths {
    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Forgets the paths and what they gathered.
    pub(super) fn clear(&mut self) {
        self.paths.clear();
        self.len = 0;
        self.gathered.clear();
    }

    /// Adds a path that starts at `vertex` with throughput 1.
    pub(super) fn push(&mut self, scene: &Scene, vertex: &Vertex, sampler: Sampler) {
        let lane = self.len % LANES;
        if self.len / LANES == self.paths.len() {
            self.paths.push(PathBlock::default());
        }
        let block = &mut self.paths[self.len / LANES];
        block.set(lane, scene, vertex);
        block.throughput.set(lane, Vec3::ONE);
        block.sampler[lane] = sampler;
        block.index[lane] = self.gathered.len() as u32;
        block.alive |= 1 << lane;
        self.gathered.push(Vec3::ZERO);
        self.len += 1;
    }

    /// Light and bounce at x_k.
    pub(super) fn step(&mut self, context: Context, k: u32) {
        if !self.is_empty() {
            self.light_step(context, k);
            self.scatter(k);
            trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
            self.arrive(context, k);
        }
    }

    /// Samples a point on a light for every path, and gathers what comes from there.
    fn light_step(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        if scene.lights.is_empty() {
            return;
        }
        self.lit.clear();
        self.shadow.clear();
        self.draw(Dimension::Light(k));
        for (block, &[u0, u1, u2, _]) in self.paths.iter().zip(&self.numbers) {
            // The light as it is seen from x_k.
            let light = scene.sample_lights([u0, u1, u2]);
            let (wi, g, holds) = solid_angle_per_area_x8(block.position, light.position, light.ng);
            let front = negative(light.ng.dot(wi));
            let per_density = g / light.density;
            let arriving = light.radiance * per_density;

            // Scattering, and the weight by the balance heuristic.
            let (eval, agree) = block.eval(wi);
            let value = block.throughput * eval.value * arriving;
            let by_bsdf = eval.pdf * block.survival(k) * per_density;
            let value = value / (f32x8::ONE + by_bsdf);

            // The shadow ray, as by `Vertex::ray_to`.
            let towards = light.position - block.position;
            let origin = offset_origin_x8(block.position, block.ng, block.offset, towards);
            let end = offset_origin_x8(light.position, light.ng, light.offset, -towards);
            let direction = end - origin;

            let mask = light.holds & holds & front & agree & eval.holds;
            for lane in lanes_of(mask.to_bitmask() & block.alive & block.agrees) {
                self.shadow.push(&Ray {
                    origin: origin.lane(lane),
                    direction: direction.lane(lane),
                    length: 1.0,
                });
                self.lit.push(Lit {
                    light: value.lane(lane),
                    index: block.index[lane],
                });
            }
        }
        trace_any(context, &mut self.shadow, RayKind::Shadow, &mut self.counts);
        for (ray, lit) in self.lit.iter().enumerate() {
            if !self.shadow.is_blocked(ray as u32) {
                self.gathered[lit.index as usize] += lit.light;
            }
        }
    }

    /// Samples the BSDF at x_k; paths that end are left out.
    fn scatter(&mut self, k: u32) {
        self.bounce.clear();
        self.draw(Dimension::Bsdf(k));
        for (block, &[u0, u1, _, u_roulette]) in self.paths.iter().zip(&self.numbers) {
            let survival = block.survival(k);
            let survives = u_roulette.simd_lt(survival) & block.throughput.is_not_zero();
            let (local, eval) = lambert::sample_x8(block.albedo, block.cos_o, [u0, u1]);
            let wi = FrameX8::new(block.normal).to_world(local);
            let wi = wi * wi.length_recip();
            let agree = positive(block.ng.dot(wi) * local.z);
            let pdf = eval.pdf * survival;
            let throughput = block.throughput * eval.value * (f32x8::ONE / pdf);
            let origin = offset_origin_x8(block.position, block.ng, block.offset, wi);

            let mask = survives & eval.holds & agree;
            for lane in lanes_of(mask.to_bitmask() & block.alive) {
                let ray = self.bounce.push(&Ray {
                    origin: origin.lane(lane),
                    direction: wi.lane(lane),
                    length: f32::INFINITY,
                });
                let (at, to) = (ray as usize / LANES, ray as usize % LANES);
                if at == self.flights.len() {
                    self.flights.push(FlightBlock::default());
                }
                let flight = &mut self.flights[at];
                flight.from.set(to, block.position.lane(lane));
                flight.throughput.set(to, throughput.lane(lane));
                flight.pdf.as_mut_array()[to] = pdf.as_array()[lane];
                flight.sampler[to] = block.sampler[lane];
                flight.index[to] = block.index[lane];
            }
        }
        // So many lanes there will be at the next vertices.
        self.len = self.bounce.len();
    }

    /// Moves the paths to their next vertices; those that reached light are complete.
    fn arrive(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        // At the last vertex only light counts.
        let goes_on = k + 2 <= context.settings.depth;
        let blocks = self.len.div_ceil(LANES);
        self.paths.resize(blocks, PathBlock::default());
        for (at, (block, flight)) in self.paths.iter_mut().zip(&self.flights).enumerate() {
            let hits = self.bounce.hits(at);
            let rays = u32::MAX >> (32 - (self.len - at * LANES).min(LANES));

            // Light ends a path.
            let ended = ends(scene, &hits);
            let mut complete = hits.found & ended;
            if !scene.environment.is_black() {
                complete |= rays & !hits.found;
            }
            for lane in lanes_of(complete) {
                let hit = self.bounce.hit((at * LANES + lane) as u32);
                let wi = hits.direction.lane(lane);
                let end = End::new(scene, hit, wi);
                let from = flight.from.lane(lane);
                let by_light = ByLight::of(scene, from, &end, wi, flight.pdf.as_array()[lane]);
                let value = flight.throughput.lane(lane) * radiance(scene, &end, wi);
                // Light sampling leaves the backs of lights out.
                if !matches!(end, End::Light(light) if !light.front) {
                    let light = value / (1.0 + by_light.density(scene, from));
                    self.gathered[flight.index[lane] as usize] += light;
                }
            }

            // Surfaces are where the paths go on.
            block.alive = if goes_on { hits.found & !ended } else { 0 };
            if block.alive != 0 {
                block.move_to(scene, &hits);
                block.throughput = flight.throughput;
                block.sampler = flight.sampler;
                block.index = flight.index;
            }
        }
        if !goes_on {
            self.len = 0;
        }
    }

    fn draw(&mut self, dimension: Dimension) {
        let samplers = self.paths.iter().map(|block| &block.sampler);
        sampler::draw_blocks(samplers, dimension, &mut self.numbers);
    }
}

/// A bit for each lane whose ray met a light.
#[inline(always)]
fn ends(scene: &Scene, hits: &HitsX8) -> u32 {
    let mut ended = 0;
    for (lane, &triangle) in hits.triangle.iter().enumerate() {
        let material = scene.mesh.material_of[triangle as usize];
        let emits = scene.materials[material as usize].emission.is_some();
        ended |= u32::from(emits) << lane;
    }
    ended
}

impl PathBlock {
    /// Puts a vertex into a lane.
    fn set(&mut self, lane: usize, scene: &Scene, vertex: &Vertex) {
        let normal = vertex.normal();
        let cos_o = normal.dot(vertex.wo);
        self.position.set(lane, vertex.position);
        self.ng.set(lane, vertex.ng);
        self.normal.set(lane, normal);
        self.cos_o.as_mut_array()[lane] = cos_o;
        self.offset.as_mut_array()[lane] = vertex.offset;
        self.albedo.set(lane, vertex.texel.colour);
        self.survival.as_mut_array()[lane] = vertex.survival(scene);
        self.agrees &= !(1 << lane);
        self.agrees |= u32::from(vertex.agrees(vertex.wo, cos_o)) << lane;
    }

    /// The vertices at which rays arrived, as by [`End::new`].
    #[inline(always)]
    fn move_to(&mut self, scene: &Scene, hits: &HitsX8) {
        let materials = hits.triangle.map(|triangle| {
            let material = scene.mesh.material_of[triangle as usize];
            &scene.materials[material as usize]
        });
        self.albedo = Vec3x8::from_lanes(|lane| materials[lane].texel.colour);
        self.survival = from_lanes(|lane| materials[lane].survival);
        let mut points = scene.mesh.points(&hits.triangle, hits.u, hits.v);
        let textured = |lane: &usize| materials[*lane].textures.is_some();
        for lane in lanes_of(self.alive).filter(textured) {
            let hit = hits.lane(lane);
            if let End::Surface(vertex) = End::new(scene, Some(hit), hits.direction.lane(lane)) {
                points.ns.set(lane, vertex.ns);
                self.albedo.set(lane, vertex.texel.colour);
            }
        }
        let wo = -hits.direction;
        let (by_ng, by_ns) = (points.ng.dot(wo), points.ns.dot(wo));
        let same_side = !(positive(by_ns) ^ positive(by_ng));
        self.position = points.position;
        self.ng = points.ng;
        self.normal = Vec3x8::select(same_side, points.ns, points.ng);
        self.cos_o = same_side.select(by_ns, by_ng);
        self.offset = points.offset;
        self.agrees = positive(by_ng * self.cos_o).to_bitmask();
    }

    /// The BSDF for a unit direction in the world, and where it is on one side of both normals.
    #[inline(always)]
    fn eval(&self, wi: Vec3x8) -> (EvalX8, f32x8) {
        let cos_i = self.normal.dot(wi);
        let agree = positive(self.ng.dot(wi) * cos_i);
        (lambert::eval_x8(self.albedo, self.cos_o, cos_i), agree)
    }

    /// Probability that a path goes on from x_k.
    #[inline(always)]
    fn survival(&self, k: u32) -> f32x8 {
        if k < ROULETTE_FROM {
            f32x8::ONE
        } else {
            self.survival
        }
    }
}
