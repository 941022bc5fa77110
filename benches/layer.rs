//! What our layer over Embree costs: the same recorded batches through the renderer's call and through a
//! bare C loop (ffi/shim.c), in turn, many times. Prints the median of the paired ratios; below 1.05 is
//! the aim. Pairs, since on a busy machine only what runs side by side can be compared.

mod common;

#[cfg(not(feature = "embree"))]
fn main() {}

#[cfg(feature = "embree")]
fn main() {
    // `cargo test --benches` passes --test: one pair then, to see that it works.
    let pairs = if std::env::args().any(|a| a == "--test") {
        1
    } else {
        201
    };
    for (name, scene) in [
        ("glossy", common::shipped("glossy")),
        ("large", common::large()),
    ] {
        layer::compare(name, &scene, pairs);
    }
}

#[cfg(feature = "embree")]
mod layer {
    use gdpt::bench::record::record;
    use gdpt::scene::Scene;
    use gdpt::trace::embree::{Build, Embree};
    use gdpt::trace::rays::{AnyBatch, ClosestBatch, Ray};
    use gdpt::trace::{RayKind, TraversalMode, Traverse};
    use std::time::Instant;

    pub fn compare(name: &str, scene: &Scene, pairs: usize) {
        let embree = Embree::new(scene.mesh.clone(), 1, Build::Robust).expect("a tree");
        // The C loop is incoherent: so is ours here, also for primary rays.
        let way = TraversalMode::PACKET8;
        for (kind, recording) in RayKind::ALL.iter().zip(record(scene, &embree, 12, 20_000)) {
            let mut ratios: Vec<f64> = (0..pairs)
                .map(|pair| {
                    let ours = || {
                        if kind.wants_closest() {
                            seconds(&recording.batches, ClosestBatch::of, |b| {
                                embree.closest_by(b, way);
                            })
                        } else {
                            seconds(&recording.batches, AnyBatch::of, |b| embree.any_by(b, way))
                        }
                    };
                    let bare = || {
                        if kind.wants_closest() {
                            seconds(&recording.batches, ClosestBatch::of, |b| {
                                embree.bare_closest(b);
                            })
                        } else {
                            seconds(&recording.batches, AnyBatch::of, |b| embree.bare_any(b))
                        }
                    };
                    // Either goes first in turn.
                    if pair % 2 == 0 {
                        let ours = ours();
                        ours / bare()
                    } else {
                        1.0 / (bare() / ours())
                    }
                })
                .collect();
            if recording.is_empty() {
                continue;
            }
            ratios.sort_by(f64::total_cmp);
            let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share).round() as usize];
            println!(
                "{name:>8} {:<13} {:>6} rays: ours over C {:.3} (quartiles {:.3} to {:.3}, {pairs} pairs)",
                kind.name(),
                recording.len(),
                at(0.5),
                at(0.25),
                at(0.75),
            );
        }
    }

    /// Seconds for tracing all batches; whole blocks of 8 alone, which is all that the C loop traces.
    fn seconds<B>(batches: &[Vec<Ray>], of: impl Fn(&[Ray]) -> B, trace: impl Fn(&mut B)) -> f64 {
        let mut batches: Vec<B> = batches
            .iter()
            .filter(|b| b.len() >= 8)
            .map(|b| of(&b[..b.len() / 8 * 8]))
            .collect();
        let start = Instant::now();
        batches.iter_mut().for_each(trace);
        start.elapsed().as_secs_f64()
    }
}
