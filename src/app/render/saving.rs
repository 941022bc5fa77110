//! `--checkpoint`, `--every` and `--resume`.

use crate::checkpoint::{self, Identity, Progress};
use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output;
use crate::path::Counts;
use crate::render::{Limits, Outcome};
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

const EVERY: Duration = Duration::from_secs(60);

/// Refuses what cannot be, before the scene is read.
pub(super) fn check(args: &RenderArgs, output: &Path) -> Result<()> {
    let Some(path) = &args.checkpoint else {
        return Ok(());
    };
    let others = args.preview.iter().chain(&args.stats);
    let others = others.map(|p| p.as_path());
    let outputs: Vec<&Path> = [path, output].into_iter().chain(others).collect();
    output::check_outputs(&args.scene, &outputs)?;
    if path.exists() && !args.resume {
        let message = "there is a checkpoint already: --resume goes on from it, or remove it";
        return Err(Error::input(path, None, message));
    }
    Ok(())
}

/// The checkpoint of a render; none without `--checkpoint`.
pub(super) struct Saving<'a> {
    path: Option<&'a Path>,
    resume: bool,
    every: Duration,
    identity: Identity,
    /// What was done before this process.
    before: Progress,
    start: Instant,
    last: Instant,
    complaint: Option<String>,
}

impl<'a> Saving<'a> {
    pub(super) fn new(
        args: &'a RenderArgs,
        scene: &Scene,
        settings: &BTreeMap<&'static str, String>,
    ) -> Self {
        let settings = settings.iter().map(|(&name, value)| (name, value.clone()));
        let more = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", format!("{:016x}", scene.hash())),
            (
                "size",
                format!("{}x{}", scene.camera.width, scene.camera.height),
            ),
        ];
        let identity = settings.chain(more);
        Self {
            path: args.checkpoint.as_deref(),
            resume: args.resume,
            every: args.every.unwrap_or(EVERY),
            identity: identity
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
            before: Progress::default(),
            start: Instant::now(),
            last: Instant::now(),
            complaint: None,
        }
    }

    /// Fills the film with what is in the file. Its samples; `None` where it starts from nothing.
    pub(super) fn resume(&mut self, film: &mut Film) -> Result<Option<u64>> {
        let there = self.path.filter(|path| self.resume && path.exists());
        let Some(path) = there else {
            return Ok(None);
        };
        self.before = checkpoint::load(path, &self.identity, film)?;
        Ok(Some(film.samples.iter().sum()))
    }

    /// The limits for this process: the time counts that of those before.
    pub(super) fn left(&mut self, limits: Limits) -> Limits {
        self.start = Instant::now();
        self.last = self.start;
        let before = Duration::from_secs_f64(self.before.seconds);
        Limits {
            time: limits.time.map(|t| t.saturating_sub(before)),
            ..limits
        }
    }

    /// Writes the file when it is time to.
    pub(super) fn now_and_then(&mut self, film: &Film, counts: &Counts) {
        if self.path.is_some() && self.last.elapsed() >= self.every {
            let progress = self.progress(counts, self.start.elapsed());
            self.save(film, &progress);
        }
    }

    /// Writes the file for the last time. What was done in all processes.
    pub(super) fn end(&mut self, film: &Film, outcome: &Outcome) -> Progress {
        let progress = self.progress(&outcome.counts, outcome.elapsed);
        if film.samples != [0; 2] {
            self.save(film, &progress);
        }
        progress
    }

    fn progress(&self, counts: &Counts, elapsed: Duration) -> Progress {
        let mut progress = self.before.clone();
        progress.counts.add(counts);
        progress.seconds += elapsed.as_secs_f64();
        progress
    }

    /// A render goes on where its checkpoint cannot be written; it is said at the end.
    fn save(&mut self, film: &Film, progress: &Progress) {
        let Some(path) = self.path else { return };
        let saved = checkpoint::save(path, &self.identity, progress, film);
        self.complaint = saved.err().map(|e| e.to_string());
        self.last = Instant::now();
    }

    /// Why the last checkpoint is not there.
    pub(super) fn complaints(&self) -> Vec<String> {
        self.complaint.iter().cloned().collect()
    }
}
