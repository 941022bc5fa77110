//! Diffuse scenes go through loops in vector lanes; every bit is that of the general loop, and so are the
//! counts of rays, dead shifts and dropped samples.

mod common;

use common::{Rng, cases, scene_of_file, shipped, tracer};
use gdpt::error::Warnings;
use gdpt::film::Film;
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::obj::{NONE, ObjFile};
use gdpt::load::sidecar::CameraTable;
use gdpt::path::{Counts, PathSettings};
use gdpt::render::{Job, Limits, Method};
use gdpt::sampler::Points;
use gdpt::scene::{Scene, SceneSettings};
use glam::Vec3;
use proptest::prelude::*;
use std::path::Path;

/// All sums of a render, as text that tells every number, and its counts.
fn render(
    scene: &Scene,
    method: Method,
    settings: &PathSettings,
    tile_size: u32,
) -> (String, Counts) {
    let mut film = Film::new(scene.camera.width, scene.camera.height, tile_size);
    let tracer = tracer(scene);
    let job = Job {
        scene,
        tracer: &*tracer,
        method,
        settings: *settings,
        limits: Limits {
            samples: 5,
            time: None,
        },
    };
    let outcome = job.run(&mut film, &mut |_, _| None, &mut |_| ());
    (format!("{film:?}"), outcome.counts)
}

fn compare(mut scene: Scene, method: Method, settings: &PathSettings, tile_size: u32) {
    assert!(scene.is_diffuse);
    let (lanes, counts) = render(&scene, method, settings, tile_size);
    scene.is_diffuse = false;
    let (general, general_counts) = render(&scene, method, settings, tile_size);
    assert_eq!(counts, general_counts);
    assert!(lanes == general, "the sums differ");
}

const SETTINGS: PathSettings = PathSettings {
    depth: 12,
    seed: 3,
    points: Points::Sobol,
    weights: Weights::Mis,
    filter: Filter::Box,
};

#[test]
fn shipped_scenes_have_the_bits_of_the_general_loop() {
    for name in ["cornell", "ajar", "corner"] {
        for method in [Method::Pt, Method::Gpt] {
            compare(shipped(name, 67, 45), method, &SETTINGS, 32);
        }
    }
    for name in ["glossy", "mirrors", "furnace", "still"] {
        assert!(!shipped(name, 8, 8).is_diffuse);
    }
}

/// A lens has camera rays of its own: only what follows offset paths is in lanes.
#[test]
fn a_lens_has_the_bits_of_the_general_loop() {
    let mut scene = shipped("cornell", 40, 40);
    let table = CameraTable {
        aperture: Some(0.1),
        focus: Some(1.0),
        ..camera_of("cornell")
    };
    scene.camera = gdpt::scene::camera::Camera::new(&table, (40, 40), scene.mesh.bounds).unwrap();
    assert!(scene.camera.lens.is_some());
    compare(scene, Method::Gpt, &SETTINGS, 32);
}

fn camera_of(name: &str) -> CameraTable {
    let path = format!("scenes/{name}.obj");
    gdpt::load::sidecar::load(Path::new(&path)).unwrap().camera
}

/// Textured walls and lamps' pictures go one by one, with the lanes around them.
#[test]
fn textures_have_the_bits_of_the_general_loop() {
    let folder = tempfile::TempDir::new().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "a.obj",
        "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\n\
         vt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\n\
         usemtl tiles\nf 1/1 2/2 3/3 4/4\nusemtl plain\nf 4/1 3/2 6/3 5/4\n\
         usemtl leaves\nf 1/1 4/2 5/3 8/4\nusemtl lamp\nf 8 5 6 7\n",
    );
    write(
        "a.mtl",
        "newmtl tiles\nmap_Kd t.png\nmap_bump -bm 0.2 t.png\nnewmtl plain\nKd 0.5 0.6 0.7\n\
         newmtl leaves\nKd 0.3 0.6 0.2\nmap_d t.png\nnewmtl lamp\nKe 1 2 3\n",
    );
    write(
        "a.toml",
        "[camera]\norigin = [0, 0.6, 3]\ntarget = [0, 0.4, 0]\nfov = 50\n\
         [environment]\nradiance = [0.3, 0.2, 0.1]\n",
    );
    image::RgbImage::from_fn(7, 5, |x, y| image::Rgb([40 * x as u8, 60 * y as u8, 90]))
        .save(folder.path().join("t.png"))
        .unwrap();
    for method in [Method::Pt, Method::Gpt] {
        let scene = scene_of_file(&folder.path().join("a.obj"), 50, 40);
        assert!(scene.mesh.cutouts.is_some());
        compare(scene, method, &SETTINGS, 32);
    }
}

/// What a random scene is made of.
#[derive(Clone, Debug)]
struct Mixture {
    seed: u64,
    triangles: usize,
    lights: usize,
    smooth: bool,
    environment: bool,
    scale: f32,
}

/// Triangles of any shape and colour all around the camera, with lights among them.
fn scene(mixture: &Mixture, size: (u32, u32)) -> Scene {
    let mut rng = Rng(mixture.seed);
    let mut file = ObjFile::default();
    // Colours with channels of 0 and of 1 among them; every third triangle is black or grey.
    let mut colour = |n: usize| {
        let channel = |r: f32| (1.5 * r - 0.25).clamp(0.0, 1.0);
        match n % 3 {
            0 => [0.25 * (n % 5) as f32; 3],
            _ => [rng.next(), rng.next(), rng.next()].map(channel),
        }
    };
    for n in 0..6 {
        file.materials.push(MtlMaterial {
            kd: Some(colour(n)),
            ..Default::default()
        });
    }
    file.materials.push(MtlMaterial {
        ke: Some([3.0, 0.0, 7.0]),
        ..Default::default()
    });
    for triangle in 0..mixture.triangles + mixture.lights {
        let is_light = triangle >= mixture.triangles;
        let centre = rng.unit_vector() * (0.5 + rng.next());
        let extent = 0.2 + 1.5 * rng.next() * rng.next();
        let first = file.positions.len() as u32;
        for _ in 0..3 {
            let corner = centre + rng.unit_vector() * extent;
            file.positions.push(corner * mixture.scale);
            file.normals.push(rng.unit_vector());
        }
        let corners = [first, first + 1, first + 2];
        file.triangles.push(corners);
        if mixture.smooth {
            let flat = triangle % 4 == 0;
            file.normal_triangles
                .push(if flat { [NONE; 3] } else { corners });
        }
        file.material_of
            .push(if is_light { 6 } else { triangle as u32 % 6 });
    }
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.0; 3]),
            target: Some([0.0, 0.0, mixture.scale]),
            fov: Some(100.0),
            ..Default::default()
        },
        size,
        environment: mixture.environment.then(|| Vec3::new(0.2, 0.0, 1.0).into()),
        roughness_threshold: 0.01,
    };
    let mut warnings = Warnings::new(false);
    Scene::build(Path::new("test.obj"), file, &settings, &mut warnings).unwrap()
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn any_diffuse_scene_has_the_bits_of_the_general_loop(
        mixture in (any::<u64>(), 1..60usize, 0..4usize, any::<bool>(), any::<bool>(), -20i32..20).prop_map(
            |(seed, triangles, lights, smooth, environment, scale)| Mixture {
                seed, triangles, lights, smooth, environment, scale: (scale as f32).exp(),
            },
        ),
        size in (1u32..30, 1u32..30),
        (depth, tile_size) in (1u32..9, 1u32..24),
        (gradients, symmetric, independent) in any::<(bool, bool, bool)>(),
    ) {
        let settings = PathSettings {
            depth,
            seed: mixture.seed,
            points: if independent { Points::Independent } else { Points::Sobol },
            weights: if symmetric { Weights::Symmetric } else { Weights::Mis },
            filter: Filter::Tent,
        };
        let method = if gradients { Method::Gpt } else { Method::Pt };
        compare(scene(&mixture, size), method, &settings, tile_size);
    }
}
