//! Scenes for the benches.
#![allow(dead_code)] // each bench uses a part

use gdpt::error::Warnings;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::obj::{self, ObjFile};
use gdpt::load::sidecar::{self, CameraTable};
use gdpt::scene::{Scene, SceneSettings};
use glam::Vec3;
use std::path::Path;

/// A shipped scene.
pub fn shipped(name: &str) -> Scene {
    shipped_at(name, 256, 256)
}

/// A shipped scene at another size.
pub fn shipped_at(name: &str, width: u32, height: u32) -> Scene {
    let path = format!("scenes/{name}.obj");
    let path = Path::new(&path);
    let mut warnings = Warnings::new(true);
    let file = obj::load(path, &mut warnings).expect("a shipped scene");
    let toml = sidecar::load(path).expect("a shipped scene");
    let settings = SceneSettings {
        camera: toml.camera,
        size: (width, height),
        environment: gdpt::scene::EnvironmentSetting::of_table(&toml.environment),
        roughness_threshold: 0.001,
        ..Default::default()
    };
    Scene::build(path, file, &settings, &mut warnings).expect("a shipped scene")
}

/// A hilly floor of 524,288 triangles under a lamp.
pub fn large() -> Scene {
    const N: u32 = 512;
    let mut file = ObjFile::default();
    let height = |x: f32, z: f32| {
        0.15 * (7.0 * x).sin() * (5.0 * z).cos() + 0.03 * (41.0 * x + 13.0 * z).sin()
    };
    for i in 0..=N {
        for j in 0..=N {
            let at = |k: u32| 2.0 * k as f32 / N as f32 - 1.0;
            let (x, z) = (at(j), -at(i));
            file.positions.push(Vec3::new(x, height(x, z), z));
        }
    }
    for i in 0..N {
        for j in 0..N {
            let corner = |di: u32, dj: u32| (i + di) * (N + 1) + j + dj;
            file.triangles
                .push([corner(0, 0), corner(0, 1), corner(1, 1)]);
            file.triangles
                .push([corner(0, 0), corner(1, 1), corner(1, 0)]);
        }
    }
    file.material_of = vec![0; file.triangles.len()];
    let first = file.positions.len() as u32;
    for (x, z) in [(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)] {
        file.positions.push(Vec3::new(x, 1.5, z));
    }
    file.triangles
        .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    file.material_of.extend([1, 1]);
    file.materials = vec![
        MtlMaterial {
            kd: Some([0.7; 3]),
            ..Default::default()
        },
        MtlMaterial {
            ke: Some([10.0; 3]),
            ..Default::default()
        },
    ];
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.0, 1.2, 2.2]),
            target: Some([0.0, 0.0, 0.0]),
            up: None,
            fov: Some(45.0),
            ..Default::default()
        },
        size: (256, 256),
        environment: Default::default(),
        roughness_threshold: 0.001,
        ..Default::default()
    };
    Scene::build(
        Path::new("large"),
        file,
        &settings,
        &mut Warnings::new(true),
    )
    .expect("a scene")
}
