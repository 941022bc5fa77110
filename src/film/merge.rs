//! The film of many films: of parts of the samples, of crops of the picture, or of both.
//!
//! Sums are added. A difference across the border of two crops has two parts, as everywhere: the left or upper film
//! has what its own pixels say, the right or lower one keeps beside it what its first column and row say.

use super::bytes::read_terms;
use super::{Film, HalfPixel, Pixel, Term, Window};
use std::io::{Read, Result};

/// The samples of a film.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// Their number in each half.
    pub samples: [u64; 2],
    /// What they count by the pixel filter, in each half.
    pub weights: [f64; 2],
    /// The sum of the squares of that.
    pub squares: [f64; 2],
}

impl Film {
    /// Counts samples whose sums are there for all pixels.
    pub fn count_samples(&mut self, sums: &Sums) {
        for half in 0..2 {
            self.samples[half] += sums.samples[half];
            self.weights[half] += sums.weights[half];
            self.squares[half] += sums.squares[half];
        }
    }

    /// Adds the sums of the pixels of `window`, all of them in this film, that [`Film::write_to`] has written of a film
    /// with tiles of the same size. They are not counted yet; their counts are returned.
    pub fn add_from(&mut self, window: Window, input: &mut impl Read) -> Result<Sums> {
        let sums = Sums::read_from(input)?;
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
                    add(self.pixel(window.x - 1, y), &terms, HalfPixel::add_right);
                } else {
                    add_outside(&mut self.outside.left[(y - self.window.y) as usize], &terms);
                }
            }
        }
        if window.y > 0 {
            for x in window.x..window.right() {
                let terms = read_terms(input)?;
                if window.y > self.window.y {
                    add(self.pixel(x, window.y - 1), &terms, HalfPixel::add_below);
                } else {
                    add_outside(&mut self.outside.up[(x - self.window.x) as usize], &terms);
                }
            }
        }
        Ok(sums)
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

fn add(pixel: &mut Pixel, terms: &[Term; 2], add: fn(&mut HalfPixel, Term)) {
    for (half, &term) in pixel.halves.iter_mut().zip(terms) {
        add(half, term);
    }
}

fn add_outside(sums: &mut [Term; 2], terms: &[Term; 2]) {
    super::add_all(std::slice::from_mut(sums), std::slice::from_ref(terms));
}

impl Pixel {
    fn add(&mut self, other: &Self) {
        for (half, other) in self.halves.iter_mut().zip(&other.halves) {
            half.add(other);
        }
        self.auxiliary.add(&other.auxiliary);
    }
}
