//! The scene: immutable, free of I/O and of tracing. Built from what `load` read.

pub mod camera;
pub mod light;
pub mod material;
pub mod mesh;

use crate::error::{Error, Result, Warnings};
use crate::load::obj::ObjFile;
use crate::load::sidecar::CameraTable;
use crate::load::{MAX_PIXELS, MAX_SIDE};
use camera::Camera;
use glam::Vec3;
use light::Lights;
use material::Material;
use mesh::Mesh;
use std::path::Path;
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3;

/// Everything that a picture is a function of, beside the settings of the renderer.
#[derive(Debug)]
pub struct Scene {
    /// The triangles; shared with the traversal backend.
    pub mesh: Arc<Mesh>,
    /// What triangles refer to by [`Mesh::material_of`].
    pub materials: Vec<Material>,
    /// The emitting triangles.
    pub lights: Lights,
    /// Radiance that arrives from every direction in which there is nothing.
    pub environment: Vec3,
    /// The pinhole camera.
    pub camera: Camera,
}

/// What the user asked for beside the OBJ: TOML and flags, merged.
#[derive(Clone, Debug, Default)]
pub struct SceneSettings {
    /// Camera values; what is absent is framed automatically.
    pub camera: CameraTable,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Constant radiance of the environment.
    pub environment: Option<Vec3>,
    /// Vertices at most this rough are of class specular.
    pub roughness_threshold: f32,
}

impl Scene {
    /// Builds the scene; `path` is for messages.
    pub fn build(
        path: &Path,
        obj: ObjFile,
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
        let materials = obj
            .materials
            .iter()
            .map(|m| Material::from_mtl(m, settings.roughness_threshold, path, warnings))
            .collect::<Result<Vec<_>>>()?;
        let mesh = Mesh::new(obj);
        let lights = Lights::new(&mesh, &materials);
        let environment = match settings.environment {
            Some(radiance) if !(radiance.is_finite() && radiance.min_element() >= 0.0) => {
                return Err(Error::Setting(format!(
                    "the environment's radiance must be finite and not negative, got {radiance}"
                )));
            }
            Some(radiance) => radiance,
            None if lights.is_empty() => {
                warnings.note("the scene has no light: a white environment is used");
                Vec3::ONE
            }
            None => Vec3::ZERO,
        };
        let camera = Camera::new(&settings.camera, (width, height), mesh.bounds)?;
        Ok(Self {
            mesh: Arc::new(mesh),
            materials,
            lights,
            environment,
            camera,
        })
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
