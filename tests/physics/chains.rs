//! Scenes that are hard for walks through mirrors and glass: what they bring is what light and BSDF sampling bring.
//!
//! Significance as in `gradients`.

use crate::common::{
    self, Ball, Render, Rng, glass, lambert, level, light, mirror, sphere, tracer,
};
use crate::gradients::{SIZE, check, check_walks, reference_at, reference_of};
use gdpt::gradient::Weights;
use gdpt::load::lights::PunctualLight;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::sidecar::CameraTable;
use gdpt::path::{Manifold, Shares};
use gdpt::scene::{EnvironmentSetting, EnvironmentSource, Scene, SceneSettings};
use glam::Vec3;

const FLOOR: usize = 0;
const LAMP: usize = 1;
const MIRROR: usize = 2;
const GLASS: usize = 3;
const BOARD: usize = 4;
const METAL: usize = 5;
const FROSTED: usize = 6;
const SATIN: usize = 7;

/// A scene of these polygons and balls on a floor, below a lamp of half this width, seen from the front.
fn scene(polygons: &[(Vec<[f32; 3]>, usize)], balls: &[Ball], lamp: f32) -> Scene {
    let (floor, mut lamp) = (level(0.0, 2.0), level(1.6, lamp));
    lamp.reverse();
    let mut all = vec![(floor.to_vec(), FLOOR), (lamp.to_vec(), LAMP)];
    all.extend_from_slice(polygons);
    scene_of(&all, balls, [0.1, 0.8, 2.6], [0.0, 0.3, 0.0])
}

/// Of these alone, seen from `origin` towards `target`.
fn scene_of(
    polygons: &[(Vec<[f32; 3]>, usize)],
    balls: &[Ball],
    origin: [f32; 3],
    target: [f32; 3],
) -> Scene {
    let settings = SceneSettings::default();
    scene_with(polygons, balls, (origin, target), settings)
}

/// With these settings, camera and size aside.
fn scene_with(
    polygons: &[(Vec<[f32; 3]>, usize)],
    balls: &[Ball],
    (origin, target): ([f32; 3], [f32; 3]),
    settings: SceneSettings,
) -> Scene {
    let all: Vec<_> = polygons.iter().map(|(c, m)| (&c[..], *m)).collect();
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some(origin),
            target: Some(target),
            fov: Some(45.0),
            ..Default::default()
        },
        size: (SIZE, SIZE),
        ..settings
    };
    // Glossy, with holes as fine as threads.
    let board = MtlMaterial {
        kd: Some([0.5, 0.3, 0.2]),
        ks: Some([0.04; 3]),
        pr: Some(0.5),
        opacity: Some(0.4),
        ..Default::default()
    };
    let metal = MtlMaterial {
        pr: Some(0.09),
        ..mirror()
    };
    let satin = MtlMaterial {
        pr: Some(0.35),
        ..mirror()
    };
    let frosted = MtlMaterial {
        pr: Some(0.15),
        ..glass(1.5)
    };
    common::polygons_and_balls(
        &all,
        balls,
        vec![
            lambert(0.6),
            light(3.0),
            mirror(),
            glass(1.5),
            board,
            metal,
            frosted,
            satin,
        ],
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
    check_walks(name, scene, &*tracer, &reference);
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

/// A ball of glass that sends light back to a wall where none comes otherwise: five sixths of it are reflected inside.
#[test]
fn light_that_a_ball_sends_back() {
    let ball = Ball {
        centre: Vec3::new(0.0, 0.5, 0.4),
        radii: Vec3::splat(0.3),
        level: 4,
        smooth: true,
        material: GLASS,
    };
    let wall = upright(Vec3::new(0.0, -0.5, -1.0), Vec3::Z, 1.5, 2.0);
    let lamp = upright(Vec3::new(0.0, 0.3, -0.6), Vec3::Z, 0.16, 0.4);
    // Seen from behind the lamp: of what is bright there is nothing.
    let all = [(wall, FLOOR), (lamp, LAMP)];
    let scene = scene_of(&all, &[ball], [0.9, 0.5, -0.65], [-0.5, 0.5, -1.0]);
    agrees_in("light sent back", &scene, 512);
}

/// A wall lit round a corner, by metal alone that is nearly smooth: by a ball of it, and by a plate, half of which is
/// behind glass; between its stripes are such of glass that is as rough, by which no walk leads. A mirror beside them: by
/// both together none leads either.
#[test]
fn light_of_nearly_smooth_metal() {
    let ball = Ball {
        centre: Vec3::new(0.1, 0.3, 0.4),
        radii: Vec3::splat(0.25),
        level: 4,
        smooth: true,
        material: METAL,
    };
    let to_wall = |x: f32| Vec3::new(x, 0.0, -1.0).normalize();
    let stripes = (0..10).map(|n| {
        let along = Vec3::new(-1.0, 0.0, 1.0).normalize() * (0.06 * n as f32 - 0.27);
        let foot = Vec3::new(0.7, 0.3, 0.4) + along;
        let material = if n % 2 == 0 { METAL } else { FROSTED };
        (upright(foot, to_wall(-1.0), 0.03, 0.7), material)
    });
    let mut all = vec![
        (
            upright(Vec3::new(0.0, -0.5, -1.0), Vec3::Z, 2.0, 2.0),
            FLOOR,
        ),
        (
            upright(Vec3::new(-0.7, -0.5, -0.2), Vec3::Z, 0.7, 2.0),
            FLOOR,
        ),
        (upright(Vec3::new(-1.2, 0.3, 0.3), Vec3::X, 0.16, 0.4), LAMP),
        (upright(Vec3::new(0.7, 0.0, 0.0), Vec3::Z, 0.3, 0.5), GLASS),
        (
            upright(Vec3::new(1.2, 0.2, 0.1), to_wall(-0.8), 0.2, 0.6),
            MIRROR,
        ),
    ];
    all.extend(stripes);
    let settings = SceneSettings {
        roughness_threshold: 0.05,
        ..Default::default()
    };
    let camera = ([0.4, 0.5, -0.1], [0.5, 0.5, -1.0]);
    let scene = scene_with(&all, &[ball], camera, settings);
    let rough = scene.reflectors.list().iter().filter(|r| r.alpha > 0.0);
    assert_eq!(rough.count(), 6);
    agrees_in("nearly smooth metal", &scene, 512);
}

/// Metal and glass, nearly smooth and satin, seen directly, in one another and in a mirror, are as bright by copied half vectors, with
/// paths that are aimed at lights, as by light sampling and reconnection; by lamps, one of which is half hidden behind a board,
/// in a studio, and by a point.
#[test]
fn class_specular_is_as_bright_as_class_rough() {
    let ball = |x: f32, material: usize| Ball {
        centre: Vec3::new(x, 0.3, 0.1),
        radii: Vec3::splat(0.3),
        level: 3,
        smooth: true,
        material,
    };
    let mut lamp = level(1.6, 0.3);
    lamp.reverse();
    let things = vec![
        (level(0.0, 2.0).to_vec(), SATIN),
        (
            upright(Vec3::new(0.0, 0.0, -0.8), Vec3::Z, 1.0, 0.8),
            MIRROR,
        ),
        (upright(Vec3::new(-1.0, 0.0, 0.0), Vec3::X, 0.8, 0.8), FLOOR),
        (
            level(1.3, 0.2).map(|[x, y, z]| [x + 0.2, y, z]).to_vec(),
            FLOOR,
        ),
    ];
    let mut by_lamp = things.clone();
    by_lamp.push((lamp.to_vec(), LAMP));
    // Seen in the floor, one before the other.
    by_lamp.push((upright(Vec3::new(0.0, 0.1, -0.7), Vec3::Z, 0.5, 0.6), LAMP));
    by_lamp.push((upright(Vec3::new(0.1, 0.2, -0.5), Vec3::Z, 0.2, 0.3), LAMP));
    let studio = EnvironmentSetting {
        source: EnvironmentSource::Studio,
        ..Default::default()
    };
    // On rough surfaces too few samples would find what metal throws there.
    let shiny = things[..2].to_vec();
    let point = PunctualLight::Point {
        position: [0.3, 1.4, 0.8],
        intensity: [2.0; 3],
        cone: None,
    };
    for (name, polygons, environment, lights) in [
        ("lamp", by_lamp, EnvironmentSetting::default(), vec![]),
        ("studio", things, studio, vec![]),
        ("point", shiny, EnvironmentSetting::default(), vec![point]),
    ] {
        let [rough, specular] = [1e-4, 0.9].map(|roughness_threshold| {
            let settings = SceneSettings {
                environment: environment.clone(),
                lights: lights.clone(),
                roughness_threshold,
                ..Default::default()
            };
            let balls = [ball(-0.4, METAL), ball(0.4, FROSTED)];
            let camera = ([0.1, 0.8, 2.6], [0.0, 0.3, 0.0]);
            scene_with(&polygons, &balls, camera, settings)
        });
        let reference = reference_at(256, &rough, &*tracer(&rough));
        let tracer = tracer(&specular);
        for weights in [Weights::Mis, Weights::Symmetric] {
            check(name, weights, &specular, &*tracer, &reference);
        }
        check_walks(name, &specular, &*tracer, &reference);
    }
}

/// A floor that balls of metal and of glass, both nearly smooth, light up for a point: walks lead there by metal, by glass none
/// do, and offset paths lead from one ball to the other. BSDF sampling finds no point, so walks are part of the reference.
#[test]
fn points_by_metal_beside_glass() {
    let ball = |x: f32, material: usize| Ball {
        centre: Vec3::new(x, 0.35, 0.0),
        radii: Vec3::splat(0.3),
        level: 3,
        smooth: true,
        material,
    };
    let balls = [ball(-0.3, METAL), ball(0.3, FROSTED)];
    let point = PunctualLight::Point {
        position: [0.0, 0.6, 0.8],
        intensity: [1.0; 3],
        cone: None,
    };
    let settings = SceneSettings {
        lights: vec![point],
        roughness_threshold: 0.05,
        ..Default::default()
    };
    // What light from the point alone does not reach.
    let floor = (level(0.0, 2.0).to_vec(), FLOOR);
    let board = (upright(Vec3::new(0.0, 0.0, 0.5), Vec3::Z, 0.8, 0.3), FLOOR);
    let camera = ([0.1, 1.8, 1.6], [0.0, 0.0, 0.2]);
    let scene = scene_with(&[floor, board], &balls, camera, settings);
    let tracer = tracer(&scene);
    let walked = Render {
        spp: 256,
        manifold: Manifold::Always,
        ..Render::default()
    };
    let reference = reference_of(walked, &scene, &*tracer);
    for weights in [Weights::Mis, Weights::Symmetric] {
        check("points", weights, &scene, &*tracer, &reference);
    }
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

/// A body of glass with these corners below and above, seen from above in the order that makes its sides look outwards.
fn prism(corners: &[[f32; 2]], low: f32, high: f32) -> Vec<(Vec<[f32; 3]>, usize)> {
    let at = |&[x, z]: &[f32; 2], y: f32| [x, y, z];
    let level = |y: f32| corners.iter().map(move |c| at(c, y));
    let mut faces = vec![level(high).collect(), level(low).rev().collect()];
    for (n, a) in corners.iter().enumerate() {
        let b = &corners[(n + 1) % corners.len()];
        faces.push(vec![at(a, low), at(b, low), at(b, high), at(a, high)]);
    }
    faces.into_iter().map(|face| (face, GLASS)).collect()
}

/// A large prism over the floor, much of whose light is totally reflected inside.
fn under_a_prism() -> Scene {
    let faces = common::wedge([-0.9, 0.9], [0.15, 1.0], [0.6, -0.6]);
    let all = faces.map(|face| (face, GLASS));
    scene(&all, &[], 0.8)
}

/// Light through a prism: a half of the ways no walk finds, and they copy half vectors beside those that one finds.
#[test]
fn light_through_a_prism() {
    agrees_in("prism", &under_a_prism(), 256);
}

/// Walks are made where they pay: through a window before a far lamp, not under a prism, below a wide lamp; whatever
/// the number of threads.
#[test]
fn walks_are_made_as_often_as_they_pay() {
    let learn = |scene: &Scene| {
        let tracer = tracer(scene);
        let settings = Render::default().settings();
        let [one, three] = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().unwrap();
            pool.install(|| Shares::learn(scene, &*tracer, &settings))
        });
        assert_eq!(one, three);
        one
    };
    let [window, prism] = [common::shipped("pane", 96, 96), under_a_prism()];
    assert!(learn(&window).passages >= 0.5);
    assert!(learn(&prism).passages <= 0.25);
    let nothing = common::shipped("cornell", 96, 96);
    assert_eq!(learn(&nothing), Shares::default());
}

/// Chains that are reflected and pass, in any order: inside a slab, a prism and a block, by a mirror behind glass, and
/// beside an egg of glass, where copies of half vectors lead from what walks find to what they do not.
#[test]
fn glass_that_reflects_inside() {
    let mut all = prism(
        &[[-0.7, 0.5], [0.1, 0.5], [0.1, 0.42], [-0.7, 0.42]],
        0.05,
        0.7,
    );
    all.extend(prism(&[[0.3, 0.7], [0.8, 0.5], [0.5, 0.3]], 0.0, 0.4));
    all.extend(prism(
        &[[-0.3, 0.2], [0.2, 0.2], [0.2, -0.3], [-0.3, -0.3]],
        0.1,
        0.45,
    ));
    all.push((
        upright(Vec3::new(-0.2, 0.0, -0.5), Vec3::Z, 0.8, 0.9),
        MIRROR,
    ));
    let egg = Ball {
        centre: Vec3::new(0.5, 0.35, -0.1),
        radii: Vec3::new(0.15, 0.3, 0.15),
        level: 3,
        smooth: true,
        material: GLASS,
    };
    let scene = scene(&all, &[egg], 0.5);
    agrees_in("glass that reflects inside", &scene, 256);
}

/// A block of glass in the open, under a lamp and before a wall: its sides and faces reflect inside, once and more often.
#[test]
fn a_block_of_glass() {
    let corners = [[-0.4, 0.3], [0.5, 0.1], [0.45, -0.125], [-0.45, 0.075]];
    let mut all = prism(&corners, 0.02, 0.5);
    all.push((upright(Vec3::new(0.0, 0.0, -0.5), Vec3::Z, 0.8, 0.9), FLOOR));
    agrees_in("a block of glass", &scene(&all, &[], 0.4), 512);
}

/// A window of solid glass in a frame that hides its edges, before a lamp, and a cube of glass below another: beside frames
/// light is seen through glass alone, and sides of glass send it where nothing else does.
#[test]
fn windows_in_frames() {
    let mut all = prism(
        &[[0.62, 0.3], [0.7, 0.3], [0.7, -0.3], [0.62, -0.3]],
        0.2,
        0.8,
    );
    let wall = |z: [f32; 2], y: [f32; 2]| {
        let at = |y: f32, z: f32| [0.6, y, z];
        let corners = vec![
            at(y[0], z[0]),
            at(y[0], z[1]),
            at(y[1], z[1]),
            at(y[1], z[0]),
        ];
        (corners, FLOOR)
    };
    all.extend([
        wall([-1.0, 1.0], [0.0, 0.2]),
        wall([-1.0, 1.0], [0.8, 1.3]),
        wall([-1.0, -0.3], [0.2, 0.8]),
        wall([0.3, 1.0], [0.2, 0.8]),
    ]);
    let outside = Vec3::new(1.4, 0.5, 0.0);
    all.push((upright(outside, Vec3::NEG_X, 0.3, 0.5), LAMP));
    all.extend(prism(
        &[[-0.7, 0.4], [-0.3, 0.4], [-0.3, 0.0], [-0.7, 0.0]],
        0.05,
        0.45,
    ));
    agrees_in("windows in frames", &scene(&all, &[], 0.3), 512);
}
