//! The theory's own experiment: an image of one dimension over a path space of one more, on a torus where
//! nothing has borders, sampled as the theory assumes.
//!
//! f is a sum of waves, so that its spectrum is known; the shift T(x, p) = (x − 1, p) has Jacobian 1; the
//! samples are a Poisson process, which is stationary. Then all formulas hold exactly.

use super::theory::{Variances, difference_power};
use crate::sampler::mix;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Pixels of the torus.
pub const PIXELS: usize = 64;
/// Frequencies that are measured: 0 to 1/2.
pub const FREQUENCIES: usize = PIXELS / 2 + 1;
/// Values of α that are measured.
pub const ALPHAS: [f64; 3] = [0.1, 0.3, 1.0];

/// A wave of f: amplitude, cycles over the image, cycles over the path's parameter, phase.
struct Wave(f64, f64, f64, f64);

/// Much at low frequencies, a little at high ones; what changes with p is noise in the image.
const WAVES: [Wave; 9] = [
    Wave(0.5, 0.0, 0.0, 0.0),
    Wave(1.0, 1.0, 0.0, 0.3),
    Wave(0.6, 2.0, 1.0, 1.1),
    Wave(0.5, 3.0, -2.0, 2.0),
    Wave(0.3, 5.0, 0.0, 0.7),
    Wave(0.25, 8.0, 3.0, 4.0),
    Wave(0.1, 13.0, 1.0, 5.1),
    Wave(0.05, 21.0, -4.0, 0.2),
    Wave(0.03, 30.0, 2.0, 1.9),
];

/// Whether gradients are estimated from samples of their own or from those of the primal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// Of their own, as the theory has it.
    Independent,
    /// The same, as the renderer does.
    Shared,
}

/// Mean squared errors at one frequency.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// In cycles per pixel.
    pub frequency: f64,
    /// Of the primal.
    pub primal: f64,
    /// Of the solve with gradients alone; 0 at frequency 0, where it says nothing.
    pub gradient_only: f64,
    /// Of the screened solve, for each of [`ALPHAS`].
    pub screened: [f64; ALPHAS.len()],
}

type Complex = (f64, f64);

fn times((a, b): Complex, (c, d): Complex) -> Complex {
    (a * c - b * d, a * d + b * c)
}

fn conjugate((a, b): Complex) -> Complex {
    (a, -b)
}

fn power((a, b): Complex) -> f64 {
    a * a + b * b
}

/// e^(−2πi jx/N) for all frequencies j, times `value`, added to `spectrum`.
fn add_point(spectrum: &mut [Complex; FREQUENCIES], x: f64, value: f64) {
    let angle = -TAU * x / PIXELS as f64;
    let step = (angle.cos(), angle.sin());
    let mut turn = (value, 0.0);
    for sum in spectrum {
        *sum = (sum.0 + turn.0, sum.1 + turn.1);
        turn = times(turn, step);
    }
}

/// f at (x, p).
fn value(x: f64, p: f64) -> f64 {
    let wave = |w: &Wave| w.0 * (TAU * (w.1 * x / PIXELS as f64 + w.2 * p) + w.3).cos();
    WAVES.iter().map(wave).sum()
}

/// The image's orthonormal spectrum: of the waves that p does not change.
fn truth() -> [Complex; FREQUENCIES] {
    let mut spectrum = [(0.0, 0.0); FREQUENCIES];
    for Wave(amplitude, frequency, _, phase) in WAVES.iter().filter(|w| w.2 == 0.0) {
        // Half of a real wave is at the negative frequency.
        let half = if *frequency == 0.0 { 1.0 } else { 0.5 };
        let size = half * amplitude * (PIXELS as f64).sqrt();
        spectrum[*frequency as usize] = (size * phase.cos(), size * phase.sin());
    }
    spectrum
}

/// Exact variances of estimates from `samples` per pixel.
pub fn variances(samples: f64) -> Variances {
    let energy = |w: &Wave| {
        let mean_square = if w.1 == 0.0 && w.2 == 0.0 {
            w.3.cos().powi(2)
        } else {
            0.5
        };
        w.0 * w.0 * mean_square
    };
    let through_differences = |w: &Wave| energy(w) * difference_power(w.1 / PIXELS as f64);
    Variances {
        primal: WAVES.iter().map(energy).sum::<f64>() / samples,
        gradient: WAVES.iter().map(through_differences).sum::<f64>() / samples,
    }
}

/// Spectra of the estimates of f and of g(x) = f(x) − f(x − 1) from a Poisson process of `samples` points
/// per pixel.
fn estimate(samples: f64, seed: u64) -> [[Complex; FREQUENCIES]; 2] {
    let mut state = mix(seed);
    let mut uniform = || {
        state = mix(state);
        ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    let mut spectra = [[(0.0, 0.0); FREQUENCIES]; 2];
    let scale = 1.0 / (samples * (PIXELS as f64).sqrt());
    let mut x = 0.0;
    loop {
        // Distances between the points of a Poisson process are exponential.
        x -= uniform().ln() / samples;
        if x >= PIXELS as f64 {
            return spectra;
        }
        let p = uniform();
        let (base, offset) = (value(x, p), value(x - 1.0, p));
        add_point(&mut spectra[0], x, base * scale);
        add_point(&mut spectra[1], x, (base - offset) * scale);
    }
}

/// Mean squared errors over `runs` independent runs with `samples` samples per pixel each.
pub fn measure(kind: Samples, runs: u64, samples: f64, seed: u64) -> Vec<Errors> {
    const CHUNK: u64 = 256;
    let truth = truth();
    let zero = || vec![Errors::default(); FREQUENCIES];
    let add_run = |sums: &mut Vec<Errors>, run: u64| {
        let start = mix(seed).wrapping_add(2 * run);
        let [primal, mut gradient] = estimate(samples, start);
        if kind == Samples::Independent {
            [_, gradient] = estimate(samples, start + 1);
        }
        for (j, sum) in sums.iter_mut().enumerate() {
            let angle = TAU * j as f64 / PIXELS as f64;
            // D = 1 − e^(−iω), and what is to be solved: (α² + |D|²) R = α² P + D* G.
            let d = (1.0 - angle.cos(), angle.sin());
            let d2 = power(d);
            let back = times(conjugate(d), gradient[j]);
            let error = |alpha: f64| {
                let screen = alpha * alpha;
                let part = |p: f64, g: f64, t: f64| (screen * p + g) / (screen + d2) - t;
                power((
                    part(primal[j].0, back.0, truth[j].0),
                    part(primal[j].1, back.1, truth[j].1),
                ))
            };
            sum.primal += power((primal[j].0 - truth[j].0, primal[j].1 - truth[j].1));
            if j > 0 {
                sum.gradient_only += error(0.0);
            }
            for (sum, alpha) in sum.screened.iter_mut().zip(ALPHAS) {
                *sum += error(alpha);
            }
        }
    };
    // Chunks of fixed size, added in their order: the same bits for any number of threads.
    let chunks: Vec<Vec<Errors>> = (0..runs.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut sums = zero();
            let end = ((chunk + 1) * CHUNK).min(runs);
            (chunk * CHUNK..end).for_each(|run| add_run(&mut sums, run));
            sums
        })
        .collect();
    let mut errors = zero();
    for (j, error) in errors.iter_mut().enumerate() {
        error.frequency = j as f64 / PIXELS as f64;
        let mean =
            |f: &dyn Fn(&Errors) -> f64| chunks.iter().map(|c| f(&c[j])).sum::<f64>() / runs as f64;
        error.primal = mean(&|e| e.primal);
        error.gradient_only = mean(&|e| e.gradient_only);
        error.screened = std::array::from_fn(|a| mean(&|e| e.screened[a]));
    }
    errors
}
