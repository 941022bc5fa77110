//! Base paths with offset paths that have vertices or directions of their own: from the camera until all offset
//! paths are connected or dead. What follows then is the same for all of them.

use super::aim::AimedPaths;
use super::bounce::Flight;
use super::chain::{self, Chains};
use super::copied::{CopiedChain, Kinds};
use super::grid::Grid;
use super::light::LightBlock;
use super::link::{Unseen, Way};
use super::manifold::{Check, Found, Kept, Request};
use super::pack::Before;
use super::plain::PlainPaths;
use super::pool::Pool;
use super::{Counts, Share, primary};
use crate::gradient::{Base, Neighbour, Offset, Weights};
use crate::lanes::{LANES, Vec3x8, first_lanes, lanes_of, mask_of};
use crate::manifold::Walks;
use crate::sampler::Sampler;
use crate::shift::{CarriedX8, OffsetsX8};
use crate::sums::PixelSample;
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::vertex::VerticesX8;
use wide::f32x8;

/// Base paths at one vertex with their `N` offset paths, with the buffers for their next steps. `N` is 4, one for each
/// [`Neighbour`], or 0 for plain path tracing, which leaves after the camera rays.
///
/// In the steps, `DIFFUSE` says that all surfaces are Lambert's, that lights are plain, and that the camera has no
/// lens: then offset paths have vertices of their own at the primary hits alone.
#[derive(Default)]
pub(super) struct BasePaths<const N: usize> {
    pub(super) blocks: Pool<Block<N>>,
    /// The offset paths' own vertices, block by block. Empty if `DIFFUSE`: there they are in the grid.
    pub(super) own: Pool<[VerticesX8; N]>,
    pub(super) grid: Grid,
    /// What was there before the paths were packed.
    pub(super) before: Before<N>,
    /// Copies of blocks, whose paths end on lights.
    pub(super) aimed: AimedPaths<N>,
    /// The blocks with paths that go on. The buffers of a step have an entry for each of them.
    pub(super) live: Vec<u32>,
    /// Random numbers for one step of each path.
    pub(super) numbers: Vec<[f32x8; 4]>,
    pub(super) lights: Pool<LightBlock<N>>,
    pub(super) flights: Pool<Flight<N>>,
    pub(super) primary: primary::Buffers,
    pub(super) bounce: ClosestBatch,
    pub(super) continuation: ClosestBatch,
    pub(super) shadow: AnyBatch,
    pub(super) reconnection: AnyBatch,
    /// What lies between paths and their last rough vertices, and those.
    pub(super) chains: Chains,
    pub(super) kept: Pool<Kept<N>>,
    /// For each chain those of the offset paths, where they copy it.
    pub(super) copies: Vec<[CopiedChain; N]>,
    /// Of the light step, for each live block; empty where no light goes through glass.
    pub(super) unseen: Vec<Unseen>,
    /// Of the light step: ways through balls of glass, with the live blocks, in order, and the lanes from which they are
    /// tried.
    pub(super) by_balls: Vec<(u32, usize, Way)>,
    pub(super) found: Vec<Found>,
    pub(super) requests: Vec<Request<N>>,
    pub(super) checks: Vec<Check>,
    pub(super) walks: Walks,
    pub(super) counts: Counts,
}

/// Eight base paths at their current vertices x_k: at first those of eight pixels in a row, until they are packed.
pub(super) struct Block<const N: usize> {
    /// The indices of their pixels in the tile, or [`NO_PIXEL`].
    pub(super) pixels: [u32; LANES],
    /// At primary hits, the place of the first in the grid.
    pub(super) place: usize,
    pub(super) vertices: VerticesX8,
    /// f/p up to x_k, the scattering there excluded.
    pub(super) throughput: Vec3x8,
    pub(super) samplers: [Sampler; LANES],
    /// A bit for each lane that holds a path.
    pub(super) alive: u32,
    pub(super) offsets: [OffsetsX8; N],
    /// The chains of single directions that have led here from rough vertices.
    pub(super) chain: [u32; LANES],
    pub(super) kinds: Kinds<N>,
    /// What the paths gathered: [`PixelSample`] in lanes.
    pub(super) primal: Vec3x8,
    pub(super) to: [Vec3x8; N],
}

/// In place of the index of a pixel: none.
pub(super) const NO_PIXEL: u32 = u32::MAX;

impl<const N: usize> Block<N> {
    /// No paths.
    pub(super) const NONE: Self = Self {
        pixels: [NO_PIXEL; LANES],
        place: 0,
        vertices: VerticesX8::NONE,
        throughput: Vec3x8::ONE,
        samplers: [Sampler::NONE; LANES],
        alive: 0,
        offsets: [OffsetsX8::start(0); N],
        chain: [chain::NONE; LANES],
        kinds: Kinds::NONE,
        primal: Vec3x8::ZERO,
        to: [Vec3x8::ZERO; N],
    };

    /// Makes it one without paths; numbers in lanes without paths stay.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.vertices.clear();
        let Self {
            pixels,
            place,
            throughput,
            alive,
            offsets,
            chain,
            kinds,
            primal,
            to,
            ..
        } = Self::NONE;
        (self.pixels, self.place, self.alive) = (pixels, place, alive);
        (self.throughput, self.offsets) = (throughput, offsets);
        (self.chain, self.kinds) = (chain, kinds);
        (self.primal, self.to) = (primal, to);
    }

    /// Adds complete paths and their shifts, in the lanes `valid`.
    #[inline(always)]
    pub(super) fn gather(
        &mut self,
        weights: Weights,
        base: &Base<f32x8>,
        shifts: &[Offset<f32x8>; N],
        valid: u32,
    ) {
        let valid = mask_of(valid);
        let zero = Vec3x8::ZERO;
        self.primal = self.primal + Vec3x8::select(valid, base.primal(), zero);
        for (to, shift) in self.to.iter_mut().zip(shifts) {
            *to = *to + Vec3x8::select(valid, base.difference(shift, weights), zero);
        }
    }

    /// Leaves what the paths in `lanes` gathered in the samples of their pixels.
    pub(super) fn deliver(&self, lanes: u32, samples: &mut [PixelSample]) {
        for lane in lanes_of(lanes & first_lanes(LANES)) {
            if self.pixels[lane] == NO_PIXEL {
                continue;
            }
            let sample = &mut samples[self.pixels[lane] as usize];
            sample.primal = self.primal.lane(lane);
            for (sum, to) in sample.to.iter_mut().zip(&self.to) {
                *sum = to.lane(lane);
            }
        }
    }

    /// A bit for each lane whose path is in a chain that began at a rough vertex.
    #[inline(always)]
    pub(super) fn in_chain(&self) -> u32 {
        (0..LANES).fold(0, |bits, lane| {
            bits | u32::from(self.chain[lane] != chain::NONE) << lane
        })
    }

    /// A bit for each lane in which anything that follows can still count.
    #[inline(always)]
    pub(super) fn carries_light(&self) -> u32 {
        let offsets = self.offsets.iter();
        offsets.fold(self.throughput.is_not_zero().to_bitmask(), |bits, o| {
            bits | o.alive() & o.carried.throughput.is_not_zero().to_bitmask()
        })
    }
}

/// Where the offset paths' own vertices are.
pub(super) struct Own<'a, const N: usize> {
    pub(super) grid: &'a Grid,
    pub(super) stored: &'a [[VerticesX8; N]],
}

impl<const N: usize> Own<'_, N> {
    /// What `f` says of those of offset path `j` of the block `at`, which begins at `place` of the grid.
    #[inline(always)]
    pub(super) fn with<const DIFFUSE: bool, R>(
        &self,
        (at, place): (u32, usize),
        j: usize,
        f: impl FnOnce(&VerticesX8) -> R,
    ) -> R {
        if DIFFUSE {
            f(&self.grid.load(place, step(j, self.grid.width)))
        } else {
            f(&self.stored[at as usize][j])
        }
    }
}

/// Steps in the grid to a [`Neighbour`].
#[inline(always)]
pub(super) fn step(neighbour: usize, width: usize) -> isize {
    let (x, y) = Neighbour::ALL[neighbour].step();
    x as isize + y as isize * width as isize
}

impl<const N: usize> BasePaths<N> {
    /// Whether no path goes on.
    pub(super) fn is_empty(&self) -> bool {
        self.live.is_empty()
    }

    /// Makes plain paths of those whose offset paths are all connected or dead.
    pub(super) fn hand_over<const DIFFUSE: bool>(
        &mut self,
        weights: Weights,
        plain: &mut PlainPaths,
        shares: &mut Vec<Share<N>>,
    ) {
        for &at in &self.live {
            let block = &mut self.blocks[at as usize];
            let offsets = block.offsets.iter();
            let on_their_own = offsets.fold(0, |bits, o| bits | o.free() | o.joined());
            // A path in a chain may yet be found by a walk from the vertex where its offset paths were on their own.
            let in_chain = if DIFFUSE { 0 } else { block.in_chain() };
            let settled = block.alive & !on_their_own & !in_chain;
            if settled == 0 {
                continue;
            }
            block.alive &= !settled;
            // Densities of the base path are inside what follows: here they are 1.
            let base = Base {
                value: block.throughput,
                densities: f32x8::ONE,
            };
            let mut to = [Vec3x8::ZERO; N];
            let mut counts = base.value.is_not_zero();
            for (to, offset) in to.iter_mut().zip(&block.offsets) {
                let connected = mask_of(offset.connected());
                let CarriedX8 { throughput, ratio } = offset.carried;
                let shift = Offset {
                    value: Vec3x8::select(connected, throughput, Vec3x8::ZERO),
                    densities: connected & ratio,
                };
                *to = base.difference(&shift, weights);
                counts |= to.is_not_zero();
            }
            let primal = base.primal();
            for lane in lanes_of(settled & counts.to_bitmask()) {
                plain.push::<DIFFUSE>(&block.vertices, lane, block.samplers[lane]);
                shares.push(Share {
                    pixel: block.pixels[lane],
                    primal: primal.lane(lane),
                    to: to.each_ref().map(|to| to.lane(lane)),
                });
            }
        }
        self.live.retain(|&at| self.blocks[at as usize].alive != 0);
    }

    /// Puts what the paths gathered into the samples of their pixels, and forgets them.
    pub(super) fn collect(&mut self, samples: &mut [PixelSample]) {
        self.live.clear();
        self.chains.clear();
        self.kept.clear();
        self.copies.clear();
        if N == 0 {
            // They have all become plain paths.
            return;
        }
        for block in self.blocks.iter() {
            block.deliver(first_lanes(LANES), samples);
        }
    }
}
