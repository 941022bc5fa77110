//! Light sampling at surfaces of class specular that spread light a little, as nearly smooth metal and glass do: paths
//! that BSDF sampling finds, in directions that light sampling draws.
//!
//! At rough surfaces offset paths share the point on the light. Here they copy the half vector, whichever technique has
//! made the path, and find light of their own: so such a path goes on as if its BSDF had been sampled, to the light
//! and no further. Where anything else is met first there is no path. What walks may find, they find better.
//!
//! No copied half vector finds a light without extent, and no BSDF sampling does: there offset paths do share it, see
//! the light step.

use super::base::{BasePaths, Block};
use super::bounce::Flight;
use super::chain::{self, Chains};
use super::light::{self, SeenX8};
use super::link::light_end;
use super::pack::copy_own;
use super::pool::Pool;
use super::{Context, trace_closest};
use crate::frame::Frame;
use crate::lanes::{LANES, Vec3x8, lanes_of, lanes_where, negative, positive};
use crate::scene::light::Source;
use crate::trace::RayKind;
use crate::trace::rays::HitsX8;
use crate::vertex::{ScatteringX8, VerticesX8};
use wide::f32x8;

/// Scattering events towards points on lights.
struct AimedX8 {
    /// With the densities of BSDF sampling.
    scattering: ScatteringX8,
    /// The lights.
    sources: [Option<Source>; LANES],
}

impl AimedX8 {
    /// At the vertices x_k in `lanes`, with `u` in [0, 1)³. It does not hold where BSDF sampling would not find the
    /// light.
    fn new(context: Context, (x, k): (&VerticesX8, u32), lanes: u32, u: [f32x8; 3]) -> Self {
        let scene = context.scene;
        let light = scene.sample_lights::<false>(x.position, lanes, u);
        let seen = SeenX8::new::<false>(scene, x.position, &light);
        let eval = x.eval::<false>(scene, seen.wi);
        let frame = Frame::new(x.normal);
        let (local_wo, local_wi) = (frame.to_local(x.wo()), frame.to_local(seen.wi));
        let pdf = eval.pdf * x.survival(k);
        let valid = seen.valid & eval.valid & positive(pdf) & pdf.simd_lt(f32x8::splat(f32::MAX));
        Self {
            scattering: ScatteringX8 {
                wi: seen.wi,
                local_wi,
                value: eval.value,
                pdf,
                valid: valid.to_bitmask() & lanes & !light.punctual,
                delta: 0,
                transmits: negative(local_wo.z * local_wi.z).to_bitmask(),
            },
            sources: std::array::from_fn(|lane| Some(light.lane(lane)?.source)),
        }
    }

    /// Of `lanes` those that have met their lights.
    fn seen(&self, context: Context, hits: &HitsX8, lanes: u32) -> u32 {
        lanes_where(lanes, |lane| {
            let end = light_end(context.scene, hits, lane);
            end.is_some_and(|end| Some(end.source) == self.sources[lane])
        })
    }
}

/// Copies of blocks, whose paths end on lights.
#[derive(Default)]
pub(super) struct AimedPaths<const N: usize> {
    blocks: Pool<Block<N>>,
    own: Pool<[VerticesX8; N]>,
    live: Vec<u32>,
    aimed: Vec<AimedX8>,
    /// The blocks of which they are copies.
    of: Vec<u32>,
}

impl<const N: usize> Block<N> {
    /// The lanes in which paths are aimed at lights.
    pub(super) fn aims(&self, chains: &Chains) -> u32 {
        let spreading = self.alive & self.vertices.spreading() & self.carries_light();
        chains.beyond(&self.chain, spreading)
    }
}

impl<const N: usize> BasePaths<N> {
    /// Puts paths that are aimed at lights from x_k in the place of those that are there, until
    /// [`BasePaths::gather_aimed`]; whether there are any.
    pub(super) fn aim(&mut self, context: Context, k: u32) -> bool {
        let mut to = std::mem::take(&mut self.aimed);
        to.blocks.clear();
        to.own.clear();
        to.live.clear();
        to.aimed.clear();
        to.of.clear();
        let aims = |at: &&u32| self.blocks[**at as usize].aims(&self.chains) != 0;
        to.of.extend(self.live.iter().filter(aims));
        let samplers = to.of.iter().map(|&at| &self.blocks[at as usize].samplers);
        light::draw(samplers, k, &mut self.numbers);
        self.bounce.clear();
        self.flights.clear();
        for (&at, &[u0, u1, u2, _]) in to.of.iter().zip(&self.numbers) {
            let block = &self.blocks[at as usize];
            let x = &block.vertices;
            let aimed = AimedX8::new(context, (x, k), block.aims(&self.chains), [u0, u1, u2]);
            let rays = x.rays(aimed.scattering.wi);
            let flight = self.flights.next(|| Flight::NONE);
            flight.scattering = aimed.scattering;
            flight.alive = aimed.scattering.valid;
            for lane in lanes_of(flight.alive) {
                flight.ray[lane] = self.bounce.push(&rays.lane(lane));
            }
            to.aimed.push(aimed);
        }
        trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
        for ((&at, flight), aimed) in to.of.iter().zip(self.flights.iter_mut()).zip(&to.aimed) {
            let wi = flight.scattering.wi;
            let hits = self.bounce.hits_of(&flight.ray, flight.alive, wi);
            flight.alive = aimed.seen(context, &hits, flight.alive);
            let (block, own) = (&self.blocks[at as usize], &self.own[at as usize]);
            let copy = to.blocks.next(|| Block::NONE);
            copy.clear();
            let own_copy = to.own.next(|| [const { VerticesX8::NONE }; N]);
            own_copy.iter_mut().for_each(VerticesX8::clear);
            for lane in lanes_of(flight.alive) {
                copy.copy::<false>(lane, block, lane);
                copy_own(own_copy, (lane, lane), own, &block.offsets);
                copy.chain[lane] = chain::NONE;
            }
            (copy.primal, copy.to) = (Vec3x8::ZERO, [Vec3x8::ZERO; N]);
        }
        to.live.extend(0..to.blocks.len() as u32);
        let any = !to.live.is_empty();
        self.aimed = to;
        if any {
            self.swap_with_aimed();
        }
        any
    }

    /// Puts the paths back that were there, with what those that were aimed have gathered.
    pub(super) fn gather_aimed(&mut self) {
        self.swap_with_aimed();
        for (&at, aimed) in self.aimed.of.iter().zip(self.aimed.blocks.iter()) {
            let block = &mut self.blocks[at as usize];
            block.primal = block.primal + aimed.primal;
            for (to, light) in block.to.iter_mut().zip(&aimed.to) {
                *to = *to + *light;
            }
        }
    }

    fn swap_with_aimed(&mut self) {
        std::mem::swap(&mut self.blocks, &mut self.aimed.blocks);
        std::mem::swap(&mut self.own, &mut self.aimed.own);
        std::mem::swap(&mut self.live, &mut self.aimed.live);
    }
}
