//! The renderer's parts: shift, light sampling, a whole tile by both methods, reconstruction.

mod common;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gdpt::film::{Film, Halves};
use gdpt::filter::Filter;
use gdpt::geometry::Seen;
use gdpt::gradient::Weights;
use gdpt::lanes::{LANES, Vec3x8};
use gdpt::path::{Manifold, PathSettings, PathTracer, Tile};
use gdpt::reconstruct::{self, Problem, Source, l1, l2};
use gdpt::render::{Job, Limits, Method, TILE_SIZE};
use gdpt::sampler::{Dimension, Sampler, SamplerKind};
use gdpt::scene::Scene;
use gdpt::shift::{self, JointsX8};
use gdpt::sums::TileSums;
use gdpt::trace::rays::{ClosestBatch, Ray};
use gdpt::trace::{Backend, RayKind, Traverse};
use gdpt::vertex::{Interaction, Vertex, VerticesX8};
use std::hint::black_box;
use wide::f32x8;

const SETTINGS: PathSettings = PathSettings {
    depth: 12,
    seed: 0,
    sampler: SamplerKind::Sobol,
    weights: Weights::Mis,
    filter: Filter::Box,
    manifold: Manifold::Auto,
};

/// The primary hits of the picture's middle row and of the row below.
fn vertices(scene: &Scene, tracer: &dyn Traverse) -> Vec<(Vertex, Vertex)> {
    let camera = &scene.camera;
    let row = |y: f32| -> Vec<Option<Vertex>> {
        let direction = |x| camera.direction(x as f32 + 0.5, y);
        let rays: Vec<Ray> = (0..camera.width)
            .map(|x| Ray {
                origin: camera.origin,
                direction: direction(x),
                length: f32::INFINITY,
            })
            .collect();
        let mut batch = ClosestBatch::of(&rays);
        tracer.closest(&mut batch, RayKind::Primary);
        (0..camera.width)
            .map(
                |x| match Interaction::new(scene, batch.hit(x), direction(x)) {
                    Interaction::Surface(v) => Some(v),
                    _ => None,
                },
            )
            .collect()
    };
    let (a, b) = (
        row(camera.height as f32 * 0.6),
        row(camera.height as f32 * 0.6 + 1.0),
    );
    a.into_iter()
        .zip(b)
        .filter_map(|(a, b)| Some((a?, b?)))
        .collect()
}

/// Eight times each, as batches are.
fn parts(c: &mut Criterion) {
    let scene = common::shipped("glossy");
    let tracer = Backend::DEFAULT.build(&scene.mesh, 1).expect("a tree");
    let pairs: Vec<(VerticesX8, VerticesX8)> = vertices(&scene, &*tracer)
        .iter()
        .map(|(x, y)| (VerticesX8::splat(&scene, x), VerticesX8::splat(&scene, y)))
        .collect();
    let mut group = c.benchmark_group("parts");
    group.throughput(Throughput::Elements((LANES * pairs.len()) as u64));

    let next = Vec3x8::splat(glam::Vec3::new(0.3, 1.99, 0.1));
    let ng = Vec3x8::splat(glam::Vec3::NEG_Y);
    group.bench_function("reconnection", |b| {
        b.iter(|| {
            for (x, y) in &pairs {
                let wi = (next - x.position).normalize();
                let joints = JointsX8::new(x.position, wi, next, ng, 0);
                black_box(shift::reconnect::<false>(&scene, &joints, y));
            }
        });
    });
    let u = [0.3, 0.6, 0.01, 0.0].map(f32x8::splat);
    let scattered: Vec<_> = pairs
        .iter()
        .map(|(x, y)| (x.scatter::<false>(&scene, 1, &u), x, y))
        .filter(|(s, ..)| s.valid != 0 && s.transmits == 0)
        .collect();
    group.bench_function("half-vector copy", |b| {
        b.iter(|| {
            for (s, x, y) in &scattered {
                black_box(shift::copy_half_vector(&scene, x, s, y));
            }
        });
    });
    group.bench_function("light sample", |b| {
        b.iter(|| {
            for (i, (x, _)) in pairs.iter().enumerate() {
                let [a, b, c, _] = Sampler::for_pixel(SamplerKind::Sobol, 0, i as u32, 0, 5)
                    .draw(Dimension::Light(1));
                let u = [a, b, c].map(f32x8::splat);
                let light = scene.sample_lights::<false>(x.position, 255, u);
                let seen = Seen::new(x.position, light.position, light.ng);
                black_box(x.eval::<false>(&scene, seen.direction));
            }
        });
    });
    group.finish();
}

fn tile<const N: usize>(
    scene: &Scene,
    tracer: &dyn Traverse,
    paths: &mut PathTracer<N>,
    sums: &mut TileSums,
) {
    let tile = Tile {
        x: 96,
        y: 128,
        width: TILE_SIZE,
        height: TILE_SIZE,
    };
    sums.reset((TILE_SIZE * TILE_SIZE) as usize);
    black_box(paths.render(scene, tracer, &SETTINGS, tile, 0..2, sums));
}

fn tiles(c: &mut Criterion) {
    for (name, scene) in [
        ("cornell", common::shipped("cornell")),
        ("glossy", common::shipped("glossy")),
        ("large", common::large()),
    ] {
        let tracer = Backend::DEFAULT.build(&scene.mesh, 1).expect("a tree");
        let mut group = c.benchmark_group(format!("tile/{name}"));
        group.sample_size(30);
        group.throughput(Throughput::Elements(2 * u64::from(TILE_SIZE * TILE_SIZE)));
        let mut sums = TileSums::default();
        let mut plain = PathTracer::<0>::default();
        group.bench_function("pt", |b| {
            b.iter(|| tile(&scene, &*tracer, &mut plain, &mut sums))
        });
        let mut gradient = PathTracer::<4>::default();
        group.bench_function("gpt", |b| {
            b.iter(|| tile(&scene, &*tracer, &mut gradient, &mut sums))
        });
        group.finish();
    }
}

fn reconstruction(c: &mut Criterion) {
    for (width, height) in [(256, 256), (1920, 1080)] {
        let scene = common::shipped_at("glossy", width, height);
        let tracer = Backend::DEFAULT.build(&scene.mesh, 2).expect("a tree");
        let mut film = Film::new(width, height, TILE_SIZE);
        let job = Job {
            scene: &scene,
            tracer: &*tracer,
            method: Method::Gpt,
            settings: SETTINGS,
            first: 0,
            limits: Limits {
                samples: 4,
                time: None,
            },
        };
        job.run(&mut film, &mut |_, _| None, &mut |_| ());
        let e = film.estimate(Halves::Both);
        let problem = Problem {
            primal: &e.primal,
            dx: &e.dx,
            dy: &e.dy,
        };
        let source = Source {
            size: (width as usize, height as usize),
            samples: film.samples,
            planes: &|half, channel| film.planes([Halves::A, Halves::B][half], channel),
            features: None,
        };
        let mut group = c.benchmark_group(format!("reconstruction/{width}x{height}"));
        group.sample_size(10);
        // Inside the pool, as in the program: a solve has many small parallel steps.
        let inside = |f: &(dyn Fn() + Sync)| rayon::scope(|_| f());
        group.bench_function("l2", |b| {
            b.iter(|| inside(&|| _ = black_box(l2::solve(&problem, 0.2))));
        });
        group.bench_function("l1", |b| {
            b.iter(|| inside(&|| _ = black_box(l1::solve(&problem, 0.2))));
        });
        group.bench_function("weighted", |b| {
            let method = reconstruct::Method::Weighted;
            b.iter(|| inside(&|| _ = black_box(reconstruct::run(method, &source))));
        });
        group.finish();
    }
}

criterion_group!(benches, parts, tiles, reconstruction);
criterion_main!(benches);
