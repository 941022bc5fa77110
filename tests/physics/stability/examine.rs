//! What is measured of one scene: many independent renders by both methods.

use crate::common::{Mean, Render, differences, largest_z, tracer};
use gdpt::film::{Film, Halves};
use gdpt::filter::Filter;
use gdpt::image::Image;
use gdpt::picture;
use gdpt::reconstruct::{Alpha, Method as Reconstruction, PAPER_ALPHA, Problem, l2};
use gdpt::render::Method;
use gdpt::scene::Scene;
use gdpt::trace::Traverse;
use rayon::prelude::*;
use std::time::Instant;

pub const WIDTH: u32 = 24;
pub const HEIGHT: u32 = 16;
const REGION: usize = 8;
const SPP: u64 = 16;
const SEEDS: u64 = 40;

/// Figures of one scene.
#[derive(Clone, Debug)]
pub struct Figures {
    /// Largest |z| of dx, dy and l2 picture against the path tracer over regions and channels, over the
    /// largest that chance would give with a probability of 1e-5.
    pub largest_z: f64,
    /// relMSE of `weighted` over that of path tracing with as many samples.
    pub weighted: f64,
    /// The same of l2.
    pub l2: f64,
    /// relMSE of `weighted` itself.
    pub absolute: f64,
    /// Mean of `weighted` over that of path tracing with the same samples, less 1.
    pub bias: f64,
    /// Its standard error.
    pub bias_error: f64,
    /// Largest sample that adds to a difference, over the largest that adds to the primal.
    pub largest: f64,
}

/// A region's sums in every picture of a kind.
fn regions(image: &Image) -> Vec<f64> {
    let mut sums = Vec::new();
    for channel in &image.channels {
        for y0 in (0..image.height).step_by(REGION) {
            for x0 in (0..image.width).step_by(REGION) {
                let rows = y0..y0 + REGION;
                let row = |y: usize| &channel[y * image.width + x0..][..REGION];
                sums.push(rows.flat_map(row).map(|&v| f64::from(v)).sum());
            }
        }
    }
    sums
}

/// Films of so many seeds.
fn films(
    scene: &Scene,
    tracer: &dyn Traverse,
    method: Method,
    (first_seed, seeds): (u64, u64),
) -> Vec<Film> {
    let films = (0..seeds).into_par_iter().map(|seed| {
        // Panics where a sample is not finite.
        Render {
            method,
            spp: SPP,
            seed: first_seed + seed,
            ..Render::default()
        }
        .film(scene, tracer)
    });
    films.collect()
}

fn pictures(films: &[Film], method: Reconstruction) -> Vec<Image> {
    films
        .par_iter()
        .map(|f| picture::of_film(f, method).image)
        .collect()
}

/// Mean and variance of every value over pictures.
fn moments(pictures: &[Image]) -> Vec<Mean> {
    let pixels = pictures[0].width * pictures[0].height;
    let mut means = vec![Mean::default(); 3 * pixels];
    for picture in pictures {
        let values = picture.channels.iter().flatten();
        means
            .iter_mut()
            .zip(values)
            .for_each(|(m, &v)| m.add(f64::from(v)));
    }
    means
}

/// Mean and variance of every region of every image over the seeds.
fn region_means<const N: usize>(seeds: impl Iterator<Item = [Image; N]>) -> Vec<Mean> {
    let mut means = Vec::new();
    for images in seeds {
        let values: Vec<f64> = images.iter().flat_map(regions).collect();
        means.resize(values.len(), Mean::default());
        means.iter_mut().zip(values).for_each(|(m, v)| m.add(v));
    }
    means
}

/// The regions of the l2 picture.
pub fn picture_means(scene: &Scene, first_seed: u64) -> Vec<Mean> {
    let films = films(scene, &*tracer(scene), Method::Gpt, (first_seed, SEEDS));
    let l2 = pictures(&films, Reconstruction::L2(Alpha::Fixed(PAPER_ALPHA)));
    region_means(l2.into_iter().map(|image| [image]))
}

/// The largest |z| of two rows of means, over the largest that chance gives with a probability of 1e-5.
pub fn largest_deviation(a: &[Mean], b: &[Mean]) -> f64 {
    let limit = largest_z(a.len(), SEEDS as usize, 1e-5);
    let brightness = a.iter().map(|m| m.mean().abs()).fold(0.0, f64::max);
    let z = a.iter().zip(b).map(|(a, b)| {
        // Where nothing is noisy, rounding is left.
        let deviation = (a.variance() + b.variance()).sqrt().max(1e-5 * brightness);
        (a.mean() - b.mean()).abs() / deviation
    });
    let z: Vec<f64> = z.collect();
    assert!(z.iter().all(|z| z.is_finite()), "a mean is not finite");
    z.into_iter().fold(0.0, f64::max) / limit
}

/// The squared errors of all values, over the squared reference: the variance over the seeds, and the squared difference
/// of the means less their noise.
fn relative_errors(pictures: &[Image], reference: &[Mean]) -> Vec<f64> {
    let pairs = moments(pictures).into_iter().zip(reference);
    let relative = |(m, r): (Mean, &Mean)| {
        let variance = m.variance() * pictures.len() as f64;
        let bias = (m.mean() - r.mean()).powi(2) - m.variance() - r.variance();
        (variance + bias) / (r.mean().powi(2) + 0.01)
    };
    pairs.map(relative).collect()
}

/// At this size the borders of tiles weigh little.
pub const WHOLE: u32 = 128;
/// Seeds at that size.
const WHOLE_SEEDS: u64 = 8;

/// What gradients bring in a scene of [`WHOLE`] pixels across and down.
pub struct Gain {
    /// relMSE of `weighted` over that of path tracing with as many samples.
    pub weighted: f64,
    /// The same without the values where path tracing is worst, one in a hundred.
    pub trimmed: f64,
    /// Seconds of a gradient sample, with the solve, over those of a path sample.
    pub cost: f64,
}

/// See [`Gain`].
pub fn gain(scene: &Scene) -> Gain {
    let tracer = tracer(scene);
    let timed = |method, first_seed| {
        let start = Instant::now();
        let films = films(scene, &*tracer, method, (first_seed, WHOLE_SEEDS));
        (films, start.elapsed().as_secs_f64())
    };
    let (pt, pt_seconds) = timed(Method::Pt, 10_000);
    let (gpt, gpt_seconds) = timed(Method::Gpt, 0);
    let start = Instant::now();
    let weighted = pictures(&gpt, Reconstruction::Weighted);
    let solve_seconds = start.elapsed().as_secs_f64();
    let reference = moments(&pictures(&pt, Reconstruction::Primal));
    let weighted = relative_errors(&weighted, &reference);
    let path = relative_errors(&pictures(&gpt, Reconstruction::Primal), &reference);
    let ratio = |places: &[usize]| {
        let sum = |errors: &[f64]| places.iter().map(|&i| errors[i]).sum::<f64>();
        sum(&weighted) / sum(&path)
    };
    let mut places: Vec<usize> = (0..path.len()).collect();
    places.sort_by(|&i, &j| path[i].total_cmp(&path[j]));
    Gain {
        weighted: ratio(&places),
        trimmed: ratio(&places[..places.len() * 99 / 100]),
        cost: (gpt_seconds + solve_seconds) / pt_seconds,
    }
}

pub fn examine(scene: &Scene) -> Figures {
    let tracer = tracer(scene);
    let pt = films(scene, &*tracer, Method::Pt, (10_000, SEEDS));
    let gpt = films(scene, &*tracer, Method::Gpt, (0, SEEDS));

    // (a) Differences and picture against the path tracer.
    let truth: Vec<Image> = pictures(&pt, Reconstruction::Primal);
    let l2_pictures = pictures(&gpt, Reconstruction::L2(Alpha::Fixed(PAPER_ALPHA)));
    let weighted = pictures(&gpt, Reconstruction::Weighted);
    let primal = |film: &Film| {
        let primal = film.estimate(Halves::Both).primal;
        let [dx, dy] = differences(&primal);
        [dx, dy, primal]
    };
    let gradients = |film: &Film| {
        let e = film.estimate(Halves::Both);
        let problem = Problem {
            primal: &e.primal,
            dx: &e.dx,
            dy: &e.dy,
        };
        let picture = l2::solve(&problem, PAPER_ALPHA);
        [e.dx, e.dy, picture]
    };
    let [a, b] = [
        region_means(pt.iter().map(primal)),
        region_means(gpt.iter().map(gradients)),
    ];
    let largest_z = largest_deviation(&a, &b);

    // (c) Errors.
    let reference = moments(&truth);
    let error = |pictures: &[Image]| -> f64 { relative_errors(pictures, &reference).iter().sum() };
    // Path tracing is what the same films hold: the same samples, so that rare ones are in both.
    let primals = pictures(&gpt, Reconstruction::Primal);
    let pt_error = error(&primals);

    // Bias of the whole picture, against the path-traced images of the same films.
    let sum = |p: &Image| {
        p.channels
            .iter()
            .flatten()
            .map(|&v| f64::from(v))
            .sum::<f64>()
    };
    let (mut difference, mut whole) = (Mean::default(), Mean::default());
    for (weighted, primal) in weighted.iter().zip(&primals) {
        difference.add(sum(weighted) - sum(primal));
        whole.add(sum(primal));
    }
    Figures {
        largest_z,
        weighted: error(&weighted) / pt_error,
        l2: error(&l2_pictures) / pt_error,
        absolute: error(&weighted) / f64::from(3 * WIDTH * HEIGHT),
        bias: difference.mean() / whole.mean(),
        bias_error: difference.variance().sqrt() / whole.mean(),
        largest: largest_sample(scene, &*tracer),
    }
}

/// (d) The largest sample of a difference over the largest of the primal.
fn largest_sample(scene: &Scene, tracer: &dyn Traverse) -> f64 {
    use gdpt::gradient::Weights;
    use gdpt::path::{Manifold, PathSettings, PathTracer, Tile};
    use gdpt::sums::TileSums;
    let tile = Tile {
        x: 0,
        y: 0,
        width: WIDTH,
        height: HEIGHT,
    };
    let settings = PathSettings {
        depth: 12,
        seed: 77,
        sampler: gdpt::sampler::SamplerKind::Independent,
        weights: Weights::Mis,
        filter: Filter::Box,
        manifold: Manifold::Auto,
    };
    let mut paths = PathTracer::<4>::default();
    let mut sums = TileSums::default();
    let (mut primal, mut difference) = (0.0f32, 0.0f32);
    for sample in 0..256 {
        sums.reset((WIDTH * HEIGHT) as usize);
        paths.render(
            scene,
            tracer,
            &settings,
            tile,
            sample..sample + 1,
            &mut sums,
        );
        for half in sums.pixels.iter().flat_map(|p| &p.halves) {
            primal = primal.max(half.primal.max_element());
            for to in half.to {
                difference = difference.max(to.abs().max_element());
            }
        }
    }
    f64::from(difference / primal)
}
