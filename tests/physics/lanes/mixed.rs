//! Random scenes in which all materials, lights, textures, lenses and filters meet.

use crate::common::{Render, Rng, light};
use gdpt::bsdf::Bsdf;
use gdpt::bsdf::plastic::Coat;
use gdpt::error::Warnings;
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::load::bitmap::{Bitmap, Texels};
use gdpt::load::map::MapStatement;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::obj::{NONE, ObjFile};
use gdpt::load::sidecar::CameraTable;
use gdpt::path::Manifold;
use gdpt::render::Method;
use gdpt::sampler::SamplerKind;
use gdpt::scene::material::{Class, Material};
use gdpt::scene::textured::{Colour, Relief, Roughness};
use gdpt::scene::{EnvironmentSetting, EnvironmentSource, Scene, SceneSettings};
use glam::{Vec2, Vec3};
use std::path::Path;
use std::sync::Arc;

/// Surfaces: the first of these materials.
const SURFACES: usize = 9;
/// Lamps: the others, one of them textured.
const LAMPS: usize = 3;

impl Rng {
    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f32) as usize
    }

    fn of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }
}

/// A scene, and how to render it.
pub fn mixed(seed: u64) -> (Scene, Render) {
    let mut rng = Rng(seed);
    let scene = scene(&mut rng);
    let render = Render {
        method: rng.of(&[Method::Pt, Method::Gpt, Method::Gpt]),
        weights: rng.of(&[Weights::Mis, Weights::Mis, Weights::Symmetric]),
        spp: 3,
        seed,
        sampler: rng.of(&[SamplerKind::Sobol, SamplerKind::Independent]),
        depth: 1 + rng.below(9) as u32,
        tile_size: 1 + rng.below(24) as u32,
        filter: rng.of(&[
            Filter::Box,
            Filter::Tent,
            Filter::Gaussian,
            Filter::Mitchell,
        ]),
        manifold: Manifold::Off,
    };
    (scene, render)
}

/// Triangles all around the camera, with lights among them.
fn scene(rng: &mut Rng) -> Scene {
    let mut file = ObjFile::default();
    let textured: Vec<bool> = (0..SURFACES).map(|_| rng.one_in(4)).collect();
    let holes = rng.one_in(4).then(|| rng.below(SURFACES));
    for (index, &textured) in textured.iter().enumerate() {
        let mut maps = Vec::new();
        if textured {
            maps.push(map("map_kd", rng));
            maps.push(map(rng.of(&["norm", "map_bump"]), rng));
        }
        if holes == Some(index) {
            maps.push(map("map_d", rng));
        }
        file.materials.push(MtlMaterial {
            kd: Some([0.5; 3]),
            // What the scene is told is that not all is diffuse.
            pm: Some(1.0),
            maps,
            ..Default::default()
        });
    }
    for lamp in 0..LAMPS {
        file.materials.push(MtlMaterial {
            ke: Some((rng.vector() * 8.0).to_array()),
            maps: if lamp == 0 {
                vec![map("map_ke", rng)]
            } else {
                Vec::new()
            },
            ..light(1.0)
        });
    }
    triangles(rng, &mut file);
    if rng.one_in(4) {
        file.colours = file.positions.iter().map(|_| rng.vector()).collect();
    }

    let aperture = if rng.one_in(4) { 0.1 } else { 0.0 };
    let environment: EnvironmentSetting = match rng.below(4) {
        0 => {
            let picture = picture(rng);
            EnvironmentSetting {
                scale: 0.5,
                rotation: 90.0 * rng.next(),
                ..EnvironmentSource::Map(picture).into()
            }
        }
        1 => (0.3 * rng.vector()).into(),
        _ => Vec3::ZERO.into(),
    };
    let settings = SceneSettings {
        camera: CameraTable {
            origin: Some([0.0; 3]),
            target: Some([0.0, 0.0, 1.0]),
            up: Some([0.0, 1.0, 0.0].into()),
            fov: Some(90.0),
            aperture: Some(aperture),
            focus: Some(1.0),
            ..Default::default()
        },
        size: (1 + rng.below(24) as u32, 1 + rng.below(24) as u32),
        environment,
        roughness_threshold: 0.02,
        ..Default::default()
    };
    let mut warnings = Warnings::new(false);
    let mut scene = Scene::build(Path::new("test.obj"), file, &settings, &mut warnings).unwrap();
    for material in &mut scene.materials[..SURFACES] {
        scatter(rng, material, settings.roughness_threshold);
    }
    scene
}

/// Triangles of any shape; some share their corners and have normals of their own.
fn triangles(rng: &mut Rng, file: &mut ObjFile) {
    let surfaces = 8 + rng.below(50);
    // From 64 on they are chosen by place.
    let lamps = if rng.one_in(6) { 70 } else { 1 + rng.below(8) };
    for triangle in 0..surfaces + lamps {
        let is_lamp = triangle >= surfaces;
        let centre = rng.unit_vector() * (0.5 + rng.next());
        let extent = if is_lamp && lamps > 8 { 0.1 } else { 1.2 };
        let extent = 0.1 + extent * rng.next();
        let first = file.positions.len() as u32;
        for _ in 0..3 {
            file.positions.push(centre + rng.unit_vector() * extent);
            file.texcoords.push(Vec2::new(rng.next(), rng.next()) * 3.0);
        }
        let corners = [first, first + 1, first + 2];
        file.triangles.push(corners);
        file.texcoord_triangles.push(corners);
        // About the geometric normal, or none.
        let [a, b, c] = corners.map(|i| file.positions[i as usize]);
        let n = (b - a).cross(c - a).normalize_or(Vec3::X);
        for _ in 0..3 {
            file.normals.push(n + rng.unit_vector() * 0.4);
        }
        let flat = rng.one_in(2);
        file.normal_triangles
            .push(if flat { [NONE; 3] } else { corners });
        let material = if is_lamp {
            SURFACES + rng.below(LAMPS)
        } else {
            rng.below(SURFACES)
        };
        file.material_of.push(material as u32);
    }
}

/// Makes a material of any kind of one that may be textured.
fn scatter(rng: &mut Rng, material: &mut Material, roughness_threshold: f32) {
    let colour = rng.vector();
    let alpha = rng.of(&[0.001, 0.015, 0.1, 0.5]);
    let ior = rng.of(&[1.5, 1.33, 0.8, 2.4]);
    let opacity = rng.of(&[1.0, 1.0, 0.6]);
    material.bsdf = match rng.below(9) {
        0 => Bsdf::Lambert { albedo: colour },
        1 => Bsdf::Mirror { f0: colour },
        2 => Bsdf::Conductor { f0: colour, alpha },
        3 => Bsdf::Glass { ior, tint: colour },
        4 => Bsdf::RoughGlass {
            ior,
            alpha,
            tint: colour,
        },
        5 => Bsdf::Thin { ior, tint: colour },
        6 => Bsdf::RoughThin {
            ior,
            alpha,
            tint: colour,
        },
        _ => Bsdf::Plastic {
            albedo: colour,
            coat: Coat {
                f0: rng.of(&[0.04, 0.2]),
                tint: rng.vector(),
                metallic: rng.of(&[0.0, 0.0, 0.4]),
                metal: rng.vector(),
                metal_is_albedo: rng.one_in(3),
                alpha: rng.of(&[0.0, 0.0, 0.02, 0.3]),
                opacity,
                through: colour * (1.0 - opacity),
            },
        },
    };
    material.parameters = material.bsdf.parameters();
    material.class = if material.bsdf.roughness() > roughness_threshold {
        Class::Rough
    } else {
        Class::Specular
    };
    material.survival = 0.4 + 0.5 * rng.next();
    // The pictures of colours are those of other values too. Single directions have no roughness to vary.
    let smooth = material.parameters.alpha == 0.0;
    let is_plastic = matches!(material.bsdf, Bsdf::Plastic { .. });
    if let Some(textures) = material.textures.as_deref_mut() {
        let colour = match &textures.colour {
            Some(Colour::Texture(map)) => Some(map.clone()),
            Some(Colour::Vertices { .. }) | None => None,
        };
        if !smooth && rng.one_in(2) {
            textures.roughness = colour.clone().map(Roughness::Pr);
        }
        if is_plastic && rng.one_in(2) {
            textures.specular = colour.clone();
        }
        if is_plastic && rng.one_in(3) {
            textures.metallic = colour;
        }
        if let Some(Relief::Heights(map, factor)) = &textures.relief
            && rng.one_in(2)
        {
            textures.relief = Some(Relief::Normals(map.clone(), *factor));
        }
        if rng.one_in(3) {
            textures.relief = None;
        }
    }
}

fn map(key: &str, rng: &mut Rng) -> MapStatement {
    let (mut map, _) = MapStatement::parse(key, "a.png", String::new(), Path::new("")).unwrap();
    map.multiplier = 0.3;
    map.bitmap = Some(picture(rng));
    map
}

fn picture(rng: &mut Rng) -> Arc<Bitmap> {
    let (width, height) = (1 + rng.below(6) as u32, 1 + rng.below(6) as u32);
    let values = (0..width * height).map(|_| rng.vector().to_array());
    Arc::new(Bitmap {
        width,
        height,
        texels: Texels::Floats {
            values: values.collect(),
            alpha: None,
            encoded: false,
        },
        has_alpha: false,
    })
}
