//! The scene: immutable, free of I/O and of tracing. Built from what `load` read.

mod alias;
pub mod camera;
mod content;
pub mod environment;
pub mod framing;
mod from_mtl;
pub mod light;
mod light_grid;
pub mod material;
pub mod mesh;
mod passage;
mod ranges;
pub mod remarks;
mod sheets;
pub mod texture;
pub mod textured;
pub mod up_axis;

use crate::bsdf::Bsdf;
use crate::error::{Error, Result, Warnings};
use crate::load::bitmap::Bitmap;
use crate::load::obj::ObjFile;
use crate::load::sidecar::{CameraTable, EnvironmentTable};
use crate::load::{MAX_PIXELS, MAX_SIDE};
use camera::Camera;
use environment::{Environment, EnvironmentMap};
use framing::Framing;
use glam::Vec3;
use light::Lights;
use material::{Class, Material};
use mesh::Mesh;
use remarks::Remarks;
use std::path::Path;
use std::sync::Arc;
use up_axis::UpAxis;
use xxhash_rust::xxh3::Xxh3;

/// Everything that a picture is a function of, beside the settings of the renderer.
#[derive(Debug)]
pub struct Scene {
    /// The triangles; shared with the traversal backend.
    pub mesh: Arc<Mesh>,
    /// What triangles refer to by [`Mesh::material_of`].
    pub materials: Vec<Material>,
    /// What is sampled as a light.
    pub lights: Lights,
    /// Radiance that arrives from every direction in which there is nothing.
    pub environment: Environment,
    /// The camera.
    pub camera: Camera,
    /// What the camera would be from elsewhere.
    pub framing: Framing,
    in_lanes: bool,
    is_diffuse: bool,
}

/// What the user asked for beside the OBJ: TOML and flags, merged.
#[derive(Clone, Debug, Default)]
pub struct SceneSettings {
    /// Camera values; what is absent is framed automatically.
    pub camera: CameraTable,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Where light comes from in which there is nothing; chosen automatically if absent.
    pub environment: Option<EnvironmentSetting>,
    /// Vertices at most this rough are of class specular.
    pub roughness_threshold: f32,
}

/// What the user asked for as the environment.
#[derive(Clone, Debug)]
pub enum EnvironmentSetting {
    /// Constant radiance.
    Constant(Vec3),
    /// A map.
    Map {
        /// Longitude across, latitude down.
        bitmap: Arc<Bitmap>,
        /// Factor on its values.
        scale: f32,
        /// Degrees by which it is turned about the vertical axis.
        rotation: f32,
    },
}

impl EnvironmentSetting {
    /// What a table asks for; `None` where it is empty.
    pub fn of_table(table: &EnvironmentTable) -> Option<Self> {
        match (&table.bitmap, table.radiance) {
            (Some(bitmap), _) => Some(EnvironmentSetting::Map {
                bitmap: bitmap.clone(),
                scale: table.scale.unwrap_or(1.0),
                rotation: table.rotation.unwrap_or(0.0),
            }),
            (None, radiance) => radiance.map(|r| Vec3::from(r).into()),
        }
    }
}

impl From<Vec3> for EnvironmentSetting {
    fn from(radiance: Vec3) -> Self {
        EnvironmentSetting::Constant(radiance)
    }
}

impl Scene {
    /// Builds the scene; `path` is for messages.
    pub fn build(
        path: &Path,
        mut obj: ObjFile,
        settings: &SceneSettings,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        let (width, height) = settings.size;
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || width > MAX_SIDE || height > MAX_SIDE || pixels > MAX_PIXELS {
            return Err(Error::Setting(format!(
                "the size {width}x{height} is not possible: each side from 1 to {MAX_SIDE}, \
                 at most {MAX_PIXELS} pixels"
            )));
        }
        let mut materials = materials(&obj, settings.roughness_threshold, path, warnings)?;
        sheets::make_thin(&mut obj, &mut materials, settings.roughness_threshold);
        let opacity = obj.materials.iter().map(textured::opacity).collect();
        for note in content::notes(&obj.materials) {
            warnings.note(note);
        }
        let mesh = Mesh::new(obj, opacity);
        if materials.iter().any(|m| m.textures.is_some()) {
            let counts = mesh.without_texcoords(materials.len());
            for (material, count) in materials.iter().zip(counts) {
                if material.textures.is_some() && count > 0 {
                    warnings.push(format!(
                        "{}: {count} triangles of material '{}' have no texture coordinates: its textures are \
                         one colour there",
                        path.display(),
                        material.name
                    ))?;
                }
            }
        }
        let has_map = matches!(settings.environment, Some(EnvironmentSetting::Map { .. }));
        let lights = Lights::new(&mesh, &materials, has_map);
        let up = UpAxis::new(&settings.camera, &mesh, &materials)?;
        let framing = Framing::new(&settings.camera, (width, height), up)?;
        let camera = framing.camera(&mesh)?;
        let environment = environment(settings, &up, !lights.emit(), warnings)?;
        let in_lanes = !mesh.triangles.is_empty();
        let is_diffuse =
            in_lanes && lights.are_plain() && mesh.materials_in_use(&materials).all(is_lambert);
        Ok(Self {
            mesh: Arc::new(mesh),
            materials,
            lights,
            environment,
            camera,
            framing,
            in_lanes,
            is_diffuse,
        })
    }

    /// Whether paths are shaded eight at once, in lanes.
    #[inline]
    pub fn in_lanes(&self) -> bool {
        self.in_lanes
    }

    /// Whether all that scatters is a Lambert surface and the lights are plain: then base paths with offset paths
    /// are in lanes too.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        self.is_diffuse
    }

    /// Has all paths shaded one by one even so, to compare with.
    pub fn leave_lanes(&mut self) {
        (self.in_lanes, self.is_diffuse) = (false, false);
    }

    /// A fingerprint of geometry, materials, light and camera: the same on every machine.
    pub fn hash(&self) -> u64 {
        let mut hasher = Xxh3::new();
        self.mesh.hash_into(&mut hasher);
        let rest = (&self.materials, &self.environment, &self.camera);
        hasher.update(format!("{rest:?}").as_bytes());
        hasher.digest()
    }
}

/// What the file's materials mean, with remarks on those that are in use.
fn materials(
    obj: &ObjFile,
    roughness_threshold: f32,
    path: &Path,
    warnings: &mut Warnings,
) -> Result<Vec<Material>> {
    let mut in_use = vec![false; obj.materials.len()];
    for &material in &obj.material_of {
        in_use[material as usize] = true;
    }
    let (mut remarks, mut unheard) = (Remarks::default(), Remarks::default());
    let read = |(m, in_use)| {
        let remarks = if in_use { &mut remarks } else { &mut unheard };
        Material::from_mtl(m, roughness_threshold, remarks)
    };
    let materials = obj.materials.iter().zip(in_use).map(read).collect();
    remarks.report(path, warnings)?;
    Ok(materials)
}

/// Whether it is a light or a Lambert surface.
fn is_lambert(material: &Material) -> bool {
    let lambert = matches!(material.bsdf, Bsdf::Lambert { .. }) && material.class == Class::Rough;
    material.emission.is_some() || lambert
}

/// The environment that is asked for, or white where there is no light at all.
fn environment(
    settings: &SceneSettings,
    up: &UpAxis,
    dark: bool,
    warnings: &mut Warnings,
) -> Result<Environment> {
    Ok(match &settings.environment {
        Some(EnvironmentSetting::Constant(radiance)) => {
            if !(radiance.is_finite() && radiance.min_element() >= 0.0) {
                return Err(Error::Setting(format!(
                    "the environment's radiance must be finite and not negative, got {radiance}"
                )));
            }
            Environment::Constant(*radiance)
        }
        Some(EnvironmentSetting::Map {
            bitmap,
            scale,
            rotation,
        }) => {
            if !(scale.is_finite() && *scale > 0.0 && rotation.is_finite()) {
                return Err(Error::Setting(format!(
                    "the environment's scale {scale} must be above 0, and its rotation {rotation} finite"
                )));
            }
            let map = EnvironmentMap::new(bitmap.clone(), *scale, *rotation, up.is_z());
            Environment::Map(Box::new(map.ok_or_else(|| {
                Error::Setting("the environment's map is black".into())
            })?))
        }
        None if dark => {
            warnings.note("the scene has no light: a white environment is used");
            Environment::Constant(Vec3::ONE)
        }
        None => Environment::Constant(Vec3::ZERO),
    })
}
