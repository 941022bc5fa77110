//! Buffers that are filled anew in every step.

use std::ops::{Deref, DerefMut};

/// A list whose entries are used again as they are: they hold what they held before until they are written. To make
/// them anew would take a good part of the time.
pub(super) struct Pool<T> {
    entries: Vec<T>,
    used: usize,
}

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self {
            entries: Vec::new(),
            used: 0,
        }
    }
}

impl<T> Pool<T> {
    /// Empties it.
    pub(super) fn clear(&mut self) {
        self.used = 0;
    }

    /// One more entry: one that was there before, or a `new` one.
    #[inline(always)]
    pub(super) fn next(&mut self, new: fn() -> T) -> &mut T {
        if self.used == self.entries.len() {
            self.entries.push(new());
        }
        self.used += 1;
        &mut self.entries[self.used - 1]
    }

    /// Makes it `used` entries long.
    pub(super) fn resize(&mut self, used: usize, new: fn() -> T) {
        if used > self.entries.len() {
            self.entries.resize_with(used, new);
        }
        self.used = used;
    }
}

impl<T> Deref for Pool<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.entries[..self.used]
    }
}

impl<T> DerefMut for Pool<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.entries[..self.used]
    }
}
