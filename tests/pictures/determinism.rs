//! An image is a function of scene, settings and seed: the same bits for any number of threads and for
//! tiles of any size.

use crate::common::{Render, shipped, tracer};
use gdpt::estimate::Estimate;
use gdpt::film::Halves;
use gdpt::image::Image;
use gdpt::reconstruct::error_estimate::{self, HalfPictures, Halved};
use gdpt::reconstruct::{self, Problem, Source, l1, l2};
use gdpt::render::Method;
use gdpt::scene::Scene;

fn bits(image: &Image) -> Vec<u32> {
    image
        .channels
        .iter()
        .flatten()
        .map(|v| v.to_bits())
        .collect()
}

/// Every image that a film gives, with the reconstructions.
fn all_bits(scene: &Scene, threads: usize, tile_size: u32, method: Method) -> Vec<Vec<u32>> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let tracer = tracer(scene);
    pool.install(|| {
        let film = Render {
            spp: 11,
            tile_size,
            method,
            ..Render::default()
        }
        .film(scene, &*tracer);
        let mut out = Vec::new();
        for halves in [Halves::A, Halves::B, Halves::Both] {
            let e: Estimate = film.estimate(halves);
            let problem = Problem {
                primal: &e.primal,
                dx: &e.dx,
                dy: &e.dy,
            };
            out.extend([&e.primal, &e.dx, &e.dy].map(bits));
            out.extend([&e.primal_variance, &e.dx_variance, &e.dy_variance].map(bits));
            out.push(bits(&l2::solve(&problem, 0.2)));
            out.push(bits(&l1::solve(&problem, 0.2).0));
        }
        let source = Source {
            size: (film.window.width as usize, film.window.height as usize),
            samples: film.samples,
            planes: &|half, channel| film.planes([Halves::A, Halves::B][half], channel),
            features: None,
        };
        let weighted = reconstruct::run(reconstruct::Method::Weighted, &source);
        out.push(bits(&weighted.picture));
        let solved = Halved {
            all: &weighted.picture,
            halves: &weighted.halves.unwrap(),
        };
        let direct = Halved {
            all: &film.direct(Halves::Both),
            halves: &HalfPictures::Alike([Halves::A, Halves::B].map(|half| film.direct(half))),
        };
        let error = error_estimate::estimate(solved, direct, film.samples);
        out.push(bits(&error.standard));
        let hits = film.first_hits();
        out.extend([direct.all, &hits.albedo, &hits.normal].map(bits));
        out.push(hits.depth.iter().map(|v| v.to_bits()).collect());
        out
    })
}

#[test]
fn threads_and_tiles_do_not_matter() {
    // Cornell is shaded in lanes.
    for name in ["glossy", "mirrors", "cornell", "pane", "rings"] {
        let scene = shipped(name, 45, 37);
        for method in [Method::Gpt, Method::Pt] {
            let want = all_bits(&scene, 1, 32, method);
            for (threads, tile_size) in [(2, 32), (7, 32), (2, 16), (7, 5), (1, 64)] {
                let got = all_bits(&scene, threads, tile_size, method);
                assert!(
                    got == want,
                    "{name}: {threads} threads, tiles of {tile_size}"
                );
            }
        }
    }
}

#[test]
fn seeds_matter() {
    let scene = shipped("cornell", 16, 16);
    let tracer = tracer(&scene);
    let primal = |seed| {
        Render {
            seed,
            ..Render::default()
        }
        .estimate(&scene, &*tracer)
        .primal
    };
    assert_ne!(primal(1), primal(2));
}

/// The halves are independent estimates of one image.
#[test]
fn halves_are_not_correlated() {
    let scene = shipped("cornell", 64, 64);
    let tracer = tracer(&scene);
    let mean = Render {
        spp: 512,
        method: Method::Pt,
        seed: 9,
        ..Render::default()
    }
    .estimate(&scene, &*tracer)
    .primal;
    let film = Render {
        spp: 16,
        ..Render::default()
    }
    .film(&scene, &*tracer);
    let error = |halves| -> Vec<f64> {
        let image = film.estimate(halves).primal;
        let pairs = image.channels[1].iter().zip(&mean.channels[1]);
        // Relative, so that bright pixels do not decide alone.
        pairs
            .map(|(a, m)| f64::from((a - m) / (m + 0.05)))
            .collect()
    };
    let (a, b) = (error(Halves::A), error(Halves::B));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let correlation = dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt();
    // The standard deviation of 4096 independent pairs is 1/64. The reference's own noise adds a
    // little, and all pixels share their position inside the pixel.
    assert!(correlation.abs() < 6.0 / 64.0, "{correlation}");
}
