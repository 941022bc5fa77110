//! `--checkpoint`, `--every` and `--resume`; and films, which are checkpoints of their own.

use super::lock::Lock;
use super::plan::Keeping;
use crate::app::finish::elsewhere;
use crate::checkpoint::{self, Header, Progress};
use crate::error::{Error, Result};
use crate::film::{Film, Halves};
use crate::output;
use crate::path::Counts;
use crate::render::{Ending, Limits, Outcome, is_pass_end, pass_length};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The checkpoint of a render; none without `--checkpoint`, unless the film is what it makes.
pub(super) struct Saving {
    /// Where it is, links followed: what they lead to is replaced, not they.
    path: Option<PathBuf>,
    /// Where the film goes at last, where that is not a picture.
    film: Option<PathBuf>,
    resume: bool,
    every: Duration,
    /// What stands in the file, but for the progress.
    header: Header,
    /// What was done before this process.
    before: Progress,
    /// Samples that the file held.
    resumed: u64,
    start: Instant,
    last: Instant,
    /// Samples of every pixel at which the render ends.
    samples: u64,
    complaint: Option<String>,
    /// Held as long as this process writes the files.
    locks: Vec<Lock>,
}

impl Saving {
    pub(super) fn new(keeping: &Keeping, film: Option<&Path>, header: Header) -> Result<Self> {
        let path = keeping.checkpoint.or(film);
        Ok(Self {
            path: path.map(output::regular_file).transpose()?,
            film: film.map(output::regular_file).transpose()?,
            resume: keeping.resume,
            every: keeping.every,
            header,
            before: Progress::default(),
            resumed: 0,
            start: Instant::now(),
            last: Instant::now(),
            samples: 0,
            complaint: None,
            locks: Vec::new(),
        })
    }

    /// Takes the files for this process alone. Another one may end soon: a film can be tried again.
    pub(super) fn lock(&mut self) -> Result<()> {
        let both = [&self.path, &self.film];
        let mut paths: Vec<&Path> = both.into_iter().flatten().map(PathBuf::as_path).collect();
        paths.dedup();
        let locks = paths.into_iter().map(Lock::new).collect::<Result<_>>();
        self.locks = locks.map_err(|e| self.again(e))?;
        Ok(())
    }

    /// What goes wrong with a film may go well another time.
    fn again(&self, e: Error) -> Error {
        match self.film {
            Some(_) => Error::Later(Box::new(e)),
            None => e,
        }
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
        let header = checkpoint::load(path, &self.header.identity, film)?;
        self.before = header.progress;
        // Its samples were made by both.
        let (there, here) = (header.about.processor, &mut self.header.about.processor);
        if !there.split("; ").any(|name| name == here) {
            *here = format!("{there}; {here}");
        } else {
            *here = there;
        }
        self.resumed = film.count(Halves::Both);
        Ok(Some(self.resumed))
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
    /// which more samples would not go on to the same bits. A film's samples are fixed, and it ends with that pass.
    pub(super) fn now_and_then(&mut self, film: &Film, counts: &Counts, next_check: u64) {
        let done = film.count(Halves::Both);
        let cut = done > 0 && done < self.samples && self.samples - done < self.pass_length(done);
        let cut = cut && self.film.is_none();
        let due = done > 0 && self.last.elapsed() >= self.every;
        if self.path.is_some() && (cut || due) {
            let progress = self.progress(counts, self.start.elapsed(), next_check);
            self.save(film, &progress);
        }
    }

    /// Samples of the pass after `done` of this render's.
    fn pass_length(&self, done: u64) -> u64 {
        pass_length(self.header.share.samples.range().start + done)
    }

    /// Writes the file for the last time. What was done in all processes; an error if a film is not where it should
    /// be.
    pub(super) fn end(
        &mut self,
        film: &Film,
        outcome: &Outcome,
        next_check: u64,
    ) -> Result<Progress> {
        let mut progress = self.progress(&outcome.counts, outcome.elapsed, next_check);
        let done = film.count(Halves::Both);
        if self.film.is_some()
            && self.film == self.path
            && done == self.resumed
            && self.before.finished
        {
            return Ok(self.before.clone());
        }
        progress.finished = outcome.ended != Ending::Interrupted;
        if done > 0 && (self.film.is_some() || is_pass_end(done)) {
            self.save(film, &progress);
        }
        if let Some(path) = self.film.clone().filter(|_| done > 0) {
            let written = self.path.as_ref() == Some(&path) && self.complaint.is_none();
            if !written {
                self.header.progress = progress.clone();
                checkpoint::save(&path, &self.header, film).map_err(|e| {
                    let save = |place: &Path| checkpoint::save(place, &self.header, film);
                    let name = path.file_name().unwrap_or_default();
                    self.again(elsewhere("film", name, e, save))
                })?;
                self.complaint = None;
            }
        }
        Ok(progress)
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
        self.header.progress = progress.clone();
        if let Err(e) = checkpoint::save(path, &self.header, film) {
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
