//! One progressive render, measured on its way; and the references.

use super::{Row, Tracing, name_of};
use crate::compare::{self, References};
use crate::estimate::Estimate;
use crate::film::{Film, Halves};
use crate::filter::Filter;
use crate::image::Image;
use crate::path::{Counts, Manifold, PathSettings};
use crate::picture::{self, Picture};
use crate::reconstruct::{self, Alpha, PAPER_ALPHA};
use crate::render::{Ending, Job, Limits, Method, Outcome, TILE_SIZE};
use crate::sampler::SamplerKind;
use crate::scene::Scene;
use crate::trace::Traverse;
use std::time::Duration;

/// Samples of the first measurement: `weighted` needs as many.
const FIRST_SAMPLES: u64 = 4;

/// What is rendered, and how.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What finds the hits.
    pub tracer: &'a dyn Traverse,
    /// How the film is filled.
    pub tracing: Tracing,
    /// Longest path in segments.
    pub depth: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the samples of a pixel are spread.
    pub sampler: SamplerKind,
    /// Seconds for tracing and for making a picture.
    pub seconds: f64,
}

/// The end of a run.
pub struct Finished {
    /// What was measured.
    pub rows: Vec<Row>,
    /// The last pictures, in the order of the reconstructions.
    pub pictures: Vec<Image>,
    /// What the film holds at the end.
    pub estimate: Estimate,
}

impl Run<'_> {
    /// What the paths depend on.
    pub fn settings(&self) -> PathSettings {
        PathSettings {
            depth: self.depth,
            seed: self.seed,
            sampler: self.sampler,
            weights: self.tracing.weights,
            filter: Filter::Box,
            manifold: Manifold::Auto,
        }
    }

    /// Adds samples to `film` until a limit is reached; `None` if `stop` ended it.
    fn trace(
        &self,
        film: &mut Film,
        limits: Limits,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Outcome> {
        let job = Job {
            scene: self.scene,
            tracer: self.tracer,
            method: self.tracing.method,
            settings: self.settings(),
            first: 0,
            limits,
        };
        let mut ask = |_: &Film, _: &Counts| stop().then_some(Ending::Interrupted);
        let outcome = job.run(film, &mut ask, &mut |_| ());
        (outcome.ended != Ending::Interrupted).then_some(outcome)
    }

    fn film(&self) -> Film {
        Film::new(self.scene.camera.width, self.scene.camera.height, TILE_SIZE)
    }

    fn method_name(&self, reconstruction: reconstruct::Method) -> String {
        match self.tracing.method {
            Method::Pt => match reconstruction.kind().after_pt() {
                Some(name) => name.to_owned(),
                None => name_of(Method::Pt),
            },
            Method::Gpt => picture::describe(reconstruction).0.to_owned(),
        }
    }

    /// Renders and measures. `stop` is asked between passes; `None` if it ended the run.
    pub fn measure(
        &self,
        scene_name: &str,
        reconstructions: &[reconstruct::Method],
        references: References,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Finished> {
        let mut film = self.film();
        let mut rows = Vec::new();
        let mut tracing = 0.0;
        // The slowest way to make the picture, the last time: kept free for the end.
        let mut solving = 0.0;
        let mut target = FIRST_SAMPLES;
        loop {
            // Trace.
            let left = (self.seconds - solving - tracing).max(0.0);
            let limits = Limits {
                samples: target,
                time: Some(Duration::from_secs_f64(left)),
            };
            let outcome = self.trace(&mut film, limits, stop)?;
            tracing += outcome.elapsed.as_secs_f64();
            let last = outcome.ended == Ending::Time;

            // Make the pictures and measure.
            let made: Vec<Picture> = reconstructions
                .iter()
                .map(|&method| picture::of_film(&film, method))
                .collect();
            solving = made.iter().map(|p| p.seconds).fold(0.0, f64::max);
            for (&reconstruction, picture) in reconstructions.iter().zip(&made) {
                let found = compare::errors(&picture.image, references);
                // Nobody needs the error for the picture.
                let solving = picture.seconds - picture.seconds_error;
                rows.push(Row {
                    scene: scene_name.to_owned(),
                    method: self.method_name(reconstruction),
                    weights: match self.tracing.method {
                        Method::Pt => String::new(),
                        Method::Gpt => name_of(self.tracing.weights),
                    },
                    backend: self.tracing.backend.name().to_owned(),
                    seed: self.seed,
                    samples: film.count(Halves::Both),
                    last,
                    seconds: tracing + solving,
                    seconds_solving: solving,
                    rel_mse: found.rel_mse.value,
                    rel_mse_interval: found.rel_mse.interval,
                    rel_mse_trimmed: found.rel_mse_trimmed,
                    rel_mse_specks: found.rel_mse_specks,
                    mse: found.mse.value,
                    rel_bias: found.rel_bias,
                });
            }
            if last {
                return Some(Finished {
                    rows,
                    pictures: made.into_iter().map(|p| p.image).collect(),
                    estimate: film.estimate(Halves::Both),
                });
            }
            target *= 2;
        }
    }

    /// Renders a reference: the primal of path tracing, or L2, which has no bias, of gradient-domain path
    /// tracing. `None` if `stop` ended it.
    pub fn reference(&self, stop: &(dyn Fn() -> bool + Sync)) -> Option<Image> {
        let mut film = self.film();
        let limits = Limits {
            samples: u64::MAX,
            time: Some(Duration::from_secs_f64(self.seconds)),
        };
        self.trace(&mut film, limits, stop)?;
        let reconstruction = match self.tracing.method {
            Method::Pt => reconstruct::Method::Primal,
            Method::Gpt => reconstruct::Method::L2(Alpha::Fixed(PAPER_ALPHA)),
        };
        Some(picture::of_film(&film, reconstruction).image)
    }
}
