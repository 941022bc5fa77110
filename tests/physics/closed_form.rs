//! Scenes whose pictures are known exactly. Significance: each test compares means over 32 seeds with
//! exact values, and fails by chance with probability 1e-5; seeds are fixed.

use crate::common::{self, Mean, Render, lambert, largest_z, light, polygons, shipped, tracer};
use gdpt::image::Image;
use gdpt::load::lights::{Cone, PunctualLight};
use gdpt::load::{mtl::MtlMaterial, sidecar::CameraTable};
use gdpt::reconstruct::{Problem, l2};
use gdpt::render::Method;
use gdpt::scene::{Scene, SceneSettings};
use glam::{Vec2, Vec3};

const SEEDS: u64 = 32;
const SIGNIFICANCE: f64 = 1e-5;

/// A camera above the origin that looks down, with x to the right and -z upwards.
fn looking_down(height: f32, fov: f32, size: usize) -> SceneSettings {
    SceneSettings {
        camera: CameraTable {
            origin: Some([0.0, height, 0.0]),
            target: Some([0.0; 3]),
            up: Some([0.0, 0.0, -1.0].into()),
            fov: Some(fov),
            ..Default::default()
        },
        size: (size as u32, size as u32),
        environment: Vec3::ZERO.into(),
        roughness_threshold: 0.05,
        ..Default::default()
    }
}

/// Compares the mean picture (green), by path tracing and by L2 reconstruction, with the exact value
/// of every pixel. `rounding` is allowed on top.
fn check(
    what: &str,
    scene: &Scene,
    depth: u32,
    spp: u64,
    rounding: f64,
    exact: impl Fn(usize, usize) -> f64,
) {
    let tracer = tracer(scene);
    for method in [Method::Pt, Method::Gpt] {
        let mut means: Vec<Mean> = Vec::new();
        for seed in 0..SEEDS {
            let film = Render {
                method,
                spp,
                seed,
                depth,
                ..Render::default()
            }
            .film(scene, &*tracer);
            let e = film.estimate(gdpt::film::Halves::Both);
            let picture: Image = match method {
                Method::Pt => e.primal,
                Method::Gpt => l2::solve(
                    &Problem {
                        primal: &e.primal,
                        dx: &e.dx,
                        dy: &e.dy,
                    },
                    0.2,
                ),
            };
            let picture = picture.plus(&film.direct(gdpt::film::Halves::Both));
            means.resize(picture.width * picture.height, Mean::default());
            means
                .iter_mut()
                .zip(&picture.channels[1])
                .for_each(|(m, &v)| m.add(f64::from(v)));
        }
        let width = scene.camera.width as usize;
        let limit = largest_z(means.len(), SEEDS as usize, SIGNIFICANCE);
        for (i, m) in means.iter().enumerate() {
            let want = exact(i % width, i / width);
            let allowed = limit * m.variance().sqrt() + rounding;
            let error = (m.mean() - want).abs();
            assert!(
                error <= allowed,
                "{what}, {method:?}, pixel {i}: {} instead of {want}, allowed {allowed:.1e}",
                m.mean()
            );
        }
    }
}

/// Form factor from a surface element at the origin with normal z to the rectangle with corners
/// (0, 0, h) and (x, y, h), facing it.
fn corner_form_factor(x: f64, y: f64, h: f64) -> f64 {
    let (x, y) = (x / h, y / h);
    let side = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    (side(x, y) + side(y, x)) / std::f64::consts::TAU
}

/// The same for the rectangle from `low` to `high` at height `h`, seen from the point `p`.
fn form_factor(p: glam::DVec2, low: Vec2, high: Vec2, h: f64) -> f64 {
    let f = |x: f32, y: f32| corner_form_factor(f64::from(x) - p.x, f64::from(y) - p.y, h);
    f(high.x, high.y) - f(low.x, high.y) - f(high.x, low.y) + f(low.x, low.y)
}

/// The mean over a pixel (by a 4 x 4 grid) of a function of the point on the plane y = 0 that a camera
/// at height 2 sees, which looks down with x to the right and -z upwards.
fn pixel_mean(size: usize, fov: f32, at: (usize, usize), f: impl Fn(glam::DVec2) -> f64) -> f64 {
    let half = 2.0 * f64::from(0.5 * fov).to_radians().tan();
    let mut sum = 0.0;
    for k in 0..16 {
        let pixel = |i: usize, k: usize| (i as f64 + (k as f64 + 0.5) / 4.0) / size as f64;
        let p = glam::DVec2::new(pixel(at.0, k % 4), pixel(at.1, k / 4)) * 2.0 - 1.0;
        sum += f(p * half) / 16.0;
    }
    sum
}

const FLOOR: &[[f32; 3]] = &[
    [-9.0, 0.0, 9.0],
    [9.0, 0.0, 9.0],
    [9.0, 0.0, -9.0],
    [-9.0, 0.0, -9.0],
];

/// A rectangle of height 1, beside the picture, so that the camera looks past it.
const LOW: Vec2 = Vec2::new(1.2, -0.5);
const HIGH: Vec2 = Vec2::new(2.2, 0.7);
const LAMP: &[[f32; 3]] = &[
    [LOW.x, 1.0, LOW.y],
    [HIGH.x, 1.0, LOW.y],
    [HIGH.x, 1.0, HIGH.y],
    [LOW.x, 1.0, HIGH.y],
];

/// A rectangle of radiance 3 at height 1 over a floor of reflectance 0.5: L = ρ · 3 · F.
#[test]
fn direct_light_of_a_rectangle_on_a_plane() {
    let (fov, size) = (40.0, 12);
    let s = looking_down(2.0, fov, size);
    let scene = polygons(&[(FLOOR, 0), (LAMP, 1)], vec![lambert(0.5), light(3.0)], &s);
    check("rectangle", &scene, 2, 64, 1e-4, |x, y| {
        pixel_mean(size, fov, (x, y), |p| {
            0.5 * 3.0 * form_factor(p, LOW, HIGH, 1.0)
        })
    });
}

/// A closed box of side 2 around the floor. All other sides emit 1: the floor's form factors to them
/// add to 1, so its radiance is its reflectance.
#[test]
fn form_factors_of_an_enclosed_box_add_to_one() {
    let (scene, size, _) = enclosed([true; 5]);
    check("closed box", &scene, 2, 16, 1e-4, |x, y| {
        assert!(x < size && y < size);
        0.6
    });
}

/// The same box with the ceiling alone emitting, on its far half.
#[test]
fn form_factor_of_the_ceiling_of_an_enclosed_box() {
    let (scene, size, fov) = enclosed([true, false, false, false, false]);
    let (low, high) = (Vec2::splat(-1.0), Vec2::splat(1.0));
    check("ceiling", &scene, 2, 64, 1e-4, |x, y| {
        pixel_mean(size, fov, (x, y), |p| 0.6 * form_factor(p, low, high, 2.0))
    });
}

/// A box of side 2 on a floor of reflectance 0.6; its ceiling, left, right, front and back sides emit
/// or are black. The camera sits just under the ceiling: height 2, seen from inside.
fn enclosed(emitting: [bool; 5]) -> (Scene, usize, f32) {
    let p = |x: f32, y: f32, z: f32| [x, y, z];
    let floor = [
        p(-1., 0., 1.),
        p(1., 0., 1.),
        p(1., 0., -1.),
        p(-1., 0., -1.),
    ];
    let sides = [
        [
            p(-1., 2., -1.),
            p(1., 2., -1.),
            p(1., 2., 1.),
            p(-1., 2., 1.),
        ],
        [
            p(-1., 0., 1.),
            p(-1., 0., -1.),
            p(-1., 2., -1.),
            p(-1., 2., 1.),
        ],
        [p(1., 0., -1.), p(1., 0., 1.), p(1., 2., 1.), p(1., 2., -1.)],
        [p(1., 0., 1.), p(-1., 0., 1.), p(-1., 2., 1.), p(1., 2., 1.)],
        [
            p(-1., 0., -1.),
            p(1., 0., -1.),
            p(1., 2., -1.),
            p(-1., 2., -1.),
        ],
    ];
    let mut all: Vec<(&[[f32; 3]], usize)> = vec![(&floor, 0)];
    all.extend(
        sides
            .iter()
            .zip(emitting)
            .map(|(s, on)| (s.as_slice(), if on { 1 } else { 2 })),
    );
    let (fov, size) = (40.0, 10);
    // Height 2 but for a hair: the form factors are those of the floor, wherever the camera is.
    let s = looking_down(1.99999, fov, size);
    (
        polygons(&all, vec![lambert(0.6), light(1.0), lambert(0.0)], &s),
        size,
        fov,
    )
}

/// The furnace: 1 everywhere but for paths longer than the depth.
#[test]
fn furnace() {
    let scene = shipped("furnace", 48, 24);
    check("furnace", &scene, 40, 64, 2e-4, |_, _| 1.0);
}

/// The same rectangle and floor, seen through a rough pane of index 1: as if it were not there.
#[test]
fn glass_of_index_one_is_invisible() {
    let pane = MtlMaterial {
        illum: Some(7),
        ni: Some(1.0),
        pr: Some(0.4),
        ..Default::default()
    };
    let sheet: &[[f32; 3]] = &[
        [-0.9, 1.5, 0.9],
        [0.9, 1.5, 0.9],
        [0.9, 1.5, -0.9],
        [-0.9, 1.5, -0.9],
    ];
    let (fov, size) = (40.0, 8);
    let s = looking_down(2.0, fov, size);
    let materials = vec![lambert(0.5), light(3.0), pane];
    let scene = polygons(&[(FLOOR, 0), (LAMP, 1), (sheet, 2)], materials, &s);
    // One segment more than without the pane.
    check("pane of index 1", &scene, 3, 64, 1e-4, |x, y| {
        pixel_mean(size, fov, (x, y), |p| {
            0.5 * 3.0 * form_factor(p, LOW, HIGH, 1.0)
        })
    });
}

/// What lights without extent give to the point `p` of the plane y = 0 of reflectance 0.5.
fn lit(lights: &[PunctualLight], p: glam::DVec2) -> f64 {
    let p = glam::DVec3::new(p.x, 0.0, p.y);
    let vector = |v: [f32; 3]| glam::DVec3::from(v.map(f64::from));
    let given = lights.iter().map(|light| match *light {
        PunctualLight::Directional {
            direction,
            irradiance,
        } => f64::from(irradiance[1]) * -vector(direction).normalize().y,
        PunctualLight::Point {
            position,
            intensity,
            cone,
        } => {
            let d = p - vector(position);
            let falloff = cone.map_or(1.0, |cone| {
                let [cutoff, beam] = [cone.cutoff_angle, cone.beam_width].map(f64::from);
                let angle = d.angle_between(vector(cone.direction)).to_degrees();
                ((cutoff - angle) / (cutoff - beam)).clamp(0.0, 1.0)
            });
            f64::from(intensity[1]) * falloff * -d.y / d.length().powi(3)
        }
    });
    0.5 / std::f64::consts::PI * given.sum::<f64>()
}

fn shining_at(position: [f32; 3], intensity: f32, cone: Option<Cone>) -> PunctualLight {
    PunctualLight::Point {
        position,
        intensity: [0.3, intensity, 0.0],
        cone,
    }
}

const CONE: Cone = Cone {
    direction: [-0.6, -1.0, 0.2],
    cutoff_angle: 50.0,
    beam_width: 10.0,
};

/// A point, a spot and a directional light, alone and together, over a floor.
#[test]
fn lights_without_extent_on_a_plane() {
    let point = shining_at([0.2, 0.7, 0.1], 2.0, None);
    let spot = shining_at([0.5, 1.1, -0.3], 3.0, Some(CONE));
    let sun = PunctualLight::Directional {
        direction: [1.0, -2.0, 0.5],
        irradiance: [1.0, 1.5, 0.0],
    };
    let (fov, size) = (40.0, 12);
    for lights in [vec![point], vec![spot], vec![sun], vec![point, sun, spot]] {
        let settings = SceneSettings {
            lights: lights.clone(),
            ..looking_down(2.0, fov, size)
        };
        let scene = polygons(&[(FLOOR, 0)], vec![lambert(0.5)], &settings);
        check("punctual", &scene, 3, 64, 3e-4, |x, y| {
            pixel_mean(size, fov, (x, y), |p| lit(&lights, p))
        });
    }
}

/// Beside a lamp with area, and among so many that they are chosen by place.
#[test]
fn lights_without_extent_beside_others() {
    let mut rng = common::Rng(3);
    let many: Vec<PunctualLight> = (0..70)
        .map(|_| {
            let position = [
                2.0 * rng.next() - 1.0,
                0.3 + rng.next(),
                2.0 * rng.next() - 1.0,
            ];
            let cone = (rng.next() < 0.5).then_some(CONE);
            shining_at(position, 0.02 + 0.1 * rng.next(), cone)
        })
        .collect();
    let (fov, size) = (40.0, 8);
    for lights in [many[..3].to_vec(), many] {
        let settings = SceneSettings {
            lights: lights.clone(),
            ..looking_down(2.0, fov, size)
        };
        let materials = vec![lambert(0.5), light(1.0)];
        let scene = polygons(&[(FLOOR, 0), (LAMP, 1)], materials, &settings);
        assert_eq!(scene.lights.depend_on_place(), lights.len() > 3);
        check("punctual, lamp", &scene, 2, 64, 1e-3, |x, y| {
            pixel_mean(size, fov, (x, y), |p| {
                lit(&lights, p) + 0.5 * form_factor(p, LOW, HIGH, 1.0)
            })
        });
    }
}

/// A mirror beside the floor shows the lights once more; walks alone find that light.
#[test]
fn lights_without_extent_in_a_mirror() {
    let wall: &[[f32; 3]] = &[
        [-1.5, 0.0, 9.0],
        [-1.5, 0.0, -9.0],
        [-1.5, 9.0, -9.0],
        [-1.5, 9.0, 9.0],
    ];
    let mirror = MtlMaterial {
        ks: Some([1.0; 3]),
        ..common::mirror()
    };
    let spot = |x: f32, across: f32| {
        let direction = [across, -1.0, 0.2];
        shining_at([x, 1.1, -0.3], 3.0, Some(Cone { direction, ..CONE }))
    };
    let sun = |across: f32| PunctualLight::Directional {
        direction: [across, -2.0, 0.5],
        irradiance: [1.0, 1.5, 0.0],
    };
    let (fov, size) = (40.0, 8);
    let settings = SceneSettings {
        lights: vec![spot(-0.9, -0.6), sun(-1.0)],
        ..looking_down(2.0, fov, size)
    };
    let scene = polygons(
        &[(FLOOR, 0), (wall, 1)],
        vec![lambert(0.5), mirror],
        &settings,
    );
    let all = [spot(-0.9, -0.6), spot(-2.1, 0.6), sun(-1.0), sun(1.0)];
    check("punctual, mirror", &scene, 3, 64, 1e-3, |x, y| {
        pixel_mean(size, fov, (x, y), |p| lit(&all, p))
    });
}

/// A pane of index 1 between them and the floor is as if it were not there: walks alone find that light.
#[test]
fn lights_without_extent_behind_a_pane() {
    let pane = common::glass(1.0);
    let sheet = common::level(0.5, 4.0);
    let lights = [
        shining_at([0.2, 0.9, 0.1], 2.0, Some(CONE)),
        PunctualLight::Directional {
            direction: [1.0, -2.0, 0.5],
            irradiance: [1.0, 1.5, 0.0],
        },
    ];
    let (fov, size) = (40.0, 8);
    let settings = SceneSettings {
        lights: lights.to_vec(),
        ..looking_down(2.0, fov, size)
    };
    let scene = polygons(
        &[(FLOOR, 0), (&sheet, 1)],
        vec![lambert(0.5), pane],
        &settings,
    );
    check("punctual, pane", &scene, 4, 64, 1e-3, |x, y| {
        pixel_mean(size, fov, (x, y), |p| lit(&lights, p))
    });
}
