//! Plain paths: the light step and the bounce step, without offset paths. They are packed densely when they
//! scatter; those that end on a light leave gaps until the next time.

use super::arrival::Arrival;
use super::vertices::{VerticesX8, draw_bsdf, draw_light};
use crate::lanes::{Float, LANES, Vec3x8, first_lanes, lanes_of};
use crate::path::{Context, Counts, trace_any, trace_closest};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::vertex::Vertex;
use glam::Vec3;
use wide::f32x8;

/// Plain paths at one vertex, with the buffers for their next steps.
#[derive(Default)]
pub(in crate::path) struct PlainPaths {
    blocks: Vec<PlainBlock>,
    /// Lanes of `blocks` in use.
    len: usize,
    /// Paths on their way to the next vertex, one for each ray of `bounce`.
    flights: Vec<PlainFlight>,
    /// Random numbers for one step of each path.
    numbers: Vec<[f32x8; 4]>,
    /// What arrives from a light if the ray of `shadow` is free.
    lit: Vec<Lit>,
    bounce: ClosestBatch,
    shadow: AnyBatch,
    /// The light of each path, in the order in which they were pushed.
    pub(in crate::path) gathered: Vec<Vec3>,
    pub(in crate::path) counts: Counts,
}

/// Eight paths at their current vertices x_k.
#[derive(Clone)]
struct PlainBlock {
    vertices: VerticesX8,
    /// f/p up to x_k, the scattering there excluded.
    throughput: Vec3x8,
    samplers: [Sampler; LANES],
    /// Indices into what is gathered.
    index: [u32; LANES],
    /// A bit for each lane that holds a path.
    alive: u32,
}

/// Eight paths between their vertices.
#[derive(Clone)]
struct PlainFlight {
    /// Where they left.
    from: Vec3x8,
    /// f/p up to the next vertex.
    throughput: Vec3x8,
    /// Density of the direction, roulette included.
    pdf: f32x8,
    samplers: [Sampler; LANES],
    index: [u32; LANES],
}

/// What arrives from a light, and where it is gathered.
struct Lit {
    light: Vec3,
    index: u32,
}

impl PlainBlock {
    const NONE: Self = Self {
        vertices: VerticesX8::NONE,
        throughput: Vec3x8::ZERO,
        samplers: [Sampler::NONE; LANES],
        index: [0; LANES],
        alive: 0,
    };
}

impl PlainFlight {
    const NONE: Self = Self {
        from: Vec3x8::ZERO,
        throughput: Vec3x8::ZERO,
        pdf: f32x8::ZERO,
        samplers: [Sampler::NONE; LANES],
        index: [0; LANES],
    };
}

impl PlainPaths {
    pub(in crate::path) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Forgets the paths and what they gathered.
    pub(in crate::path) fn clear(&mut self) {
        self.blocks.clear();
        self.len = 0;
        self.gathered.clear();
    }

    /// Adds a path that starts at `vertex` with throughput 1.
    pub(in crate::path) fn push(&mut self, scene: &Scene, vertex: &Vertex, sampler: Sampler) {
        let (block, lane) = self.start(sampler);
        block.vertices.set(lane, scene, vertex);
    }

    /// [`PlainPaths::push`] for the vertex in a lane of `vertices`.
    pub(super) fn push_lane(&mut self, vertices: &VerticesX8, from: usize, sampler: Sampler) {
        let (block, lane) = self.start(sampler);
        block.vertices.copy(lane, vertices, from);
    }

    #[inline(always)]
    fn start(&mut self, sampler: Sampler) -> (&mut PlainBlock, usize) {
        let lane = self.len % LANES;
        if self.len / LANES == self.blocks.len() {
            self.blocks.push(PlainBlock::NONE);
        }
        let block = &mut self.blocks[self.len / LANES];
        block.throughput.set(lane, Vec3::ONE);
        block.samplers[lane] = sampler;
        block.index[lane] = self.gathered.len() as u32;
        block.alive |= 1 << lane;
        self.gathered.push(Vec3::ZERO);
        self.len += 1;
        (block, lane)
    }

    /// Light and bounce at x_k.
    pub(in crate::path) fn step(&mut self, context: Context, k: u32) {
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
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        draw_light(samplers, k, &mut self.numbers);
        for (block, &[u0, u1, u2, _]) in self.blocks.iter().zip(&self.numbers) {
            let x = &block.vertices;
            let light = scene.sample_lights([u0, u1, u2]);
            let to_light = x.connect(k, block.throughput, &light);
            let value = to_light.value / (f32x8::ONE + to_light.by_bsdf);
            let rays = x.rays_to(light.position, light.ng, light.offset);
            for lane in lanes_of(to_light.holds & block.alive) {
                self.shadow.push(&rays.lane(lane));
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
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        draw_bsdf(samplers, k, &mut self.numbers);
        for (block, numbers) in self.blocks.iter().zip(&self.numbers) {
            let x = &block.vertices;
            let scattering = x.scatter(k, block.throughput, numbers);
            let rays = x.rays(scattering.wi);
            let carries_light = block.throughput.is_not_zero().to_bitmask();
            for lane in lanes_of(scattering.holds & carries_light & block.alive) {
                let ray = self.bounce.push(&rays.lane(lane)) as usize;
                let (at, to) = (ray / LANES, ray % LANES);
                if at == self.flights.len() {
                    self.flights.push(PlainFlight::NONE);
                }
                let flight = &mut self.flights[at];
                flight.from.set(to, x.position.lane(lane));
                flight.throughput.set(to, scattering.throughput.lane(lane));
                flight.pdf.set_lane(to, scattering.pdf.as_array()[lane]);
                flight.samplers[to] = block.samplers[lane];
                flight.index[to] = block.index[lane];
            }
        }
        // So many lanes there will be at the next vertices.
        self.len = self.bounce.len();
    }

    /// Moves the paths to their next vertices; those that reached light are complete.
    fn arrive(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        self.blocks
            .resize(self.len.div_ceil(LANES), PlainBlock::NONE);
        for (at, (block, flight)) in self.blocks.iter_mut().zip(&self.flights).enumerate() {
            let hits = self.bounce.hits(at);
            let rays = first_lanes(self.len - at * LANES);
            let arrival = Arrival::new(context, k, &hits, rays, flight.from, flight.pdf);
            if arrival.ends != 0 {
                let value = flight.throughput * arrival.radiance;
                let light = value / (f32x8::ONE + arrival.by_light);
                for lane in lanes_of(arrival.ends) {
                    self.gathered[flight.index[lane] as usize] += light.lane(lane);
                }
            }
            block.alive = arrival.surfaces;
            if block.alive != 0 {
                block.vertices = arrival.vertices(scene, &hits);
                block.throughput = flight.throughput;
                block.samplers = flight.samplers;
                block.index = flight.index;
            }
        }
        if self.blocks.iter().all(|block| block.alive == 0) {
            self.len = 0;
        }
    }
}
