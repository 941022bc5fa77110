//! Backends against brute force on random triangles, and against each other on shipped scenes.

use crate::common::{Rng, SCENES, lambert, polygons, shipped};
use gdpt::scene::{Scene, SceneSettings};
use gdpt::trace::brute::Brute;
use gdpt::trace::rays::{AnyBatch, ClosestBatch, Ray};
use gdpt::trace::{Backend, RayKind, Traverse};
use glam::Vec3;

fn backends() -> Vec<Backend> {
    <Backend as clap::ValueEnum>::value_variants().to_vec()
}

fn soup(triangles: usize, size: f32, seed: u64) -> Scene {
    let mut rng = Rng(seed);
    let mut point =
        |scale: f32| Vec3::new(rng.next() - 0.5, rng.next() - 0.5, rng.next() - 0.5) * scale;
    let corners: Vec<[[f32; 3]; 3]> = (0..triangles)
        .map(|_| {
            let centre = point(2.0);
            [centre, centre + point(size), centre + point(size)].map(|p| p.to_array())
        })
        .collect();
    let list: Vec<(&[[f32; 3]], usize)> = corners.iter().map(|t| (t.as_slice(), 0)).collect();
    let settings = SceneSettings {
        size: (4, 4),
        roughness_threshold: 0.05,
        ..Default::default()
    };
    polygons(&list, vec![lambert(0.5)], &settings)
}

/// Rays through the scene's bounds: some from outside, some from inside, some short.
fn rays(scene: &Scene, count: usize, seed: u64) -> Vec<Ray> {
    let mut rng = Rng(seed);
    let (low, high) = scene.mesh.bounds;
    let size = (high - low).length();
    (0..count)
        .map(|i| {
            let inside = low + (high - low) * Vec3::new(rng.next(), rng.next(), rng.next());
            let direction = rng.unit_vector();
            match i % 3 {
                0 => Ray {
                    origin: inside - direction * size,
                    direction,
                    length: f32::INFINITY,
                },
                1 => Ray {
                    origin: inside,
                    direction,
                    length: f32::INFINITY,
                },
                // Not normalised: the length counts in units of the direction.
                _ => Ray {
                    origin: inside,
                    direction: direction * (0.3 * size),
                    length: 1.0,
                },
            }
        })
        .collect()
}

/// Whether the distances agree, and both hit points are the same to rounding. Which triangle is named
/// may differ where two meet.
fn compare(what: &str, scene: &Scene, rays: &[Ray], a: &dyn Traverse, b: &dyn Traverse) {
    let trace = |t: &dyn Traverse| {
        let (mut closest, mut any) = (ClosestBatch::default(), AnyBatch::default());
        for ray in rays {
            closest.push(ray);
            any.push(ray);
        }
        t.closest(&mut closest, RayKind::Bounce);
        t.any(&mut any, RayKind::Shadow);
        (closest, any)
    };
    let ((ca, aa), (cb, ab)) = (trace(a), trace(b));
    let (low, high) = scene.mesh.bounds;
    let size = (high - low).length();
    let mut different = 0;
    let mut hits = 0;
    for i in 0..rays.len() as u32 {
        let ray = &rays[i as usize];
        match (ca.hit(i), cb.hit(i)) {
            (Some(x), Some(y)) => {
                hits += 1;
                let apart = (x.t - y.t).abs() * ray.direction.length();
                if apart > 1e-4 * size {
                    different += 1;
                } else {
                    for hit in [x, y] {
                        let p = scene.mesh.point(hit.triangle, hit.u, hit.v).position;
                        let on_ray = ray.origin + ray.direction * hit.t;
                        assert!((p - on_ray).length() < 1e-4 * size, "{what}: {p} {on_ray}");
                    }
                }
            }
            (None, None) => {}
            _ => different += 1,
        }
        different += u32::from(aa.is_blocked(i) != ab.is_blocked(i));
    }
    assert!(hits > rays.len() / 10, "{what}: only {hits} hits");
    // Rays within rounding of an edge.
    assert!(
        different as usize <= rays.len() / 2000 + 1,
        "{what}: {different} of {} differ",
        rays.len()
    );
}

#[test]
fn backends_agree_with_brute_force_on_random_triangles() {
    // Not a multiple of a block, so that partly filled blocks are met too.
    for (triangles, size, seed) in [(1, 2.0, 1), (20, 1.0, 2), (500, 0.4, 3), (500, 0.05, 4)] {
        let scene = soup(triangles, size, seed);
        let oracle = Brute(scene.mesh.clone());
        let count = 4003;
        let mut rays = rays(&scene, count, seed);
        // At single triangles and specks few random rays hit: aim.
        let mut rng = Rng(seed ^ 99);
        for ray in rays.iter_mut().step_by(2) {
            let t = (rng.next() * triangles as f32) as u32;
            let target = scene
                .mesh
                .point(t.min(triangles as u32 - 1), 0.3, 0.3)
                .position;
            ray.origin = target - ray.direction * 0.5;
        }
        for backend in backends() {
            let tracer = backend.build(&scene.mesh, 1).unwrap();
            let what = format!("{} on {triangles} triangles", backend.name());
            compare(&what, &scene, &rays, &*tracer, &oracle);
        }
    }
}

#[test]
fn backends_agree_on_shipped_scenes() {
    for name in SCENES {
        let scene = shipped(name, 16, 16);
        let rays = rays(&scene, 20_000, 7);
        let oracle = Brute(scene.mesh.clone());
        for backend in backends() {
            let tracer = backend.build(&scene.mesh, 1).unwrap();
            let few = if scene.mesh.triangles.len() > 200 {
                &rays[..2000]
            } else {
                &rays
            };
            compare(
                &format!("{} on {name}", backend.name()),
                &scene,
                few,
                &*tracer,
                &oracle,
            );
        }
        let all: Vec<_> = backends()
            .iter()
            .map(|b| b.build(&scene.mesh, 1).unwrap())
            .collect();
        for other in &all[1..] {
            compare(
                &format!("backends on {name}"),
                &scene,
                &rays,
                &*all[0],
                &**other,
            );
        }
    }
}

#[test]
fn batches_can_be_used_again() {
    let scene = soup(100, 0.5, 5);
    for backend in backends() {
        let tracer = backend.build(&scene.mesh, 1).unwrap();
        let (first, second) = (rays(&scene, 40, 1), rays(&scene, 13, 2));
        let mut used = ClosestBatch::default();
        first.iter().for_each(|r| _ = used.push(r));
        tracer.closest(&mut used, RayKind::Primary);
        used.clear();
        assert!(used.is_empty());
        let mut fresh = ClosestBatch::default();
        for ray in &second {
            used.push(ray);
            fresh.push(ray);
        }
        tracer.closest(&mut used, RayKind::Primary);
        tracer.closest(&mut fresh, RayKind::Primary);
        for i in 0..13 {
            assert_eq!(
                used.hit(i).map(|h| h.triangle),
                fresh.hit(i).map(|h| h.triangle)
            );
        }
    }
}
