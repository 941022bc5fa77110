//! The scene: immutable, free of I/O and of tracing. Built from what `load` read.

mod alias;
pub mod camera;
mod content;
mod cumulative;
pub mod environment;
mod flat;
pub mod framing;
mod from_mtl;
mod lamps;
pub mod light;
mod light_grid;
pub mod light_sample;
pub mod material;
pub mod mesh;
mod passage;
mod place;
pub mod punctual;
mod ranges;
pub mod reflectors;
pub mod remarks;
mod sheets;
mod sky;
pub mod smoothing;
mod studio;
mod surroundings;
pub mod texture;
pub mod textured;
pub mod up_axis;
mod vertex_colours;

pub use surroundings::{EnvironmentSetting, EnvironmentSource};

use crate::bsdf::Bsdf;
use crate::error::{Error, Result, Warnings};
use crate::lanes::Vec3x8;
use crate::load::environment::Background;
use crate::load::lights::PunctualLight;
use crate::load::obj::ObjFile;
use crate::load::sidecar::CameraTable;
use crate::load::{MAX_PIXELS, MAX_SIDE};
use camera::Camera;
use environment::{Environment, MapKind};
use framing::Framing;
use glam::Vec3;
use light::Lights;
use material::{Class, Material};
use mesh::Mesh;
use punctual::Punctual;
use reflectors::Reflectors;
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
    /// What triangles refer to by [`Mesh::object_of`]; empty where nobody asked for them.
    pub objects: Vec<String>,
    /// What is sampled as a light.
    pub lights: Lights,
    /// What sends light on in single directions.
    pub reflectors: Reflectors,
    /// Radiance that arrives from every direction in which there is nothing.
    pub environment: Environment,
    /// What the camera sees there.
    pub background: Background,
    /// The camera.
    pub camera: Camera,
    /// What the camera would be from elsewhere.
    pub framing: Framing,
    /// Degrees by which a studio is turned against the camera.
    studio_rotation: f32,
    is_diffuse: bool,
}

/// What the user asked for beside the OBJ: TOML and flags, merged.
#[derive(Clone, Debug)]
pub struct SceneSettings {
    /// Camera values; what is absent is framed automatically.
    pub camera: CameraTable,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Light from where there is nothing, and what the camera sees there.
    pub environment: EnvironmentSetting,
    /// Lights without extent.
    pub lights: Vec<PunctualLight>,
    /// Vertices at most this rough are of class specular; on planes they may be rougher, see [`material::FLAT`].
    pub roughness_threshold: f32,
}

impl Default for SceneSettings {
    fn default() -> Self {
        Self {
            camera: CameraTable::default(),
            size: (0, 0),
            environment: EnvironmentSetting::default(),
            lights: Vec::new(),
            roughness_threshold: material::ROUGHNESS_THRESHOLD,
        }
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
        let colour = vertex_colours::make_linear(&mut obj);
        let mut materials = materials(&obj, colour, settings.roughness_threshold, path, warnings)?;
        sheets::make_thin(&mut obj, &mut materials, settings.roughness_threshold);
        lamps::face_normals(&mut obj, &materials);
        smoothing::add_normals(&mut obj);
        lamps::part(&mut obj, &materials);
        let opacity = obj.materials.iter().map(textured::opacity).collect();
        for note in content::notes(&obj.materials) {
            warnings.note(note);
        }
        let objects = std::mem::take(&mut obj.objects);
        let mesh = Mesh::new(obj, opacity);
        // What such lights throw on metal by mirrors and through panes, walks alone find, and only where it is rough.
        if settings.lights.is_empty() {
            flat::let_planes_be_specular(&mesh, &mut materials, settings.roughness_threshold);
        }
        let has_pictures = |m: &Material| m.textures.iter().any(|t| t.named().next().is_some());
        if materials.iter().any(has_pictures) {
            let counts = mesh.without_texcoords(materials.len());
            for (material, count) in materials.iter().zip(counts) {
                if has_pictures(material) && count > 0 {
                    warnings.push(format!(
                        "{}: {count} triangles of material '{}' have no texture coordinates: its textures are \
                         one colour there",
                        path.display(),
                        material.name
                    ))?;
                }
            }
        }
        let up = UpAxis::new(&settings.camera, &mesh, &materials)?;
        let framing = Framing::new(&settings.camera, (width, height), up)?;
        let camera = framing.camera(&mesh)?;
        let punctual = Punctual::new(&settings.lights);
        let has_lamps = !punctual.is_empty()
            || mesh
                .materials_in_use(&materials)
                .any(|material| material.emission.is_some());
        let (environment, background) =
            surroundings::build(&settings.environment, &camera, has_lamps, warnings)?;
        let lights = Lights::new(&mesh, &materials, punctual, environment.map().is_some());
        let is_diffuse = lights.are_plain() && mesh.materials_in_use(&materials).all(is_lambert);
        let reflectors = Reflectors::new(&mesh, &materials);
        Ok(Self {
            mesh: Arc::new(mesh),
            materials,
            objects,
            lights,
            reflectors,
            environment,
            background,
            camera,
            framing,
            studio_rotation: settings.environment.rotation,
            is_diffuse,
        })
    }

    /// Looks at the scene by another camera. The lamps of a studio follow it.
    pub fn look_by(&mut self, camera: Camera) {
        if let Environment::Map(map) = &mut self.environment
            && map.kind == MapKind::Studio
        {
            map.turn_to(surroundings::studio_rotation(&camera, self.studio_rotation));
        }
        self.camera = camera;
    }

    /// Whether the camera sees the environment where there is nothing.
    pub fn shows_environment(&self) -> bool {
        self.background == Background::Environment
    }

    /// Light that the camera sees in the unit directions `direction` in `lanes`, in which there is nothing.
    #[inline]
    pub fn seen_directly(&self, direction: Vec3x8, lanes: u32) -> Vec3x8 {
        match self.background {
            Background::Environment => self.environment.radiance_in(direction, lanes),
            Background::Colour(_) | Background::Transparent => Vec3x8::ZERO,
        }
    }

    /// Whether all that scatters is a Lambert surface and the lights are plain: then paths need no code for anything
    /// else.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        self.is_diffuse
    }

    /// Has paths traced as in any other scene even so, to compare with.
    pub fn forget_diffuse(&mut self) {
        self.is_diffuse = false;
    }

    /// A fingerprint of geometry, materials, light and camera: the same on every machine.
    pub fn hash(&self) -> u64 {
        let mut hasher = Xxh3::new();
        self.mesh.hash_into(&mut hasher);
        let rest = (&self.materials, &self.environment, &self.camera);
        mesh::hash_bytes(&mut hasher, &rest);
        self.lights.punctual().hash_into(&mut hasher);
        hasher.update(&[u8::from(self.shows_environment())]);
        hasher.digest()
    }
}

/// What the file's materials mean, with remarks on those that are in use.
fn materials(
    obj: &ObjFile,
    vertices: Option<Vec3>,
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
        Material::from_mtl(m, vertices, roughness_threshold, remarks)
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
