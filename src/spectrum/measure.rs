//! Errors of a scene by frequency, from many independent renders.
//!
//! The basis is that of the DCT-II, in which the solve with one weight is diagonal, borders and all: of a
//! primal with the coefficient p and differences G it makes (α²p + d)/(α² + |D|²), with d that of Dᵀ G. So
//! the spectra of p and d and what they have in common say the error for every α.

use super::theory::{Variances, difference_power};
use crate::estimate::Planes;
use crate::reconstruct::l2::divergence;
use rayon::prelude::*;
use rustdct::{DctPlanner, TransformType2And3};
use std::sync::Arc;

/// Sums over the renders.
pub struct Sums {
    size: (usize, usize),
    transforms: [Arc<dyn TransformType2And3<f64>>; 2],
    renders: u64,
    /// For each channel and coefficient.
    coefficients: Vec<[Pair; 3]>,
    /// For each pixel, summed over the channels: primal, dx, dy.
    pixels: Vec<[[Moments; 3]; 3]>,
}

/// Sums of a value and of its square.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    sum: f64,
    squares: f64,
}

/// Sums of p and d, of their squares and of their product.
#[derive(Clone, Copy, Debug, Default)]
struct Pair {
    p: Moments,
    d: Moments,
    product: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.squares += value * value;
    }

    fn variance(&self, n: f64) -> f64 {
        ((self.squares - self.sum * self.sum / n) / (n - 1.0)).max(0.0)
    }
}

/// Variances at one coefficient, the means over the channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coefficient {
    /// In cycles per pixel, over both axes.
    pub frequency: f64,
    /// |D|².
    pub d2: f64,
    /// Of the primal.
    pub primal: f64,
    /// Of Dᵀ G.
    pub divergence: f64,
    /// Covariance of both.
    pub covariance: f64,
}

/// What was measured.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Number of renders.
    pub renders: u64,
    /// Of primal and differences, the means over all of them: what the theory predicts from.
    pub variances: Variances,
    /// All coefficients but that of the mean.
    pub coefficients: Vec<Coefficient>,
    /// Variance of the primal at each pixel, the mean over the channels.
    pub primal_variance: Vec<f64>,
    /// Variance of the differences at each pixel, the mean over channels and directions.
    pub gradient_variance: Vec<f64>,
}

impl Coefficient {
    /// The squared error of the screened solve; of gradients alone with α = 0.
    pub fn screened(&self, alpha: f64) -> f64 {
        self.screened_with(alpha, self.covariance)
    }

    /// The same if primal and gradients were independent.
    pub fn screened_if_independent(&self, alpha: f64) -> f64 {
        self.screened_with(alpha, 0.0)
    }

    fn screened_with(&self, alpha: f64, covariance: f64) -> f64 {
        let screen = alpha * alpha;
        (screen * screen * self.primal + 2.0 * screen * covariance + self.divergence)
            / (screen + self.d2).powi(2)
    }
}

impl Sums {
    /// Of no renders yet, of `size` pixels.
    pub fn new(size: (usize, usize)) -> Self {
        let mut planner = DctPlanner::new();
        let (width, height) = size;
        Self {
            size,
            transforms: [planner.plan_dct2(width), planner.plan_dct2(height)],
            renders: 0,
            coefficients: vec![Default::default(); width * height],
            pixels: vec![Default::default(); width * height],
        }
    }

    /// Adds a render: `planes` of channel 0, 1 and 2.
    pub fn add(&mut self, planes: &[Planes; 3]) {
        self.renders += 1;
        for (channel, planes) in planes.iter().enumerate() {
            let divergence = divergence(self.size, &planes.dx, &planes.dy);
            let (p, d) = (self.transform(&planes.primal), self.transform(&divergence));
            let coefficients = self.coefficients.par_iter_mut().zip(&p).zip(&d);
            coefficients.for_each(|((sums, &p), &d)| {
                let pair = &mut sums[channel];
                pair.p.add(p);
                pair.d.add(d);
                pair.product += p * d;
            });
            let values = planes.primal.iter().zip(&planes.dx).zip(&planes.dy);
            for (sums, ((&p, &dx), &dy)) in self.pixels.iter_mut().zip(values) {
                for (kind, value) in [p, dx, dy].into_iter().enumerate() {
                    sums[channel][kind].add(f64::from(value));
                }
            }
        }
    }

    /// The orthonormal DCT-II, row by row: coefficient (k, l) at l·width + k.
    fn transform(&self, values: &[f32]) -> Vec<f64> {
        let (width, height) = self.size;
        let mut data: Vec<f64> = values.iter().map(|&v| f64::from(v)).collect();
        transform_rows(&mut data, width, &self.transforms[0]);
        let mut columns = transpose(&data, width);
        transform_rows(&mut columns, height, &self.transforms[1]);
        transpose(&columns, height)
    }

    /// The variances, of at least two renders.
    pub fn finish(&self) -> Measured {
        let (width, height) = self.size;
        let n = self.renders as f64;
        let coefficient = |(i, pairs): (usize, &[Pair; 3])| {
            let (x, y) = (
                (i % width) as f64 / (2 * width) as f64,
                (i / width) as f64 / (2 * height) as f64,
            );
            let mean = |f: &dyn Fn(&Pair) -> f64| pairs.iter().map(f).sum::<f64>() / 3.0;
            Coefficient {
                frequency: x.hypot(y),
                d2: difference_power(x) + difference_power(y),
                primal: mean(&|p| p.p.variance(n)),
                divergence: mean(&|p| p.d.variance(n)),
                covariance: mean(&|p| (p.product - p.p.sum * p.d.sum / n) / (n - 1.0)),
            }
        };
        let coefficients = self.coefficients.iter().enumerate().skip(1);
        let of_pixels = |kind: usize| -> Vec<f64> {
            let pixel = |sums: &[[Moments; 3]; 3]| {
                sums.iter().map(|c| c[kind].variance(n)).sum::<f64>() / 3.0
            };
            self.pixels.iter().map(pixel).collect()
        };
        let [primal, dx, dy] = [0, 1, 2].map(of_pixels);
        // There are no differences across the border.
        let differences = (width - 1) * height + width * (height - 1);
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        Measured {
            renders: self.renders,
            coefficients: coefficients.map(coefficient).collect(),
            variances: Variances {
                primal: sum(&primal) / (width * height) as f64,
                gradient: (sum(&dx) + sum(&dy)) / differences as f64,
            },
            primal_variance: primal,
            gradient_variance: dx.iter().zip(&dy).map(|(x, y)| 0.5 * (x + y)).collect(),
        }
    }
}

fn transform_rows(data: &mut [f64], width: usize, transform: &Arc<dyn TransformType2And3<f64>>) {
    let scale = (2.0 / width as f64).sqrt();
    data.par_chunks_mut(width).for_each_init(
        || vec![0.0; transform.get_scratch_len()],
        |scratch, row| {
            transform.process_dct2_with_scratch(row, scratch);
            row.iter_mut().for_each(|v| *v *= scale);
            row[0] *= 0.5f64.sqrt();
        },
    );
}

/// The transpose of rows of `width` values.
fn transpose(data: &[f64], width: usize) -> Vec<f64> {
    let height = data.len() / width;
    let columns = (0..width).flat_map(|x| (0..height).map(move |y| data[y * width + x]));
    columns.collect()
}
