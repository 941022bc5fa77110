//! What paths do in diffuse scenes leaves out all code for anything else; every bit is what it is with that code, and
//! so are the counts of rays, dead shifts and dropped samples. All scenes have the bits that they had.

mod freeze;
mod mixed;

use crate::common::{Render, Rng, cases, lambert, light, polygons, scene_of_file, shipped, tracer};
use gdpt::error::Warnings;
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::load::bitmap::{Bitmap, Texels};
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::obj::{NONE, ObjFile};
use gdpt::load::sidecar::CameraTable;
use gdpt::path::{Counts, Manifold};
use gdpt::render::Method;
use gdpt::sampler::SamplerKind;
use gdpt::scene::framing::Framing;
use gdpt::scene::{EnvironmentSource, Scene, SceneSettings};
use gdpt::shift::Death;
use glam::Vec3;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::RefCell;
use std::path::Path;

/// All sums of a render, as text that tells every number, and its counts.
fn sums(scene: &Scene, render: &Render) -> (String, Counts) {
    let (film, counts) = render.film_and_counts(scene, &*tracer(scene));
    (format!("{film:?}"), counts)
}

fn compare(mut scene: Scene, render: &Render) -> Counts {
    assert!(scene.is_diffuse());
    let (diffuse, counts) = sums(&scene, render);
    scene.forget_diffuse();
    assert!(!scene.is_diffuse());
    let (general, general_counts) = sums(&scene, render);
    assert_eq!(counts, general_counts);
    if diffuse != general {
        let at = std::iter::zip(diffuse.bytes(), general.bytes())
            .position(|(a, b)| a != b)
            .unwrap_or(0);
        let part = |text: &str| {
            text[at.saturating_sub(300)..]
                .chars()
                .take(400)
                .collect::<String>()
        };
        panic!(
            "the sums differ: diffuse {}\n\ngeneral {}",
            part(&diffuse),
            part(&general)
        );
    }
    counts
}

fn by(method: Method) -> Render {
    Render {
        method,
        spp: 5,
        seed: 3,
        ..Render::default()
    }
}

#[test]
fn shipped_scenes_have_the_bits_of_the_general_code() {
    for name in ["cornell", "ajar", "corner"] {
        for method in [Method::Pt, Method::Gpt] {
            compare(shipped(name, 67, 45), &by(method));
        }
    }
    for name in ["glossy", "mirrors", "furnace", "still"] {
        assert!(!shipped(name, 8, 8).is_diffuse());
    }
}

/// With a lens, offset paths have camera rays of their own.
#[test]
fn a_lens_has_the_bits_of_the_general_code() {
    let mut scene = shipped("cornell", 40, 40);
    let table = CameraTable {
        aperture: Some(0.1),
        focus: Some(1.0),
        ..camera_of("cornell")
    };
    let framing = Framing::new(&table, (40, 40), scene.framing.up).unwrap();
    scene.camera = framing.camera(&scene.mesh).unwrap();
    assert!(scene.camera.lens.is_some());
    compare(scene, &by(Method::Gpt));
}

fn camera_of(name: &str) -> CameraTable {
    let path = format!("scenes/{name}.obj");
    gdpt::load::sidecar::load(Path::new(&path)).unwrap().camera
}

/// Textured surfaces go one by one, with the lanes around them; holes are the backend's.
#[test]
fn textures_have_the_bits_of_the_general_code() {
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
        compare(scene, &by(method));
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
    brightest: f32,
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
    // Lamps that differ, one without power and one with very much.
    for ke in [
        [3.0, 0.0, 7.0],
        [1.0, 20.0, 0.5],
        [0.0; 3],
        [mixture.brightest; 3],
    ] {
        file.materials.push(MtlMaterial {
            kd: Some([0.0; 3]),
            ke: Some(ke),
            ..Default::default()
        });
    }
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
            .push(triangle as u32 % if is_light { 4 } else { 6 } + if is_light { 6 } else { 0 });
    }
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.0; 3]),
            target: Some([0.0, 0.0, mixture.scale]),
            fov: Some(100.0),
            ..Default::default()
        },
        size,
        // Black must be said, or a scene without lights gets a studio.
        environment: if mixture.environment {
            Vec3::new(0.2, 0.0, 1.0)
        } else {
            Vec3::ZERO
        }
        .into(),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let mut warnings = Warnings::new(false);
    Scene::build(Path::new("test.obj"), file, &settings, &mut warnings).unwrap()
}

#[test]
fn any_diffuse_scene_has_the_bits_of_the_general_code() {
    let mut runner = TestRunner::new(cases(300));
    let mixtures = (
        any::<u64>(),
        1..60usize,
        0..8usize,
        any::<bool>(),
        any::<bool>(),
        -44i32..44,
        prop_oneof![Just(5.0f32), Just(1e38)],
    )
        .prop_map(
            |(seed, triangles, lights, smooth, environment, scale, brightest)| Mixture {
                seed,
                triangles,
                lights,
                smooth,
                environment,
                scale: (scale as f32).exp(),
                brightest,
            },
        );
    let sizes = ((1u32..30, 1u32..30), 1u32..24, 1u32..9);
    let switches = any::<(bool, bool, bool)>();
    let total = RefCell::new(Counts::default());
    runner
        .run(
            &(mixtures, sizes, switches),
            |(mixture, (size, tile_size, depth), (gradients, symmetric, independent))| {
                let render = Render {
                    method: [Method::Pt, Method::Gpt][usize::from(gradients)],
                    weights: [Weights::Mis, Weights::Symmetric][usize::from(symmetric)],
                    spp: 5,
                    seed: mixture.seed,
                    sampler: [SamplerKind::Sobol, SamplerKind::Independent]
                        [usize::from(independent)],
                    depth,
                    tile_size,
                    filter: Filter::Tent,
                    manifold: Manifold::Auto,
                };
                let counts = compare(scene(&mixture, size), &render);
                total.borrow_mut().add(&counts);
                Ok(())
            },
        )
        .unwrap();
    // What may happen to a diffuse path has happened; shifts that are not finite would be too rare.
    let total = total.into_inner();
    for death in [Death::Missed, Death::Blocked, Death::Side] {
        assert!(total.deaths[death as usize] > 0, "none died of {death:?}");
    }
    assert!(total.dropped > 0, "no sample was dropped");
}

/// A floor under so many lamps, one above the other.
fn lamps(count: usize, lamp: MtlMaterial, settings: &SceneSettings) -> Scene {
    let floor = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
    let above =
        |n: usize| [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)].map(|(x, z)| [x, 1.0 + n as f32, z]);
    let above: Vec<_> = (0..count).map(above).collect();
    let mut list: Vec<(&[[f32; 3]], usize)> = vec![(&floor, 0)];
    list.extend(above.iter().map(|lamp| (&lamp[..], 1)));
    polygons(&list, vec![lambert(0.5), lamp], settings)
}

#[test]
fn what_is_not_diffuse_is_left_to_the_general_code() {
    let size = SceneSettings {
        size: (8, 8),
        environment: Vec3::ONE.into(),
        ..Default::default()
    };
    assert!(lamps(1, light(1.0), &size).is_diffuse());
    assert!(lamps(63, light(1.0), &size).is_diffuse());
    // Lights chosen by place.
    assert!(!lamps(64, light(1.0), &size).is_diffuse());
    // A lamp without power is a black surface.
    compare(lamps(1, light(0.0), &size), &by(Method::Gpt));
    // A metal.
    let metal = MtlMaterial {
        pm: Some(1.0),
        pr: Some(0.5),
        ..lambert(0.5)
    };
    assert!(!lamps(1, metal, &size).is_diffuse());
    // Nothing at all.
    let settings = SceneSettings {
        camera: camera_of("cornell"),
        ..size.clone()
    };
    let nothing = polygons(&[], vec![lambert(0.5)], &settings);
    sums(&nothing, &by(Method::Gpt));
    // A map of the environment.
    let bitmap = Bitmap {
        width: 2,
        height: 1,
        texels: Texels::Floats {
            values: vec![[1.0; 3]; 2],
            alpha: None,
            encoded: false,
        },
        has_alpha: false,
    };
    let sky = SceneSettings {
        environment: EnvironmentSource::Map(bitmap.into()).into(),
        ..size
    };
    assert!(!lamps(1, light(1.0), &sky).is_diffuse());
}
