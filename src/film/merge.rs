//! The film of many films: of parts of the samples, of crops of the picture, or of both.
//!
//! Sums are added. A difference across the border of two crops has two parts, as everywhere: the left or upper film
//! has what its own pixels say, the right or lower one keeps beside it what its first column and row say.

use super::bytes::{read_counted, read_terms};
use super::{Counted, Film, HalfPixel, Pixel, Window, add_terms};
use std::io::{Read, Result};

impl Film {
    /// Adds the sums of the pixels of `window`, all of them in this film, that [`Film::write_to`] has written of a film
    /// with tiles of the same size. They are not counted yet; their counts are returned.
    pub fn add_from(&mut self, window: Window, input: &mut impl Read) -> Result<[Counted; 2]> {
        let counted = read_counted(input)?;
        let tile = self.tile_size;
        let steps = |start: u32, end: u32| (start..end).step_by(tile as usize);
        for top in steps(window.y, window.bottom()) {
            for left in steps(window.x, window.right()) {
                for y in top..window.bottom().min(top + tile) {
                    for x in left..window.right().min(left + tile) {
                        self.pixel(x, y).add(&Pixel::read_from(input)?);
                    }
                }
            }
        }
        if window.x > 0 {
            for y in window.y..window.bottom() {
                let terms = read_terms(input)?;
                if window.x > self.window.x {
                    self.pixel(window.x - 1, y)
                        .add_terms(&terms, HalfPixel::add_right);
                } else {
                    add_terms(&mut self.outside.left[(y - self.window.y) as usize], &terms);
                }
            }
        }
        if window.y > 0 {
            for x in window.x..window.right() {
                let terms = read_terms(input)?;
                if window.y > self.window.y {
                    self.pixel(x, window.y - 1)
                        .add_terms(&terms, HalfPixel::add_below);
                } else {
                    add_terms(&mut self.outside.up[(x - self.window.x) as usize], &terms);
                }
            }
        }
        Ok(counted)
    }

    /// The pixel at a place in the picture.
    fn pixel(&mut self, x: u32, y: u32) -> &mut Pixel {
        let (x, y) = (x - self.window.x, y - self.window.y);
        let index = (y / self.tile_size) as usize * self.columns() + (x / self.tile_size) as usize;
        let tile = &mut self.tiles[index];
        let (x, y) = (x % self.tile_size, y % self.tile_size);
        &mut tile.pixels[(y * tile.tile.width + x) as usize]
    }
}

impl Pixel {
    fn add(&mut self, other: &Self) {
        for (half, other) in self.halves.iter_mut().zip(&other.halves) {
            half.add(other);
        }
        self.auxiliary.add(&other.auxiliary);
    }
}
