//! Packing: where many lanes of the blocks are empty, paths that go on move together, those at rough surfaces and those
//! at mirrors and glass apart. What a path gathers does not depend on its lane.

use super::base::{BasePaths, Block};
use super::chain::{self, Chains};
use super::manifold::Kept;
use super::pool::Pool;
use crate::lanes::{LANES, lanes_of};
use crate::shift::OffsetsX8;
use crate::sums::PixelSample;
use crate::vertex::VerticesX8;

/// Blocks are packed if this share of them, or less, holds all paths: to move paths costs little against what a block
/// costs in each of the steps that follow.
const WORTH: f32 = 0.9;

/// Blocks as they were, with the offset paths' own vertices.
#[derive(Default)]
pub(super) struct Before<const N: usize> {
    blocks: Pool<Block<N>>,
    own: Pool<[VerticesX8; N]>,
}

impl<const N: usize> BasePaths<N> {
    /// Moves the paths together if that pays; those that have ended leave what they gathered in `samples`. Not at the
    /// primary hits, which are in the order of the pixels.
    pub(super) fn pack<const DIFFUSE: bool>(&mut self, samples: &mut [PixelSample]) {
        let blocks = self.live.iter().map(|&at| &self.blocks[at as usize]);
        let paths = blocks.fold(0, |sum, block| sum + block.alive.count_ones() as usize);
        if paths.div_ceil(LANES) as f32 > WORTH * self.live.len() as f32 {
            return;
        }
        let Before { blocks, own } = &mut self.before;
        std::mem::swap(blocks, &mut self.blocks);
        std::mem::swap(own, &mut self.own);
        self.blocks.clear();
        self.own.clear();
        for block in blocks.iter() {
            block.deliver(!block.alive, samples);
        }
        for rough in [true, false] {
            // Of the new block that is being filled the lanes that are, and where the vertices are at which its chains
            // began.
            let mut filled = LANES;
            let mut notes = [None; LANES];
            for &at in &self.live {
                let block = &blocks[at as usize];
                let surfaces = block.vertices.rough;
                let moves = block.alive & if rough { surfaces } else { !surfaces };
                for from in lanes_of(moves) {
                    if filled == LANES {
                        filled = 0;
                        notes = [None; LANES];
                        self.blocks.next(|| Block::NONE).clear();
                        if !DIFFUSE {
                            let own = self.own.next(|| [const { VerticesX8::NONE }; N]);
                            own.iter_mut().for_each(VerticesX8::clear);
                        }
                    }
                    let at_new = self.blocks.len() - 1;
                    let to = &mut self.blocks[at_new];
                    to.copy::<DIFFUSE>(filled, block, from);
                    if !DIFFUSE {
                        let (to, own) = (&mut self.own[at_new], &own[at as usize]);
                        copy_own(to, (filled, from), own, &block.offsets);
                        let chain = block.chain[from];
                        if chain != chain::NONE {
                            let lanes = (filled, from);
                            keep(&mut self.chains, &mut self.kept, &mut notes, chain, lanes);
                        }
                    }
                    filled += 1;
                }
            }
        }
        self.live.clear();
        self.live.extend(0..self.blocks.len() as u32);
    }
}

/// Puts the vertices that the offset paths `offsets` have for themselves in lane `from` of `own` into lane `lane`.
pub(super) fn copy_own<const N: usize>(
    to: &mut [VerticesX8; N],
    (lane, from): (usize, usize),
    own: &[VerticesX8; N],
    offsets: &[OffsetsX8; N],
) {
    for ((to, own), offset) in to.iter_mut().zip(own).zip(offsets) {
        if offset.free() >> from & 1 == 1 {
            to.copy::<false>(lane, own, from);
        }
    }
}

/// Where the vertices x_k are kept at which chains of a block began.
#[derive(Clone, Copy)]
struct Note {
    k: u32,
    number: u32,
}

/// Moves the vertex at which a chain began into the lane where the path is now. `notes`: those of the block so far.
fn keep<const N: usize>(
    chains: &mut Chains,
    kept: &mut Pool<Kept<N>>,
    notes: &mut [Option<Note>; LANES],
    chain: u32,
    (to, from): (usize, usize),
) {
    let Some(chain) = chains.get_mut(chain) else {
        return;
    };
    // Those that began together stay together.
    let k = chain.start.k;
    let together = notes.iter().flatten().find(|note| note.k == k);
    let number = match together {
        Some(note) => note.number,
        None => {
            let number = kept.len() as u32;
            kept.next(|| Kept::NONE).clear();
            // There are no more than lanes.
            if let Some(free) = notes.iter_mut().find(|note| note.is_none()) {
                *free = Some(Note { k, number });
            }
            number
        }
    };
    let (before, new) = kept.split_at_mut(number as usize);
    new[0].copy(to, &before[chain.note as usize], from);
    chain.note = number;
}

impl<const N: usize> Block<N> {
    /// Puts the path in lane `from` of `other` into a lane.
    #[inline(always)]
    pub(super) fn copy<const DIFFUSE: bool>(&mut self, lane: usize, other: &Self, from: usize) {
        self.pixels[lane] = other.pixels[from];
        self.vertices.copy::<DIFFUSE>(lane, &other.vertices, from);
        self.throughput.set(lane, other.throughput.lane(from));
        self.samplers[lane] = other.samplers[from];
        self.alive |= 1 << lane;
        for (to, offset) in self.offsets.iter_mut().zip(&other.offsets) {
            to.copy(lane, offset, from);
        }
        if !DIFFUSE {
            self.chain[lane] = other.chain[from];
            self.kinds.copy(lane, &other.kinds, from);
        }
        self.primal.set(lane, other.primal.lane(from));
        for (to, light) in self.to.iter_mut().zip(&other.to) {
            to.set(lane, light.lane(from));
        }
    }
}
