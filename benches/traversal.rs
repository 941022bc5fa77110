//! Traversal by kind of rays and backend, on recorded rays; for Embree beside a bare C loop over the same
//! batches: what our layer costs is the ratio of the two.

mod common;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use gdpt::bench::record::{Recording, record};
use gdpt::scene::Scene;
use gdpt::trace::rays::{AnyBatch, ClosestBatch};
use gdpt::trace::{Backend, RayKind};

/// Whole blocks of 8 alone, which is all that the C loop traces.
fn whole_blocks(recording: &Recording) -> Recording {
    let batches = recording
        .batches
        .iter()
        .map(|b| b[..b.len() / 8 * 8].to_vec());
    Recording {
        batches: batches.filter(|b| !b.is_empty()).collect(),
    }
}

/// Times `closest` or `any` over fresh copies of the recorded batches.
fn time(
    group: &mut criterion::BenchmarkGroup<criterion::measurement::WallTime>,
    id: BenchmarkId,
    kind: RayKind,
    recording: &Recording,
    closest: &dyn Fn(&mut ClosestBatch),
    any: &dyn Fn(&mut AnyBatch),
) {
    group.throughput(Throughput::Elements(recording.len() as u64));
    group.bench_function(id, |b| {
        if kind.wants_closest() {
            b.iter_batched_ref(
                || {
                    recording
                        .batches
                        .iter()
                        .map(|r| ClosestBatch::of(r))
                        .collect::<Vec<_>>()
                },
                |batches| batches.iter_mut().for_each(closest),
                BatchSize::LargeInput,
            );
        } else {
            b.iter_batched_ref(
                || {
                    recording
                        .batches
                        .iter()
                        .map(|r| AnyBatch::of(r))
                        .collect::<Vec<_>>()
                },
                |batches| batches.iter_mut().for_each(any),
                BatchSize::LargeInput,
            );
        }
    });
}

fn scene(c: &mut Criterion, name: &str, scene: &Scene) {
    let first = Backend::DEFAULT.build(&scene.mesh, 1).expect("a tree");
    let recordings = record(scene, &*first, 12, 30_000);
    for kind in RayKind::ALL {
        let recording = whole_blocks(&recordings[kind.index()]);
        if recording.is_empty() {
            continue;
        }
        let mut group = c.benchmark_group(format!("{name}/{}", kind.name()));
        group.sample_size(20);
        for &backend in <Backend as clap::ValueEnum>::value_variants() {
            let tracer = backend.build(&scene.mesh, 1).expect("a tree");
            let id = BenchmarkId::from_parameter(backend.name());
            let (closest, any) = (
                |b: &mut ClosestBatch| tracer.closest(b, kind),
                |b: &mut AnyBatch| tracer.any(b, kind),
            );
            time(&mut group, id, kind, &recording, &closest, &any);
        }
        #[cfg(feature = "embree")]
        {
            use gdpt::trace::Traverse;
            use gdpt::trace::embree::{Build, Embree};
            let embree = Embree::new(scene.mesh.clone(), 1, Build::Robust).expect("a tree");
            // The C loop is incoherent; so is ours, for a fair comparison of primary rays.
            let way = gdpt::trace::TraversalMode::PACKET8;
            let id = BenchmarkId::from_parameter("embree packet 8");
            let (closest, any) = (
                |b: &mut ClosestBatch| embree.closest_by(b, way),
                |b: &mut AnyBatch| embree.any_by(b, way),
            );
            time(&mut group, id, kind, &recording, &closest, &any);
            let id = BenchmarkId::from_parameter("bare C loop");
            let (closest, any) = (
                |b: &mut ClosestBatch| embree.bare_closest(b),
                |b: &mut AnyBatch| embree.bare_any(b),
            );
            time(&mut group, id, kind, &recording, &closest, &any);
        }
        group.finish();
    }
}

fn traversal(c: &mut Criterion) {
    scene(c, "glossy", &common::shipped("glossy"));
    scene(c, "large", &common::large());
}

criterion_group!(benches, traversal);
criterion_main!(benches);
