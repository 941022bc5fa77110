//! `--error`: renders until the estimated error is small enough.

use crate::film::{Film, Halves};
use crate::picture::{self, Picture};
use crate::reconstruct;

/// Samples before the error is estimated for the first time.
const FIRST_CHECK: u64 = 16;

/// Whether the error is small enough for `--error`: asked after every pass, answered by a solve whenever
/// the samples may suffice. As it goes down as one over the samples or faster, the next time is known.
pub(super) struct ErrorCheck {
    target: Option<f64>,
    pub(super) next: u64,
    /// The picture of the last solve.
    pub(super) last: Option<Picture>,
}

impl ErrorCheck {
    pub(super) fn new(target: Option<f64>, next: Option<u64>) -> Self {
        Self {
            target,
            next: next.unwrap_or(FIRST_CHECK),
            last: None,
        }
    }

    pub(super) fn reached(&mut self, film: &Film, method: reconstruct::Method) -> bool {
        let done = film.count(Halves::Both);
        let Some(target) = self.target.filter(|_| done >= self.next) else {
            return false;
        };
        let picture = self.last.insert(picture::of_film(film, method));
        let error = picture.rel_mse.unwrap_or(f64::INFINITY);
        let missing = error / target;
        self.next = (done as f64 * missing.clamp(1.1, 2.0)) as u64;
        missing <= 1.0
    }
}
