//! Base and offset paths of a tile, traced together: at each vertex a light step, then a bounce step,
//! each a few batches of rays of one kind.
//!
//! The estimator is that of method.md section 2, carried in ratios: F = f(x)/p(x) for the base path,
//! [`Carried`](crate::shift::Carried) for what an offset path adds to it.

mod bounce;
mod light;
mod primary;

use crate::gradient::{Base, Shift, Weights};
use crate::sampler::{self, Sampler};
use crate::scene::Scene;
use crate::shift::{Death, Offset};
use crate::sums::{PixelSample, TileSums};
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::trace::{RayKind, Traverse};
use crate::vertex::{End, Vertex};
use glam::Vec3;
use std::ops::Range;

/// What the estimate depends on, beside the scene.
#[derive(Clone, Copy, Debug)]
pub struct PathSettings {
    /// Longest path in segments; 1 is light seen directly.
    pub depth: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Weights of the differences.
    pub weights: Weights,
}

/// Russian roulette starts at this vertex. It depends on the material alone, so its probabilities are
/// the same for what base and offset path share; where they do not share they are part of p.
const ROULETTE_FROM: u32 = 4;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Counts over the work done.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rays by kind, see [`RayKind::index`].
    pub rays: [u64; RayKind::ALL.len()],
    /// Dead shifts by reason, see [`Death::ALL`].
    pub deaths: [u64; Death::ALL.len()],
    /// Samples dropped because they were not finite.
    pub dropped: u64,
    /// The first of them: pixel and sample number.
    pub first_dropped: Option<(u32, u32, u64)>,
}

impl Counts {
    /// Adds what another tile counted.
    pub fn add(&mut self, other: &Counts) {
        self.rays
            .iter_mut()
            .zip(other.rays)
            .for_each(|(a, b)| *a += b);
        self.deaths
            .iter_mut()
            .zip(other.deaths)
            .for_each(|(a, b)| *a += b);
        self.dropped += other.dropped;
        self.first_dropped = self.first_dropped.or(other.first_dropped);
    }
}

/// A base path at its current vertex x_k, with its offset paths: `N` is 4, one for each
/// [`Neighbour`](crate::gradient::Neighbour), or 0 for plain path tracing.
#[derive(Clone, Debug)]
struct BasePath<const N: usize> {
    /// Index into the tile's pixels.
    pixel: u32,
    sampler: Sampler,
    /// x_k
    vertex: Vertex,
    /// f/p up to x_k, the scattering there excluded.
    throughput: Vec3,
    offsets: [Offset; N],
}

impl<const N: usize> BasePath<N> {
    /// Whether anything that follows can still count.
    fn carries_light(&self) -> bool {
        self.throughput != Vec3::ZERO
            || self.offsets.iter().any(|o| match o {
                Offset::Free { carried, .. }
                | Offset::Joined { carried, .. }
                | Offset::Connected(carried) => carried.throughput != Vec3::ZERO,
                Offset::Dead => false,
            })
    }
}

/// The gradient-domain path tracer (`N` = 4) or the plain one (`N` = 0) with its buffers: for one thread,
/// used again for every tile.
pub struct PathTracer<const N: usize> {
    paths: Vec<BasePath<N>>,
    /// Primary hits of the tile and, with offset paths, of a border of one pixel.
    ends: Vec<Option<End>>,
    light_paths: Vec<light::LightPath<N>>,
    bounces: Vec<bounce::Bounce<N>>,
    samples: Vec<PixelSample>,
    primary: ClosestBatch,
    bounce: ClosestBatch,
    continuation: ClosestBatch,
    shadow: AnyBatch,
    reconnection: AnyBatch,
    counts: Counts,
}

impl<const N: usize> Default for PathTracer<N> {
    fn default() -> Self {
        Self {
            paths: Vec::new(),
            ends: Vec::new(),
            light_paths: Vec::new(),
            bounces: Vec::new(),
            samples: Vec::new(),
            primary: ClosestBatch::default(),
            bounce: ClosestBatch::default(),
            continuation: ClosestBatch::default(),
            shadow: AnyBatch::default(),
            reconnection: AnyBatch::default(),
            counts: Counts::default(),
        }
    }
}

/// What all steps of a tile read.
#[derive(Clone, Copy)]
struct Context<'a> {
    scene: &'a Scene,
    tracer: &'a dyn Traverse,
    settings: &'a PathSettings,
}

impl<const N: usize> PathTracer<N> {
    /// Traces the samples `range` of every pixel of `tile` and adds them to `sums`.
    pub fn render(
        &mut self,
        scene: &Scene,
        tracer: &dyn Traverse,
        settings: &PathSettings,
        tile: Tile,
        range: Range<u64>,
        sums: &mut TileSums,
    ) -> Counts {
        let context = Context {
            scene,
            tracer,
            settings,
        };
        self.counts = Counts::default();
        for sample in range {
            self.samples.clear();
            self.samples
                .resize((tile.width * tile.height) as usize, PixelSample::default());
            self.primary_step(context, tile, sample, sums);
            // A path at x_k has k segments; what is gathered there has k + 1.
            for k in 1..settings.depth {
                if self.paths.is_empty() {
                    break;
                }
                self.light_step(context, k);
                self.bounce_step(context, k);
            }
            self.paths.clear();
            self.finish_sample(tile, sample, sums);
        }
        std::mem::take(&mut self.counts)
    }

    /// Adds the sample of each pixel to its sums; what is not finite is dropped whole.
    fn finish_sample(&mut self, tile: Tile, sample: u64, sums: &mut TileSums) {
        let half = sampler::half(sample);
        for (index, value) in self.samples.iter().enumerate() {
            if value.is_finite() {
                sums.pixels[index].halves[half].add(value);
            } else {
                sums.pixels[index].dropped += 1;
                self.counts.dropped += 1;
                let (x, y) = (index as u32 % tile.width, index as u32 / tile.width);
                self.counts
                    .first_dropped
                    .get_or_insert((tile.x + x, tile.y + y, sample));
            }
        }
    }

    /// Adds a complete path and its shifts to the sample of its pixel.
    #[inline]
    fn gather(
        samples: &mut [PixelSample],
        pixel: u32,
        weights: Weights,
        base: &Base,
        shifts: &[Shift; N],
    ) {
        let sample = &mut samples[pixel as usize];
        sample.primal += base.primal();
        for (sum, shift) in sample.to.iter_mut().zip(shifts) {
            *sum += base.difference(shift, weights);
        }
    }

    fn trace_closest(
        context: Context,
        batch: &mut ClosestBatch,
        kind: RayKind,
        counts: &mut Counts,
    ) {
        if !batch.is_empty() {
            counts.rays[kind.index()] += batch.len() as u64;
            context.tracer.closest(batch, kind);
        }
    }

    fn trace_any(context: Context, batch: &mut AnyBatch, kind: RayKind, counts: &mut Counts) {
        if !batch.is_empty() {
            counts.rays[kind.index()] += batch.len() as u64;
            context.tracer.any(batch, kind);
        }
    }
}

/// Probability that a path goes on from x_k.
#[inline]
fn survival(scene: &Scene, vertex: &Vertex, k: u32) -> f32 {
    if k < ROULETTE_FROM {
        1.0
    } else {
        vertex.survival(scene)
    }
}

/// A shift that holds, or counts its death.
#[inline]
fn or_dead(result: Result<Offset, Death>, counts: &mut Counts) -> Offset {
    result.unwrap_or_else(|death| {
        counts.deaths[death as usize] += 1;
        Offset::Dead
    })
}
