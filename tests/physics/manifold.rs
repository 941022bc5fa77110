//! Chains of mirrors and glass: 𝒢 against numeric derivatives, answers against closed forms and against a search.

use crate::common::{Rng, cases, glass, lambert, mirror, polygons, shipped, sphere, tracer};
use gdpt::error::Warnings;
use gdpt::frame::Frame;
use gdpt::lanes::{Float, Vec3x8};
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::obj::{NONE, ObjFile};
use gdpt::manifold::{Failure, Link, Start, Through, Walks};
use gdpt::scene::reflectors::{Branch, Form, Inside, Sequence, Target, Targets};
use gdpt::scene::{Scene, SceneSettings};
use gdpt::trace::rays::{ClosestBatch, Ray};
use gdpt::trace::{RayKind, Traverse};
use glam::Vec3;
use proptest::prelude::*;
use std::path::Path;
use wide::f32x8;

fn settings() -> SceneSettings {
    SceneSettings {
        size: (8, 8),
        ..Default::default()
    }
}

/// A ball around 0 with normals, its corners on the sphere of radius 1; or flat triangles.
fn ball(material: MtlMaterial, level: u32, smooth: bool) -> Scene {
    let mut file = ObjFile {
        materials: vec![material],
        ..Default::default()
    };
    for corners in sphere(level) {
        let first = file.positions.len() as u32;
        let numbers = [first, first + 1, first + 2];
        file.positions.extend(corners);
        file.normals.extend(corners);
        file.triangles.push(numbers);
        file.normal_triangles
            .push(if smooth { numbers } else { [NONE; 3] });
        file.material_of.push(0);
    }
    let mut warnings = Warnings::new(false);
    Scene::build(Path::new("ball.obj"), file, &settings(), &mut warnings).unwrap()
}

/// A square of half this side about `centre`, its front towards `normal`.
fn square(centre: Vec3, normal: Vec3, half: f32) -> [[f32; 3]; 4] {
    let (a, b) = normal.any_orthonormal_pair();
    let (a, b) = if a.cross(b).dot(normal) > 0.0 {
        (a, b)
    } else {
        (b, a)
    };
    let corner = |s: f32, t: f32| (centre + (a * s + b * t) * half).to_array();
    [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ]
}

/// The sides of a block.
fn block(low: Vec3, high: Vec3) -> Vec<[[f32; 3]; 4]> {
    let corner =
        |i: usize, j: usize, k: usize| [[low.x, high.x][i], [low.y, high.y][j], [low.z, high.z][k]];
    vec![
        [
            corner(0, 0, 1),
            corner(1, 0, 1),
            corner(1, 1, 1),
            corner(0, 1, 1),
        ],
        [
            corner(1, 0, 0),
            corner(0, 0, 0),
            corner(0, 1, 0),
            corner(1, 1, 0),
        ],
        [
            corner(1, 0, 1),
            corner(1, 0, 0),
            corner(1, 1, 0),
            corner(1, 1, 1),
        ],
        [
            corner(0, 0, 0),
            corner(0, 0, 1),
            corner(0, 1, 1),
            corner(0, 1, 0),
        ],
        [
            corner(0, 1, 1),
            corner(1, 1, 1),
            corner(1, 1, 0),
            corner(0, 1, 0),
        ],
        [
            corner(0, 0, 0),
            corner(1, 0, 0),
            corner(1, 0, 1),
            corner(0, 0, 1),
        ],
    ]
}

fn start(position: Vec3) -> Start {
    Start {
        position,
        ng: Vec3::Y,
        offset: 0.0,
        k: 1,
    }
}

fn point(position: Vec3, ng: Vec3) -> Target {
    Target::Surface {
        position,
        ng,
        offset: 0.0,
    }
}

fn walk(
    (scene, tracer): (&Scene, &dyn Traverse),
    from: Vec3,
    target: Target,
    through: Through,
) -> Result<Link, Failure> {
    let mut walks = Walks::default();
    let walk = walks.push(start(from), target, through);
    walks.solve(scene, tracer);
    walks.link(walk).copied()
}

/// 𝒢 by differences of the directions in which targets around this one are found; `None` where one of them is not.
fn numeric_geometry(
    scene: (&Scene, &dyn Traverse),
    from: Vec3,
    target: Target,
    through: Through,
    step: f32,
) -> Option<f32> {
    let (place, normal) = match target {
        Target::Surface { position, ng, .. } => (position, ng),
        // The plane across the way there.
        Target::Point(position) => {
            let link = walk(scene, from, target, through).ok()?;
            (position, link.arrival)
        }
        Target::Direction(direction) => (direction, direction),
    };
    let (a, b) = normal.any_orthonormal_pair();
    let found = |shift: Vec3| {
        let target = match target {
            Target::Surface { ng, .. } => point(place + shift, ng),
            Target::Point(_) => Target::Point(place + shift),
            Target::Direction(_) => Target::Direction((place + shift).normalize()),
        };
        walk(scene, from, target, through).ok().map(|link| link.wi)
    };
    let along = |axis: Vec3| Some((found(axis * step)? - found(-axis * step)?) / (2.0 * step));
    Some(along(a)?.cross(along(b)?).length())
}

/// Something near the ball that gives light: far away, a point, or a surface that looks at the ball.
fn beside_ball(to: Vec3, kind: u32) -> Target {
    match kind {
        0 => Target::Direction(to.normalize()),
        1 => Target::Point(to),
        _ => point(to, -to.normalize()),
    }
}

/// Where the shortest way from `from` to `target` by the side of the unit ball that both see meets it, unless it grazes:
/// there it would lie between triangles.
fn by_ball(from: Vec3, target: Target) -> Option<Vec3> {
    let near = |p: Vec3| p.length() < 1.3;
    let length = |p: Vec3| match target {
        Target::Surface { position, .. } | Target::Point(position) => {
            from.distance(p) + position.distance(p)
        }
        Target::Direction(d) => from.distance(p) - d.dot(p),
    };
    if near(from) || !matches!(target, Target::Direction(_)) && near(target.towards(Vec3::ZERO)) {
        return None;
    }
    let seen = |p: Vec3| p.dot(from - p) > 0.0 && p.dot(target.towards(p)) > 0.0;
    let mut rng = Rng(7);
    let mut best = (f32::INFINITY, Vec3::ZERO, 1.0);
    for round in 0..3000 {
        let p = if round < 2000 {
            rng.unit_vector()
        } else {
            (best.1 + rng.unit_vector() * best.2).normalize()
        };
        if round >= 2000 {
            best.2 *= 0.995;
        }
        if seen(p) && length(p) < best.0 {
            best = (length(p), p, best.2);
        }
    }
    let p = best.1;
    (best.0.is_finite() && p.dot((from - p).normalize()) > 0.4).then_some(p)
}

/// A walk may begin where it goes astray. What it does not find, BSDF sampling carries.
#[test]
fn most_walks_by_a_ball_arrive() {
    let scene = ball(mirror(), 5, true);
    let tracer = tracer(&scene);
    let mut rng = Rng(11);
    let mut place = || Vec3::from_array([(); 3].map(|()| 6.0 * rng.next() - 3.0));
    let (mut there, mut found) = (0, 0);
    for kind in (0..3).cycle().take(600) {
        let (from, target) = (place(), beside_ball(place(), kind));
        if by_ball(from, target).is_some() {
            there += 1;
            found += u32::from(walk((&scene, &*tracer), from, target, single()).is_ok());
        }
    }
    println!("{found} of {there}");
    assert!(
        there > 100 && f64::from(found) > 0.98 * f64::from(there),
        "{found} of {there}"
    );
}

fn single() -> Through {
    Through::Mirrors(Sequence::of(0))
}

fn vector(low: f32, high: f32) -> impl Strategy<Value = Vec3> {
    (low..high, low..high, low..high).prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(cases(60))]

    /// Of one plane, and of two: the image of the target is seen.
    #[test]
    fn planes_show_images(from in vector(0.2, 1.5), to in vector(0.2, 1.5), ng in vector(-1.0, 1.0)) {
        let (floor, wall) = (square(Vec3::ZERO, Vec3::Y, 8.0), square(Vec3::ZERO, Vec3::X, 8.0));
        let scene = polygons(&[(&floor, 0), (&wall, 0)], vec![mirror()], &settings());
        let tracer = tracer(&scene);
        let numbers = [0, 1].map(|r| match &scene.reflectors.list()[r].form {
            Form::Plane(plane) if plane.image(&point(Vec3::ONE, Vec3::Y)) == point(Vec3::new(1.0, -1.0, 1.0), Vec3::Y) => 0,
            _ => 1,
        });
        let floor = numbers.iter().position(|&n| n == 0).unwrap() as u32;
        // What is met first.
        let (on_floor, on_wall) = (from.y / (from.y + to.y), from.x / (from.x + to.x));
        let first = if on_floor < on_wall { floor } else { 1 - floor };
        let both = Sequence::of(first).and(1 - first).unwrap();
        for (by, image, last, factor) in [
            (Sequence::of(floor), to * Vec3::new(1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), 1),
            (both, to * Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, -1.0, 1.0), 2),
        ] {
            let way = image - from;
            let arriving = way.normalize() * last;
            let ng = ng.normalize_or(Vec3::Y);
            let ng = if ng.dot(arriving) < 0.0 { ng } else { -ng };
            prop_assume!(ng.dot(arriving) < -0.05);
            let link = walk((&scene, &*tracer), from, point(to, ng), Through::Mirrors(by)).unwrap();
            // A walk has arrived within an angle of 2e-5.
            prop_assert!(link.wi.distance(way.normalize()) < 1e-4);
            let expected = -ng.dot(arriving) / way.length_squared();
            prop_assert!((link.geometry / expected - 1.0).abs() < 1e-3, "{} {}", link.geometry, expected);
            prop_assert!(link.free && link.vertices == factor);
            prop_assert!(link.factor.max_element() <= 1.0 && link.factor.min_element() >= 0.7f32.powi(factor as i32));
            let link = walk((&scene, &*tracer), from, Target::Point(to), Through::Mirrors(by)).unwrap();
            prop_assert!((link.geometry * way.length_squared() - 1.0).abs() < 1e-3, "{}", link.geometry);
            prop_assert!(link.arrival.distance(arriving) < 1e-4);
            // From behind it is not seen.
            let behind = walk((&scene, &*tracer), from, point(to, -ng), Through::Mirrors(by));
            prop_assert_eq!(behind.unwrap_err(), Failure::Behind);
        }
    }

    /// Through a slab, the law of refraction holds at both of its sides, and 𝒢 is that of a numeric derivative.
    #[test]
    fn slabs_refract(from in vector(-1.0, 1.0), to in vector(-1.0, 1.0), ior in 1.1f32..2.2, thickness in 0.02f32..1.0) {
        let (from, to) = (from.with_y(-0.3), to.with_y(thickness + 0.8));
        let sides = block(Vec3::new(-30.0, 0.0, -30.0), Vec3::new(30.0, thickness, 30.0));
        let sides: Vec<_> = sides.iter().map(|side| (&side[..], 0)).collect();
        let scene = polygons(&sides, vec![glass(ior)], &settings());
        prop_assert_eq!(scene.reflectors.list().len(), 6);
        let tracer = tracer(&scene);
        let target = point(to, Vec3::NEG_Y);
        let link = walk((&scene, &*tracer), from, target, Through::Passage).unwrap();
        prop_assert_eq!(link.vertices, 2);
        let across = (to - from).with_y(0.0).length();
        let sine = sine_outside(across, 1.1, thickness, ior);
        prop_assert!((link.wi.with_y(0.0).length() - sine).abs() < 1e-4, "{} {}", link.wi, sine);
        let numeric = numeric_geometry((&scene, &*tracer), from, target, Through::Passage, 4e-3).unwrap();
        prop_assert!((link.geometry / numeric - 1.0).abs() < 0.02, "{} {}", link.geometry, numeric);
    }

    /// Reflected inside a slab, once or twice, the law of refraction holds where light enters and leaves, what arrives is
    /// what is not lost, and 𝒢 is that of a numeric derivative.
    #[test]
    fn slabs_reflect_inside(
        from in vector(-1.0, 1.0), to in vector(-1.0, 1.0), ior in 1.1f32..2.2, thickness in 0.02f32..0.6, twice in any::<bool>()
    ) {
        let sides = block(Vec3::new(-30.0, 0.0, -30.0), Vec3::new(30.0, thickness, 30.0));
        let sides: Vec<_> = sides.iter().map(|side| (&side[..], 0)).collect();
        let scene = polygons(&sides, vec![glass(ior)], &settings());
        let tracer = tracer(&scene);
        let is_at = |r: &u32, y: f32| match &scene.reflectors.list()[*r as usize].form {
            Form::Plane(plane) => {
                let image = plane.image(&Target::Point(Vec3::Y * (y - 1.0)));
                matches!(image, Target::Point(p) if p.distance(Vec3::Y * (y + 1.0)) < 1e-3)
            }
            Form::Curved(_) => false,
        };
        let [bottom, top] = [0.0, thickness].map(|y| (0..6).find(|r| is_at(r, y)).unwrap());
        // From above, and back up; or from below, down again, and up.
        let (by, from, crossings) = if twice {
            (Sequence::of(top).and(bottom).unwrap(), from.with_y(-0.3), 3.0)
        } else {
            (Sequence::of(bottom), from.with_y(thickness + 0.3), 2.0)
        };
        let to = to.with_y(thickness + 0.8);
        let (target, through) = (point(to, Vec3::NEG_Y), Through::Mirrors(by));
        let link = walk((&scene, &*tracer), from, target, through).unwrap();
        let behind = walk((&scene, &*tracer), from, point(to, Vec3::Y), through);
        prop_assert_eq!(behind.unwrap_err(), Failure::Behind);
        prop_assert_eq!(link.vertices as usize, 2 + by.numbers().len());
        let across = (to - from).with_y(0.0).length();
        let sine = sine_outside(across, 1.1, crossings * thickness, ior);
        prop_assert!((link.wi.with_y(0.0).length() - sine).abs() < 2e-4, "{} {}", link.wi, sine);
        let cos = (1.0 - sine * sine).sqrt();
        let reflected = gdpt::bsdf::fresnel::dielectric(cos, ior);
        let expected = (1.0 - reflected).powi(2) * reflected.powi(by.numbers().len() as i32);
        prop_assert!((link.factor.x / expected - 1.0).abs() < 1e-2, "{} {}", link.factor, expected);
        prop_assert!((link.probability / expected - 1.0).abs() < 1e-2 || link.probability < expected);
        let numeric = numeric_geometry((&scene, &*tracer), from, target, through, 4e-3).unwrap();
        prop_assert!((link.geometry / numeric - 1.0).abs() < 0.03, "{} {}", link.geometry, numeric);
    }

    /// Through a slab behind a frame, walks find the ways that pass close to the frame, where the straight way is blocked.
    #[test]
    fn slabs_refract_beside_frames(
        from in vector(-1.0, 1.0), beside in -0.03f32..0.03, along in -0.5f32..0.5, ior in 1.1f32..2.2,
        thickness in 0.02f32..0.3, past in 0.1f32..2.0
    ) {
        let from = from.with_y(-0.4);
        let sides = block(Vec3::new(-0.6, 0.0, -0.6), Vec3::new(0.6, thickness, 0.6));
        // A frame below the slab's edges at x < 0.
        let frame = [[-3.0, -0.001, -3.0], [-3.0, -0.001, 3.0], [-0.55, -0.001, 3.0], [-0.55, -0.001, -3.0]];
        let mut all: Vec<_> = sides.iter().map(|side| (&side[..], 0)).collect();
        all.push((&frame[..], 1));
        let scene = polygons(&all, vec![glass(ior), lambert(0.5)], &settings());
        let tracer = tracer(&scene);
        let into = Vec3::new(-0.55 + beside, 0.0, along);
        let wi = (into - from).normalize();
        let inside = refracted(wi, Vec3::NEG_Y, ior);
        let out_of = into + inside * (thickness / inside.y);
        let to = out_of + wi * past;
        let stays_inside = out_of.x.abs() < 0.599 && out_of.z.abs() < 0.599;
        prop_assume!(stays_inside && beside.abs() > 5e-3);
        let found = walk((&scene, &*tracer), from, point(to, -wi), Through::Passage);
        match found {
            Ok(link) => {
                prop_assert!(beside > 0.0 && link.vertices == 2 && link.free);
                prop_assert!(link.wi.distance(wi) < 1e-4);
            }
            Err(_) => prop_assert!(beside < 0.0),
        }
    }

    /// What light does inside a block, walks find that know where it begins: by sides, by faces, by both, in any order; and
    /// these ways may be chosen.
    #[test]
    fn courses_inside_blocks(
        from in vector(-1.0, 1.0), into in (-0.4f32..0.4, -0.4f32..0.4), ior in 1.1f32..2.2, thickness in 0.05f32..0.25,
        bounces in 0u32..3, past in 0.1f32..2.0, distant in any::<bool>()
    ) {
        const HALF: f32 = 0.4;
        let from = from.with_y(-0.4 - from.y.abs());
        let sides = block(Vec3::new(-HALF, 0.0, -HALF), Vec3::new(HALF, thickness, HALF));
        let sides: Vec<_> = sides.iter().map(|side| (&side[..], 0)).collect();
        let scene = polygons(&sides, vec![glass(ior)], &settings());
        let tracer = tracer(&scene);
        // Followed through the block.
        let into = Vec3::new(into.0, 0.0, into.1);
        let wi = (into - from).normalize();
        let (mut p, mut d) = (into, refracted(wi, Vec3::NEG_Y, ior));
        let (mut by, mut at_faces, mut at_sides) = (Vec::new(), 0, 0);
        let number = |p: Vec3, normal: Vec3| {
            let is_it = |r: &u32| match &scene.reflectors.list()[*r as usize].form {
                Form::Plane(plane) => {
                    let shown = |p: Vec3| match plane.image(&Target::Point(p)) {
                        Target::Point(image) => image,
                        other => panic!("{other:?}"),
                    };
                    shown(p).distance(p) < 1e-4 && shown(p + normal).distance(p - normal) < 1e-3
                }
                Form::Curved(_) => false,
            };
            (0..6).find(is_it).unwrap()
        };
        loop {
            let far = |d: f32, p: f32, low: f32, high: f32| if d > 0.0 { (high - p) / d } else { (low - p) / d };
            let ways = [far(d.x, p.x, -HALF, HALF), far(d.y, p.y, 0.0, thickness), far(d.z, p.z, -HALF, HALF)];
            let axis = (0..3).min_by(|&a, &b| ways[a].total_cmp(&ways[b])).unwrap();
            p += d * ways[axis];
            if axis == 1 && at_faces == bounces {
                break;
            }
            by.push(number(p, Vec3::AXES[axis]));
            d[axis] = -d[axis];
            (at_faces, at_sides) = (at_faces + u32::from(axis == 1), at_sides + u32::from(axis != 1));
            prop_assume!(by.len() < 4);
        }
        // Near edges it is a matter of rounding.
        prop_assume!(p.x.abs() < HALF - 1e-3 && p.z.abs() < HALF - 1e-3);
        prop_assume!(matches!((at_sides, bounces), (1, 0 | 2) | (2, 0) | (0, 1 | 2)));
        let is_reached_twice = by.iter().enumerate().any(|(i, r)| by[..i].contains(r));
        prop_assume!(!is_reached_twice);
        let out = Vec3::new(d.x * ior, (1.0 - ior * ior * (d.x * d.x + d.z * d.z)).sqrt().copysign(d.y), d.z * ior);
        let target = if distant { Target::Direction(out) } else { point(p + out * past, -out) };
        let sequence = by.iter().try_fold(Sequence::NONE, |so_far, &r| so_far.and(r)).unwrap();
        let link = walk((&scene, &*tracer), from, target, Through::Mirrors(sequence));
        let link = link.map_err(|failure| TestCaseError::fail(format!("{by:?} {failure:?}")))?;
        prop_assert!(link.free && link.vertices as usize == 2 + by.len());
        prop_assert!(link.wi.distance(wi) < 2e-4, "{} {}", link.wi, wi);
        let targets = Targets::gather(|_| Some(target));
        let chosen = scene.reflectors.probability(&[Some(sequence); 8], Vec3x8::splat(from), &targets, true);
        prop_assert!(chosen.lane(3) > 0.0);
        // What is reflected in all is worth as much as anything else.
        let inside = refracted(wi, Vec3::NEG_Y, ior);
        let is_total = ior * (1.0 - inside.x.abs().max(inside.z.abs()).powi(2)).sqrt() > 1.0;
        if at_sides == 1 && bounces == 0 && is_total {
            prop_assert!(chosen.lane(3) > 0.2, "{}", chosen.lane(3));
        }
    }

    /// By a ball, what a walk finds is as short as any way, and 𝒢 is as by a numeric derivative; also to directions.
    #[test]
    fn balls_reflect(from in vector(-3.0, 3.0), to in vector(-3.0, 3.0), kind in 0u32..3) {
        let scene = ball(mirror(), 5, true);
        let tracer = tracer(&scene);
        let target = beside_ball(to, kind);
        let way = by_ball(from, target);
        prop_assume!(way.is_some());
        let p = way.unwrap();
        // Not every walk arrives: see `most_walks_by_a_ball_arrive`.
        let link = walk((&scene, &*tracer), from, target, single());
        prop_assume!(link.is_ok());
        let link = link.unwrap();
        prop_assert!(link.free && link.wi.distance((p - from).normalize()) < 4e-3, "{} {}", link.wi, p - from);
        let numeric = numeric_geometry((&scene, &*tracer), from, target, single(), 0.02);
        prop_assume!(numeric.is_some());
        let numeric = numeric.unwrap();
        prop_assert!((link.geometry / numeric - 1.0).abs() < 0.1, "{} {}", link.geometry, numeric);
    }

    /// By a microfacet of a ball, seen from outside or from inside: the half vector is its normal, and 𝒢 as by a numeric
    /// derivative.
    #[test]
    fn microfacets_reflect(
        from in vector(-3.0, 3.0), to in vector(-3.0, 3.0), kind in 0u32..3, slopes in (-0.1f32..0.1, -0.1f32..0.1), inside in any::<bool>()
    ) {
        let metal = MtlMaterial { pr: Some(0.09), ..mirror() };
        let scene = ball(metal, 5, true);
        prop_assert!((scene.reflectors.alpha(0) - 0.0081).abs() < 1e-6);
        let tracer = tracer(&scene);
        let scale = if inside { 0.15 } else { 1.0 };
        let (from, target) = (from * scale, beside_ball(to * scale, kind));
        prop_assume!(inside == (from.length() < 1.0) && !(inside && kind == 0));
        let normal = Vec3::new(slopes.0, slopes.1, 1.0).normalize();
        let through = Through::Microfacet(0, normal);
        let link = walk((&scene, &*tracer), from, target, through);
        prop_assume!(link.is_ok());
        let link = link.unwrap();
        prop_assert_eq!(link.vertices, 1);
        let mut rays = ClosestBatch::default();
        rays.push(&Ray::without_end(from, link.wi));
        tracer.closest(&mut rays, RayKind::Walk);
        let hit = rays.hit(0).unwrap();
        let ns = scene.mesh.point(hit.triangle, hit.u, hit.v).ns;
        // Grazing, it would change much from triangle to triangle.
        prop_assume!(ns.dot(link.wi).abs() > 0.3);
        let half = (link.arrival - link.wi).normalize();
        let local = Vec3::from(Frame::<f32>::new(ns.into()).to_local(half.into()));
        let local = local.with_z(local.z.abs());
        prop_assert!(local.distance(normal) < 5e-3, "{} {}", local, normal);
        let numeric = numeric_geometry((&scene, &*tracer), from, target, through, 0.02 * scale);
        prop_assume!(numeric.is_some());
        let numeric = numeric.unwrap();
        prop_assert!((link.geometry / numeric - 1.0).abs() < 0.1, "{} {}", link.geometry, numeric);
    }

    /// By a microfacet of a plane, seen from above or below, the way is known beforehand.
    #[test]
    fn microfacets_of_planes_are_exact(
        from in vector(0.2, 1.5), to in vector(0.2, 1.5), far in any::<bool>(), slopes in (-0.1f32..0.1, -0.1f32..0.1), below in any::<bool>()
    ) {
        let floor = square(Vec3::ZERO, Vec3::Y, 30.0);
        let metal = MtlMaterial { pr: Some(0.09), ..mirror() };
        let scene = polygons(&[(&floor, 0)], vec![metal], &settings());
        let tracer = tracer(&scene);
        let side = if below { -1.0 } else { 1.0 };
        let [from, to] = [from, to].map(|p| p * Vec3::new(1.0, side, 1.0));
        let target = if far { Target::Direction(to.normalize()) } else { Target::Point(to) };
        let normal = Vec3::new(slopes.0, slopes.1, 1.0).normalize();
        let mut walks = Walks::default();
        let walk = walks.push(start(from), target, Through::Microfacet(0, normal));
        walks.solve(&scene, &*tracer);
        let link = walks.link(walk);
        prop_assume!(link.is_ok());
        let link = link.unwrap();
        // But for rounding, which asks for other steps now and then.
        let guess = scene.reflectors.guess_by_microfacet((0, normal), from, &target).unwrap();
        prop_assert!(guess.distance(link.wi) < 1e-3, "{} {}", guess, link.wi);
        let half = link.arrival - link.wi;
        let grazing = half.length();
        let half = half.normalize();
        let local = Vec3::from(Frame::<f32>::new(Vec3::Y.into()).to_local(half.into()));
        prop_assert!((local * Vec3::new(1.0, 1.0, side)).distance(normal) < 1e-4 / grazing, "{} {}", local, normal);
    }

    /// Through a prism, whose sides are not parallel: 𝒢 as by a numeric derivative, both ways round.
    #[test]
    fn prisms_refract(from in vector(-0.3, 0.3), to in vector(-0.3, 0.3), ior in 1.1f32..1.6, back in any::<bool>()) {
        let (from, to) = (from - Vec3::X * 3.0, to + Vec3::new(3.0, -0.5, 0.0));
        let (from, to) = if back { (to, from) } else { (from, to) };
        // An upright wedge, sharp at the top.
        let corner = |x: f32, y: f32, z: f32| [x, y, z];
        let side = |z: f32| [corner(-0.5, -3.0, z), corner(0.5, -3.0, z), corner(0.0, 3.0, z)];
        let ([a, b, c], [d, e, f]) = (side(5.0), side(-5.0));
        let sides = [vec![a, b, c], vec![e, d, f], vec![b, e, f, c], vec![d, a, c, f], vec![d, e, b, a]];
        let sides: Vec<_> = sides.iter().map(|side| (&side[..], 0)).collect();
        let scene = polygons(&sides, vec![glass(ior)], &settings());
        prop_assert_eq!(scene.reflectors.list().len(), 5);
        let tracer = tracer(&scene);
        let scene = (&scene, &*tracer);
        for target in [point(to, (from - to).normalize()), Target::Direction((to - from).normalize())] {
            let link = walk(scene, from, target, Through::Passage).unwrap();
            prop_assert_eq!(link.vertices, 2);
            let numeric = numeric_geometry(scene, from, target, Through::Passage, 1e-2).unwrap();
            prop_assert!((link.geometry / numeric - 1.0).abs() < 0.03, "{} {}", link.geometry, numeric);
        }
    }
}

/// The unit direction in which light along `d` goes on inside glass, behind a surface with this normal, outwards.
fn refracted(d: Vec3, normal: Vec3, ior: f32) -> Vec3 {
    let along = (d - normal * d.dot(normal)) / ior;
    along - normal * (1.0 - along.length_squared()).sqrt()
}

/// The sine under which a ray leaves for a point so far across, through so much air and glass, by bisection.
fn sine_outside(across: f32, air: f32, through_glass: f32, ior: f32) -> f32 {
    let [across, air, through_glass, ior] = [across, air, through_glass, ior].map(f64::from);
    let (mut low, mut high) = (0.0f64, 1.0);
    for _ in 0..60 {
        let sine = 0.5 * (low + high);
        let tangent = |s: f64| s / (1.0 - s * s).sqrt();
        let reached = air * tangent(sine) + through_glass * tangent(sine / ior);
        if reached < across {
            low = sine
        } else {
            high = sine
        }
    }
    low as f32
}

/// What becomes of a ray in a plane through the centre of a ball of radius 1, reflected inside or not: where it leaves,
/// and in which direction, by the laws of refraction and reflection.
fn through_ball(from: Vec3, wi: Vec3, index: f32, inside: Inside) -> Option<(Vec3, Vec3)> {
    let refract = |d: Vec3, n: Vec3, eta: f32| {
        let cos = -d.dot(n);
        let squared = 1.0 - eta * eta * (1.0 - cos * cos);
        (squared > 0.0).then(|| d * eta + n * (eta * cos - squared.sqrt()))
    };
    let along = -from.dot(wi);
    let half = (1.0 - from.length_squared() + along * along)
        .max(0.0)
        .sqrt();
    let meets = half > 0.0 && along > half;
    if !meets {
        return None;
    }
    let into = from + wi * (along - half);
    let opposite = |p: Vec3, d: Vec3| p - d * (2.0 * p.dot(d));
    let mut d = refract(wi, into, 1.0 / index)?.normalize();
    let mut out = opposite(into, d);
    if inside == Inside::Reflected {
        d -= out * (2.0 * d.dot(out));
        out = opposite(out, d);
    }
    Some((out, refract(d, -out, index)?.normalize()))
}

/// The ways through a ball are those that a search finds, each in its branch; the walks there arrive on a mesh, too, with
/// 𝒢 as by a numeric derivative.
#[test]
fn ways_through_a_ball() {
    // How often there is each part, at least.
    let counts = ways_that(Inside::Passes, (1.5, 3.0), ([30, 15, 200], 100));
    assert!(counts[1] > 50 && counts[3] > 10, "{counts:?}");
    ways_that(Inside::Reflected, (1.5, 3.0), ([200, 3, 0], 80));
    ways_that(Inside::Reflected, (1.8, 10.0), ([80, 30, 10], 50));
}

/// Of a ball with this index, from so far away at most; at least so many ways of each part, and compared with numeric
/// derivatives. How often there are so many ways.
fn ways_that(
    inside: Inside,
    (index, far): (f32, f32),
    (least, least_compared): ([u32; 3], u32),
) -> [u32; 4] {
    let scene = ball(glass(index), 5, true);
    let tracer = tracer(&scene);
    let reflector = scene.reflectors.balls()[0].0;
    let ball = *scene.reflectors.ball(reflector).unwrap();
    assert!(ball.sphere.centre.length() < 1e-4 && (ball.sphere.radius - 1.0).abs() < 1e-4);
    let mut rng = Rng(5);
    let mut place = |near: f32, far: f32| rng.unit_vector() * (near + (far - near) * rng.next());
    let (mut counts, mut parts) = ([0; 4], [0; 3]);
    let (mut walks, mut arrived, mut compared, mut equal) = (0, 0, 0, 0);
    for round in 0..600 {
        let from = place(1.02, far);
        // Mostly about where rays meet.
        let to = if round % 3 == 0 {
            place(1.02, 4.0)
        } else {
            let ahead = match inside {
                Inside::Passes => -from.normalize(),
                Inside::Reflected => from.normalize(),
            };
            (place(0.0, 0.5) + ahead).normalize() * (1.05 + 3.0 * (round % 7) as f32)
        };
        let target = beside_ball(to, round % 3);
        // By how much rays in the plane miss it, from one side of the ball to the other.
        let axis = -from.normalize();
        let across = target.towards(Vec3::ZERO);
        let Some(across) = (across - axis * axis.dot(across)).try_normalize() else {
            continue;
        };
        let widest = 1.0 / from.length();
        let direction = |p: f32| {
            let sine = p * widest;
            axis * (1.0 - sine * sine).sqrt() + across * sine
        };
        let miss = |p: f32| {
            let (out, d) = through_ball(from, direction(p), index, inside)?;
            let there = target.towards(out).normalize();
            Some((d.dot(there), d.cross(there).dot(axis.cross(across))))
        };
        const STEPS: i32 = 4000;
        let at = |i: i32| i as f32 / STEPS as f32 * 0.99999;
        let mut found: Vec<f32> = Vec::new();
        for i in -STEPS..STEPS {
            if let (Some((_, a)), Some((cos, b))) = (miss(at(i)), miss(at(i + 1)))
                && a * b <= 0.0
                && cos > 0.0
            {
                found.push(0.5 * (at(i) + at(i + 1)));
            }
        }
        // Ways that begin or end to be there may be found or not.
        let apart = found.windows(2).all(|w| w[1] - w[0] > 0.05);
        let away = found.iter().all(|p| (0.01..0.95).contains(&p.abs()));
        if !apart || !away {
            continue;
        }
        counts[found.len()] += 1;
        let guesses = Branch::ALL.map(|branch| ball.guess(branch, from, &target));
        let probabilities = {
            let targets = Targets::gather(|_| Some(target));
            ball.probabilities(Vec3x8::splat(from), &targets, true, f32x8::ZERO)
        };
        let of_kind = guesses.iter().zip(Branch::ALL);
        let of_kind = of_kind.filter(|(_, branch)| branch.inside == inside);
        let is_inside = |wi: &&Vec3| axis.cross(**wi).length() < 0.95 * widest;
        let there = of_kind.filter_map(|(guess, _)| guess.as_ref());
        let there = there.filter(is_inside).count();
        assert_eq!(
            there,
            found.len(),
            "{from} {target:?}: {found:?} {guesses:?}"
        );
        for &p in &found {
            let branch = ball.branch(inside, from, direction(p), &target);
            parts[branch.part as usize] += 1;
            let guess = guesses[branch.number()].unwrap();
            assert!(
                guess.distance(direction(p)) < 3e-3,
                "{branch:?} {p} {guess}"
            );
            assert_eq!(probabilities[branch.number()].lane(0), 1.0);
            walks += 1;
            let through = Through::Ball(reflector, branch);
            let Ok(link) = walk((&scene, &*tracer), from, target, through) else {
                continue;
            };
            arrived += 1;
            assert!(link.vertices == branch.vertices() && link.wi.distance(guess) < 0.05);
            let numeric = numeric_geometry((&scene, &*tracer), from, target, through, 4e-3);
            if let Some(numeric) = numeric.filter(|n| (0.01..3.0).contains(n)) {
                let ratio = link.geometry / numeric;
                // Facets bend 𝒢 from one to the next.
                compared += 1;
                equal += u32::from((ratio - 1.0).abs() < 0.1);
            }
        }
    }
    println!("{inside:?}: {counts:?} {parts:?} {walks} {arrived} {compared} {equal}");
    assert!(parts.iter().zip(least).all(|(&n, least)| n >= least));
    assert!(f64::from(arrived) > 0.95 * f64::from(walks));
    assert!(compared > least_compared && f64::from(equal) > 0.9 * f64::from(compared));
    counts
}

/// What passes a ball is no plain passage; what passes thin shells is.
#[test]
fn passages() {
    let scene = ball(glass(1.5), 4, true);
    let tracer = tracer(&scene);
    let target = point(Vec3::new(0.1, 0.0, 3.0), Vec3::NEG_Z);
    let link = walk(
        (&scene, &*tracer),
        Vec3::new(0.0, 0.2, -3.0),
        target,
        Through::Passage,
    );
    assert!(link.is_err());

    // A thin shell, however curved, bends nothing: an open one, as closed ones are bodies.
    let dome = |u: f32, v: f32| Vec3::new(v.sin() * u.cos(), v.sin() * u.sin(), v.cos()).to_array();
    let mut patches = Vec::new();
    for (i, j) in (0..12).flat_map(|i| (0..6).map(move |j| (i as f32, j as f32))) {
        let corner = |i: f32, j: f32| dome(i * std::f32::consts::TAU / 12.0, 0.02 + j * 0.25);
        patches.push([
            corner(i, j),
            corner(i, j + 1.0),
            corner(i + 1.0, j + 1.0),
            corner(i + 1.0, j),
        ]);
    }
    let patches: Vec<_> = patches.iter().map(|p| (&p[..], 0)).collect();
    let scene = polygons(&patches, vec![glass(1.5)], &settings());
    let tracer = crate::common::tracer(&scene);
    let (from, to) = (Vec3::new(0.1, 0.2, 0.0), Vec3::new(0.3, -0.1, 3.0));
    let link = walk(
        (&scene, &*tracer),
        from,
        point(to, Vec3::NEG_Z),
        Through::Passage,
    )
    .unwrap();
    assert!(link.wi.distance((to - from).normalize()) < 1e-6 && link.free);
    let way = to - from;
    let expected = way.normalize().z / way.length_squared();
    assert!((link.geometry / expected - 1.0).abs() < 1e-4);
}

/// Reflectors are what they are: connected, planes merged, relief and rough ones left out.
#[test]
fn reflectors_are_found() {
    let (floor, wall) = (
        square(Vec3::ZERO, Vec3::Y, 8.0),
        square(Vec3::ZERO, Vec3::X, 8.0),
    );
    let rough = MtlMaterial {
        pr: Some(0.5),
        ..mirror()
    };
    let scene = polygons(
        &[(&floor, 0), (&wall, 1)],
        vec![mirror(), rough],
        &settings(),
    );
    let list = scene.reflectors.list();
    assert_eq!(list.len(), 1);
    assert!(list[0].triangles == 2 && (list[0].area - 256.0).abs() < 1e-2);

    let round = ball(mirror(), 3, true);
    assert_eq!(round.reflectors.list().len(), 1);
    assert!(matches!(&round.reflectors.list()[0].form, Form::Curved(_)));
    let faceted = ball(mirror(), 1, false);
    assert!(faceted.reflectors.list().len() > 8);
}

/// How often reflectors are chosen is what their probabilities say, which add to at most 1.
#[test]
fn choices_have_their_probabilities() {
    let scene = shipped("mirrors", 8, 8);
    let mut rng = Rng(3);
    let mut chosen_pairs = 0;
    for _ in 0..300 {
        let mut inside = || {
            Vec3::new(
                rng.next() * 1.9 - 0.95,
                rng.next() * 1.9 + 0.05,
                rng.next() * 1.9 - 0.95,
            )
        };
        let (from, to) = (inside(), inside());
        let target = point(to, Vec3::NEG_Y);
        let from = Vec3x8::splat(from);
        let targets = Targets::gather(|_| Some(target));
        for always in [false, true] {
            let mut counts: Vec<(Sequence, f32, f32)> = Vec::new();
            const STEPS: usize = 64;
            for step in 0..STEPS {
                let u = f32x8::from_lanes(|lane| (8 * step + lane) as f32 / (8 * STEPS) as f32);
                let choice = scene.reflectors.choose(from, &targets, 255, u, always);
                let again = scene
                    .reflectors
                    .probability(&choice.by, from, &targets, always);
                for lane in 0..8 {
                    let Some(by) = choice.by[lane] else { continue };
                    let p = choice.probability.lane(lane);
                    assert_eq!(p, again.lane(lane));
                    match counts.iter_mut().find(|c| c.0 == by) {
                        Some(count) => count.2 += 1.0,
                        None => counts.push((by, p, 1.0)),
                    }
                }
            }
            let total: f32 = counts.iter().map(|c| c.1).sum();
            assert!(
                total < 1.0001 && !(always && !counts.is_empty() && total < 0.99),
                "{total}"
            );
            for (by, p, count) in counts {
                chosen_pairs += usize::from(by.numbers().len() == 2);
                assert!((count / (8 * STEPS) as f32 - p).abs() < 4e-3, "{by:?}: {p}");
            }
        }
    }
    assert!(chosen_pairs > 0);
}
