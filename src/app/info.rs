//! `gdpt info`: what a scene holds and what its render takes.

use super::{Ended, SceneFlags, load_scene};
use crate::bsdf::Bsdf;
use crate::cli::InfoArgs;
use crate::error::{Result, Warnings};
use crate::film::BYTES_PER_PIXEL;
use crate::output::{check_outputs, write_json};
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::material::{Class, Material};
use glam::Vec3;
use serde::Serialize;
use std::io::Write;

/// Bytes of a triangle at the peak, while Embree builds its tree: measured with 10 million triangles.
const BYTES_PER_TRIANGLE: usize = 144;

/// What `--json` writes.
#[derive(Serialize)]
struct Info {
    version: &'static str,
    scene: String,
    scene_hash: String,
    triangles: usize,
    vertices: usize,
    bounds: [[f32; 3]; 2],
    width: u32,
    height: u32,
    camera: [f32; 3],
    environment: String,
    materials: Vec<MaterialInfo>,
    /// Whether there are emitting triangles to be sampled.
    light_sampling: bool,
    /// Whether offset paths copy half vectors anywhere.
    half_vector_copy: bool,
    /// Bytes for the film and the images made of it.
    memory_picture: usize,
    /// Bytes for triangles and tree, about.
    memory_scene: usize,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct MaterialInfo {
    name: String,
    /// What the MTL became.
    is: String,
    class: &'static str,
    triangles: usize,
    area: f64,
    /// Power of a light, the mean over the channels: π times area and radiance.
    power: Option<f64>,
}

/// Prints what the scene holds.
pub fn info(args: &InfoArgs) -> Result<Ended> {
    if let Some(path) = &args.json {
        check_outputs(&args.scene, &[path])?;
    }
    let flags = SceneFlags::of_size(args.size);
    let mut warnings = Warnings::new(false);
    let scene = load_scene(&args.scene, flags, &mut warnings)?;
    let info = Info {
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.display().to_string(),
        scene_hash: format!("{:016x}", scene.hash()),
        triangles: scene.mesh.triangles.len(),
        // One more stands at the end for Embree.
        vertices: scene.mesh.positions.len().saturating_sub(1),
        bounds: [scene.mesh.bounds.0, scene.mesh.bounds.1].map(|b| b.to_array()),
        width: scene.camera.width,
        height: scene.camera.height,
        camera: scene.camera.origin.to_array(),
        environment: environment(&scene.environment),
        materials: materials(&scene),
        light_sampling: !scene.lights.is_empty(),
        half_vector_copy: scene.materials.iter().any(|m| m.class == Class::Specular),
        memory_picture: super::picture_bytes(scene.camera.width, scene.camera.height) as usize,
        memory_scene: BYTES_PER_TRIANGLE * scene.mesh.triangles.len(),
        warnings: warnings.list().to_vec(),
    };
    let _ = write!(std::io::stdout(), "{}", text(&info));
    if let Some(path) = &args.json {
        write_json(path, &info)?;
    }
    Ok(Ended::Done)
}

/// Every material with what bears it.
fn materials(scene: &Scene) -> Vec<MaterialInfo> {
    let mut counts = vec![(0, 0.0f64); scene.materials.len()];
    for (triangle, &material) in scene.mesh.material_of.iter().enumerate() {
        let (count, area) = &mut counts[material as usize];
        *count += 1;
        *area += f64::from(scene.mesh.area(triangle as u32));
    }
    let with_counts = scene.materials.iter().zip(counts);
    with_counts
        .map(|(material, (triangles, area))| MaterialInfo {
            name: material.name.clone(),
            is: describe(material),
            class: match material.class {
                Class::Rough => "rough",
                Class::Specular => "specular",
            },
            triangles,
            area,
            power: material.emission.map(|radiance| {
                std::f64::consts::PI * area * f64::from(radiance.element_sum() / 3.0)
            }),
        })
        .collect()
}

/// Where light comes from in which there is nothing.
fn environment(environment: &Environment) -> String {
    match environment {
        Environment::Constant(radiance) => format!("{:?}", radiance.to_array()),
        Environment::Map(map) => {
            let (width, height) = map.size();
            format!("a map of {width}x{height}")
        }
    }
}

/// What a material became.
fn describe(material: &Material) -> String {
    let colour = |c: Vec3| format!("{},{},{}", c.x, c.y, c.z);
    if let Some(radiance) = material.emission {
        return format!("light of radiance {}", colour(radiance));
    }
    match material.bsdf {
        Bsdf::Lambert { albedo } => format!("Lambert {}", colour(albedo)),
        Bsdf::Mirror { f0 } => format!("mirror {}", colour(f0)),
        Bsdf::Conductor { f0, alpha } => format!("metal {}, alpha {alpha}", colour(f0)),
        Bsdf::Glass { ior, tint } => format!("glass {ior}, tint {}", colour(tint)),
        Bsdf::RoughGlass { ior, alpha, tint } => {
            format!("glass {ior}, alpha {alpha}, tint {}", colour(tint))
        }
        Bsdf::Plastic { albedo, coat } => {
            let metal = if coat.metallic > 0.0 {
                format!(", {} metal {}", coat.metallic, colour(coat.metal))
            } else {
                String::new()
            };
            format!(
                "plastic {}, coat {:.3}, alpha {:.4}{metal}",
                colour(albedo),
                coat.f0,
                coat.alpha
            )
        }
    }
}

fn text(info: &Info) -> String {
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    let [low, high] = info.bounds;
    let mut text = format!(
        "{}: {} triangles, {} vertices, from {low:?} to {high:?}\n\
         picture {}x{}, camera at {:?}, environment {}\n",
        info.scene,
        info.triangles,
        info.vertices,
        info.width,
        info.height,
        info.camera,
        info.environment
    );
    for m in &info.materials {
        text += &format!(
            "  {}: {}, {} triangles, area {:.4}",
            m.name, m.is, m.triangles, m.area
        );
        match m.power {
            Some(power) => text += &format!(", power {power:.4}\n"),
            None => text += &format!(", {}\n", m.class),
        }
    }
    let yes = |b: bool| if b { "yes" } else { "no" };
    text += &format!(
        "light sampling: {}; half-vector copies: {}\n\
         memory: {:.1} MB for the picture ({BYTES_PER_PIXEL} bytes a pixel of film), about {:.1} MB for the scene\n",
        yes(info.light_sampling),
        yes(info.half_vector_copy),
        megabytes(info.memory_picture),
        megabytes(info.memory_scene)
    );
    for warning in &info.warnings {
        text += &format!("warning: {warning}\n");
    }
    text
}
