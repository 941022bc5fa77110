//! Records the rays of a render, of base and offset paths at each bounce, batch by batch.

use crate::film::Film;
use crate::filter::Filter;
use crate::gradient::Weights;
use crate::path::{Manifold, PathSettings};
use crate::render::{Job, Limits, Method, TILE_SIZE};
use crate::sampler::SamplerKind;
use crate::scene::Scene;
use crate::trace::rays::{AnyBatch, ClosestBatch, Ray};
use crate::trace::{RayKind, TraversalMode, Traverse};
use std::sync::Mutex;

/// The rays of one kind, in the batches in which the renderer traced them.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Each batch's rays.
    pub batches: Vec<Vec<Ray>>,
}

impl Recording {
    /// Number of rays.
    pub fn len(&self) -> usize {
        self.batches.iter().map(Vec::len).sum()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.batches.is_empty()
    }
}

/// Traces with another backend and keeps the rays.
struct Recorder<'a> {
    inner: &'a dyn Traverse,
    kept: [Mutex<Recording>; RayKind::ALL.len()],
    /// Rays of a kind after which no more are kept.
    enough: usize,
}

impl Recorder<'_> {
    fn keep(&self, kind: RayKind, rays: impl Iterator<Item = Ray>) {
        let mut kept = self.kept[kind.index()]
            .lock()
            .expect("no panic while recording");
        if kept.len() < self.enough {
            kept.batches.push(rays.collect());
        }
    }
}

impl Traverse for Recorder<'_> {
    fn mode(&self, kind: RayKind) -> TraversalMode {
        self.inner.mode(kind)
    }

    fn modes(&self) -> &'static [TraversalMode] {
        self.inner.modes()
    }

    fn memory(&self) -> usize {
        self.inner.memory()
    }

    fn closest_by(&self, batch: &mut ClosestBatch, way: TraversalMode) {
        self.inner.closest_by(batch, way);
    }

    fn any_by(&self, batch: &mut AnyBatch, way: TraversalMode) {
        self.inner.any_by(batch, way);
    }

    fn closest(&self, batch: &mut ClosestBatch, kind: RayKind) {
        self.keep(kind, (0..batch.len() as u32).map(|i| batch.ray(i)));
        self.inner.closest(batch, kind);
    }

    fn any(&self, batch: &mut AnyBatch, kind: RayKind) {
        self.keep(kind, (0..batch.len() as u32).map(|i| batch.ray(i)));
        self.inner.any(batch, kind);
    }
}

/// Renders eight samples of every pixel and returns the rays by kind: of each kind the first ones, up to
/// about `enough`.
pub fn record(
    scene: &Scene,
    tracer: &dyn Traverse,
    depth: u32,
    enough: usize,
) -> [Recording; RayKind::ALL.len()] {
    let recorder = Recorder {
        inner: tracer,
        kept: Default::default(),
        enough,
    };
    let mut film = Film::new(scene.camera.width, scene.camera.height, TILE_SIZE);
    let job = Job {
        scene,
        tracer: &recorder,
        method: Method::Gpt,
        settings: PathSettings {
            depth,
            seed: 0,
            sampler: SamplerKind::Sobol,
            weights: Weights::Mis,
            filter: Filter::Box,
            manifold: Manifold::Auto,
        },
        first: 0,
        limits: Limits {
            samples: 8,
            time: None,
        },
    };
    job.run(&mut film, &mut |_, _| None, &mut |_| ());
    recorder
        .kept
        .map(|k| k.into_inner().expect("no panic while recording"))
}
