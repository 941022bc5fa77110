//! Plain paths: the light step and the bounce step, without offset paths. They are packed densely when they
//! scatter, and by the kinds of the surfaces at which they arrive; in diffuse scenes, where there is but one, those
//! that end on a light leave gaps until the next time.

mod walks;

use super::arrival::{Arrival, Left};
use super::chain::{self, Chains, Event};
use super::light::{ConnectedX8, shadow_rays};
use super::link::{self, Unseen, Way, light_end, start};
use super::order::Order;
use super::pool::Pool;
use super::shares::Ledger;
use super::{Context, Counts, bounce, light, trace_any, trace_closest};
use crate::lanes::{Float, LANES, Vec3x8, first_lanes, lanes_of};
use crate::manifold::Walks;
use crate::sampler::Sampler;
use crate::scene::light_sample::LightSamplesX8;
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch, HitsX8};
use crate::vertex::VerticesX8;
use glam::Vec3;
use walks::Request;
use wide::f32x8;

/// Plain paths at one vertex, with the buffers for their next steps.
#[derive(Default)]
pub(super) struct PlainPaths {
    blocks: Pool<PlainBlock>,
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
    /// What lies between paths and their last rough vertices.
    chains: Chains,
    /// Of the light step, for each block; empty where no light goes through glass.
    unseen: Vec<Unseen>,
    /// Of the light step: ways through balls of glass, the blocks and lanes from which they are tried, and with what
    /// probability.
    by_balls: Vec<(u32, usize, Way, f32)>,
    requests: Vec<Request>,
    /// The blocks and lanes of vertices that try walks by mirrors.
    tries: Vec<(u32, u32)>,
    /// Light that has been found by chains.
    found: Vec<Found>,
    walks: Walks,
    /// The light of each path, in the order in which they were pushed.
    pub(super) gathered: Vec<Vec3>,
    /// What walks cost and bring, if anyone wants to know.
    pub(super) ledger: Option<Ledger>,
    pub(super) counts: Counts,
}

/// Eight paths at their current vertices x_k.
struct PlainBlock {
    vertices: VerticesX8,
    /// f/p up to x_k, the scattering there excluded.
    throughput: Vec3x8,
    samplers: [Sampler; LANES],
    /// Indices into what is gathered.
    index: [u32; LANES],
    /// A bit for each lane that holds a path.
    alive: u32,
    /// The chains of single directions that have led here from rough vertices.
    chain: [u32; LANES],
}

/// Eight paths between their vertices.
struct PlainFlight {
    /// Where they left.
    from: Vec3x8,
    /// f/p up to the next vertex.
    throughput: Vec3x8,
    /// Density of the direction, roulette included.
    pdf: f32x8,
    /// A bit for each lane whose direction light sampling could have drawn.
    lit: u32,
    samplers: [Sampler; LANES],
    index: [u32; LANES],
    /// The chains that go on here, or begin where they left.
    chain: [u32; LANES],
}

/// Light that BSDF sampling has found by a chain: what it would add alone, and the walk that could have found it.
struct Found {
    light: Vec3,
    index: u32,
    chain: u32,
    way: Way,
    walk: u32,
}

/// What arrives from a light, and where it is gathered.
struct Lit {
    light: Vec3,
    index: u32,
    /// The lane among all.
    place: u32,
}

impl PlainBlock {
    const NONE: Self = Self {
        vertices: VerticesX8::NONE,
        throughput: Vec3x8::ZERO,
        samplers: [Sampler::NONE; LANES],
        index: [0; LANES],
        alive: 0,
        chain: [chain::NONE; LANES],
    };

    /// The lanes at surfaces of class specular in which light is sampled as at rough ones: those that spread light a
    /// little, where no walk may find it.
    #[inline(always)]
    fn spread<const DIFFUSE: bool>(&self, context: Context, chains: &Chains) -> u32 {
        if DIFFUSE || !context.aims {
            return 0;
        }
        chains.beyond(&self.chain, self.alive & self.vertices.spreading())
    }
}

impl PlainFlight {
    const NONE: Self = Self {
        from: Vec3x8::ZERO,
        throughput: Vec3x8::ZERO,
        pdf: f32x8::ZERO,
        lit: 0,
        samplers: [Sampler::NONE; LANES],
        index: [0; LANES],
        chain: [chain::NONE; LANES],
    };

    /// Gathers the light that the paths in the lanes `ends` have reached.
    #[inline(always)]
    fn reach_light(&self, arrival: &Arrival, ends: u32, gathered: &mut [Vec3]) {
        if ends != 0 {
            let value = self.throughput * arrival.radiance;
            let light = value / (f32x8::ONE + arrival.by_light);
            for lane in lanes_of(ends) {
                gathered[self.index[lane] as usize] += light.lane(lane);
            }
        }
    }

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
            gathered.lit |= (flight.lit >> from & 1) << lane;
            gathered.samplers[lane] = flight.samplers[from];
            gathered.index[lane] = flight.index[from];
            gathered.chain[lane] = flight.chain[from];
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
        self.chains.clear();
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
            let block = self.blocks.next(|| PlainBlock::NONE);
            block.vertices.clear();
            block.alive = 0;
        }
        let block = &mut self.blocks[self.len / LANES];
        block.vertices.copy::<DIFFUSE>(lane, vertices, from);
        block.throughput.set(lane, Vec3::ONE);
        block.samplers[lane] = sampler;
        block.index[lane] = self.gathered.len() as u32;
        block.alive |= 1 << lane;
        block.chain[lane] = chain::NONE;
        self.gathered.push(Vec3::ZERO);
        self.len += 1;
    }

    /// Light and bounce at x_k. `DIFFUSE`: in a scene that is diffuse.
    pub(super) fn step<const DIFFUSE: bool>(&mut self, context: Context, k: u32) {
        self.light_step::<DIFFUSE>(context, k);
        if !DIFFUSE && context.walks {
            self.walk_step(context, k);
        }
        self.scatter::<DIFFUSE>(context, k);
        trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
        if DIFFUSE {
            self.arrive(context, k);
        } else {
            self.arrive_by_kind(context, k);
        }
        if !DIFFUSE && context.walks {
            self.walk_again(context);
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
        self.unseen.clear();
        self.by_balls.clear();
        let through_glass = !DIFFUSE && context.walks_through_glass();
        let through_balls = !DIFFUSE && context.walks_through_balls();
        let samplers = self.blocks.iter().map(|block| &block.samplers);
        light::draw(samplers, k, &mut self.numbers);
        for (at, (block, &[u0, u1, u2, _])) in self.blocks.iter().zip(&self.numbers).enumerate() {
            let x = &block.vertices;
            let rough = x.rough & block.alive;
            let lit = rough | block.spread::<DIFFUSE>(context, &self.chains);
            if lit == 0 {
                if through_glass {
                    self.unseen.push((LightSamplesX8::NONE, 0));
                }
                continue;
            }
            let light = scene.sample_lights::<DIFFUSE>(x.position, lit, [u0, u1, u2]);
            let to_light = ConnectedX8::new::<DIFFUSE>(scene, x, &light, k);
            let value = to_light.value(block.throughput) / (f32x8::ONE + to_light.by_bsdf());
            let rays = shadow_rays::<DIFFUSE>(x, &light);
            if through_glass {
                self.unseen.push((light, rough & !to_light.valid));
            }
            if through_balls {
                let (from, samplers) = ((x.position, k), &block.samplers);
                let found = &mut self.by_balls;
                link::by_balls(context, from, samplers, &light, rough, |lane, way, p| {
                    found.push((at as u32, lane, way, p));
                });
            }
            for lane in lanes_of(to_light.valid & lit) {
                self.shadow.push(&rays.lane(lane));
                self.lit.push(Lit {
                    light: value.lane(lane),
                    index: block.index[lane],
                    place: (at * LANES + lane) as u32,
                });
            }
        }
        trace_any(context, &mut self.shadow, RayKind::Shadow, &mut self.counts);
        for (ray, lit) in self.lit.iter().enumerate() {
            let is_seen = !self.shadow.is_blocked(ray as u32);
            if is_seen {
                self.gathered[lit.index as usize] += lit.light;
            }
            if through_glass {
                let (at, lane) = (lit.place as usize / LANES, lit.place as usize % LANES);
                let x = &self.blocks[at].vertices;
                let (sampled, unseen) = &mut self.unseen[at];
                let mut tried = x.rough & 1 << lane;
                if is_seen {
                    tried = link::steps_aside(scene, x.position, sampled, tried);
                }
                *unseen |= tried;
            }
        }
    }

    /// Samples the BSDF at x_k; paths that end are left out.
    fn scatter<const DIFFUSE: bool>(&mut self, context: Context, k: u32) {
        let scene = context.scene;
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
            let lit = rough | block.spread::<DIFFUSE>(context, &self.chains);
            for lane in lanes_of(scattering.valid & carries_light & block.alive) {
                let ray = self.bounce.push(&rays.lane(lane)) as usize;
                let (at, to) = (ray / LANES, ray % LANES);
                if at == self.flights.len() {
                    self.flights.push(PlainFlight::NONE);
                }
                let flight = &mut self.flights[at];
                flight.from.set(to, x.position.lane(lane));
                flight.throughput.set(to, throughput.lane(lane));
                flight.pdf.set_lane(to, scattering.pdf.as_array()[lane]);
                flight.lit = flight.lit & !(1 << to) | (lit >> lane & 1) << to;
                flight.samplers[to] = block.samplers[lane];
                flight.index[to] = block.index[lane];
                if !DIFFUSE && context.walks {
                    flight.chain[to] = if rough >> lane & 1 == 1 {
                        let (wi, pdf) = (scattering.wi.lane(lane), scattering.pdf.as_array()[lane]);
                        self.chains.begin(start(x, lane, k), wi, pdf, 0)
                    } else if block.chain[lane] != chain::NONE
                        && let Some(event) = Event::of(x, &scattering, lane)
                    {
                        self.chains.scatter(scene, block.chain[lane], event)
                    } else {
                        chain::NONE
                    };
                }
            }
        }
        // So many lanes there will be at the next vertices.
        self.len = self.bounce.len();
    }

    /// Moves the paths to their next vertices; those that reached light are complete.
    fn arrive(&mut self, context: Context, k: u32) {
        self.blocks
            .resize(self.len.div_ceil(LANES), || PlainBlock::NONE);
        for (at, (block, flight)) in self.blocks.iter_mut().zip(&self.flights).enumerate() {
            let rays = first_lanes(self.len - at * LANES);
            let hits = self.bounce.hits(at);
            let arrival = block.arrive::<true>(context, k, &hits, flight, rays);
            flight.reach_light(&arrival, arrival.ends, &mut self.gathered);
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
            .resize(rays.len().div_ceil(LANES), || PlainBlock::NONE);
        for (block, rays) in self.blocks.iter_mut().zip(rays.chunks(LANES)) {
            let lanes = first_lanes(rays.len());
            let mut of_lanes = [0; LANES];
            of_lanes[..rays.len()].copy_from_slice(rays);
            let hits = self.bounce.gathered_hits(&of_lanes, lanes);
            let flight = PlainFlight::gather(&self.flights, &of_lanes, lanes);
            let arrival = block.arrive::<false>(context, k, &hits, &flight, lanes);
            let mut ends = arrival.ends;
            if context.walks {
                block.chain = flight.chain;
                for lane in lanes_of(arrival.ends) {
                    let chain = flight.chain[lane];
                    if let Some(gone) = self.chains.get(chain)
                        && let Some(end) = light_end(context.scene, &hits, lane)
                        && let Some(through) = gone.through(context.scene, &end.target)
                    {
                        ends &= !(1 << lane);
                        self.found.push(Found {
                            light: flight.throughput.lane(lane) * end.radiance,
                            index: flight.index[lane],
                            chain,
                            way: (end, through),
                            walk: 0,
                        });
                    }
                }
                let surfaces = (arrival.surfaces, block.vertices.rough);
                self.chains
                    .arrive(context.scene, &mut block.chain, &hits, surfaces);
            }
            flight.reach_light(&arrival, ends, &mut self.gathered);
        }
        // Behind those that go on there are only such that have ended.
        self.blocks
            .resize(going_on.div_ceil(LANES), || PlainBlock::NONE);
        self.len = going_on;
    }
}

impl PlainBlock {
    /// Where the paths of `flight` arrive whose rays are `rays`.
    #[inline(always)]
    fn arrive<'a, const DIFFUSE: bool>(
        &mut self,
        context: Context<'a>,
        k: u32,
        hits: &HitsX8,
        flight: &PlainFlight,
        rays: u32,
    ) -> Arrival<'a> {
        let left = Left {
            from: flight.from,
            pdf: flight.pdf,
            lit: flight.lit,
        };
        let arrival = Arrival::new(context, k, hits, rays, left);
        self.alive = arrival.surfaces;
        if self.alive != 0 {
            arrival.put::<DIFFUSE>(context.scene, hits, &mut self.vertices);
            self.throughput = flight.throughput;
            self.samplers = flight.samplers;
            self.index = flight.index;
        }
        arrival
    }
}
