//! The film: sums over all samples, in two independent halves.
//!
//! It is kept tile by tile, so that threads never share memory. A difference between two pixels is the
//! sum of what the base paths of both say; at the border of a tile the second part belongs to the
//! neighbouring tile, and is added after the pass. Everywhere the order is the same: the pixel's own
//! part, then its neighbour's. So the bits depend neither on the number of threads nor on the tiles.
//!
//! A film may hold a crop of a picture. What its pixels say of differences to pixels left of it and above is kept
//! beside it, and belongs to the films of those when all become one.

mod bytes;
mod means;
mod merge;
mod window;

pub use means::{FirstHits, Halves};
pub use window::Window;

use crate::gradient::Neighbour;
use crate::path::Tile;
use crate::sums::{Auxiliary, PixelSums, TileSums};
use glam::Vec3;

/// Sums of one half at one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct HalfPixel {
    primal: Vec3,
    /// Difference to the right neighbour.
    dx: Vec3,
    /// Difference to the lower neighbour.
    dy: Vec3,
    primal_sq: Vec3,
    dx_sq: Vec3,
    dy_sq: Vec3,
    /// Light seen directly.
    direct: Vec3,
}

/// Sums at one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pixel {
    halves: [HalfPixel; 2],
    auxiliary: Auxiliary,
}

/// Bytes of film for each pixel.
pub const BYTES_PER_PIXEL: usize = size_of::<Pixel>();

/// Most samples of a film: its sums are 32-bit floats, to which nothing can be added beyond 2²⁴ samples of one size.
pub const MAX_SAMPLES: u64 = 1 << 24;

/// The sums of a tile's pixels.
#[derive(Clone, Debug)]
pub struct FilmTile {
    /// Which pixels.
    pub tile: Tile,
    /// Whether the picture ends at the tile's right and lower side: no differences go across.
    last: (bool, bool),
    pixels: Vec<Pixel>,
    borders: Borders,
}

/// What the first column and the first row of a tile say of the differences that belong to the tiles
/// to the left and above: value and square for each half.
#[derive(Clone, Debug, Default)]
struct Borders {
    left: Vec<[Term; 2]>,
    up: Vec<[Term; 2]>,
}

/// What one pixel says of its difference to a neighbour: sum and sum of squares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Term {
    sum: Vec3,
    square: Vec3,
}

/// What the pixels of a crop say, in each half, of differences that belong to pixels outside.
#[derive(Clone, Debug, Default)]
struct Outside {
    /// Of the first column, to the left, if there is anything.
    left: Vec<[Term; 2]>,
    /// Of the first row, upwards.
    up: Vec<[Term; 2]>,
}

/// The film.
#[derive(Clone, Debug)]
pub struct Film {
    /// Its pixels.
    pub window: Window,
    /// Side of a tile; those at the right and lower border may be smaller.
    tile_size: u32,
    /// Row by row; each has its place in the picture.
    pub tiles: Vec<FilmTile>,
    outside: Outside,
    /// Number of samples in each half, the same for all pixels.
    pub samples: [u64; 2],
    /// Sum of what they count by the pixel filter: their number, but for a filter that is in part negative.
    weights: [f64; 2],
    /// Sum of the squares of that.
    squares: [f64; 2],
}

/// Samples of one half: those of a pass, or of a film.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counted {
    /// Their number.
    pub samples: u64,
    /// Sum of what they count by the pixel filter.
    pub weight: f64,
    /// Sum of its squares.
    pub square: f64,
}

impl Counted {
    /// One more, which counts `weight`.
    pub fn add(&mut self, weight: f32) {
        self.samples += 1;
        self.weight += f64::from(weight);
        self.square += f64::from(weight) * f64::from(weight);
    }
}

impl FilmTile {
    /// Adds the sums of a pass, and keeps what belongs to neighbouring tiles for the end of the pass.
    pub fn add(&mut self, sums: &TileSums) {
        let (width, height) = (self.tile.width as usize, self.tile.height as usize);
        for (index, pixel) in self.pixels.iter_mut().enumerate() {
            let own = &sums.pixels[index];
            let right = (index % width + 1 < width).then(|| &sums.pixels[index + 1]);
            let below = (index / width + 1 < height).then(|| &sums.pixels[index + width]);
            for (h, half) in pixel.halves.iter_mut().enumerate() {
                let from = &own.halves[h];
                half.primal += from.primal;
                half.primal_sq += from.primal_sq;
                if right.is_some() || !self.last.0 {
                    half.dx += from.to[Neighbour::Right as usize];
                    half.dx_sq += from.to_sq[Neighbour::Right as usize];
                }
                if below.is_some() || !self.last.1 {
                    half.dy += from.to[Neighbour::Down as usize];
                    half.dy_sq += from.to_sq[Neighbour::Down as usize];
                }
                if let Some(right) = right {
                    half.add_right(term(right, h, Neighbour::Left));
                }
                if let Some(below) = below {
                    half.add_below(term(below, h, Neighbour::Up));
                }
                half.direct += from.direct;
            }
            pixel.auxiliary.add(&own.auxiliary);
        }
        let both = |p: &PixelSums, n| [0, 1].map(|h| term(p, h, n));
        self.borders.left.clear();
        let first_column = (0..height).map(|y| both(&sums.pixels[y * width], Neighbour::Left));
        self.borders.left.extend(first_column);
        self.borders.up.clear();
        let first_row = (0..width).map(|x| both(&sums.pixels[x], Neighbour::Up));
        self.borders.up.extend(first_row);
    }
}

/// What one pixel says of its difference to a neighbour.
#[inline]
fn term(pixel: &PixelSums, half: usize, neighbour: Neighbour) -> Term {
    let half = &pixel.halves[half];
    Term {
        sum: half.to[neighbour as usize],
        square: half.to_sq[neighbour as usize],
    }
}

impl HalfPixel {
    /// Adds other sums.
    #[inline]
    fn add(&mut self, other: &Self) {
        self.primal += other.primal;
        self.dx += other.dx;
        self.dy += other.dy;
        self.primal_sq += other.primal_sq;
        self.dx_sq += other.dx_sq;
        self.dy_sq += other.dy_sq;
        self.direct += other.direct;
    }

    /// Adds what the right neighbour says, own minus neighbour.
    #[inline]
    fn add_right(&mut self, term: Term) {
        self.dx -= term.sum;
        self.dx_sq += term.square;
    }

    /// Adds what the neighbour below says.
    #[inline]
    fn add_below(&mut self, term: Term) {
        self.dy -= term.sum;
        self.dy_sq += term.square;
    }
}

impl Pixel {
    /// Adds to both halves what a neighbour says.
    fn add_terms(&mut self, terms: &[Term; 2], add: fn(&mut HalfPixel, Term)) {
        for (half, &term) in self.halves.iter_mut().zip(terms) {
            add(half, term);
        }
    }
}

/// Adds what is said of a difference to pixels outside.
fn add_terms(sums: &mut [Term; 2], terms: &[Term; 2]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        sum.sum += term.sum;
        sum.square += term.square;
    }
}

impl Film {
    /// Of a whole picture, all zero, in tiles of `tile_size` pixels a side.
    pub fn new(width: u32, height: u32, tile_size: u32) -> Self {
        Self::of(Window::whole(width, height), tile_size)
    }

    /// Of some pixels of a picture, all zero, in tiles of `tile_size` pixels a side.
    pub fn of(window: Window, tile_size: u32) -> Self {
        let steps = |start: u32, end: u32| (start..end).step_by(tile_size as usize);
        let columns = || steps(window.x, window.right());
        let tiles = steps(window.y, window.bottom())
            .flat_map(|y| columns().map(move |x| (x, y)))
            .map(|(x, y)| {
                let tile = Tile {
                    x,
                    y,
                    width: tile_size.min(window.right() - x),
                    height: tile_size.min(window.bottom() - y),
                };
                let last = (
                    x + tile.width == window.picture.0,
                    y + tile.height == window.picture.1,
                );
                let pixels = vec![Pixel::default(); (tile.width * tile.height) as usize];
                FilmTile {
                    tile,
                    last,
                    pixels,
                    borders: Borders::default(),
                }
            })
            .collect();
        let none =
            |count: u32, any: bool| vec![Default::default(); count as usize * usize::from(any)];
        Self {
            window,
            tile_size,
            tiles,
            outside: Outside {
                left: none(window.height, window.x > 0),
                up: none(window.width, window.y > 0),
            },
            samples: [0; 2],
            weights: [0.0; 2],
            squares: [0.0; 2],
        }
    }

    /// Tiles in a row.
    fn columns(&self) -> usize {
        self.window.width.div_ceil(self.tile_size) as usize
    }

    /// Ends a pass: adds what the tiles' first rows and columns say to their neighbours. `counted`
    /// are the samples of the pass in each half.
    pub fn end_pass(&mut self, counted: [Counted; 2]) {
        let columns = self.columns();
        for index in 0..self.tiles.len() {
            let borders = std::mem::take(&mut self.tiles[index].borders);
            let tile = self.tiles[index].tile;
            if index % columns > 0 {
                let tile = &mut self.tiles[index - 1];
                let width = tile.tile.width as usize;
                for (y, terms) in borders.left.iter().enumerate() {
                    tile.pixels[y * width + width - 1].add_terms(terms, HalfPixel::add_right);
                }
            } else if tile.x > 0 {
                let places = &mut self.outside.left[(tile.y - self.window.y) as usize..];
                for (place, terms) in places.iter_mut().zip(&borders.left) {
                    add_terms(place, terms);
                }
            }
            if index >= columns {
                let tile = &mut self.tiles[index - columns];
                let (width, height) = (tile.tile.width as usize, tile.tile.height as usize);
                for (x, terms) in borders.up.iter().enumerate() {
                    tile.pixels[(height - 1) * width + x].add_terms(terms, HalfPixel::add_below);
                }
            } else if tile.y > 0 {
                let places = &mut self.outside.up[(tile.x - self.window.x) as usize..];
                for (place, terms) in places.iter_mut().zip(&borders.up) {
                    add_terms(place, terms);
                }
            }
            self.tiles[index].borders = borders;
        }
        self.count_samples(counted);
    }

    /// Counts samples whose sums are there for all pixels.
    pub fn count_samples(&mut self, counted: [Counted; 2]) {
        for (half, counted) in counted.iter().enumerate() {
            self.samples[half] += counted.samples;
            self.weights[half] += counted.weight;
            self.squares[half] += counted.square;
        }
    }

    /// Whether any sample carried light.
    pub fn has_light(&self) -> bool {
        let mut halves = self.pixels().flat_map(|p| &p.halves);
        halves.any(|h| h.primal != Vec3::ZERO || h.direct != Vec3::ZERO)
    }

    /// Whether it is of something: any camera ray met a surface, and any sample carried light.
    pub fn shows_something(&self) -> bool {
        self.has_hits() && self.has_light()
    }

    /// Whether any camera ray met a surface.
    pub fn has_hits(&self) -> bool {
        self.pixels().any(|p| p.auxiliary.hits > 0)
    }

    fn pixels(&self) -> impl Iterator<Item = &Pixel> {
        self.tiles.iter().flat_map(|tile| &tile.pixels)
    }
}

const _: () = assert!(BYTES_PER_PIXEL <= 250);
