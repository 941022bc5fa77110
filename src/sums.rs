//! What the samples of a pixel add up to, before neighbouring pixels are put together.

use glam::Vec3;

/// One sample of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSample {
    /// Light that arrives by two segments or more.
    pub primal: Vec3,
    /// Light seen directly.
    pub direct: Vec3,
    /// 1 where the camera ray meets the scene, 0 where there is nothing.
    pub coverage: f32,
    /// What the pixel's base path says of the difference to each
    /// [`Neighbour`](crate::gradient::Neighbour), neighbour minus own.
    pub to: [Vec3; 4],
}

impl PixelSample {
    /// Multiplies all of it.
    pub fn scale(&mut self, factor: f32) {
        self.primal *= factor;
        self.direct *= factor;
        self.coverage *= factor;
        self.to.iter_mut().for_each(|to| *to *= factor);
    }

    /// Whether all of it is finite, squares included.
    #[inline]
    pub fn is_finite(&self) -> bool {
        let squares = self.to.iter().map(|&v| v * v).sum::<Vec3>();
        (self.primal * self.primal + self.direct + squares).is_finite()
    }
}

/// Sums over the samples of one half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HalfSums {
    /// Sum of the primal.
    pub primal: Vec3,
    /// Sum of light seen directly.
    pub direct: Vec3,
    /// Sum of the differences to each neighbour.
    pub to: [Vec3; 4],
    /// Sum of the primal's squares.
    pub primal_sq: Vec3,
    /// Sum of the differences' squares.
    pub to_sq: [Vec3; 4],
}

impl HalfSums {
    /// Adds a sample.
    #[inline]
    pub fn add(&mut self, sample: &PixelSample) {
        self.primal += sample.primal;
        self.primal_sq += sample.primal * sample.primal;
        self.direct += sample.direct;
        for j in 0..4 {
            self.to[j] += sample.to[j];
            self.to_sq[j] += sample.to[j] * sample.to[j];
        }
    }
}

/// What else is summed of a pixel, over the samples of both halves: what its camera rays met, and what was dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Auxiliary {
    /// Sum of the albedo of what is seen: of first hits, behind mirrors and glass of what these show.
    pub albedo: Vec3,
    /// Sum of its shading normals, on the side of the camera.
    pub normal: Vec3,
    /// Sum of the first hits' distances.
    pub depth: f32,
    /// Number of first hits.
    pub hits: u32,
    /// Sum of the coverage.
    pub coverage: f32,
    /// Samples dropped because they were not finite.
    pub dropped: u32,
}

impl Auxiliary {
    /// Adds that a camera ray met something.
    #[inline]
    pub fn first_hit(&mut self, depth: f32) {
        self.depth += depth;
        self.hits += 1;
    }

    /// Adds what it shows.
    #[inline]
    pub fn features(&mut self, albedo: Vec3, normal: Vec3) {
        self.albedo += albedo;
        self.normal += normal;
    }

    /// Adds other sums.
    #[inline]
    pub fn add(&mut self, other: &Self) {
        self.albedo += other.albedo;
        self.normal += other.normal;
        self.depth += other.depth;
        self.hits = self.hits.saturating_add(other.hits);
        self.coverage += other.coverage;
        self.dropped = self.dropped.saturating_add(other.dropped);
    }
}

/// Sums of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSums {
    /// Halves A and B.
    pub halves: [HalfSums; 2],
    /// What is not light.
    pub auxiliary: Auxiliary,
}

/// Sums of the pixels of a tile, row by row.
#[derive(Clone, Debug, Default)]
pub struct TileSums {
    /// One for each pixel.
    pub pixels: Vec<PixelSums>,
}

impl TileSums {
    /// All zero, for this many pixels.
    pub fn reset(&mut self, pixels: usize) {
        self.pixels.clear();
        self.pixels.resize(pixels, PixelSums::default());
    }
}
