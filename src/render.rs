//! The progressive render: passes over all tiles until enough samples, enough time, or a signal.

use crate::film::{Counted, Film};
use crate::path::{Counts, PathSettings, PathTracer, Shares};
use crate::sampler;
use crate::scene::Scene;
use crate::sums::TileSums;
use crate::trace::Traverse;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Which estimator fills the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum Method {
    /// Path tracing.
    Pt,
    /// Gradient-domain path tracing.
    Gpt,
}

/// When to stop; whichever comes first.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Samples of every pixel.
    pub samples: u64,
    /// Time since the start, asked after every pass.
    pub time: Option<Duration>,
}

/// How a render ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was counted.
    pub counts: Counts,
    /// Time spent tracing.
    pub elapsed: Duration,
    /// Why it ended.
    pub ended: Ending,
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// It has its samples.
    Samples,
    /// Its time is over.
    Time,
    /// Its error is small enough.
    Error,
    /// There is nothing to see.
    Nothing,
    /// The user asked for the end.
    Interrupted,
}

impl Ending {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        ["samples", "time", "error", "nothing", "interrupted"][self as usize]
    }
}

/// Progress after a pass.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Samples so far.
    pub samples: u64,
    /// Rays so far.
    pub rays: u64,
    /// Time so far.
    pub elapsed: Duration,
}

/// Side of a tile in pixels: the paths of one sample of a tile fit the second-level cache.
pub const TILE_SIZE: u32 = 32;

/// Samples of a pass.
pub const PASS: u64 = 4;

/// Samples of the pass that begins after `done`. The first ones are of few, so that a short time limit is met. The
/// film's sums are grouped by passes, so the schedule is part of what the bits depend on.
pub fn pass_length(done: u64) -> u64 {
    if done < PASS { PASS / 2 } else { PASS }
}

/// Whether a pass ends after `samples` samples, if no limit cuts one short.
pub fn is_pass_end(samples: u64) -> bool {
    samples == PASS / 2 || samples.is_multiple_of(PASS)
}

/// What to render.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What finds the hits.
    pub tracer: &'a dyn Traverse,
    /// Which estimator.
    pub method: Method,
    /// Its settings.
    pub settings: PathSettings,
    /// Which of the samples comes first: 0, or where a part of them begins, at the end of a pass.
    pub first: u64,
    /// When to stop.
    pub limits: Limits,
}

impl Job<'_> {
    /// Adds samples to `film` until a limit is reached or `stop` gives a reason; both are asked between
    /// passes, `stop` with what was counted so far. The film may hold samples already. Works on the current rayon pool.
    pub fn run(
        &self,
        film: &mut Film,
        stop: &mut (dyn FnMut(&Film, &Counts) -> Option<Ending> + Send),
        progress: &mut (dyn FnMut(Progress) + Send),
    ) -> Outcome {
        match self.method {
            Method::Pt => self.passes::<0>(film, stop, progress),
            Method::Gpt => self.passes::<4>(film, stop, progress),
        }
    }

    fn passes<const N: usize>(
        &self,
        film: &mut Film,
        stop: &mut (dyn FnMut(&Film, &Counts) -> Option<Ending> + Send),
        progress: &mut (dyn FnMut(Progress) + Send),
    ) -> Outcome {
        let start = Instant::now();
        let mut counts = Counts::default();
        let walks = Shares::learn(self.scene, self.tracer, &self.settings);
        let worker = |_| Worker {
            paths: PathTracer::new(walks),
            sums: TileSums::default(),
            counts: Counts::default(),
        };
        let mut workers: Vec<Worker<N>> = (0..rayon::current_num_threads()).map(worker).collect();
        let ended = loop {
            let done = film.samples[0] + film.samples[1];
            let late = self
                .limits
                .time
                .is_some_and(|limit| start.elapsed() >= limit);
            if done >= self.limits.samples {
                break Ending::Samples;
            }
            if late && done > 0 {
                break Ending::Time;
            }
            if let Some(reason) = stop(film, &counts) {
                break reason;
            }
            let end = (done + pass_length(self.first + done)).min(self.limits.samples);
            self.pass(
                film,
                self.first + done..self.first + end,
                &mut workers,
                &mut counts,
            );
            progress(Progress {
                samples: end,
                rays: counts.rays.iter().sum(),
                elapsed: start.elapsed(),
            });
        };
        Outcome {
            counts,
            elapsed: start.elapsed(),
            ended,
        }
    }

    /// One pass. Each worker takes the next tile when it is done with one; the lock is held for that
    /// alone, and nothing is allocated once the workers' buffers have grown.
    fn pass<const N: usize>(
        &self,
        film: &mut Film,
        range: Range<u64>,
        workers: &mut [Worker<N>],
        counts: &mut Counts,
    ) {
        let tiles = Mutex::new(film.tiles.iter_mut());
        let next = || tiles.lock().expect("no panic while taking a tile").next();
        workers.par_iter_mut().with_max_len(1).for_each(|worker| {
            while let Some(tile) = next() {
                let Worker {
                    paths,
                    sums,
                    counts,
                } = worker;
                sums.reset((tile.tile.width * tile.tile.height) as usize);
                counts.add(&paths.render(
                    self.scene,
                    self.tracer,
                    &self.settings,
                    tile.tile,
                    range.clone(),
                    sums,
                ));
                tile.add(sums);
            }
        });
        let mut counted = [Counted::default(); 2];
        range.for_each(|n| counted[sampler::half(n)].add(self.settings.position(n).weight));
        film.end_pass(counted);
        for worker in workers {
            counts.add(&std::mem::take(&mut worker.counts));
        }
    }
}

/// What one thread works with.
struct Worker<const N: usize> {
    paths: PathTracer<N>,
    sums: TileSums,
    counts: Counts,
}
