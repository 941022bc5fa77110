//! `--watch`: the picture as it grows.

use crate::app::finish::layers;
use crate::develop::Plate;
use crate::film::{Film, FirstHits, Halves};
use crate::load::environment::Background;
use crate::picture::{self, Picture};
use crate::progress::Reporter;
use crate::reconstruct;
use crate::render::Method;
use crate::watch::{Snapshot, Watcher};
use std::path::Path;
use std::time::{Duration, Instant};

/// Least time between two pictures.
const LEAST: Duration = Duration::from_millis(250);
/// How many times longer is rendered than pictures are made to be watched.
const SHARE: u32 = 10;

/// One picture that is watched.
pub(super) struct Watching<'a> {
    watcher: Option<&'a Watcher>,
    name: String,
    method: Method,
    background: Background,
    quiet: bool,
    next: Instant,
    complaint: Option<String>,
}

impl<'a> Watching<'a> {
    pub(super) fn new(
        watcher: Option<&'a Watcher>,
        output: &Path,
        method: Method,
        background: Background,
        quiet: bool,
    ) -> Self {
        Self {
            watcher,
            name: output.display().to_string(),
            method,
            background,
            quiet,
            next: Instant::now(),
            complaint: None,
        }
    }

    /// Shows what there is, when it is time to.
    pub(super) fn now_and_then(&mut self, film: &Film, reconstruct: reconstruct::Method) {
        let Some(watcher) = self.watcher else { return };
        if let Some(failure) = watcher.failure() {
            self.complain(failure);
        }
        let start = Instant::now();
        if film.count(Halves::Both) == 0 || start < self.next || !watcher.is_ready() {
            return;
        }
        let picture = picture::of_film(film, reconstruct);
        self.show(watcher, &picture, &film.first_hits(), film);
        self.next = Instant::now() + (start.elapsed() * SHARE).max(LEAST);
    }

    /// Shows the picture at last. Why it is not shown, if so.
    pub(super) fn end(
        mut self,
        picture: &Picture,
        hits: &FirstHits,
        film: &Film,
    ) -> Option<String> {
        let watcher = self.watcher?;
        // One may be on its way.
        if let Some(failure) = watcher.settle() {
            self.complain(failure);
        }
        if watcher.is_ready() {
            self.show(watcher, picture, hits, film);
            if let Some(failure) = watcher.settle() {
                self.complain(failure);
            }
        }
        self.complaint
    }

    fn show(&self, watcher: &Watcher, picture: &Picture, hits: &FirstHits, film: &Film) {
        let plate = Plate {
            image: &picture.image,
            coverage: &hits.coverage,
            background: self.background,
        };
        watcher.show(Snapshot {
            name: self.name.clone(),
            size: (film.window.width, film.window.height),
            layers: layers(self.method, &plate, picture, hits, film),
        });
    }

    fn complain(&mut self, failure: String) {
        Reporter::new(self.quiet).warnings(std::slice::from_ref(&failure));
        self.complaint = Some(failure);
    }
}
