//! Plain paths: the light step and the bounce step, without offset paths. They are packed densely when they
//! scatter, and by the kinds of the surfaces at which they arrive; in diffuse scenes, where there is but one, those
//! that end on a light leave gaps until the next time.

use super::arrival::{Arrival, Left};
use super::light::{ConnectedX8, shadow_rays};
use super::order::Order;
use super::{Context, Counts, bounce, light, trace_any, trace_closest};
use crate::lanes::{Float, LANES, Vec3x8, first_lanes, lanes_of};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch, HitsX8};
use crate::vertex::VerticesX8;
use glam::Vec3;
use wide::f32x8;

/// Plain paths at one vertex, with the buffers for their next steps.
#[derive(Default)]
pub(super) struct PlainPaths {
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
    order: Order,
    /// The light of each path, in the order in which they were pushed.
    pub(super) gathered: Vec<Vec3>,
    pub(super) counts: Counts,
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
    /// A bit for each lane whose scattering event is of class rough.
    rough: u32,
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
        rough: 0,
        samplers: [Sampler::NONE; LANES],
        index: [0; LANES],
    };

    /// The paths of the rays `rays`, which are anywhere in `flights`.
    #[inline(always)]
    fn gather(flights: &[Self], rays: &[u32; LANES], lanes: u32) -> Self {
        let mut gathered = Self::NONE;
        for lane in lanes_of(lanes) {
            let (flight, from) = (
                &flights[rays[lane] as usize / LANES],
                rays[lane] as usize % LANES,
            );
            gathered.from.set(lane, flight.from.lane(from));
            gathered.throughput.set(lane, flight.throughput.lane(from));
            gathered.pdf.set_lane(lane, flight.pdf.lane(from));
            gathered.rough |= (flight.rough >> from & 1) << lane;
            gathered.samplers[lane] = flight.samplers[from];
            gathered.index[lane] = flight.index[from];
        }
        gathered
    }
}

impl PlainPaths {
    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The block with the first path that goes on, where it is in the first lane, and its f/p.
    pub(super) fn first(&self) -> Option<(&VerticesX8, Vec3x8)> {
        let block = self.blocks.first().filter(|_| !self.is_empty())?;
        Some((&block.vertices, block.throughput))
    }

    /// Forgets the paths and what they gathered.
    pub(super) fn clear(&mut self) {
        self.blocks.clear();
        self.len = 0;
        self.gathered.clear();
    }

    /// Adds a path that starts with throughput 1 at the vertex in a lane of `vertices`.
    pub(super) fn push<const DIFFUSE: bool>(
        &mut self,
        vertices: &VerticesX8,
        from: usize,
        sampler: Sampler,
    ) {
        let lane = self.len % LANES;
        if self.len / LANES == self.blocks.len() {
            self.blocks.push(PlainBlock::NONE);
        }
        let block = &mut self.blocks[self.len / LANES];
        block.vertices.copy::<DIFFUSE>(lane, vertices, from);
        block.throughput.set(lane, Vec3::ONE);
        block.samplers[lane] = sampler;
        block.index[lane] = self.gathered.len() as u32;
        block.alive |= 1 << lane;
        self.gathered.push(Vec3::ZERO);
        self.len += 1;
    }

    /// Light and bounce at x_k. `DIFFUSE`: in a scene that is diffuse.
    pub(super) fn step<const DIFFUSE: bool>(&mut self, context: Context, k: u32) {
        self.light_step::<DIFFUSE>(context, k);
        self.scatter::<DIFFUSE>(context.scene, k);
        trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
        if DIFFUSE {
            self.arrive(context, k);
        } else {
            self.arrive_by_kind(context, k);
        }
    }

    /// Samples a point on a light for every path, and gathers what comes from there.
    fn light_step<const DIFFUSE: bool>(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        if scene.lights.is_empty() {
            return;
        }
        self.lit.clear();
        self.shadow.clear();
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        light::draw(samplers, k, &mut self.numbers);
        for (block, &[u0, u1, u2, _]) in self.blocks.iter().zip(&self.numbers) {
            let x = &block.vertices;
            // A path through a specular vertex is found by BSDF sampling alone.
            let rough = x.rough & block.alive;
            if rough == 0 {
                continue;
            }
            let light = scene.sample_lights::<DIFFUSE>(x.position, rough, [u0, u1, u2]);
            let to_light = ConnectedX8::new::<DIFFUSE>(scene, x, &light, k);
            let value = to_light.value(block.throughput) / (f32x8::ONE + to_light.by_bsdf());
            let rays = shadow_rays::<DIFFUSE>(x, &light);
            for lane in lanes_of(to_light.holds & rough) {
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
    fn scatter<const DIFFUSE: bool>(&mut self, scene: &Scene, k: u32) {
        self.bounce.clear();
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        bounce::draw::<DIFFUSE>(samplers, k, &mut self.numbers);
        for (block, numbers) in self.blocks.iter().zip(&self.numbers) {
            let x = &block.vertices;
            let scattering = x.scatter::<DIFFUSE>(scene, k, numbers);
            let throughput = scattering.carry(block.throughput);
            let rays = x.rays(scattering.wi);
            let carries_light = block.throughput.is_not_zero().to_bitmask();
            let rough = x.rough & !scattering.delta;
            for lane in lanes_of(scattering.holds & carries_light & block.alive) {
                let ray = self.bounce.push(&rays.lane(lane)) as usize;
                let (at, to) = (ray / LANES, ray % LANES);
                if at == self.flights.len() {
                    self.flights.push(PlainFlight::NONE);
                }
                let flight = &mut self.flights[at];
                flight.from.set(to, x.position.lane(lane));
                flight.throughput.set(to, throughput.lane(lane));
                flight.pdf.set_lane(to, scattering.pdf.as_array()[lane]);
                flight.rough = flight.rough & !(1 << to) | (rough >> lane & 1) << to;
                flight.samplers[to] = block.samplers[lane];
                flight.index[to] = block.index[lane];
            }
        }
        // So many lanes there will be at the next vertices.
        self.len = self.bounce.len();
    }

    /// Moves the paths to their next vertices; those that reached light are complete.
    fn arrive(&mut self, context: Context, k: u32) {
        self.blocks
            .resize(self.len.div_ceil(LANES), PlainBlock::NONE);
        for (at, (block, flight)) in self.blocks.iter_mut().zip(&self.flights).enumerate() {
            let rays = first_lanes(self.len - at * LANES);
            block.arrive::<true>(
                context,
                k,
                &self.bounce.hits(at),
                flight,
                rays,
                &mut self.gathered,
            );
        }
        if self.blocks.iter().all(|block| block.alive == 0) {
            self.len = 0;
        }
    }

    /// With paths that arrive at surfaces of one kind in the same blocks, in their order.
    fn arrive_by_kind(&mut self, context: Context, k: u32) {
        let going_on = self.order.sort(context, k, &self.bounce);
        let rays = &self.order.rays;
        self.blocks
            .resize(rays.len().div_ceil(LANES), PlainBlock::NONE);
        for (block, rays) in self.blocks.iter_mut().zip(rays.chunks(LANES)) {
            let lanes = first_lanes(rays.len());
            let mut of_lanes = [0; LANES];
            of_lanes[..rays.len()].copy_from_slice(rays);
            let hits = self.bounce.gathered_hits(&of_lanes, lanes);
            let flight = PlainFlight::gather(&self.flights, &of_lanes, lanes);
            block.arrive::<false>(context, k, &hits, &flight, lanes, &mut self.gathered);
        }
        // Behind those that go on there are only such that have ended.
        self.blocks
            .resize(going_on.div_ceil(LANES), PlainBlock::NONE);
        self.len = going_on;
    }
}

impl PlainBlock {
    /// Where the paths of `flight` arrive whose rays are `rays`.
    #[inline(always)]
    fn arrive<const DIFFUSE: bool>(
        &mut self,
        context: Context,
        k: u32,
        hits: &HitsX8,
        flight: &PlainFlight,
        rays: u32,
        gathered: &mut [Vec3],
    ) {
        let left = Left {
            from: flight.from,
            pdf: flight.pdf,
            rough: flight.rough,
        };
        let arrival = Arrival::new(context, k, hits, rays, left);
        if arrival.ends != 0 {
            let value = flight.throughput * arrival.radiance;
            let light = value / (f32x8::ONE + arrival.by_light);
            for lane in lanes_of(arrival.ends) {
                gathered[flight.index[lane] as usize] += light.lane(lane);
            }
        }
        self.alive = arrival.surfaces;
        if self.alive != 0 {
            arrival.put::<DIFFUSE>(context.scene, hits, &mut self.vertices);
            self.throughput = flight.throughput;
            self.samplers = flight.samplers;
            self.index = flight.index;
        }
    }
}
