//! Base and offset paths of a tile, traced together: at each vertex a light step, then a bounce step,
//! each a few batches of rays of one kind.
//!
//! The estimator is carried in ratios: F = f(x)/p(x) for the base path,
//! [`Carried`](crate::shift::Carried) for what an offset path adds to it.

mod bounce;
mod by_light;
mod counts;
mod diffuse;
mod light;
mod primary;
pub mod replay;

pub use counts::Counts;

use crate::filter::{Filter, Position};
use crate::gradient::{Base, Shift, Weights};
use crate::sampler::{self, Dimension, Points, Sampler};
use crate::scene::Scene;
use crate::shift::{Death, Offset};
use crate::sums::{PixelSample, TileSums};
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::trace::{RayKind, Traverse};
use crate::vertex::{End, Vertex};
use diffuse::{Front, PlainPaths};
use glam::Vec3;
use std::ops::Range;

/// What the estimate depends on, beside the scene.
#[derive(Clone, Copy, Debug)]
pub struct PathSettings {
    /// Longest path in segments; 1 is light seen directly.
    pub depth: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the samples of a pixel are spread.
    pub points: Points,
    /// Weights of the differences.
    pub weights: Weights,
    /// Pixel filter.
    pub filter: Filter,
}

impl PathSettings {
    /// Where the camera rays of a sample go through each pixel.
    pub fn position(&self, sample: u64) -> Position {
        let [u, v, ..] = Sampler::for_pass(self.points, self.seed, sample).draw(Dimension::Pixel);
        self.filter.position([u, v])
    }
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

/// The gradient-domain path tracer (`N` = 4) or the plain one (`N` = 0) with its buffers: for one
/// thread, used again for every tile.
#[derive(Default)]
pub struct PathTracer<const N: usize> {
    /// Base paths with offset paths that have vertices or directions of their own.
    front: Wavefront<N>,
    /// What follows once all offset paths of a base path are connected or dead: for all of them the
    /// same, so it is traced as a plain path that starts with throughput 1, one for each of `shares`.
    suffixes: Wavefront<0>,
    /// In the place of `suffixes` in diffuse scenes.
    diffuse_suffixes: PlainPaths,
    /// In the place of `front` there, if the camera has no lens.
    diffuse_front: Front<N>,
    shares: Vec<Share<N>>,
}

/// What a suffix counts for: its light S adds `primal`·S to the primal and `to`·S to the differences of
/// a pixel. For F = βS, Y = B·S and densities that all have the ratio R, w(Y − F) is
/// (B − β)S/(1 + R) over the densities of the techniques, which are inside S.
struct Share<const N: usize> {
    pixel: u32,
    primal: Vec3,
    to: [Vec3; N],
}

/// Paths at one vertex, with the buffers for their next steps.
#[derive(Default)]
struct Wavefront<const N: usize> {
    paths: Vec<BasePath<N>>,
    /// Which of the camera rays pass through the film.
    there: Vec<bool>,
    /// Primary hits of the tile and, with offset paths, of a border of one pixel; with a lens, of each
    /// pixel and its neighbours.
    ends: Vec<Option<End>>,
    /// Random numbers for one step of each path.
    numbers: Vec<[f32; 4]>,
    light_paths: Vec<light::LightPath<N>>,
    bounces: Vec<bounce::Bounce<N>>,
    /// What the paths gather, by their `pixel`.
    samples: Vec<PixelSample>,
    primary: ClosestBatch,
    bounce: ClosestBatch,
    continuation: ClosestBatch,
    shadow: AnyBatch,
    reconnection: AnyBatch,
    counts: Counts,
}

/// What all steps of a tile read.
#[derive(Clone, Copy)]
struct Context<'a> {
    scene: &'a Scene,
    tracer: &'a dyn Traverse,
    settings: &'a PathSettings,
    /// Whether plain paths go in lanes.
    in_lanes: bool,
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
            in_lanes: scene.in_lanes(),
        };
        for sample in range {
            self.front.samples.clear();
            self.front
                .samples
                .resize((tile.width * tile.height) as usize, PixelSample::default());
            let front_in_lanes = N == 0 || scene.is_diffuse();
            if context.in_lanes && front_in_lanes && scene.camera.lens.is_none() {
                let samples = &mut self.front.samples;
                self.diffuse_front
                    .primary_step(context, tile, sample, samples, sums);
            } else {
                self.front.primary_step(context, tile, sample, sums);
            }
            self.hand_over(context, 1);
            // A path at x_k has k segments; what is gathered there has k + 1.
            for k in 1..settings.depth {
                if self.is_done() {
                    break;
                }
                self.front.step(context, k);
                self.diffuse_front.step(context, k);
                self.suffixes.step(context, k);
                self.diffuse_suffixes.step(context, k);
                self.hand_over(context, k + 1);
            }
            self.front.paths.clear();
            self.diffuse_front.collect(tile, &mut self.front.samples);
            self.collect();
            let weight = settings.position(sample).weight;
            self.front.finish_sample(tile, sample, weight, sums);
        }
        let mut counts = std::mem::take(&mut self.front.counts);
        counts.add(&std::mem::take(&mut self.suffixes.counts));
        counts.add(&std::mem::take(&mut self.diffuse_front.counts));
        counts.add(&std::mem::take(&mut self.diffuse_suffixes.counts));
        counts
    }

    /// Whether no path goes on.
    fn is_done(&self) -> bool {
        self.front.paths.is_empty()
            && self.diffuse_front.is_empty()
            && self.suffixes.paths.is_empty()
            && self.diffuse_suffixes.is_empty()
    }

    /// Makes suffixes of the paths at x_k whose offset paths are all connected or dead.
    fn hand_over(&mut self, context: Context, k: u32) {
        // Plain paths stay where they are, unless there are lanes for them.
        if N == 0 && !context.in_lanes {
            return;
        }
        let Self {
            front,
            suffixes,
            diffuse_front,
            diffuse_suffixes,
            shares,
        } = self;
        let weights = context.settings.weights;
        diffuse_front.hand_over(k, weights, diffuse_suffixes, shares);
        front.paths.retain(|path| {
            let settled = path
                .offsets
                .iter()
                .all(|o| matches!(o, Offset::Connected(_) | Offset::Dead));
            if settled {
                // Densities of the base path are inside S: here they are 1.
                let base = Base {
                    value: path.throughput.into(),
                    densities: 1.0,
                };
                let to = std::array::from_fn(|j| match &path.offsets[j] {
                    Offset::Connected(c) => {
                        let shift = Shift {
                            value: c.throughput.into(),
                            densities: c.ratio,
                        };
                        base.difference(&shift, weights).into()
                    }
                    _ => base.difference(&Shift::DEAD, weights).into(),
                });
                if path.throughput == Vec3::ZERO && to == [Vec3::ZERO; N] {
                    return false;
                }
                if context.in_lanes {
                    diffuse_suffixes.push(context.scene, &path.vertex, path.sampler);
                } else {
                    suffixes.paths.push(BasePath {
                        pixel: shares.len() as u32,
                        sampler: path.sampler,
                        vertex: path.vertex,
                        throughput: Vec3::ONE,
                        offsets: [],
                    });
                    suffixes.samples.push(PixelSample::default());
                }
                shares.push(Share {
                    pixel: path.pixel,
                    primal: base.primal().into(),
                    to,
                });
            }
            !settled
        });
    }

    /// Adds what the suffixes gathered to the samples of their pixels.
    fn collect(&mut self) {
        let suffixes = self.suffixes.samples.iter().map(|s| s.primal);
        let gathered = suffixes.chain(self.diffuse_suffixes.gathered.iter().copied());
        for (share, light) in self.shares.iter().zip(gathered) {
            let sample = &mut self.front.samples[share.pixel as usize];
            sample.primal += share.primal * light;
            for (sum, to) in sample.to.iter_mut().zip(&share.to) {
                *sum += *to * light;
            }
        }
        self.shares.clear();
        self.suffixes.samples.clear();
        self.suffixes.paths.clear();
        self.diffuse_suffixes.clear();
    }
}

impl<const N: usize> Wavefront<N> {
    /// Light and bounce at x_k.
    fn step(&mut self, context: Context, k: u32) {
        if !self.paths.is_empty() {
            self.light_step(context, k);
            self.bounce_step(context, k);
        }
    }

    /// Adds the sample of each pixel to its sums; what is not finite is dropped whole.
    fn finish_sample(&mut self, tile: Tile, sample: u64, weight: f32, sums: &mut TileSums) {
        let half = sampler::half(sample);
        for (index, value) in self.samples.iter_mut().enumerate() {
            if weight != 1.0 {
                value.scale(weight);
            }
            if value.is_finite() {
                sums.pixels[index].halves[half].add(value);
                sums.pixels[index].coverage += value.coverage;
            } else {
                sums.pixels[index].dropped += 1;
                self.counts.dropped += 1;
                let (x, y) = (index as u32 % tile.width, index as u32 / tile.width);
                self.counts.note_dropped((tile.x + x, tile.y + y, sample));
            }
        }
    }
}

/// Finds the hits of a batch and counts its rays.
fn trace_closest(context: Context, batch: &mut ClosestBatch, kind: RayKind, counts: &mut Counts) {
    if !batch.is_empty() {
        counts.rays[kind.index()] += batch.len() as u64;
        context.tracer.closest(batch, kind);
    }
}

/// Finds what is blocked in a batch and counts its rays.
fn trace_any(context: Context, batch: &mut AnyBatch, kind: RayKind, counts: &mut Counts) {
    if !batch.is_empty() {
        counts.rays[kind.index()] += batch.len() as u64;
        context.tracer.any(batch, kind);
    }
}

/// Adds a complete path and its `N` shifts to the sample of its pixel.
#[inline]
fn gather<const N: usize>(
    sample: &mut PixelSample,
    weights: Weights,
    base: &Base,
    shifts: &[Shift; N],
) {
    sample.primal += Vec3::from(base.primal());
    for (to, shift) in sample.to.iter_mut().zip(shifts) {
        *to += Vec3::from(base.difference(shift, weights));
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
