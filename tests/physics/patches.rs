//! Curved mirrors that are cut up: every part shows what it reflects, and walks that begin there find it.

use crate::common::{Rng, mirror, shipped, tracer};
use gdpt::error::Warnings;
use gdpt::lanes::{Float, Vec3x8};
use gdpt::load::obj::ObjFile;
use gdpt::manifold::{Start, Through, Walks};
use gdpt::scene::reflectors::{Form, Sequence, Target, Targets};
use gdpt::scene::{Scene, SceneSettings};
use gdpt::trace::rays::{ClosestBatch, Hit, Ray};
use gdpt::trace::{RayKind, Traverse};
use glam::Vec3;
use std::path::Path;

fn hit(tracer: &dyn Traverse, from: Vec3, direction: Vec3) -> Option<Hit> {
    let mut rays = ClosestBatch::default();
    rays.push(&Ray {
        origin: from + direction * 1e-4,
        direction,
        length: f32::INFINITY,
    });
    tracer.closest(&mut rays, RayKind::Walk);
    rays.hit(0)
}

/// A way by one reflection that is there.
struct There {
    from: Vec3,
    wi: Vec3,
    target: Target,
    by: u32,
}

/// From a random place in the room of `rings`, by what is curved there and no ball.
fn way(scene: &Scene, tracer: &dyn Traverse, rng: &mut Rng) -> Option<There> {
    let mut place = || {
        Vec3::new(
            2.0 * rng.next() - 1.0,
            2.0 * rng.next(),
            2.0 * rng.next() - 1.0,
        )
    };
    let from = place() * 0.95;
    let wi = (place() - from).try_normalize()?;
    let first = hit(tracer, from, wi)?;
    let by = scene.reflectors.of(first.triangle)?;
    if !is_cut(scene, by) {
        return None;
    }
    let p = scene.mesh.point(first.triangle, first.u, first.v);
    let normal = p.ns * 1f32.copysign(-p.ns.dot(wi));
    let on = wi - normal * (2.0 * wi.dot(normal));
    // Corner normals may show what the triangle is turned away from, or what it covers.
    if p.ng.dot(wi) * p.ng.dot(on) >= 0.0 {
        return None;
    }
    let last = hit(tracer, p.position, on)?;
    let end = scene.mesh.point(last.triangle, last.u, last.v);
    if scene.reflectors.of(last.triangle).is_some() {
        return None;
    }
    let target = Target::Surface {
        position: end.position,
        ng: end.ng * 1f32.copysign(-end.ng.dot(on)),
        offset: 1e-4,
    };
    Some(There {
        from,
        wi,
        target,
        by,
    })
}

fn is_cut(scene: &Scene, reflector: u32) -> bool {
    let list = scene.reflectors.list();
    let surface = list[reflector as usize].surface;
    list.iter().filter(|r| r.surface == surface).count() > 1
}

#[test]
fn ways_by_patches_are_shown_and_found() {
    let scene = shipped("rings", 8, 8);
    let tracer = tracer(&scene);
    let mut rng = Rng(5);
    let ways: Vec<There> = std::iter::repeat_with(|| way(&scene, &*tracer, &mut rng))
        .flatten()
        .take(2000)
        .collect();
    let mut found = 0;
    for way in &ways {
        let by = Sequence::of(way.by);
        let targets = Targets::gather(|_| Some(way.target));
        let from = Vec3x8::splat(way.from);
        let probability = scene
            .reflectors
            .probability(&[Some(by); 8], from, &targets, true);
        assert!(probability.lane(0) > 0.0, "{} {}", way.from, way.wi);
        let mut walks = Walks::default();
        let start = Start {
            position: way.from,
            ng: way.wi,
            offset: 1e-4,
            k: 1,
        };
        let walk = walks.push(start, way.target, Through::Mirrors(by));
        walks.solve(&scene, &*tracer);
        let link = walks.link(walk);
        found += u32::from(link.is_ok_and(|link| link.free && link.wi.distance(way.wi) < 2e-3));
    }
    // By the whole ring and the whole bowl walks find 0.73 of them.
    assert!(found > 1800, "{found} of {}", ways.len());
}

/// A mirror that is bent a little: a strip of a cylinder of radius 10 about the z axis, 2 wide and 2 long.
fn bent() -> Scene {
    const SIDE: u32 = 12;
    let mut file = ObjFile {
        materials: vec![mirror()],
        ..Default::default()
    };
    for i in 0..=SIDE {
        for j in 0..=SIDE {
            let angle = 0.2 * (i as f32 / SIDE as f32 - 0.5);
            let out = Vec3::new(angle.sin(), angle.cos(), 0.0);
            let along = Vec3::Z * (2.0 * j as f32 / SIDE as f32 - 1.0);
            file.positions.push(10.0 * out + along);
            file.normals.push(out);
        }
    }
    for i in 0..SIDE {
        for j in 0..SIDE {
            let first = i * (SIDE + 1) + j;
            for t in [[0, 1, SIDE + 2], [0, SIDE + 2, SIDE + 1]] {
                let numbers = t.map(|corner| first + corner);
                file.triangles.push(numbers);
                file.normal_triangles.push(numbers);
                file.material_of.push(0);
            }
        }
    }
    let settings = SceneSettings {
        size: (8, 8),
        ..Default::default()
    };
    let mut warnings = Warnings::new(false);
    Scene::build(Path::new("bent.obj"), file, &settings, &mut warnings).unwrap()
}

/// From all sides, grazing ones too: light of points that a mirror does not show would be lost.
#[test]
fn a_bent_mirror_shows_all_that_it_reflects() {
    let scene = bent();
    assert_eq!(scene.reflectors.list().len(), 1);
    let mut rng = Rng(9);
    for _ in 0..20_000 {
        let triangle = (rng.next() * scene.mesh.triangles.len() as f32) as u32;
        let (u, v) = (rng.next(), rng.next());
        let (u, v) = if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        };
        let p = scene.mesh.point(triangle, u, v);
        let mut away = rng.unit_vector();
        away -= p.ns * (p.ns.dot(away) * rng.next());
        let way = away.normalize();
        let on = p.ns * (2.0 * p.ns.dot(way)) - way;
        let mut distance = || 0.2 + 6.0 * rng.next() * rng.next();
        let from = Vec3x8::splat(p.position + way * distance());
        let target = Target::Point(p.position + on * distance());
        let targets = Targets::gather(|_| Some(target));
        let by = [Some(Sequence::of(0)); 8];
        let shown = scene.reflectors.probability(&by, from, &targets, true);
        assert!(shown.lane(0) > 0.0, "{way} {from:?}");
    }
}

/// All of a surface is in one of its patches, and no more.
#[test]
fn patches_are_parts_of_surfaces() {
    let scene = shipped("rings", 8, 8);
    let list = scene.reflectors.list();
    let triangles = 0..scene.mesh.triangles.len() as u32;
    let mut counts = vec![0; list.len()];
    for reflector in triangles.filter_map(|t| scene.reflectors.of(t)) {
        counts[reflector as usize] += 1;
    }
    assert!(
        list.iter()
            .zip(counts)
            .all(|(r, count)| r.triangles == count)
    );
    assert!(list.len() > 8 && list.iter().all(|r| matches!(r.form, Form::Curved(_))));
    let surface = |r: u32| list[r as usize].surface;
    for number in 0..list.len() as u32 {
        assert_eq!(surface(surface(number)), surface(number));
        assert!(scene.reflectors.are_one(number, surface(number)));
    }
    let mut surfaces: Vec<u32> = list.iter().map(|r| r.surface).collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    assert_eq!(surfaces, [0, 1, 2]);
}
