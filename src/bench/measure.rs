//! Times every backend, kind of rays and way through the tree, in turn and several times over, so that
//! a change of the machine's speed meets all of them.

use super::record::Recording;
use crate::trace::rays::{AnyBatch, ClosestBatch};
use crate::trace::{RayKind, TraversalMode, Traverse};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// A backend with its tree.
pub struct Subject {
    /// Its name.
    pub name: &'static str,
    /// What traces.
    pub tracer: Box<dyn Traverse>,
    /// Seconds to build the tree.
    pub build_seconds: f64,
}

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The backend.
    pub backend: &'static str,
    /// Kind of rays.
    pub kind: &'static str,
    /// Way through the tree.
    pub way: String,
    /// Whether the renderer goes this way.
    pub chosen: bool,
    /// Number of rays.
    pub rays: usize,
    /// Rays that hit something: the same for all ways of all backends, but for rays that meet an edge
    /// to rounding.
    pub hits: usize,
    /// Median over the runs, in million rays per second, all threads together.
    pub mrays_per_second: f64,
    /// Slowest run.
    pub slowest: f64,
    /// Fastest run.
    pub fastest: f64,
    /// Seconds to build the tree.
    pub build_seconds: f64,
    /// Bytes of the tree, without the mesh.
    pub tree_bytes: usize,
    /// Threads.
    pub threads: usize,
}

/// Batches ready to be traced.
enum Batches {
    Closest(Vec<ClosestBatch>),
    Any(Vec<AnyBatch>),
}

impl Batches {
    fn new(kind: RayKind, recording: &Recording) -> Self {
        if kind.wants_closest() {
            Batches::Closest(
                recording
                    .batches
                    .iter()
                    .map(|rays| ClosestBatch::of(rays))
                    .collect(),
            )
        } else {
            Batches::Any(
                recording
                    .batches
                    .iter()
                    .map(|rays| AnyBatch::of(rays))
                    .collect(),
            )
        }
    }

    /// Traces all batches on the current pool: seconds, and the number of hits.
    fn trace(self, tracer: &dyn Traverse, way: TraversalMode) -> (f64, usize) {
        match self {
            Batches::Closest(mut batches) => {
                let start = Instant::now();
                batches
                    .par_iter_mut()
                    .for_each(|b| tracer.closest_by(b, way));
                let seconds = start.elapsed().as_secs_f64();
                let hits =
                    |b: &ClosestBatch| (0..b.len() as u32).filter(|&i| b.hit(i).is_some()).count();
                (seconds, batches.iter().map(hits).sum())
            }
            Batches::Any(mut batches) => {
                let start = Instant::now();
                batches.par_iter_mut().for_each(|b| tracer.any_by(b, way));
                let seconds = start.elapsed().as_secs_f64();
                let hits = |b: &AnyBatch| (0..b.len() as u32).filter(|&i| b.is_blocked(i)).count();
                (seconds, batches.iter().map(hits).sum())
            }
        }
    }
}

/// Measures everything, `runs` times after a first run that does not count. Works on the current rayon
/// pool; `progress` is told the share done.
pub fn measure(
    subjects: &[Subject],
    recordings: &[Recording; RayKind::ALL.len()],
    runs: usize,
    progress: &mut (dyn FnMut(f64) + Send),
) -> Vec<Row> {
    let threads = rayon::current_num_threads();
    let mut rows = Vec::new();
    let mut cases = Vec::new();
    for subject in subjects {
        for kind in RayKind::ALL {
            let recording = &recordings[kind.index()];
            if recording.is_empty() {
                continue;
            }
            for &way in subject.tracer.modes() {
                cases.push((subject, kind, way, Vec::new()));
                rows.push(Row {
                    backend: subject.name,
                    kind: kind.name(),
                    way: way.name(),
                    chosen: way == subject.tracer.mode(kind),
                    rays: recording.len(),
                    hits: 0,
                    mrays_per_second: 0.0,
                    slowest: 0.0,
                    fastest: 0.0,
                    build_seconds: subject.build_seconds,
                    tree_bytes: subject.tracer.memory(),
                    threads,
                });
            }
        }
    }
    for run in 0..=runs {
        for (case, row) in cases.iter_mut().zip(&mut rows) {
            let (subject, kind, way, speeds) = case;
            let batches = Batches::new(*kind, &recordings[kind.index()]);
            let (seconds, hits) = batches.trace(&*subject.tracer, *way);
            if run > 0 {
                speeds.push(row.rays as f64 / 1e6 / seconds);
            }
            row.hits = hits;
        }
        progress((run + 1) as f64 / (runs + 1) as f64);
    }
    for ((.., speeds), row) in cases.iter_mut().zip(&mut rows) {
        speeds.sort_by(f64::total_cmp);
        row.mrays_per_second = speeds[speeds.len() / 2];
        row.slowest = speeds[0];
        row.fastest = speeds[speeds.len() - 1];
    }
    rows
}
