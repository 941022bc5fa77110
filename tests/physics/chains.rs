//! Scenes that are hard for walks through mirrors and glass: what they bring is what light and BSDF sampling bring.
//!
//! Significance as in `gradients`.

use crate::common::{self, Ball, Rng, glass, lambert, level, light, mirror, sphere, tracer};
use crate::gradients::{SIZE, check, reference_at};
use gdpt::gradient::Weights;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::sidecar::CameraTable;
use gdpt::scene::{Scene, SceneSettings};
use glam::Vec3;

const FLOOR: usize = 0;
const LAMP: usize = 1;
const MIRROR: usize = 2;
const GLASS: usize = 3;
const BOARD: usize = 4;

/// A scene of these polygons and balls on a floor, below a lamp of half this width, seen from the front.
fn scene(polygons: &[(Vec<[f32; 3]>, usize)], balls: &[Ball], lamp: f32) -> Scene {
    let (floor, mut lamp) = (level(0.0, 2.0), level(1.6, lamp));
    lamp.reverse();
    let mut all: Vec<(&[[f32; 3]], usize)> = vec![(&floor, FLOOR), (&lamp, LAMP)];
    all.extend(polygons.iter().map(|(corners, m)| (&corners[..], *m)));
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.1, 0.8, 2.6]),
            target: Some([0.0, 0.3, 0.0]),
            fov: Some(45.0),
            ..Default::default()
        },
        size: (SIZE, SIZE),
        environment: Default::default(),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    // Glossy, with holes as fine as threads.
    let board = MtlMaterial {
        kd: Some([0.5, 0.3, 0.2]),
        ks: Some([0.04; 3]),
        pr: Some(0.5),
        opacity: Some(0.4),
        ..Default::default()
    };
    common::polygons_and_balls(
        &all,
        balls,
        vec![lambert(0.6), light(3.0), mirror(), glass(1.5), board],
        &settings,
    )
}

/// Gradients of both weights, and their picture, against path tracing without walks.
fn agrees(name: &str, polygons: &[(Vec<[f32; 3]>, usize)]) {
    agrees_in(name, &scene(polygons, &[], 0.6), 64);
}

/// See [`agrees`]; with so many samples by path tracing.
fn agrees_in(name: &str, scene: &Scene, spp: u64) {
    assert!(!scene.reflectors.list().is_empty(), "{name}");
    let tracer = tracer(scene);
    let reference = reference_at(spp, scene, &*tracer);
    for weights in [Weights::Mis, Weights::Symmetric] {
        check(name, weights, scene, &*tracer, &reference);
    }
}

/// An upright rectangle that looks along `normal`, which is level.
fn upright(foot: Vec3, normal: Vec3, half: f32, height: f32) -> Vec<[f32; 3]> {
    let along = Vec3::Y.cross(normal) * half;
    let up = Vec3::Y * height;
    [
        foot - along,
        foot + along,
        foot + along + up,
        foot - along + up,
    ]
    .map(|p| p.to_array())
    .to_vec()
}

fn ball(centre: Vec3, radius: f32, level: u32) -> impl Iterator<Item = (Vec<[f32; 3]>, usize)> {
    sphere(level).into_iter().map(move |corners| {
        let corners = corners.map(|p| (centre + p * radius).to_array());
        (corners.to_vec(), MIRROR)
    })
}

/// More reflectors than pairs of them are made of, in a grid, with planes among them.
#[test]
fn balls_between_facing_mirrors() {
    let mut rng = Rng(7);
    let mut all = vec![
        (
            upright(Vec3::new(-1.2, 0.0, 0.0), Vec3::X, 1.2, 1.0),
            MIRROR,
        ),
        (
            upright(Vec3::new(1.2, 0.0, 0.0), Vec3::NEG_X, 1.2, 1.0),
            MIRROR,
        ),
    ];
    for n in 0..20 {
        let place = Vec3::new(
            -0.95 + 0.475 * (n % 5) as f32,
            0.1 + 0.1 * rng.next(),
            -0.8 + 0.5 * (n / 5) as f32 + 0.2 * rng.next(),
        );
        all.extend(ball(place, 0.1, 1));
    }
    agrees("balls between mirrors", &all);
}

/// Facets whose images of the lamp are close to one another: each is another chain.
#[test]
fn finely_faceted_mirror() {
    let all: Vec<_> = ball(Vec3::new(0.0, 0.35, -0.2), 0.35, 4).collect();
    agrees("faceted ball", &all);
}

/// What spreads light and lets some pass straight ends a chain.
#[test]
fn holes_behind_glass() {
    let pane = |z: f32, normal: Vec3| (upright(Vec3::new(0.0, 0.02, z), normal, 0.7, 0.9), GLASS);
    let all = vec![
        pane(0.5, Vec3::Z),
        pane(0.44, Vec3::NEG_Z),
        (upright(Vec3::new(0.0, 0.0, 0.2), Vec3::Z, 0.6, 0.7), BOARD),
        (
            upright(Vec3::new(0.3, 0.0, 1.0), Vec3::NEG_X, 0.5, 0.6),
            MIRROR,
        ),
    ];
    agrees("holes behind glass", &all);
}

/// Two balls of glass that touch, one of them in the floor, beside an egg of glass, which is no ball: walks go through
/// the balls by up to three ways, and copies of half vectors lead from one body to another.
#[test]
fn balls_of_glass() {
    let ball = |x: f32, y: f32, z: f32, radii: Vec3| Ball {
        centre: Vec3::new(x, y, z),
        radii,
        level: 3,
        smooth: true,
        material: GLASS,
    };
    let balls = [
        ball(-0.3, 0.2, 0.0, Vec3::splat(0.3)),
        ball(0.25, 0.45, 0.05, Vec3::splat(0.27)),
        ball(0.65, 0.3, 0.3, Vec3::new(0.15, 0.3, 0.15)),
    ];
    let scene = scene(&[], &balls, 0.5);
    assert_eq!(scene.reflectors.balls().len(), 2);
    agrees_in("balls of glass", &scene, 512);
}
