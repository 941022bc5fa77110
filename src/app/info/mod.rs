//! `gdpt info`: what a scene holds and what its render takes.

mod text;

use super::{Ended, SceneFlags, load_with_camera};
use crate::bsdf::Bsdf;
use crate::cli::InfoArgs;
use crate::error::{Error, Result, Warnings};
use crate::output::{check_outputs, print_beside, write_json};
use crate::scene::Scene;
use crate::scene::environment::{Environment, MapKind};
use crate::scene::material::{Class, Material};
use crate::scene::reflectors::Form;
use crate::scene::texture::Texture;
use glam::Vec3;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

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
    /// Of all triangles, in square units.
    area: f64,
    /// Triangles that are shaded by normals of their corners; the others are flat.
    smooth: usize,
    width: u32,
    height: u32,
    camera: [f32; 3],
    /// What the camera is, and why.
    view: String,
    environment: String,
    /// Those that triangles have.
    materials: Vec<MaterialInfo>,
    /// Names of the others.
    unused_materials: Vec<String>,
    /// What sends light on in single directions, for walks to lights.
    reflectors: Vec<ReflectorInfo>,
    /// Why there are no walks although there are such surfaces.
    no_walks: Option<String>,
    /// Emitting triangles.
    lights: usize,
    /// Lights without extent, in words.
    punctual: Vec<String>,
    /// Triangles with holes.
    cutouts: usize,
    textures: Vec<TextureInfo>,
    /// What of the renderer the scene needs.
    kernels: Vec<String>,
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

#[derive(Serialize)]
struct ReflectorInfo {
    material: String,
    form: &'static str,
    /// GGX roughness.
    alpha: f32,
    /// Into how many it is cut up.
    patches: usize,
    triangles: u32,
    area: f32,
}

#[derive(Serialize)]
struct TextureInfo {
    material: String,
    /// What it stands for.
    role: &'static str,
    width: u32,
    height: u32,
}

/// Prints what the scenes hold. One that cannot be read does not keep the others from being told.
pub fn info(args: &InfoArgs) -> Result<Ended> {
    let inputs: Vec<&Path> = args.scenes.iter().map(PathBuf::as_path).collect();
    let outputs: Vec<&Path> = args.json.iter().map(PathBuf::as_path).collect();
    check_outputs(&inputs, &outputs)?;
    let mut infos = Vec::new();
    let mut errors = Vec::new();
    for path in inputs {
        match of_scene(path, args) {
            Ok(info) => infos.push(info),
            Err(e) => errors.push(e),
        }
    }
    if let Some(path) = &args.json {
        match &infos[..] {
            [info] if args.scenes.len() == 1 => write_json(path, info)?,
            [] => (),
            infos => write_json(path, infos)?,
        }
    }
    let texts: Vec<String> = infos.iter().map(text::of).collect();
    print_beside(&outputs, &texts.join("\n"))?;
    match (errors.pop(), args.scenes.len()) {
        (None, _) => Ok(Ended::Done),
        (Some(error), 1) => Err(error),
        (Some(last), all) => {
            errors.push(last);
            for error in &errors {
                let _ = writeln!(std::io::stderr(), "error: {error}");
            }
            let failed = errors.len();
            Err(Error::Scenes { failed, all })
        }
    }
}

fn of_scene(path: &Path, args: &InfoArgs) -> Result<Info> {
    let mut warnings = Warnings::new(false);
    let scene = load_with_camera(
        path,
        SceneFlags::of_size(args.size, &args.reading),
        &mut warnings,
    )?;
    let (materials, unused_materials) = materials(&scene);
    Ok(Info {
        version: env!("CARGO_PKG_VERSION"),
        scene: path.display().to_string(),
        scene_hash: format!("{:016x}", scene.hash()),
        triangles: scene.mesh.triangles.len(),
        // One more stands at the end for Embree.
        vertices: scene.mesh.positions.len().saturating_sub(1),
        bounds: [scene.mesh.bounds.0, scene.mesh.bounds.1].map(|b| b.to_array()),
        area: materials.iter().map(|m| m.area).sum(),
        smooth: scene.mesh.smooth_triangles(),
        width: scene.camera.width,
        height: scene.camera.height,
        camera: scene.camera.origin.to_array(),
        view: scene.framing.describe(&scene.camera),
        environment: environment(&scene.environment),
        materials,
        unused_materials,
        reflectors: reflectors(&scene),
        no_walks: scene.reflectors.hindrance().map(str::to_owned),
        lights: scene.lights.triangles(),
        punctual: scene.lights.punctual().describe(),
        cutouts: cutouts(&scene),
        textures: textures(&scene),
        kernels: kernels(&scene),
        memory_picture: super::memory::picture_bytes(scene.camera.width, scene.camera.height)
            as usize,
        memory_scene: BYTES_PER_TRIANGLE * scene.mesh.triangles.len() + texture_bytes(&scene),
        warnings: warnings.list().to_vec(),
    })
}

/// Every material that triangles have, with what bears it; the names of those that none has.
fn materials(scene: &Scene) -> (Vec<MaterialInfo>, Vec<String>) {
    let mut counts = vec![(0, 0.0f64); scene.materials.len()];
    for (triangle, &material) in scene.mesh.material_of.iter().enumerate() {
        let (count, area) = &mut counts[material as usize];
        *count += 1;
        *area += f64::from(scene.mesh.area(triangle as u32));
    }
    let with_counts = scene.materials.iter().zip(counts);
    let (used, unused): (Vec<_>, Vec<_>) = with_counts.partition(|(_, (count, _))| *count > 0);
    // A material of bodies and of open sheets stands there twice.
    let is_used = |name: &str| used.iter().any(|(m, _)| m.name == name);
    let names = unused.iter().map(|(m, _)| m.name.clone());
    let unused = names.filter(|name| !is_used(name)).collect();
    let used = used
        .into_iter()
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
        });
    (used.collect(), unused)
}

fn reflectors(scene: &Scene) -> Vec<ReflectorInfo> {
    let list = scene.reflectors.list();
    let surfaces = list
        .iter()
        .zip(0..)
        .filter(|(r, number)| r.surface == *number);
    let info = surfaces.map(|(r, number)| {
        let patches = || list.iter().filter(|patch| patch.surface == number);
        ReflectorInfo {
            material: scene.materials[r.material as usize].name.clone(),
            form: match r.form {
                Form::Plane(_) => "flat",
                Form::Curved(_) if scene.reflectors.ball(number).is_some() => "ball",
                Form::Curved(_) => "curved",
            },
            alpha: r.alpha,
            patches: patches().count(),
            triangles: patches().map(|patch| patch.triangles).sum(),
            area: patches().map(|patch| patch.area).sum(),
        }
    });
    info.collect()
}

fn cutouts(scene: &Scene) -> usize {
    let first = scene.mesh.cutouts.as_ref().map(|c| c.first as usize);
    first.map_or(0, |first| scene.mesh.triangles.len() - first)
}

/// Every texture with its material.
fn all_textures(scene: &Scene) -> Vec<(&str, &'static str, &Texture)> {
    let mut all = Vec::new();
    for (index, material) in scene.materials.iter().enumerate() {
        let name = material.name.as_str();
        if let Some(textures) = &material.textures {
            all.extend(textures.named().map(|(role, t)| (name, role, t)));
        }
        let opacity = scene.mesh.cutouts.as_ref();
        let opacity = opacity.and_then(|c| c.opacity(index as u32));
        all.extend(opacity.map(|t| (name, "opacity", t)));
    }
    all
}

fn textures(scene: &Scene) -> Vec<TextureInfo> {
    let all = all_textures(scene).into_iter();
    all.map(|(material, role, texture)| TextureInfo {
        material: material.to_owned(),
        role,
        width: texture.size().0,
        height: texture.size().1,
    })
    .collect()
}

/// Bytes of all pictures, each once.
fn texture_bytes(scene: &Scene) -> usize {
    let mut seen: Vec<&Texture> = Vec::new();
    for (_, _, texture) in all_textures(scene) {
        if !seen.iter().any(|other| other.shares_picture(texture)) {
            seen.push(texture);
        }
    }
    seen.iter().map(|t| t.bytes()).sum()
}

/// What of the renderer the scene needs; a scene pays for nothing else.
fn kernels(scene: &Scene) -> Vec<String> {
    let mut kernels: Vec<String> = Vec::new();
    let mut need = |name: String| {
        if !kernels.contains(&name) {
            kernels.push(name);
        }
    };
    let in_use = || scene.mesh.materials_in_use(&scene.materials);
    for material in in_use().filter(|m| m.emission.is_none()) {
        let kind = match material.bsdf {
            Bsdf::Lambert { .. } => "Lambert",
            Bsdf::Mirror { .. } => "mirror",
            Bsdf::Conductor { .. } => "metal",
            Bsdf::Glass { .. } => "smooth glass",
            Bsdf::RoughGlass { .. } => "rough glass",
            Bsdf::Thin { .. } => "smooth panes",
            Bsdf::RoughThin { .. } => "rough panes",
            Bsdf::Plastic { .. } => "plastic",
        };
        need(kind.to_owned());
    }
    if !scene.reflectors.is_empty() && !scene.lights.is_empty() {
        need("walks to lights by mirrors and glass".to_owned());
    }
    need("reconnection".to_owned());
    let copies = |m: &Material| {
        let smooth = matches!(m.bsdf, Bsdf::Plastic { coat, .. } if coat.is_smooth());
        m.class == Class::Specular || smooth
    };
    if in_use().any(copies) {
        need("half-vector copy".to_owned());
    }
    let (triangles, points) = (
        scene.lights.triangles(),
        scene.lights.punctual().points.len(),
    );
    let count = |n: usize, what: &str| match n {
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
    };
    let lights = match (triangles, points) {
        (_, 0) => count(triangles, "triangle"),
        (0, _) => count(points, "point"),
        _ => format!(
            "{} and {}",
            count(triangles, "triangle"),
            count(points, "point")
        ),
    };
    if scene.lights.depend_on_place() {
        need(format!("light choice by place among {lights}"));
    } else if triangles + points > 0 {
        need(format!("light choice by power among {lights}"));
    }
    if scene.environment.map().is_some() {
        need("environment map".to_owned());
    }
    if in_use().any(|m| m.textures.is_some()) {
        need("textures".to_owned());
    }
    if scene.mesh.cutouts.is_some() {
        need("cut-outs".to_owned());
    }
    if scene.camera.lens.is_some() {
        need("lens".to_owned());
    }
    if scene.is_diffuse() {
        need("diffuse throughout".to_owned());
    }
    kernels
}

/// Where light comes from in which there is nothing.
fn environment(environment: &Environment) -> String {
    match environment {
        Environment::Constant(radiance) => format!("{:?}", radiance.to_array()),
        Environment::Map(map) => match map.kind {
            MapKind::Picture => {
                let (width, height) = map.size();
                format!("a map of {width}x{height}")
            }
            MapKind::Sky => "a clear sky".to_owned(),
            MapKind::Studio => "a studio".to_owned(),
        },
    }
}

/// What a material became, with textures in place of the values that they replace.
fn describe(material: &Material) -> String {
    let texture = |role: &str| {
        let mut named = material.textures.iter().flat_map(|t| t.named());
        let (_, texture) = named.find(|(name, _)| *name == role)?;
        let (width, height) = texture.size();
        Some(format!("texture of {width}x{height}"))
    };
    let colour = |c: Vec3| format!("{},{},{}", c.x, c.y, c.z);
    let rounded = |c: Vec3| colour((c * 1e4).round() / 1e4);
    let by_vertices = material.textures.iter().any(|t| t.has_vertex_colours());
    let base = |c: Vec3| match by_vertices {
        true => "colours of vertices".to_owned(),
        false => texture("colour").unwrap_or_else(|| rounded(c)),
    };
    let roughness = |alpha: f32| match texture("roughness") {
        Some(texture) => format!("roughness {texture}"),
        None => format!("alpha {}", (alpha * 1e4).round() / 1e4),
    };
    // Through both boundaries of a body.
    let twice = |tint: Vec3| rounded(tint * tint);
    if let Some(radiance) = material.emission {
        let times = texture("emission").map(|t| format!(" times a {t}"));
        return format!(
            "light of radiance {}{}",
            colour(radiance),
            times.unwrap_or_default()
        );
    }
    match material.bsdf {
        Bsdf::Lambert { albedo } => format!("Lambert {}", base(albedo)),
        Bsdf::Mirror { f0 } => format!("mirror {}", base(f0)),
        Bsdf::Conductor { f0, alpha } => format!("metal {}, {}", base(f0), roughness(alpha)),
        Bsdf::Glass { ior, tint } => format!("solid glass {ior}, tint {}", twice(tint)),
        Bsdf::RoughGlass { ior, alpha, tint } => {
            format!(
                "solid glass {ior}, {}, tint {}",
                roughness(alpha),
                twice(tint)
            )
        }
        Bsdf::Thin { ior, tint } => format!("thin glass {ior}, tint {}", rounded(tint)),
        Bsdf::RoughThin { ior, alpha, tint } => {
            format!(
                "thin glass {ior}, {}, tint {}",
                roughness(alpha),
                rounded(tint)
            )
        }
        Bsdf::Plastic { albedo, coat } if coat.opacity < 1.0 && coat.tint == Vec3::ZERO => {
            format!("Lambert {}, opacity {}", base(albedo), coat.opacity)
        }
        Bsdf::Plastic { albedo, coat } => {
            let metal = if coat.metallic > 0.0 {
                format!(", {} metal {}", coat.metallic, rounded(coat.metal))
            } else {
                String::new()
            };
            let opacity = if coat.opacity < 1.0 {
                format!(", opacity {}", coat.opacity)
            } else {
                String::new()
            };
            format!(
                "plastic {}, coat {:.3}, {}{metal}{opacity}",
                base(albedo),
                coat.f0,
                roughness(coat.alpha)
            )
        }
    }
}
