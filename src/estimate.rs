//! What a render estimates: means over the samples, and the variances of these means.

use crate::image::Image;

/// Means over the samples, and the variances of these means. Differences are right (dx) or lower (dy)
/// neighbour minus pixel; those across the film's border are 0.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The path-traced image without light seen directly.
    pub primal: Image,
    /// Differences to the right.
    pub dx: Image,
    /// Differences downwards.
    pub dy: Image,
    /// Variance of `primal`. From the second moments of low-discrepancy samples, so rather too large.
    pub primal_variance: Image,
    /// Variance of `dx`, from its two parts as if they were independent: within a factor of about 2.
    pub dx_variance: Image,
    /// Variance of `dy`, likewise.
    pub dy_variance: Image,
}

/// One channel of an [`Estimate`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// The path-traced image without light seen directly.
    pub primal: Vec<f32>,
    /// Differences to the right.
    pub dx: Vec<f32>,
    /// Differences downwards.
    pub dy: Vec<f32>,
    /// Variance of `primal`; infinite where it is not known.
    pub primal_variance: Vec<f32>,
    /// Variance of `dx`.
    pub dx_variance: Vec<f32>,
    /// Variance of `dy`.
    pub dy_variance: Vec<f32>,
}

impl Estimate {
    /// All zero.
    pub fn new(width: usize, height: usize) -> Self {
        let image = || Image::new(width, height);
        Self {
            primal: image(),
            dx: image(),
            dy: image(),
            primal_variance: image(),
            dx_variance: image(),
            dy_variance: image(),
        }
    }

    /// One channel: 0 is red.
    pub fn channel(&self, channel: usize) -> Planes {
        let of = |image: &Image| image.channels[channel].clone();
        Planes {
            primal: of(&self.primal),
            dx: of(&self.dx),
            dy: of(&self.dy),
            primal_variance: of(&self.primal_variance),
            dx_variance: of(&self.dx_variance),
            dy_variance: of(&self.dy_variance),
        }
    }
}
