//! The error theory: exactly in one dimension, and how the laboratory measures it on scenes.

use crate::common::{Render, Rng, shipped, tracer};
use gdpt::estimate::Planes;
use gdpt::film::Halves;
use gdpt::image::Image;
use gdpt::reconstruct::{Problem, l2};
use gdpt::sampler::SamplerKind;
use gdpt::spectrum::measure::Sums;
use gdpt::spectrum::one_dimensional::{self, ALPHAS, Errors, FREQUENCIES, Samples};
use gdpt::spectrum::table;
use gdpt::spectrum::theory::{Variances, difference_power};
use rayon::prelude::*;

/// In one dimension the squared error of a complex coefficient is the mean over the runs of something
/// with a standard deviation of about its mean: 1 % for this many.
const RUNS: u64 = 10_000;

/// Compares measured with predicted errors in all bins. With a standard deviation of 1 %, a deviation of
/// 5 % in one of the 33·5 bins of a test happens with a probability of 1e-4. Asked are 10 %; 5 % are tested.
fn compare(what: &str, measured: &[Errors], predicted: impl Fn(&Errors) -> Vec<(f64, f64)>) {
    assert_eq!(measured.len(), FREQUENCIES);
    for errors in measured {
        for (index, (found, expected)) in predicted(errors).into_iter().enumerate() {
            assert!(
                (found / expected - 1.0).abs() < 0.05,
                "{what}, frequency {}, number {index}: {found} against {expected}",
                errors.frequency
            );
        }
    }
}

#[test]
fn in_one_dimension_the_formulas_hold_at_every_frequency() {
    for samples in [1.0, 4.0] {
        let v = one_dimensional::variances(samples);
        let measured = one_dimensional::measure(Samples::Independent, RUNS, samples, 7);
        compare("independent", &measured, |e| {
            let d2 = difference_power(e.frequency);
            let mut pairs = vec![(e.primal, v.primal)];
            if e.frequency > 0.0 {
                pairs.push((e.gradient_only, v.gradient / d2));
            }
            for (alpha, &screened) in ALPHAS.iter().zip(&e.screened) {
                let a2 = alpha * alpha;
                let formula = (a2 * a2 * v.primal + d2 * v.gradient) / ((a2 + d2) * (a2 + d2));
                pairs.push((screened, formula));
            }
            pairs
        });
    }
}

#[test]
fn shared_samples_add_what_primal_and_gradients_have_in_common() {
    let v = one_dimensional::variances(2.0);
    let measured = one_dimensional::measure(Samples::Shared, RUNS, 2.0, 8);
    let pairs = |shared: bool| {
        move |e: &Errors| -> Vec<(f64, f64)> {
            let d2 = difference_power(e.frequency);
            let screened = ALPHAS.iter().zip(&e.screened);
            let formula = |alpha: f64| match shared {
                true => v.screened_shared(alpha, d2),
                false => v.screened(alpha, d2),
            };
            screened
                .map(|(&alpha, &found)| (found, formula(alpha)))
                .collect()
        }
    };
    compare("shared", &measured, pairs(true));
    // The formula for independent samples is wrong by up to 10 % here: the test above would see it.
    let deviation = |e: &Errors| {
        let (found, expected) = pairs(false)(e)[2];
        found / expected
    };
    let largest = measured.iter().map(deviation).fold(0.0, f64::max);
    assert!(largest > 1.08, "{largest}");
}

#[test]
fn the_best_alpha_is_best_at_every_frequency() {
    let v = Variances {
        primal: 3.0,
        gradient: 0.2,
    };
    let best = v.best_alpha();
    for d2 in [0.01, 0.5, 4.0, 8.0] {
        let least = v.screened(best, d2);
        let closed = v.gradient * v.primal / (v.primal * d2 + v.gradient);
        assert!((least / closed - 1.0).abs() < 1e-12);
        for factor in [0.9, 1.1] {
            assert!(v.screened(best * factor, d2) > least);
        }
    }
}

fn noise(rng: &mut Rng, count: usize, deviation: f32) -> Vec<f32> {
    let uniform = (0..count).map(|_| rng.next() - 0.5);
    uniform.map(|u| deviation * 12.0f32.sqrt() * u).collect()
}

/// Planes of white noise, without differences across the border.
fn white(rng: &mut Rng, (width, height): (usize, usize)) -> Planes {
    let mut planes = Planes {
        primal: noise(rng, width * height, 2.0),
        dx: noise(rng, width * height, 0.3),
        dy: noise(rng, width * height, 0.3),
        ..Planes::default()
    };
    for i in 0..width * height {
        if i % width + 1 == width {
            planes.dx[i] = 0.0;
        }
        if i / width + 1 == height {
            planes.dy[i] = 0.0;
        }
    }
    planes
}

#[test]
fn white_independent_noise_has_the_predicted_spectra() {
    // 200 renders of 24·20 coefficients in 3 channels: a bin of at least 20 coefficients is known to
    // sqrt(2/(20·3·200)) = 1.3 %, so 7 % are 5 standard deviations: 1e-6 a bin.
    let size = (24, 20);
    let mut rng = Rng(3);
    let mut sums = Sums::new(size);
    for _ in 0..200 {
        sums.add(&[(); 3].map(|()| white(&mut rng, size)));
    }
    let measured = sums.finish();
    assert!((measured.variances.primal / 4.0 - 1.0).abs() < 0.02);
    assert!((measured.variances.gradient / 0.09 - 1.0).abs() < 0.02);
    let alphas = [0.0, 0.2, 1.0];
    let bins = table::bins(&measured, &alphas, 2);
    assert_eq!(
        bins.iter().map(|b| b.coefficients).sum::<usize>(),
        24 * 20 - 1
    );
    for bin in bins.iter().filter(|b| b.coefficients >= 20) {
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 0.07;
        assert!(close(bin.primal, bin.primal_predicted), "{bin:?}");
        assert!(close(bin.divergence, bin.divergence_predicted), "{bin:?}");
        assert!(bin.correlation.abs() < 0.07, "{bin:?}");
        for a in 0..alphas.len() {
            assert!(close(bin.screened[a], bin.screened_predicted[a]), "{bin:?}");
        }
    }
    assert!((table::concentration(&measured.primal_variance, 0.1) - 0.1).abs() < 0.05);
}

#[test]
fn spectra_are_those_of_the_pictures_that_l2_makes() {
    // The mean over all coefficients is the mean squared error of the pictures themselves (Parseval).
    let (size, alpha) = ((18, 14), 0.3);
    let scene = shipped("corner", size.0, size.1);
    let tracer = tracer(&scene);
    let mut sums = Sums::new((size.0 as usize, size.1 as usize));
    let mut pictures: Vec<Image> = Vec::new();
    for seed in 0..8 {
        let film = Render {
            spp: 4,
            seed,
            sampler: SamplerKind::Independent,
            ..Render::default()
        }
        .film(&scene, &*tracer);
        sums.add(&[0, 1, 2].map(|channel| film.planes(Halves::Both, channel)));
        let e = film.estimate(Halves::Both);
        let problem = Problem {
            primal: &e.primal,
            dx: &e.dx,
            dy: &e.dy,
        };
        pictures.push(l2::solve(&problem, alpha));
    }
    let measured = sums.finish();
    let (total, _) = table::total(&measured, f64::from(alpha));

    // Without the mean of each picture, which the spectra leave out.
    let count = f64::from(size.0 * size.1);
    let mut squares = 0.0;
    for channel in 0..3 {
        let flat = |image: &Image| -> Vec<f64> {
            let values = &image.channels[channel];
            let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / count;
            values.iter().map(|&v| f64::from(v) - mean).collect()
        };
        let flats: Vec<Vec<f64>> = pictures.iter().map(flat).collect();
        for i in 0..count as usize {
            let mean = flats.iter().map(|f| f[i]).sum::<f64>() / 8.0;
            squares += flats.iter().map(|f| (f[i] - mean).powi(2)).sum::<f64>() / 7.0;
        }
    }
    let expected = squares / 3.0 / (count - 1.0);
    assert!(
        (total / expected - 1.0).abs() < 1e-3,
        "{total} against {expected}"
    );
}

#[test]
fn errors_of_independent_samples_fall_as_one_over_the_samples() {
    // Slope of MSE over samples from 16 to 256, over 160 renders of 16x16 pixels each. The MSE of a
    // seed's picture has a relative deviation below 0.3 there, so the mean's is below 2.4 %, and the
    // slope's below 0.0125: 0.05 is 4 of them, with fixed seeds.
    let scene = shipped("corner", 16, 16);
    let tracer = tracer(&scene);
    let counts = [16u64, 64, 256];
    let seeds = 160;
    // Two independent renders differ by twice the variance, whatever the truth is.
    let slope = |sampler: SamplerKind| {
        let errors = counts.map(|spp| {
            let picture = |seed: u64| {
                let render = Render {
                    spp,
                    seed,
                    sampler,
                    ..Render::default()
                };
                let e = render.estimate(&scene, &*tracer);
                let problem = Problem {
                    primal: &e.primal,
                    dx: &e.dx,
                    dy: &e.dy,
                };
                let solved = l2::solve(&problem, 0.2);
                [e.primal, solved]
            };
            let pairs: Vec<[f64; 2]> = (0..seeds / 2)
                .into_par_iter()
                .map(|pair| {
                    let (a, b) = (picture(2 * pair), picture(2 * pair + 1));
                    [0, 1].map(|kind| {
                        let values = a[kind].channels.iter().zip(&b[kind].channels);
                        let values = values.flat_map(|(a, b)| a.iter().zip(b));
                        values.map(|(a, b)| f64::from(a - b).powi(2)).sum()
                    })
                })
                .collect();
            [0, 1].map(|kind| pairs.iter().map(|p| p[kind]).sum::<f64>())
        });
        [0, 1].map(|kind| (errors[2][kind] / errors[0][kind]).ln() / 16f64.ln())
    };
    let independent = slope(SamplerKind::Independent);
    for (what, slope) in ["primal", "l2"].iter().zip(independent) {
        assert!((slope + 1.0).abs() < 0.05, "{what}: {slope}");
    }
    // Evenly spread samples do at least as well.
    for (what, slope) in ["primal", "l2"].iter().zip(slope(SamplerKind::Sobol)) {
        assert!(slope < -1.0, "{what}: {slope}");
    }
}
