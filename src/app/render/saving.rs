//! `--checkpoint`, `--every` and `--resume`.

use crate::checkpoint::{self, Identity, Progress};
use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::film::{Film, Halves};
use crate::output;
use crate::path::Counts;
use crate::render::{Limits, Outcome, is_pass_end, pass_length};
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const EVERY: Duration = Duration::from_secs(60);

/// Refuses what cannot be, before the scene is read.
pub(super) fn check(args: &RenderArgs) -> Result<()> {
    let Some(path) = &args.checkpoint else {
        return Ok(());
    };
    if output::regular_file(path)?.exists() && !args.resume {
        let message = "there is a checkpoint already: --resume goes on from it, or remove it";
        return Err(Error::input(path, None, message));
    }
    Ok(())
}

/// The checkpoint of a render; none without `--checkpoint`.
pub(super) struct Saving {
    /// Where it is, links followed: what they lead to is replaced, not they.
    path: Option<PathBuf>,
    resume: bool,
    every: Duration,
    identity: Identity,
    /// What was done before this process.
    before: Progress,
    start: Instant,
    last: Instant,
    /// Samples of every pixel at which the render ends.
    samples: u64,
    complaint: Option<String>,
    /// Held as long as this process writes the file.
    lock: Option<(File, PathBuf)>,
}

impl Saving {
    pub(super) fn new(
        args: &RenderArgs,
        scene: &Scene,
        scene_hash: &str,
        settings: &BTreeMap<&'static str, String>,
    ) -> Result<Self> {
        let settings = settings.iter().map(|(&name, value)| (name, value.clone()));
        let more = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", scene_hash.to_owned()),
            (
                "size",
                format!("{}x{}", scene.camera.width, scene.camera.height),
            ),
        ];
        let identity = settings.chain(more);
        let path = args.checkpoint.as_deref();
        Ok(Self {
            path: path.map(output::regular_file).transpose()?,
            resume: args.resume,
            every: args.every.unwrap_or(EVERY),
            identity: identity
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
            before: Progress::default(),
            start: Instant::now(),
            last: Instant::now(),
            samples: 0,
            complaint: None,
            lock: None,
        })
    }

    /// Takes the checkpoint for this process alone.
    pub(super) fn lock(&mut self) -> Result<()> {
        let Some(path) = &self.path else {
            return Ok(());
        };
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".lock");
        let place = path.with_file_name(name);
        let file = File::create(&place).map_err(Error::io(&place, "cannot be written"))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = "another render is writing this checkpoint";
            return Err(Error::input(path, None, message));
        }
        self.lock = Some((file, place));
        Ok(())
    }

    /// Fills the film with what is in the file. Its samples; `None` where it starts from nothing.
    pub(super) fn resume(&mut self, film: &mut Film) -> Result<Option<u64>> {
        let there = self
            .path
            .as_deref()
            .filter(|path| self.resume && path.exists());
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
        self.samples = limits.samples;
        let before = Duration::try_from_secs_f64(self.before.seconds).unwrap_or_default();
        Limits {
            time: limits.time.map(|t| t.saturating_sub(before)),
            ..limits
        }
    }

    /// When `--error` is to look at the error, if an earlier process has left word.
    pub(super) fn next_check(&self) -> Option<u64> {
        Some(self.before.next_check).filter(|&n| n > 0)
    }

    /// Writes the file when it is time to: now and then, and before a pass that `--spp` cuts short, from
    /// which more samples would not go on to the same bits.
    pub(super) fn now_and_then(&mut self, film: &Film, counts: &Counts, next_check: u64) {
        let done = film.count(Halves::Both);
        let cut = done > 0 && done < self.samples && self.samples - done < pass_length(done);
        if self.path.is_some() && (cut || self.last.elapsed() >= self.every) {
            let progress = self.progress(counts, self.start.elapsed(), next_check);
            self.save(film, &progress);
        }
    }

    /// Writes the file for the last time. What was done in all processes.
    pub(super) fn end(&mut self, film: &Film, outcome: &Outcome, next_check: u64) -> Progress {
        let progress = self.progress(&outcome.counts, outcome.elapsed, next_check);
        let done = film.count(Halves::Both);
        if done > 0 && is_pass_end(done) {
            self.save(film, &progress);
        }
        progress
    }

    fn progress(&self, counts: &Counts, elapsed: Duration, next_check: u64) -> Progress {
        let mut progress = self.before.clone();
        progress.counts.add(counts);
        progress.seconds += elapsed.as_secs_f64();
        progress.next_check = next_check;
        progress
    }

    /// A render goes on where its checkpoint cannot be written; the first time it is said at once, even
    /// to who wants to read errors only.
    fn save(&mut self, film: &Film, progress: &Progress) {
        let Some(path) = &self.path else { return };
        let before = self.complaint.take();
        if let Err(e) = checkpoint::save(path, &self.identity, progress, film) {
            if before.is_none() {
                let _ = writeln!(
                    std::io::stderr(),
                    "warning: {e}; the render goes on without"
                );
            }
            self.complaint = Some(e.to_string());
        }
        self.last = Instant::now();
    }

    /// The checkpoint, where there is one.
    pub(super) fn kept(&self) -> Option<&Path> {
        self.path
            .as_deref()
            .filter(|path| self.complaint.is_none() && path.exists())
    }

    /// Why the last checkpoint is not there.
    pub(super) fn complaints(&self) -> Vec<String> {
        self.complaint.iter().cloned().collect()
    }
}

impl Drop for Saving {
    fn drop(&mut self) {
        if let Some((_, place)) = &self.lock {
            let _ = std::fs::remove_file(place);
        }
    }
}
