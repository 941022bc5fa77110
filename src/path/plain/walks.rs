//! Walks to light from plain paths.

use super::super::link::{self, LinksX8, start};
use super::super::shares::Kind;
use super::{Context, PlainBlock, PlainPaths};
use crate::lanes::{Float, LANES, Vec3x8, first_lanes, lanes_of};
use crate::manifold::{Through, Walks};
use crate::sampler::Sampler;
use crate::vertex::VerticesX8;
use glam::Vec3;
use wide::f32x8;

/// Walks from eight vertices.
pub(super) struct Request {
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
    fn ask(&mut self, walks: &mut Walks, k: u32, lanes: u32) {
        for lane in lanes_of(lanes) {
            if let Some((end, through)) = &self.ways[lane] {
                let start = start(&self.vertices, lane, k);
                self.walks[lane] = walks.push(start, end.target, *through);
                self.lanes |= 1 << lane;
            }
        }
    }
}

impl PlainPaths {
    /// Samples light through mirrors and glass, and gathers what comes from there.
    pub(super) fn walk_step(&mut self, context: Context, k: u32) {
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
                request.ask(&mut self.walks, k, lanes);
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
                request.ask(&mut self.walks, k, lanes);
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
                let reflectors = &context.scene.reflectors;
                for lane in lanes_of(lanes) {
                    if let Some((_, through)) = &request.ways[lane] {
                        let kind = Kind::of(through, reflectors);
                        ledger.walk(kind, self.walks.rays(walks[lane]));
                    }
                }
                let by_bsdf = by_bsdf / links.by_walk;
                for lane in lanes_of(links.free & eval.valid.to_bitmask()) {
                    if let Some((_, through)) = &request.ways[lane] {
                        let path = request.index[lane];
                        let kind = Kind::of(through, reflectors);
                        ledger.bring(kind, path, value.lane(lane), by_bsdf.lane(lane));
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
            request.ask(&mut self.walks, k, lanes);
            if request.lanes != 0 {
                self.requests.push(request);
            }
        }
    }

    /// Gathers light that has been found by chains, weighted by whether a walk finds it too.
    pub(super) fn walk_again(&mut self, context: Context) {
        self.walks.clear();
        for found in &mut self.found {
            if let Some(chain) = self.chains.get(found.chain) {
                let (end, through) = found.way;
                found.walk = self.walks.push(chain.start, end.target, through);
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
                let kind = Kind::of(through, &context.scene.reflectors);
                ledger.walk_again(kind, self.walks.rays(found.walk));
                ledger.bring(kind, found.index, light, 1.0 / by_walk);
            }
        }
        self.counts.add_rays(self.walks.take_traced());
    }
}
