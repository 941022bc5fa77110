//! Measured against predicted, by bins of frequency.

use super::measure::{Coefficient, Measured};
use serde::Serialize;

/// Means over the coefficients of a range of frequencies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// From this frequency on, in cycles per pixel.
    pub from: f64,
    /// Up to this one.
    pub to: f64,
    /// Number of coefficients.
    pub coefficients: usize,
    /// The primal's error.
    pub primal: f64,
    /// What is predicted.
    pub primal_predicted: f64,
    /// Power of Dᵀ G, of the gradients' errors.
    pub divergence: f64,
    /// What is predicted.
    pub divergence_predicted: f64,
    /// Correlation of the primal's errors with those of Dᵀ G; 0 is predicted.
    pub correlation: f64,
    /// Errors of the solve, for each α that was asked for.
    pub screened: Vec<f64>,
    /// What is predicted.
    pub screened_predicted: Vec<f64>,
    /// The same from the measured spectra, as if primal and gradients were independent: what is missing to
    /// `screened` is their correlation, what is missing to the prediction their spectra.
    pub screened_if_independent: Vec<f64>,
}

impl Bin {
    /// Half a period of the bin: its geometric mean.
    pub fn middle(&self) -> f64 {
        (self.from * self.to).sqrt()
    }
}

/// Bins, `per_octave` of them for each octave, up to the highest frequency; bins without coefficients
/// are left out. α = 0 stands for gradients alone.
pub fn bins(measured: &Measured, alphas: &[f64], per_octave: u32) -> Vec<Bin> {
    // The corner of the spectrum is at the square root of 1/2.
    let highest = 0.5f64.sqrt();
    let step = 2.0f64.powf(1.0 / f64::from(per_octave));
    let lowest = measured.coefficients.iter().map(|c| c.frequency);
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    let mut edges = vec![highest];
    // From the Nyquist frequency downwards, so that octaves end there.
    let mut edge = 0.5;
    while edge > lowest {
        edges.push(edge);
        edge /= step;
    }
    edges.push(edge);
    edges.reverse();
    let bin = |w: &[f64]| {
        let last = w[1] == highest;
        let inside =
            |c: &&Coefficient| (w[0]..w[1]).contains(&c.frequency) || last && c.frequency >= w[1];
        let inside: Vec<&Coefficient> = measured.coefficients.iter().filter(inside).collect();
        (!inside.is_empty()).then(|| mean_of(&inside, measured, alphas, (w[0], w[1])))
    };
    edges.windows(2).filter_map(bin).collect()
}

fn mean_of(inside: &[&Coefficient], measured: &Measured, alphas: &[f64], range: (f64, f64)) -> Bin {
    let mean = |f: &dyn Fn(&Coefficient) -> f64| {
        inside.iter().map(|c| f(c)).sum::<f64>() / inside.len() as f64
    };
    let predicted = measured.variances;
    let (primal, divergence) = (mean(&|c| c.primal), mean(&|c| c.divergence));
    let each = |f: &dyn Fn(&Coefficient, f64) -> f64| -> Vec<f64> {
        alphas.iter().map(|&alpha| mean(&|c| f(c, alpha))).collect()
    };
    Bin {
        from: range.0,
        to: range.1,
        coefficients: inside.len(),
        primal,
        primal_predicted: predicted.primal,
        divergence,
        divergence_predicted: mean(&|c| c.d2 * predicted.gradient),
        correlation: mean(&|c| c.covariance) / (primal * divergence).sqrt(),
        screened: each(&|c, alpha| c.screened(alpha)),
        screened_predicted: each(&|c, alpha| predicted.screened(alpha, c.d2)),
        screened_if_independent: each(&|c, alpha| c.screened_if_independent(alpha)),
    }
}

/// The mean squared error over all coefficients, as a function of α: measured and predicted.
pub fn total(measured: &Measured, alpha: f64) -> (f64, f64) {
    let coefficients = &measured.coefficients;
    let mean = |f: &dyn Fn(&Coefficient) -> f64| {
        coefficients.iter().map(f).sum::<f64>() / coefficients.len() as f64
    };
    (
        mean(&|c| c.screened(alpha)),
        mean(&|c| measured.variances.screened(alpha, c.d2)),
    )
}

/// The share of all variance that is in the noisiest `share` of the pixels: `share` if it is the same
/// everywhere.
pub fn concentration(variances: &[f64], share: f64) -> f64 {
    let mut sorted = variances.to_vec();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let count = (sorted.len() as f64 * share).ceil() as usize;
    sorted[..count].iter().sum::<f64>() / sorted.iter().sum::<f64>()
}
