//! What the sums of a film say: means, variances of the means, what camera rays met.

use super::{Film, FilmTile, HalfPixel, Pixel};
use crate::estimate::{Estimate, Planes};
use crate::image::Image;
use glam::Vec3;
use rayon::prelude::*;

/// Means of what the camera rays met.
#[derive(Clone, Debug)]
pub struct FirstHits {
    /// Albedo of what is seen: behind mirrors and smooth glass of what these show, times what they leave of light.
    pub albedo: Image,
    /// Its shading normal in world coordinates, on the side from which it is seen; 0 where nothing is hit.
    pub normal: Image,
    /// Distance from the camera; 0 where nothing is hit.
    pub depth: Vec<f32>,
    /// The share of each pixel in which something is hit, by the pixel filter; from 0 to 1.
    pub coverage: Vec<f32>,
    /// Samples dropped.
    pub dropped: Vec<f32>,
}

/// The halves of the film that an estimate is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halves {
    /// The first half alone.
    A,
    /// The second half alone.
    B,
    /// All samples.
    Both,
}

impl Halves {
    fn range(self) -> std::ops::Range<usize> {
        match self {
            Halves::A => 0..1,
            Halves::B => 1..2,
            Halves::Both => 0..2,
        }
    }
}

impl Film {
    /// Visits every pixel with its index `y * width + x` in the window.
    fn for_each(&self, mut visit: impl FnMut(usize, &Pixel)) {
        let window = self.window;
        for FilmTile { tile, pixels, .. } in &self.tiles {
            let (left, top) = (tile.x - window.x, tile.y - window.y);
            for (index, pixel) in pixels.iter().enumerate() {
                let (x, y) = (index as u32 % tile.width, index as u32 / tile.width);
                visit(((top + y) * window.width + left + x) as usize, pixel);
            }
        }
    }

    fn image(&self) -> Image {
        Image::new(self.window.width as usize, self.window.height as usize)
    }

    /// Number of samples of one half or of all.
    pub fn count(&self, halves: Halves) -> u64 {
        self.samples[halves.range()].iter().sum()
    }

    /// What the samples of one half or of all count together. A few samples of a filter that is in part
    /// negative may cancel; then it is their number, which is right in the mean.
    fn weight(&self, halves: Halves) -> f32 {
        let (n, weight) = (
            self.count(halves) as f64,
            self.weights[halves.range()].iter().sum::<f64>(),
        );
        (if weight > 0.5 * n { weight } else { n }) as f32
    }

    /// Means and variances of one half or of all samples. All 0 where there are no samples.
    ///
    /// Differences across the border of a crop are not known, and 0 as those across the border of a picture: the
    /// pixels outside have not said their part.
    pub fn estimate(&self, halves: Halves) -> Estimate {
        let mut e = Estimate::new(self.window.width as usize, self.window.height as usize);
        if self.count(halves) == 0 {
            return e;
        }
        self.for_each(|index, pixel| {
            let m = self.moments(halves, pixel, self.cut(index));
            e.primal.set(index, m.primal);
            e.dx.set(index, m.dx);
            e.dy.set(index, m.dy);
            e.primal_variance.set(index, m.primal_sq);
            e.dx_variance.set(index, m.dx_sq);
            e.dy_variance.set(index, m.dy_sq);
        });
        e
    }

    /// One channel of [`Film::estimate`].
    pub fn planes(&self, halves: Halves, channel: usize) -> Planes {
        let plane = || vec![0.0; self.window.pixels()];
        let mut p = Planes {
            primal: plane(),
            dx: plane(),
            dy: plane(),
            primal_variance: plane(),
            dx_variance: plane(),
            dy_variance: plane(),
        };
        if self.count(halves) == 0 {
            return p;
        }
        // A row of tiles fills a stretch of each plane.
        let columns = self.columns();
        let width = self.window.width;
        let stretch = (width * self.tile_size) as usize;
        let rows = |plane| <[f32]>::par_chunks_mut(plane, stretch);
        (
            self.tiles.par_chunks(columns),
            rows(&mut p.primal),
            rows(&mut p.dx),
            rows(&mut p.dy),
            rows(&mut p.primal_variance),
            rows(&mut p.dx_variance),
            rows(&mut p.dy_variance),
        )
            .into_par_iter()
            .for_each(|(tiles, primal, dx, dy, primal_sq, dx_sq, dy_sq)| {
                for FilmTile { tile, pixels, .. } in tiles {
                    for (index, pixel) in pixels.iter().enumerate() {
                        let (x, y) = (index as u32 % tile.width, index as u32 / tile.width);
                        let at = (y * width + tile.x - self.window.x + x) as usize;
                        let above = (tile.y - self.window.y) * width;
                        let m = self.moments(halves, pixel, self.cut(above as usize + at));
                        primal[at] = m.primal[channel];
                        dx[at] = m.dx[channel];
                        dy[at] = m.dy[channel];
                        primal_sq[at] = m.primal_sq[channel];
                        dx_sq[at] = m.dx_sq[channel];
                        dy_sq[at] = m.dy_sq[channel];
                    }
                }
            });
        p
    }

    /// Whether the differences to the right and downwards of the pixel with this index in the window lack what
    /// pixels outside say.
    #[inline]
    fn cut(&self, index: usize) -> (bool, bool) {
        let (width, height) = (self.window.width as usize, self.window.height as usize);
        (
            self.window.is_cut_right() && index % width + 1 == width,
            self.window.is_cut_below() && index / width + 1 == height,
        )
    }

    /// A pixel's means, and the variances of the means in place of the squares; of differences that are `cut` as if
    /// their samples were 0.
    #[inline]
    fn moments(&self, halves: Halves, pixel: &Pixel, cut: (bool, bool)) -> HalfPixel {
        let n = self.count(halves) as f32;
        let weight = self.weight(halves);
        // What a filter makes of equal samples is no variance.
        let square = (self.squares[halves.range()].iter().sum::<f64>() / f64::from(n)) as f32;
        // Of a mean over n samples; one sample alone says nothing.
        let variance = |sum_sq: Vec3, mean_sq: Vec3| {
            if n > 1.0 {
                (sum_sq / n - mean_sq * square).max(Vec3::ZERO) / (n - 1.0)
            } else {
                Vec3::INFINITY
            }
        };
        let mut sum = HalfPixel::default();
        for half in &pixel.halves[halves.range()] {
            sum.add(half);
        }
        if cut.0 {
            (sum.dx, sum.dx_sq) = (Vec3::ZERO, Vec3::ZERO);
        }
        if cut.1 {
            (sum.dy, sum.dy_sq) = (Vec3::ZERO, Vec3::ZERO);
        }
        let (primal, dx, dy) = (sum.primal / weight, sum.dx / weight, sum.dy / weight);
        // A difference has two parts, of which the squares are summed one by one. Their covariance is
        // left out: they share the position inside the pixel, so the true variance is up to twice this,
        // or less where both shifts are dead. With means a and b, (a + b)²/2 is at most what is to be
        // subtracted, a² + b².
        HalfPixel {
            primal,
            dx,
            dy,
            primal_sq: variance(sum.primal_sq, primal * primal),
            dx_sq: variance(sum.dx_sq, dx * dx * 0.5),
            dy_sq: variance(sum.dy_sq, dy * dy * 0.5),
            direct: Vec3::ZERO,
        }
    }

    /// Light seen directly, with a radiance of its own or from the environment ("very direct"): the mean
    /// over one half or over all samples.
    pub fn direct(&self, halves: Halves) -> Image {
        let mut image = self.image();
        let weight = self.weight(halves);
        let weight = if weight > 0.0 { weight } else { 1.0 };
        self.for_each(|index, pixel| {
            let sum: Vec3 = pixel.halves[halves.range()].iter().map(|h| h.direct).sum();
            image.set(index, sum / weight);
        });
        image
    }

    /// Whether any sample of a pixel has found light that is not seen directly.
    pub fn lit(&self) -> Vec<bool> {
        let mut lit = vec![false; self.window.pixels()];
        self.for_each(|index, pixel| {
            lit[index] = pixel.halves.iter().any(|h| h.primal != Vec3::ZERO);
        });
        lit
    }

    /// Means of what the camera rays met.
    pub fn first_hits(&self) -> FirstHits {
        let mut hits = FirstHits {
            albedo: self.image(),
            normal: self.image(),
            depth: self.image().channels[0].clone(),
            coverage: self.image().channels[0].clone(),
            dropped: self.image().channels[0].clone(),
        };
        let n = (self.samples[0] + self.samples[1]).max(1) as f32;
        let weight = self.weight(Halves::Both).max(f32::MIN_POSITIVE);
        self.for_each(|index, pixel| {
            let sums = &pixel.auxiliary;
            hits.albedo.set(index, sums.albedo / n);
            hits.normal.set(index, sums.normal / n);
            hits.depth[index] = sums.depth / sums.hits.max(1) as f32;
            // A filter that is in part negative may go beyond.
            hits.coverage[index] = (sums.coverage / weight).clamp(0.0, 1.0);
            hits.dropped[index] = sums.dropped as f32;
        });
        hits
    }
}
