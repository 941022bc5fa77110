//! Light through mirrors and glass: at every rough vertex a walk to a point on a light, as a third technique beside
//! light and BSDF sampling, and as the shift of the paths that it can make.
//!
//! Of a path x_r, chain, L the measure is that of L: area, or solid angle of the environment. In it, with 𝒢 the solid
//! angle at x_r over it, BSDF sampling has the density p_ω Π P(lobe) 𝒢, the walk p_L P(σ): that of the point, times
//! the probability of trying this way. By the balance heuristic a path adds f/Σp, and to a difference
//! (f(y)|T'| - f(x))/Σ(p(x) + p(y)|T'|), whichever technique has made it: so both are treated alike, and what BSDF
//! sampling has found goes through the same code once a walk has found it too. The shift keeps L and σ: |T'| = 1.

use super::Context;
use super::base::{BasePaths, Block};
use super::chain::NONE;
use super::link::{LinksX8, Way, by_mirrors, draw, fits, probability, start, straight_on};
use super::pack::copy_own;
use crate::gradient::{Base, Offset};
use crate::lanes::{LANES, Vec3x8, lanes_of, lanes_where, mask_of, positive};
use crate::manifold::{Through, Walks};
use crate::scene::Scene;
use crate::shift::{Death, OffsetsX8};
use crate::vertex::VerticesX8;
use wide::f32x8;

/// Walks from the vertices of a block and of its offset paths.
#[derive(Clone)]
pub(super) struct Request<const N: usize> {
    /// The live block that gathers.
    index: u32,
    /// Where the vertices are: in the block, or with those that have been kept.
    kept: Option<u32>,
    k: u32,
    lanes: u32,
    ways: [Option<Way>; LANES],
    /// P(σ) of the ways, where they were chosen by it.
    probability: Option<f32x8>,
    walks: [u32; LANES],
    offsets: [[u32; LANES]; N],
    /// Of what BSDF sampling has found: the chains, or [`NONE`].
    chains: [u32; LANES],
}

/// A walk that may find a copy of what none finds.
pub(super) struct Check {
    /// The flight, the lane and the offset path.
    index: u32,
    lane: usize,
    j: usize,
    chain: u32,
    walk: u32,
}

/// Rough vertices of base and offset paths at which chains begin.
pub(super) struct Kept<const N: usize> {
    vertices: VerticesX8,
    throughput: Vec3x8,
    offsets: [OffsetsX8; N],
    own: [VerticesX8; N],
}

impl<const N: usize> Kept<N> {
    /// In no lane.
    pub(super) const NONE: Self = Self {
        vertices: VerticesX8::NONE,
        throughput: Vec3x8::ZERO,
        offsets: [OffsetsX8::start(0); N],
        own: [const { VerticesX8::NONE }; N],
    };

    /// Makes it that of no lane; the numbers stay.
    pub(super) fn clear(&mut self) {
        self.vertices.clear();
        self.offsets = [OffsetsX8::start(0); N];
        self.own.iter_mut().for_each(VerticesX8::clear);
    }

    /// Keeps the vertices of all lanes.
    pub(super) fn set(&mut self, block: &Block<N>, own: &[VerticesX8; N]) {
        self.vertices.clone_from(&block.vertices);
        self.throughput = block.throughput;
        self.offsets = block.offsets;
        self.own.clone_from(own);
    }

    /// Puts the vertices in lane `from` of `other` into a lane.
    pub(super) fn copy(&mut self, lane: usize, other: &Self, from: usize) {
        self.vertices.copy::<false>(lane, &other.vertices, from);
        self.throughput.set(lane, other.throughput.lane(from));
        for (offset, other) in self.offsets.iter_mut().zip(&other.offsets) {
            offset.copy(lane, other, from);
        }
        copy_own(&mut self.own, (lane, from), &other.own, &other.offsets);
    }
}

/// The vertices of a request.
#[derive(Clone, Copy)]
struct Places<'a, const N: usize> {
    vertices: &'a VerticesX8,
    throughput: Vec3x8,
    offsets: &'a [OffsetsX8; N],
    own: &'a [VerticesX8; N],
}

impl<const N: usize> BasePaths<N> {
    /// Samples light through mirrors and glass at the rough vertices x_k, and gathers what comes from there. Through
    /// glass these are the samples of the light step that were not seen, or to which slabs lead as well.
    pub(super) fn walk_step(&mut self, context: Context, k: u32) {
        let scene = context.scene;
        // There is no room for a chain.
        if k + 2 > context.settings.depth {
            return;
        }
        let mut requests = std::mem::take(&mut self.requests);
        requests.clear();
        self.walks.clear();
        let live = self.live.iter().map(|&at| &self.blocks[at as usize]);
        draw(live.map(|block| &block.samplers), k, &mut self.numbers);
        let mut by_balls = self.by_balls.iter().peekable();
        for (index, &at) in self.live.iter().enumerate() {
            let block = &self.blocks[at as usize];
            let x = &block.vertices;
            let rough = x.rough & block.alive;
            if rough == 0 {
                continue;
            }
            if let Some((sampled, unseen)) = self.unseen.get(index)
                && let tried = straight_on(context, &block.samplers, k, rough & unseen)
                && tried != 0
            {
                let request = Request::begin(&mut requests, (index as u32, None), k);
                for lane in lanes_of(tried) {
                    let way = sampled.lane(lane).map(|end| (end, Through::Passage));
                    request.ask(&mut self.walks, x, lane, way);
                }
            }
            let before = requests.len();
            while let Some(&(_, lane, way)) = by_balls.next_if(|(of, ..)| *of == index as u32) {
                // One way of a lane in each request.
                let mut begun = requests[before..].iter();
                let request = match begun.position(|r| r.lanes >> lane & 1 == 0) {
                    Some(place) => &mut requests[before + place],
                    None => Request::begin(&mut requests, (index as u32, None), k),
                };
                request.ask(&mut self.walks, x, lane, Some(way));
            }
            let tried = lanes_where(rough, |lane| context.tries(&block.samplers[lane], k));
            if tried == 0 {
                continue;
            }
            let [u0, u1, u2, u3] = self.numbers[index];
            let light = scene.sample_lights::<false>(x.position, tried, [u0, u1, u2]);
            let from = (x.position, k);
            let (ways, probability) = by_mirrors(context, from, &block.samplers, &light, tried, u3);
            let request = Request::begin(&mut requests, (index as u32, None), k);
            for lane in lanes_of(tried) {
                request.ask(&mut self.walks, x, lane, ways[lane]);
            }
            request.probability = Some(probability);
        }
        self.answer(context, &mut requests);
        self.requests = requests;
    }

    /// Gathers paths that have reached light by chains which a walk finds too. All others of their kind are BSDF
    /// sampling's alone, and copy half vectors; their copies are dead if a walk finds these.
    pub(super) fn walk_again(&mut self, context: Context) {
        let mut requests = std::mem::take(&mut self.requests);
        requests.clear();
        self.walks.clear();
        for found in &self.found {
            let block = &self.blocks[self.live[found.index as usize] as usize];
            let at = block.chain[found.lane];
            let Some(chain) = self.chains.get(at) else {
                continue;
            };
            // Those that began together go together.
            let of_block = |r: &&mut Request<N>| r.index == found.index;
            let mut same = requests.iter_mut().rev().take_while(of_block);
            let request = match same.position(|r| r.kept == Some(chain.note)) {
                Some(back) => {
                    let last = requests.len() - 1;
                    &mut requests[last - back]
                }
                None => {
                    let begun = (found.index, Some(chain.note));
                    Request::begin(&mut requests, begun, chain.start.k)
                }
            };
            let x = &self.kept[chain.note as usize].vertices;
            request.ask(&mut self.walks, x, found.lane, Some(found.way));
            request.chains[found.lane] = at;
        }
        self.answer(context, &mut requests);
        self.requests = requests;
    }

    /// The walks that have been made last from the base path in a lane, and the complete paths that they gave, for
    /// those who watch.
    pub(super) fn walked(&self, context: Context, lane: usize) -> Vec<Walked<N>> {
        let requests = self.requests.iter().filter(|r| r.ways[lane].is_some());
        let walked = requests.map(|request| {
            let (reflectors, materials) = (&context.scene.reflectors, &context.scene.materials);
            let name = |&r: &u32| {
                materials[reflectors.list()[r as usize].material as usize]
                    .name
                    .as_str()
            };
            let way = match request.ways[lane] {
                Some((_, Through::Mirrors(by))) => {
                    let names: Vec<&str> = by.numbers().iter().map(name).collect();
                    format!("by {}", names.join(" and "))
                }
                Some((_, Through::Microfacet(reflector, normal))) => {
                    let angle = normal.x.hypot(normal.y).atan2(normal.z).to_degrees();
                    let of = name(&reflector);
                    format!("by a microfacet of {of}, turned by {angle:.2}°")
                }
                Some((_, Through::Ball(reflector, branch))) => {
                    format!(
                        "through a ball of {}, {}",
                        name(&reflector),
                        branch.describe()
                    )
                }
                _ => "through glass".to_owned(),
            };
            let shots = self.walks.shots(request.walks[lane]);
            let shots = if shots == 1 {
                "1 shot".to_owned()
            } else {
                format!("{shots} shots")
            };
            let came_of_it = match self.walks.link(request.walks[lane]) {
                Ok(link) => format!(
                    "{} specular, geometry term {:.6e}, {}",
                    match link.vertices {
                        1 => "1 vertex".to_owned(),
                        m => format!("{m} vertices"),
                    },
                    link.geometry,
                    if link.free { "seen" } else { "blocked" }
                ),
                Err(failure) => format!("none: {}", failure.describe()),
            };
            let complete = self.places(request).complete(context, &self.walks, request);
            let (base, shifts, valid, _) = complete;
            Walked {
                text: format!("a walk to light {way}, {shots}: {came_of_it}"),
                complete: (valid >> lane & 1 == 1).then_some((base, shifts)),
            }
        });
        walked.collect()
    }

    /// Where the walks of a request begin.
    fn places(&self, request: &Request<N>) -> Places<'_, N> {
        match request.kept {
            None => {
                let at = self.live[request.index as usize] as usize;
                let block = &self.blocks[at];
                Places {
                    vertices: &block.vertices,
                    throughput: block.throughput,
                    offsets: &block.offsets,
                    own: &self.own[at],
                }
            }
            Some(note) => {
                let kept = &self.kept[note as usize];
                Places {
                    vertices: &kept.vertices,
                    throughput: kept.throughput,
                    offsets: &kept.offsets,
                    own: &kept.own,
                }
            }
        }
    }

    /// Makes the walks, those of the offset paths where the base paths have a chain, and gathers what they find.
    fn answer(&mut self, context: Context, requests: &mut [Request<N>]) {
        let scene = context.scene;
        if requests.is_empty() {
            return;
        }
        let mut walks = std::mem::take(&mut self.walks);
        walks.solve(scene, context.tracer);
        let mut checks = std::mem::take(&mut self.checks);
        for request in requests.iter_mut() {
            for lane in lanes_of(request.lanes) {
                let found = match walks.link(request.walks[lane]) {
                    Ok(link) => match self.chains.get(request.chains[lane]) {
                        Some(chain) => chain.is(link),
                        None => fits(context, request.k, link.vertices),
                    },
                    Err(_) => false,
                };
                if !found {
                    request.lanes &= !(1 << lane);
                    self.check_copies(scene, request, lane, (&mut walks, &mut checks));
                }
            }
            let places = self.places(request);
            for (j, offset) in places.offsets.iter().enumerate() {
                for lane in lanes_of(request.lanes & offset.free()) {
                    if let Some((end, through)) = request.ways[lane] {
                        let start = start(&places.own[j], lane, request.k);
                        let walk = walks.push(start, end.target, through);
                        request.offsets[j][lane] = walk;
                    }
                }
            }
        }
        walks.solve(scene, context.tracer);
        self.counts.add_rays(walks.take_traced());
        for check in checks.drain(..) {
            let copy = &self.copies[check.chain as usize][check.j];
            if walks.link(check.walk).is_ok_and(|link| copy.is(link)) {
                let follower = &mut self.flights[check.index as usize].followers[check.j];
                follower.arrived &= !(1 << check.lane);
                self.counts.die(Death::Walk, 1);
            }
        }
        self.checks = checks;
        let weights = context.settings.weights;
        for request in requests.iter().filter(|r| r.lanes != 0) {
            let places = self.places(request);
            let (base, shifts, valid, dead) = places.complete(context, &walks, request);
            self.counts.deaths[Death::Walk as usize] += u64::from(dead);
            if request.kept.is_some() {
                // What a walk finds, and is of no use, does not copy either.
                let followers = &mut self.flights[request.index as usize].followers;
                for follower in followers {
                    follower.arrived &= !(follower.copies & request.lanes & !valid);
                }
            }
            if valid == 0 {
                continue;
            }
            let at = self.live[request.index as usize];
            self.blocks[at as usize].gather(weights, &base, &shifts, valid);
            if request.kept.is_some() {
                self.flights[request.index as usize].walked |= valid;
            }
        }
        self.walks = walks;
    }
}

impl<const N: usize> BasePaths<N> {
    /// Of a path in a lane that BSDF sampling alone finds: walks that may find the copies of its offset paths, which
    /// are dead then.
    fn check_copies(
        &mut self,
        scene: &Scene,
        request: &Request<N>,
        lane: usize,
        (walks, checks): (&mut Walks, &mut Vec<Check>),
    ) {
        let (Some(note), Some((_, through))) = (request.kept, request.ways[lane]) else {
            return;
        };
        let (index, chain) = (request.index, request.chains[lane]);
        let block = &self.blocks[self.live[index as usize] as usize];
        for (j, offset) in block.offsets.iter().enumerate() {
            let follower = &mut self.flights[index as usize].followers[j];
            if (offset.free() & follower.copies & follower.arrived) >> lane & 1 == 0 {
                continue;
            }
            let start = start(&self.kept[note as usize].own[j], lane, request.k);
            let copy = &self.copies[chain as usize][j];
            match copy.way(scene, start.position, through) {
                Some((target, through)) => checks.push(Check {
                    index,
                    lane,
                    j,
                    chain,
                    walk: walks.push(start, target, through),
                }),
                None => {
                    follower.arrived &= !(1 << lane);
                    self.counts.die(Death::Walk, 1);
                }
            }
        }
    }
}

/// A walk in words.
pub(super) struct Walked<const N: usize> {
    pub(super) text: String,
    /// The complete path with its shifts, if there is one.
    pub(super) complete: Option<(Base<f32x8>, [Offset<f32x8>; N])>,
}

/// What BSDF sampling has found by a chain: light, in a lane of a live block.
pub(super) struct Found {
    index: u32,
    lane: usize,
    way: Way,
}

impl Found {
    pub(super) fn new(index: usize, lane: usize, way: Way) -> Self {
        Self {
            index: index as u32,
            lane,
            way,
        }
    }
}

impl<const N: usize> Request<N> {
    /// Adds one to those that there are, the last of which may have asked for nothing.
    fn begin(requests: &mut Vec<Self>, (index, kept): (u32, Option<u32>), k: u32) -> &mut Self {
        if requests.last().is_some_and(|last| last.lanes == 0) {
            requests.pop();
        }
        requests.push(Self {
            index,
            kept,
            k,
            lanes: 0,
            ways: [None; LANES],
            probability: None,
            walks: [0; LANES],
            offsets: [[0; LANES]; N],
            chains: [NONE; LANES],
        });
        let last = requests.len() - 1;
        &mut requests[last]
    }

    fn ask(&mut self, walks: &mut Walks, from: &VerticesX8, lane: usize, way: Option<Way>) {
        if let Some((end, through)) = way {
            let start = start(from, lane, self.k);
            self.walks[lane] = walks.push(start, end.target, through);
            self.ways[lane] = way;
            self.lanes |= 1 << lane;
        }
    }
}

impl<const N: usize> Places<'_, N> {
    /// The complete paths of a request with their shifts, the lanes that have one, and how many shifts have died as
    /// there is no chain. Values are f, densities are p in the measure of the end: see the top of this file.
    fn complete(
        &self,
        context: Context,
        walks: &Walks,
        request: &Request<N>,
    ) -> (Base<f32x8>, [Offset<f32x8>; N], u32, u32) {
        let (scene, k) = (context.scene, request.k);
        let x = self.vertices;
        let ways = &request.ways;
        let chance = || probability(context, x.position, ways);
        let ways = (ways, request.probability.unwrap_or_else(chance));
        let links = LinksX8::new(context, walks, (x, k), &request.walks, ways, request.lanes);
        let eval = x.eval::<false>(scene, links.wi);
        let mut valid = links.valid & eval.valid.to_bitmask();
        let free = mask_of(links.free & valid);
        let seen = |value: Vec3x8| Vec3x8::select(free, value, Vec3x8::ZERO);
        let by_bsdf = free & (eval.pdf * x.survival(k) * links.per_pdf);
        let densities = links.by_walk + by_bsdf;
        valid &= positive(densities).to_bitmask();
        let base = Base {
            value: seen(self.throughput * eval.value * links.arriving),
            densities: mask_of(valid).select(densities, f32x8::ONE),
        };
        let mut shifts = [Offset::DEAD; N];
        let mut dead = 0;
        for (j, (shift, offset)) in shifts.iter_mut().zip(self.offsets).enumerate() {
            let carried = offset.carried;
            let mut put = |new: Offset<f32x8>, lanes: u32| {
                let lanes = mask_of(lanes);
                shift.value = Vec3x8::select(lanes, new.value, shift.value);
                shift.densities = lanes.select(new.densities, shift.densities);
            };
            if offset.connected() != 0 {
                let value = seen(carried.throughput * eval.value * links.arriving);
                let densities = carried.ratio * (links.by_walk + by_bsdf);
                put(Offset { value, densities }, offset.connected() & valid);
            }
            if offset.joined() != 0 {
                let eval = x.eval_seen_from::<false>(scene, offset.wo, links.wi);
                let by_bsdf = free & (eval.pdf * x.survival(k) * links.per_pdf);
                let value = seen(carried.throughput * eval.value * links.arriving);
                let densities = carried.ratio * (links.by_walk + by_bsdf);
                let lanes = offset.joined() & valid & eval.valid.to_bitmask();
                put(Offset { value, densities }, lanes);
            }
            let lanes = offset.free() & valid;
            if lanes != 0 {
                let y = &self.own[j];
                let walked = &request.offsets[j];
                let ways = (
                    &request.ways,
                    probability(context, y.position, &request.ways),
                );
                let links = LinksX8::new(context, walks, (y, k), walked, ways, lanes);
                let eval = y.eval::<false>(scene, links.wi);
                let free = mask_of(links.free);
                let by_bsdf = free & (eval.pdf * y.survival(k) * links.per_pdf);
                let value = carried.throughput * eval.value * links.arriving;
                let value = Vec3x8::select(free, value, Vec3x8::ZERO);
                let densities = carried.ratio * (links.by_walk + by_bsdf);
                let finite = (value.is_finite() & densities.is_finite()).to_bitmask();
                let there = links.valid & eval.valid.to_bitmask() & finite;
                put(Offset { value, densities }, there);
                dead += (lanes & !links.valid).count_ones();
            }
        }
        (base, shifts, valid, dead)
    }
}
