//! The mean of dx and dy over many seeds is the finite difference of the path-traced image, region by
//! region, on every shipped scene, with both kinds of weights; so is the mean of the L2 picture.
//!
//! Significance: for each scene and kind of weights, all regions and channels together fail by chance
//! with probability 1e-4; seeds are fixed.

use crate::common::{self, Mean, Render, SCENES, differences, largest_z, shipped, tracer};
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::image::Image;
use gdpt::load::lights::{Cone, PunctualLight};
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::sidecar::{self, CameraTable};
use gdpt::path::Manifold;
use gdpt::reconstruct::{Problem, l2};
use gdpt::render::Method;
use gdpt::scene::Scene;
use gdpt::scene::framing::Framing;
use gdpt::trace::Traverse;
use glam::Vec3;
use std::path::Path;

pub(super) const SIZE: u32 = 32;
const REGION: usize = 8;
const SEEDS: u64 = 48;
const SIGNIFICANCE: f64 = 1e-4;

/// The mean of each region and channel.
fn regions(image: &Image) -> Vec<f64> {
    let mut out = Vec::new();
    for channel in &image.channels {
        for y0 in (0..image.height).step_by(REGION) {
            for x0 in (0..image.width).step_by(REGION) {
                let mut sum = 0.0;
                for y in y0..y0 + REGION {
                    for x in x0..x0 + REGION {
                        sum += f64::from(channel[y * image.width + x]);
                    }
                }
                out.push(sum / (REGION * REGION) as f64);
            }
        }
    }
    out
}

fn accumulate(means: &mut Vec<Mean>, images: &[&Image]) {
    let values: Vec<f64> = images.iter().flat_map(|i| regions(i)).collect();
    means.resize(values.len(), Mean::default());
    means.iter_mut().zip(values).for_each(|(m, v)| m.add(v));
}

/// dx, dy and picture by path tracing, by light and BSDF sampling alone.
pub(super) fn reference(scene: &Scene, tracer: &dyn Traverse) -> Vec<Mean> {
    reference_at(64, scene, tracer)
}

/// As above, of so many samples: of few of them light that is rarely found has no normal distribution.
pub(super) fn reference_at(spp: u64, scene: &Scene, tracer: &dyn Traverse) -> Vec<Mean> {
    let render = Render {
        spp,
        manifold: Manifold::Off,
        ..Render::default()
    };
    reference_of(render, scene, tracer)
}

pub(super) fn reference_of(render: Render, scene: &Scene, tracer: &dyn Traverse) -> Vec<Mean> {
    let mut means = Vec::new();
    for seed in 0..SEEDS {
        let render = Render {
            method: Method::Pt,
            seed: 1000 + seed,
            ..render
        };
        let primal = render.estimate(scene, tracer).primal;
        let [dx, dy] = differences(&primal);
        accumulate(&mut means, &[&dx, &dy, &primal]);
    }
    means
}

pub(super) fn check(
    name: &str,
    weights: Weights,
    scene: &Scene,
    tracer: &dyn Traverse,
    reference: &[Mean],
) {
    // With walks wherever they can be made, and as often as they pay.
    let manifold = match weights {
        Weights::Mis => Manifold::Always,
        Weights::Symmetric => Manifold::Auto,
    };
    let render = Render {
        weights,
        manifold,
        ..Render::default()
    };
    check_render(name, render, scene, tracer, reference);
}

/// As above, of 16 samples and with more settings.
fn check_render(
    name: &str,
    render: Render,
    scene: &Scene,
    tracer: &dyn Traverse,
    reference: &[Mean],
) {
    let weights = render.weights;
    let mut means = Vec::new();
    for seed in 0..SEEDS {
        let render = Render {
            spp: 16,
            seed,
            ..render
        };
        let e = render.estimate(scene, tracer);
        let problem = Problem {
            primal: &e.primal,
            dx: &e.dx,
            dy: &e.dy,
        };
        accumulate(&mut means, &[&e.dx, &e.dy, &l2::solve(&problem, 0.2)]);
    }
    let limit = largest_z(means.len(), SEEDS as usize, SIGNIFICANCE);
    let per_kind = means.len() / 3;
    let mut sum_sq = 0.0;
    for (i, (a, b)) in means.iter().zip(reference).enumerate() {
        let deviation = (a.variance() + b.variance()).sqrt();
        // The furnace has regions without any noise; there rounding is all that is left.
        let z = (a.mean() - b.mean()) / deviation.max(1e-6);
        sum_sq += z * z;
        let kind = ["dx", "dy", "picture"][i / per_kind];
        assert!(
            z.abs() < limit,
            "{name} {weights:?}: {kind} region {}: {} against {}, z = {z:.2} (limit {limit:.2})",
            i % per_kind,
            a.mean(),
            b.mean(),
        );
    }
    // Many small deviations one way would pass the test above. z² has mean 1; channels go together, and so do the three
    // kinds in part: 2 is 3.5 standard deviations for 24 independent regions.
    let mean_sq = sum_sq / means.len() as f64;
    assert!(mean_sq < 2.0, "{name} {weights:?}: mean z² = {mean_sq:.2}");
}

/// One test for each scene, so that a failure names it.
fn check_scene(name: &str) {
    assert!(SCENES.contains(&name));
    let scene = shipped(name, SIZE, SIZE);
    let tracer = tracer(&scene);
    let reference = reference(&scene, &*tracer);
    for weights in [Weights::Mis, Weights::Symmetric] {
        check(name, weights, &scene, &*tracer, &reference);
    }
    if ["mirrors", "rings"].contains(&name) {
        check_walks(name, &scene, &*tracer, &reference);
    }
}

macro_rules! scenes {
    ($($name:ident),*) => { $(
        #[test]
        fn $name() {
            check_scene(stringify!($name));
        }
    )* };
}

scenes!(
    cornell, glossy, mirrors, pane, rings, ajar, caustic, corner, furnace, still
);

/// Path tracing with walks at every vertex.
pub(super) fn check_walks(name: &str, scene: &Scene, tracer: &dyn Traverse, reference: &[Mean]) {
    let always = Render {
        spp: 16,
        manifold: Manifold::Always,
        ..Render::default()
    };
    let walked = reference_of(always, scene, tracer);
    let limit = largest_z(walked.len(), SEEDS as usize, SIGNIFICANCE);
    for (a, b) in walked.iter().zip(reference) {
        let z = (a.mean() - b.mean()) / (a.variance() + b.variance()).sqrt().max(1e-6);
        assert!(z.abs() < limit, "{name}: {} against {}", a.mean(), b.mean());
    }
}

/// Through a lens, with the camera close to what is not in focus.
#[test]
fn lens() {
    let mut scene = shipped("still", SIZE, SIZE);
    let toml = sidecar::load(Path::new("scenes/still.obj")).unwrap();
    let close = toml.camera_named(Some("close")).unwrap();
    let framing = Framing::new(&close, (SIZE, SIZE), scene.framing.up).unwrap();
    scene.camera = framing.camera(&scene.mesh).unwrap();
    assert!(scene.camera.lens.is_some());
    let tracer = tracer(&scene);
    let reference = reference(&scene, &*tracer);
    check("lens", Weights::Mis, &scene, &*tracer, &reference);
}

/// Filters wider than a pixel, one of them negative in part. A mean over weights that vary is biased, by the
/// number of samples, so the reference has as many.
#[test]
fn filters() {
    let scene = shipped("corner", SIZE, SIZE);
    let tracer = tracer(&scene);
    for filter in [Filter::Tent, Filter::Gaussian, Filter::Mitchell] {
        let render = Render {
            spp: 16,
            filter,
            ..Render::default()
        };
        let reference = reference_of(render, &scene, &*tracer);
        check_render("filters", render, &scene, &*tracer, &reference);
    }
}

/// A board on the floor around (`x`, `z`), as wide as twice `half`, turned by a slope.
fn upright(half: f32, x: f32, z: f32, turn: f32) -> [[f32; 3]; 4] {
    [(-half, 0.0), (half, 0.0), (half, 0.7), (-half, 0.7)].map(|(u, y)| [x + u, y, z + turn * u])
}

/// A lamp and its floor seen through panes, smooth and frosted, and through a half open board; the lamp lights
/// what is behind them through them too.
#[test]
fn panes() {
    let (floor, mut lamp) = (common::level(0.0, 2.0), common::level(1.2, 0.5));
    lamp.reverse();
    let sheets = [
        upright(0.3, -0.6, 0.4, 0.5),
        upright(0.3, 0.1, 0.5, 0.0),
        upright(0.3, 0.7, 0.3, -0.4),
    ];
    let all: [(&[[f32; 3]], usize); 5] = [
        (&floor, 0),
        (&lamp, 1),
        (&sheets[0], 2),
        (&sheets[1], 3),
        (&sheets[2], 4),
    ];
    let settings = gdpt::scene::SceneSettings {
        camera: CameraTable {
            origin: Some([0.2, 0.9, 2.4]),
            target: Some([0.0, 0.3, 0.0]),
            fov: Some(45.0),
            ..Default::default()
        },
        size: (SIZE, SIZE),
        environment: Default::default(),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let glass = |tf, pr| MtlMaterial {
        illum: Some(7),
        tf: Some(tf),
        pr,
        ..Default::default()
    };
    let board = MtlMaterial {
        kd: Some([0.8, 0.4, 0.2]),
        opacity: Some(0.4),
        ..Default::default()
    };
    let lamp = MtlMaterial {
        ke: Some([3.0, 2.0, 1.0]),
        ..Default::default()
    };
    let materials = vec![
        common::lambert(0.6),
        lamp,
        glass([0.7, 0.9, 0.8], None),
        glass([1.0; 3], Some(0.5)),
        board,
    ];
    let scene = common::polygons(&all, materials, &settings);
    let tracer = tracer(&scene);
    let reference = reference(&scene, &*tracer);
    for weights in [Weights::Mis, Weights::Symmetric] {
        check("panes", weights, &scene, &*tracer, &reference);
    }
}

/// So many lamps that the choice among them is by the place that is lit: base and offset path have
/// densities of their own for the same lamp.
#[test]
fn many_lamps() {
    let mut rng = common::Rng(4);
    let floor: &[[f32; 3]] = &[
        [-2.0, 0.0, 2.0],
        [2.0, 0.0, 2.0],
        [2.0, 0.0, -2.0],
        [-2.0, 0.0, -2.0],
    ];
    let board: &[[f32; 3]] = &[
        [-0.5, 0.0, 0.2],
        [0.6, 0.0, 0.0],
        [0.6, 0.5, 0.0],
        [-0.5, 0.5, 0.2],
    ];
    let lamps: Vec<[[f32; 3]; 3]> = (0..200)
        .map(|_| {
            let p = Vec3::new(
                3.0 * rng.next() - 1.5,
                0.1 + rng.next(),
                3.0 * rng.next() - 1.5,
            );
            // Many look away from what is lit.
            let (a, b) = (rng.unit_vector() * 0.08, rng.unit_vector() * 0.08);
            [p, p + a, p + b].map(|c| c.to_array())
        })
        .collect();
    let mut all = vec![(floor, 0), (board, 1)];
    all.extend(
        lamps
            .iter()
            .enumerate()
            .map(|(i, l)| (l.as_slice(), 2 + i % 2)),
    );
    let settings = gdpt::scene::SceneSettings {
        camera: CameraTable {
            origin: Some([0.3, 1.5, 2.5]),
            target: Some([0.0; 3]),
            fov: Some(50.0),
            ..Default::default()
        },
        size: (SIZE, SIZE),
        environment: Default::default(),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let coloured = |ke| MtlMaterial {
        ke: Some(ke),
        ..Default::default()
    };
    let materials = vec![
        common::lambert(0.7),
        common::lambert(0.3),
        coloured([4.0, 1.0, 0.2]),
        coloured([0.1, 0.8, 2.0]),
    ];
    // With equal channels there would be a third as many independent regions.
    let scene = common::polygons(&all, materials, &settings);
    assert!(scene.lights.depend_on_place());
    let tracer = tracer(&scene);
    let reference = reference(&scene, &*tracer);
    for weights in [Weights::Mis, Weights::Symmetric] {
        check("lamps", weights, &scene, &*tracer, &reference);
    }
}

/// Lights without extent of all kinds beside a lamp, on Lambert, rough metal and what is coated, with their shadows.
#[test]
fn lights_without_extent() {
    let (floor, mut lamp) = (common::level(0.0, 2.0), common::level(1.5, 0.3));
    lamp.reverse();
    let boards = [upright(0.4, -0.6, -0.2, 0.5), upright(0.4, 0.5, 0.1, -0.3)];
    let all: [(&[[f32; 3]], usize); 4] =
        [(&floor, 0), (&lamp, 1), (&boards[0], 2), (&boards[1], 3)];
    let settings = gdpt::scene::SceneSettings {
        camera: CameraTable {
            origin: Some([0.2, 1.2, 2.4]),
            target: Some([0.0, 0.2, 0.0]),
            fov: Some(45.0),
            ..Default::default()
        },
        size: (SIZE, SIZE),
        lights: vec![
            PunctualLight::Point {
                position: [0.9, 0.8, 0.6],
                intensity: [0.2, 0.8, 0.4],
                cone: None,
            },
            PunctualLight::Point {
                position: [-0.2, 1.3, 1.0],
                intensity: [3.0, 1.0, 1.0],
                cone: Some(Cone {
                    direction: [-0.1, -1.0, -0.9],
                    cutoff_angle: 25.0,
                    beam_width: 15.0,
                }),
            },
            PunctualLight::Directional {
                direction: [0.6, -1.0, -0.4],
                irradiance: [0.3, 0.4, 1.2],
            },
        ],
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let metal = MtlMaterial {
        pm: Some(1.0),
        pr: Some(0.35),
        ks: Some([0.9, 0.8, 0.6]),
        ..Default::default()
    };
    let coated = MtlMaterial {
        kd: Some([0.3, 0.5, 0.2]),
        ks: Some([0.04; 3]),
        ns: Some(200.0),
        ..Default::default()
    };
    let materials = vec![common::lambert(0.6), common::light(2.0), metal, coated];
    let scene = common::polygons(&all, materials, &settings);
    let tracer = tracer(&scene);
    let reference = reference(&scene, &*tracer);
    for weights in [Weights::Mis, Weights::Symmetric] {
        check("punctual", weights, &scene, &*tracer, &reference);
    }
}

/// A lamp as wide as the floor behind a board's edge, close to both: BSDF samples find the lamp about as
/// often as light samples do, and the edge hides it from one of two neighbouring pixels. Whatever a
/// blocked path's densities get wrong shows here.
#[test]
fn penumbra_of_a_wide_lamp() {
    let floor: &[[f32; 3]] = &[
        [-1.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, -1.0],
        [-1.0, 0.0, -1.0],
    ];
    let lamp: &[[f32; 3]] = &[
        [-1.0, 0.5, -1.0],
        [1.0, 0.5, -1.0],
        [1.0, 0.5, 1.0],
        [-1.0, 0.5, 1.0],
    ];
    let boards: Vec<[[f32; 3]; 4]> = (0..4)
        .map(|i| {
            let x = -0.9 + 0.5 * i as f32;
            [
                [x, 0.04, 1.0],
                [x + 0.25, 0.04, 1.0],
                [x + 0.25, 0.04, -1.0],
                [x, 0.04, -1.0],
            ]
        })
        .collect();
    let mut all = vec![(floor, 0), (lamp, 1)];
    all.extend(boards.iter().map(|b| (b.as_slice(), 2)));
    let settings = gdpt::scene::SceneSettings {
        camera: CameraTable {
            origin: Some([0.0, 0.45, 0.9]),
            target: Some([0.0, 0.0, 0.0]),
            fov: Some(60.0),
            ..Default::default()
        },
        size: (SIZE, SIZE),
        environment: Default::default(),
        roughness_threshold: 0.001,
        ..Default::default()
    };
    let materials = vec![
        common::lambert(0.8),
        common::light(1.0),
        common::lambert(0.2),
    ];
    let scene = common::polygons(&all, materials, &settings);
    let tracer = tracer(&scene);
    let reference = reference(&scene, &*tracer);
    for weights in [Weights::Mis, Weights::Symmetric] {
        check("penumbra", weights, &scene, &*tracer, &reference);
    }
}
