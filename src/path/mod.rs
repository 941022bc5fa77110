//! Base and offset paths of a tile, traced together, eight at once: at each vertex a light step, then a bounce step,
//! each a few batches of rays of one kind.
//!
//! The estimator is carried in ratios: F = f(x)/p(x) for the base path,
//! [`CarriedX8`](crate::shift::CarriedX8) for what an offset path adds to it.

mod aim;
mod arrival;
mod base;
mod bounce;
mod by_light;
mod chain;
mod copied;
mod counts;
mod features;
mod grid;
mod light;
mod link;
mod manifold;
mod order;
mod pack;
mod plain;
mod pool;
mod primary;
pub mod replay;
mod shares;

pub use counts::Counts;
pub use shares::Shares;

use crate::filter::{Filter, Position};
use crate::gradient::Weights;
use crate::sampler::{self, Dimension, Sampler, SamplerKind};
use crate::scene::Scene;
use crate::scene::material::Material;
use crate::scene::reflectors::Sequence;
use crate::sums::{PixelSample, TileSums};
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::trace::{RayKind, Traverse};
use base::BasePaths;
use glam::Vec3;
use plain::PlainPaths;
use std::ops::Range;

/// What the estimate depends on, beside the scene.
#[derive(Clone, Copy, Debug)]
pub struct PathSettings {
    /// Longest path in segments; 1 is light seen directly.
    pub depth: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the samples of a pixel are spread.
    pub sampler: SamplerKind,
    /// Weights of the differences.
    pub weights: Weights,
    /// Pixel filter.
    pub filter: Filter,
    /// Whether light is sampled through mirrors and glass.
    pub manifold: Manifold,
}

/// Whether light is sampled through mirrors and glass (manifold light sampling), where a scene has any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum Manifold {
    /// As often as it may bring light.
    #[default]
    Auto,
    /// Never: by BSDF sampling alone.
    Off,
    /// At every rough vertex.
    Always,
}

impl PathSettings {
    /// Where the camera rays of a sample go through each pixel.
    pub fn position(&self, sample: u64) -> Position {
        let [u, v, ..] = Sampler::for_pass(self.sampler, self.seed, sample).draw(Dimension::Pixel);
        self.filter.position([u, v])
    }

    /// Whether light is sampled through mirrors and glass.
    fn walks(&self, scene: &Scene) -> bool {
        let wanted = self.manifold != Manifold::Off;
        wanted && !scene.reflectors.is_empty() && !scene.lights.is_empty()
    }
}

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

/// The gradient-domain path tracer (`N` = 4) or the plain one (`N` = 0) with its buffers: for one
/// thread, used again for every tile.
#[derive(Default)]
pub struct PathTracer<const N: usize> {
    /// What the paths gather, pixel by pixel.
    samples: Vec<PixelSample>,
    /// Base paths with offset paths that have vertices or directions of their own.
    base: BasePaths<N>,
    /// What follows once all offset paths of a base path are connected or dead: for all of them the
    /// same, so it is traced as a plain path that starts with throughput 1, one for each of `shares`.
    plain: PlainPaths,
    shares: Vec<Share<N>>,
    /// How often walks are made.
    walks: Shares,
    counts: Counts,
}

/// What a plain path counts for: its light S adds `primal`·S to the primal and `to`·S to the differences of
/// a pixel. For F = βS, Y = B·S and densities that all have the ratio R, w(Y − F) is
/// (B − β)S/(1 + R) over the densities of the techniques, which are inside S.
struct Share<const N: usize> {
    pixel: u32,
    primal: Vec3,
    to: [Vec3; N],
}

/// What all steps of a tile read.
#[derive(Clone, Copy)]
struct Context<'a> {
    scene: &'a Scene,
    tracer: &'a dyn Traverse,
    settings: &'a PathSettings,
    /// Whether light is sampled through mirrors and glass.
    walks: bool,
    /// And how often.
    shares: Shares,
    /// Whether light is sampled at surfaces of class specular: paths with offset paths are aimed at lights.
    aims: bool,
}

impl<'a> Context<'a> {
    fn new(
        scene: &'a Scene,
        tracer: &'a dyn Traverse,
        settings: &'a PathSettings,
        shares: Shares,
    ) -> Self {
        let always = settings.manifold == Manifold::Always;
        Self {
            scene,
            tracer,
            settings,
            walks: settings.walks(scene),
            shares: if always { Shares::ALL } else { shares },
            aims: !scene.lights.is_empty() && scene.materials.iter().any(Material::spreads_little),
        }
    }

    /// Whether light without extent is sampled at surfaces of class specular.
    fn aims_at_points(&self) -> bool {
        self.aims && !self.scene.lights.punctual().is_empty()
    }

    /// Whether walks straight through glass follow the light step, see [`link::Unseen`].
    fn walks_through_glass(&self) -> bool {
        self.walks && self.scene.reflectors.let_light_pass()
    }

    /// Whether walks through balls of glass follow the light step, with its samples.
    fn walks_through_balls(&self) -> bool {
        self.walks && !self.scene.reflectors.balls().is_empty()
    }

    /// Whether walks through mirrors are made wherever they may lead to light.
    fn always(&self) -> bool {
        self.settings.manifold == Manifold::Always
    }

    /// The share of vertices at which walks by these mirrors are made once they are chosen: those whose coin is below.
    fn share(&self, by: &Sequence) -> f32 {
        let kind = shares::Kind::by_mirrors(by, &self.scene.reflectors);
        self.where_worth(self.shares.of(kind))
    }

    /// Whether a path may make a walk at x_k, by whichever mirrors.
    fn tries(&self, sampler: &Sampler, k: u32) -> bool {
        let most = self.shares.flat_mirrors.max(self.shares.curved_mirrors);
        sampler.coin(k) < self.where_worth(most)
    }

    /// A share of walks by mirrors, less often where these show little.
    fn where_worth(&self, share: f32) -> f32 {
        if self.always() {
            1.0
        } else {
            share * self.scene.reflectors.worth()
        }
    }
}

/// What has just been done, for those who watch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// The camera rays are traced.
    Primary,
    /// Base paths at x_k whose offset paths are all connected or dead have become plain paths.
    HandedOver(u32),
    /// Light is sampled at the vertices x_k of base and offset paths.
    Light(u32),
    /// Light is sampled through mirrors and glass at the vertices x_k of base and offset paths.
    Walked(u32),
    /// Walks have been made to the light that base paths have reached from x_k in single directions.
    WalkedAgain(u32),
    /// Base paths have been aimed at lights from x_k, and offset paths have followed.
    Aimed(u32),
    /// Base paths have scattered at x_k and offset paths have followed; it is known where they arrive.
    Followed(u32),
    /// They are at x_{k+1}.
    Arrived(u32),
    /// Plain paths have gone from x_k to x_{k+1}.
    Plain(u32),
}

impl<const N: usize> PathTracer<N> {
    /// One that makes walks to light so often, if at all.
    pub fn new(walks: Shares) -> Self {
        Self {
            walks,
            ..Self::default()
        }
    }

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
        let context = Context::new(scene, tracer, settings, self.walks);
        for sample in range {
            self.trace(context, tile, sample, sums);
            let weight = settings.position(sample).weight;
            self.finish_sample(tile, sample, weight, sums);
        }
        let mut counts = std::mem::take(&mut self.counts);
        counts.add(&std::mem::take(&mut self.base.counts));
        counts.add(&std::mem::take(&mut self.plain.counts));
        counts
    }

    /// Traces one sample of every pixel of `tile`, unwatched.
    fn trace(&mut self, context: Context, tile: Tile, sample: u64, sums: &mut TileSums) {
        let watch = &mut |_: &Self, _| ();
        // What may happen to a path is decided here, once: with a lens, offset paths have camera rays of their own.
        let scene = context.scene;
        match (scene.is_diffuse(), scene.camera.lens.is_some()) {
            (true, false) => self.trace_in::<true, true>(context, tile, sample, sums, watch),
            (true, true) => self.trace_in::<false, true>(context, tile, sample, sums, watch),
            (false, _) => self.trace_in::<false, false>(context, tile, sample, sums, watch),
        }
    }

    /// Traces one sample of every pixel of `tile`; `watch` sees the state after each step. `BASE`: what `DIFFUSE` is
    /// for [`BasePaths`]; `PLAIN`: for [`PlainPaths`].
    fn trace_in<const BASE: bool, const PLAIN: bool>(
        &mut self,
        context: Context,
        tile: Tile,
        sample: u64,
        sums: &mut TileSums,
        watch: &mut impl FnMut(&Self, Step),
    ) {
        self.samples.clear();
        let pixels = (tile.width * tile.height) as usize;
        self.samples.resize(pixels, PixelSample::default());
        self.base
            .primary_step::<BASE>(context, tile, sample, &mut self.samples, sums);
        watch(self, Step::Primary);
        self.hand_over::<BASE>(context);
        watch(self, Step::HandedOver(1));
        // A path at x_k has k segments; what is gathered there has k + 1.
        for k in 1..context.settings.depth {
            if self.base.is_empty() && self.plain.is_empty() {
                break;
            }
            if !self.base.is_empty() {
                self.base.light_step::<BASE>(context, k);
                watch(self, Step::Light(k));
                if !BASE && context.walks {
                    self.base.walk_step(context, k);
                    watch(self, Step::Walked(k));
                }
                if !BASE && context.aims && self.base.aim(context, k) {
                    self.base.follow::<false>(context, k);
                    self.base.land::<false>(context);
                    watch(self, Step::Aimed(k));
                    self.base.arrive::<false>(context);
                    self.base.gather_aimed();
                }
                self.base.scatter::<BASE>(context, k);
                self.base.follow::<BASE>(context, k);
                self.base.land::<BASE>(context);
                watch(self, Step::Followed(k));
                if !BASE && context.walks {
                    self.base.walk_again(context);
                    watch(self, Step::WalkedAgain(k));
                }
                self.base.arrive::<BASE>(context);
                watch(self, Step::Arrived(k));
            }
            if !self.plain.is_empty() {
                self.plain.step::<PLAIN>(context, k);
                watch(self, Step::Plain(k));
            }
            self.hand_over::<BASE>(context);
            watch(self, Step::HandedOver(k + 1));
            self.base.pack::<BASE>(&mut self.samples);
        }
        self.base.collect(&mut self.samples);
        self.collect();
    }

    /// Makes plain paths of the base paths whose offset paths are all connected or dead.
    fn hand_over<const BASE: bool>(&mut self, context: Context) {
        let weights = context.settings.weights;
        self.base
            .hand_over::<BASE>(weights, &mut self.plain, &mut self.shares);
    }

    /// Adds what the plain paths gathered to the samples of their pixels.
    fn collect(&mut self) {
        for (share, &light) in self.shares.iter().zip(&self.plain.gathered) {
            let sample = &mut self.samples[share.pixel as usize];
            sample.primal += share.primal * light;
            for (sum, to) in sample.to.iter_mut().zip(&share.to) {
                *sum += *to * light;
            }
        }
        self.shares.clear();
        self.plain.clear();
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
                sums.pixels[index].auxiliary.coverage += value.coverage;
            } else {
                sums.pixels[index].auxiliary.dropped += 1;
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
