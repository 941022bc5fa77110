//! Plain paths: the light step and the bounce step, without offset paths. They are packed densely when they
//! scatter, and by the kinds of the surfaces at which they arrive; in diffuse scenes, where there is but one, those
//! that end on a light leave gaps until the next time.

use super::arrival::{Arrival, Left};
use super::chain::{self, Chains, Event};
use super::light::{ConnectedX8, shadow_rays};
use super::link::{self, LinksX8, Unseen, Way, light_end, start};
use super::order::Order;
use super::pool::Pool;
use super::shares::Ledger;
use super::{Context, Counts, bounce, light, trace_any, trace_closest};
use crate::lanes::{Float, LANES, Vec3x8, first_lanes, lanes_of};
use crate::manifold::{Through, Walks};
use crate::sampler::Sampler;
use crate::scene::light_sample::LightSamplesX8;
use crate::trace::RayKind;
use crate::trace::rays::{AnyBatch, ClosestBatch, HitsX8};
use crate::vertex::VerticesX8;
use glam::Vec3;
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
    /// A bit for each lane whose scattering event is of class rough.
    rough: u32,
    samplers: [Sampler; LANES],
    index: [u32; LANES],
    /// The chains that go on here, or begin where they left.
    chain: [u32; LANES],
}

/// Walks from eight vertices.
struct Request {
    vertices: VerticesX8,
    throughput: Vec3x8,
    index: [u32; LANES],
    lanes: u32,
    ways: link::Ways,
    /// P(σ) of the ways.
    probability: f32x8,
    walks: [u32; LANES],
}

impl Request {
    fn new(ways: link::Ways, probability: f32x8) -> Self {
        Self {
            vertices: VerticesX8::NONE,
            throughput: Vec3x8::ZERO,
            index: [0; LANES],
            lanes: 0,
            ways,
            probability,
            walks: [0; LANES],
        }
    }

    /// Takes a vertex from a block.
    fn copy(&mut self, to: usize, block: &PlainBlock, from: usize) {
        self.vertices.copy::<false>(to, &block.vertices, from);
        self.throughput.set(to, block.throughput.lane(from));
        self.index[to] = block.index[from];
    }

    /// Adds the walks of the ways in `lanes`.
    fn ask(&mut self, context: Context, walks: &mut Walks, k: u32, lanes: u32) {
        for lane in lanes_of(lanes) {
            if let Some((end, through)) = &self.ways[lane] {
                let start = start(&self.vertices, lane, k);
                self.walks[lane] = walks.push(context.scene, start, end.target, *through);
                self.lanes |= 1 << lane;
            }
        }
    }
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
}

impl PlainFlight {
    const NONE: Self = Self {
        from: Vec3x8::ZERO,
        throughput: Vec3x8::ZERO,
        pdf: f32x8::ZERO,
        rough: 0,
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
            gathered.rough |= (flight.rough >> from & 1) << lane;
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
            // A path through a specular vertex is found by BSDF sampling alone.
            let rough = x.rough & block.alive;
            if rough == 0 {
                if through_glass {
                    self.unseen.push((LightSamplesX8::NONE, 0));
                }
                continue;
            }
            let light = scene.sample_lights::<DIFFUSE>(x.position, rough, [u0, u1, u2]);
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
            for lane in lanes_of(to_light.valid & rough) {
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
            if !self.shadow.is_blocked(ray as u32) {
                self.gathered[lit.index as usize] += lit.light;
            } else if through_glass {
                let (block, lane) = (lit.place as usize / LANES, lit.place as usize % LANES);
                self.unseen[block].1 |= 1 << lane;
            }
        }
    }

    /// Samples light through mirrors and glass, and gathers what comes from there.
    fn walk_step(&mut self, context: Context, k: u32) {
        // There is no room for a chain.
        if k + 2 > context.settings.depth {
            return;
        }
        self.walks.clear();
        self.requests.clear();
        for (at, (sampled, unseen)) in self.unseen.iter().enumerate() {
            let block = &self.blocks[at];
            let lanes = unseen & block.throughput.is_not_zero().to_bitmask();
            let lanes = link::straight_on(context, &block.samplers, k, lanes);
            if lanes != 0 {
                let way = |lane: usize| Some((sampled.lane(lane)?, Through::Passage));
                let share = f32x8::splat(context.shares.passages);
                let mut request = Request::new(std::array::from_fn(way), share);
                request.vertices = block.vertices.clone();
                request.throughput = block.throughput;
                request.index = block.index;
                request.ask(context, &mut self.walks, k, lanes);
                self.requests.push(request);
            }
        }
        for tried in self.by_balls.chunks(LANES) {
            let mut request = Request::new([None; LANES], f32x8::ONE);
            let mut lanes = 0;
            for (to, &(at, lane, way, probability)) in tried.iter().enumerate() {
                let block = &self.blocks[at as usize];
                request.copy(to, block, lane);
                request.ways[to] = Some(way);
                request.probability.set_lane(to, probability);
                lanes |= u32::from(block.throughput.lane(lane) != Vec3::ZERO) << to;
            }
            if lanes != 0 {
                request.ask(context, &mut self.walks, k, lanes);
                self.requests.push(request);
            }
        }
        self.try_mirrors(context, k);
        self.walks.solve(context.scene, context.tracer);
        for request in &self.requests {
            let ways = (&request.ways, request.probability);
            let from = (&request.vertices, k);
            let (walks, lanes) = (&request.walks, request.lanes);
            let links = LinksX8::new(context, &self.walks, from, walks, ways, lanes);
            let x = &request.vertices;
            let eval = x.eval::<false>(context.scene, links.wi);
            let by_bsdf = eval.pdf * x.survival(k) * links.per_pdf;
            let value = request.throughput * eval.value * links.arriving;
            let value = value / (links.by_walk + by_bsdf);
            for lane in lanes_of(links.free & eval.valid.to_bitmask()) {
                self.gathered[request.index[lane] as usize] += value.lane(lane);
            }
            if let Some(ledger) = &mut self.ledger {
                for lane in lanes_of(lanes) {
                    if let Some((_, through)) = &request.ways[lane] {
                        ledger.walk(through, self.walks.rays(walks[lane]));
                    }
                }
                let by_bsdf = by_bsdf / links.by_walk;
                for lane in lanes_of(links.free & eval.valid.to_bitmask()) {
                    if let Some((_, through)) = &request.ways[lane] {
                        let path = request.index[lane];
                        ledger.bring(through, path, value.lane(lane), by_bsdf.lane(lane));
                    }
                }
            }
        }
    }

    /// Asks for walks by mirrors, from the vertices that try one.
    fn try_mirrors(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        self.tries.clear();
        for (at, block) in self.blocks.iter().enumerate() {
            let rough = block.vertices.rough & block.alive;
            for lane in lanes_of(rough & block.throughput.is_not_zero().to_bitmask()) {
                if context.tries(&block.samplers[lane], k) {
                    self.tries.push((at as u32, lane as u32));
                }
            }
        }
        for tries in self.tries.chunks(LANES) {
            let mut request = Request::new([None; LANES], f32x8::ZERO);
            let mut samplers = [Sampler::NONE; LANES];
            for (to, &(at, lane)) in tries.iter().enumerate() {
                let (block, from) = (&self.blocks[at as usize], lane as usize);
                request.copy(to, block, from);
                samplers[to] = block.samplers[from];
            }
            link::draw([&samplers], k, &mut self.numbers);
            let [u0, u1, u2, u3] = self.numbers[0];
            let (from, lanes) = (request.vertices.position, first_lanes(tries.len()));
            let light = scene.sample_lights::<false>(from, lanes, [u0, u1, u2]);
            (request.ways, request.probability) =
                link::by_mirrors(context, (from, k), &samplers, &light, lanes, u3);
            request.ask(context, &mut self.walks, k, lanes);
            if request.lanes != 0 {
                self.requests.push(request);
            }
        }
    }

    /// Gathers light that has been found by chains, weighted by whether a walk finds it too.
    fn walk_again(&mut self, context: Context) {
        self.walks.clear();
        for found in &mut self.found {
            if let Some(chain) = self.chains.get(found.chain) {
                let (end, through) = found.way;
                found.walk = self
                    .walks
                    .push(context.scene, chain.start, end.target, through);
            }
        }
        self.walks.solve(context.scene, context.tracer);
        for found in self.found.drain(..) {
            let mut by_walk = 0.0;
            if let (Some(chain), Ok(link)) =
                (self.chains.get(found.chain), self.walks.link(found.walk))
                && chain.is(link)
            {
                let from = chain.start.position;
                let mut ways = [None; LANES];
                ways[0] = Some(found.way);
                let way = link::probability(context, Vec3x8::splat(from), &ways).lane(0);
                let by_bsdf = chain.pdf * link.probability * link.geometry;
                by_walk = way * context.scene.light_density(&found.way.0, from) / by_bsdf;
            }
            let light = found.light / (1.0 + by_walk);
            self.gathered[found.index as usize] += light;
            if let Some(ledger) = &mut self.ledger {
                let through = &found.way.1;
                ledger.walk_again(through, self.walks.rays(found.walk));
                ledger.bring(through, found.index, light, 1.0 / by_walk);
            }
        }
        self.counts.add_rays(self.walks.take_traced());
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
                flight.rough = flight.rough & !(1 << to) | (rough >> lane & 1) << to;
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
            rough: flight.rough,
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
