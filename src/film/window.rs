//! The pixels of a picture that a film holds.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A rectangle of pixels of a picture: all of it, or a crop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Window {
    /// Its first row.
    pub y: u32,
    /// Its first column.
    pub x: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Pixels of the whole picture, across and down.
    pub picture: (u32, u32),
}

impl Window {
    /// All of a picture.
    pub fn whole(width: u32, height: u32) -> Self {
        Self {
            x: 0,
            y: 0,
            width,
            height,
            picture: (width, height),
        }
    }

    /// Whether it is all of its picture.
    pub fn is_whole(&self) -> bool {
        (self.width, self.height) == self.picture
    }

    /// One past its last column.
    pub fn right(&self) -> u32 {
        self.x + self.width
    }

    /// One past its last row.
    pub fn bottom(&self) -> u32 {
        self.y + self.height
    }

    /// Whether the pixels of its last column have neighbours outside.
    pub fn is_cut_right(&self) -> bool {
        self.right() < self.picture.0
    }

    /// Whether the pixels of its last row have neighbours outside.
    pub fn is_cut_below(&self) -> bool {
        self.bottom() < self.picture.1
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether there are pixels that both have.
    pub fn meets(&self, other: &Self) -> bool {
        self.x < other.right()
            && other.x < self.right()
            && self.y < other.bottom()
            && other.y < self.bottom()
    }

    /// The smallest that holds both, which are of one picture.
    pub fn with(&self, other: &Self) -> Self {
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        Self {
            x,
            y,
            width: self.right().max(other.right()) - x,
            height: self.bottom().max(other.bottom()) - y,
            picture: self.picture,
        }
    }

    /// Whether it lies in its picture, and is not empty: not so in files that are damaged.
    pub fn is_valid(&self) -> bool {
        let inside = |start: u32, length: u32, all: u32| {
            length > 0 && start.checked_add(length).is_some_and(|end| end <= all)
        };
        let pixels = u64::from(self.picture.0) * u64::from(self.picture.1);
        inside(self.x, self.width, self.picture.0)
            && inside(self.y, self.height, self.picture.1)
            && pixels <= u64::from(u32::MAX)
    }
}

/// As `--crop` has it.
impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { x, y, .. } = self;
        write!(f, "{x},{y},{},{}", self.right(), self.bottom())
    }
}
