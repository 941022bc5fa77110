//! The commands, from flags to files.

pub mod bench;
pub mod chart;
pub mod compare;
mod finish;
pub mod info;
pub mod manual;
mod memory;
pub mod merge;
pub mod reconstruct;
pub mod render;
pub mod spectrum;

use crate::cli::{EnvironmentFlag, ReadingArgs, SizeFlag};
use crate::error::{Error, Result, Warnings};
use crate::image::Image;
use crate::load::environment::{Background, EnvironmentTable, Model};
use crate::load::sidecar::CameraTable;
use crate::load::{obj, sidecar};
use crate::output::format::{Encoding, Format};
use crate::reconstruct::{Alpha, Kind, Method};
use crate::render::Method as RenderMethod;
use crate::scene::framing::Open;
use crate::scene::material::ROUGHNESS_THRESHOLD;
use crate::scene::smoothing;
use crate::scene::{EnvironmentSetting, Scene, SceneSettings};
use crate::trace::{Backend, Traverse};
use crate::vantage;
use std::path::Path;

/// How the program ended, if not with an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Everything that was asked for is done.
    Done,
    /// A signal ended the render; what there was is written.
    Interrupted,
    /// A signal ended the render of a film, which can go on.
    Unfinished,
}

/// What flags say of the scene. They win over the TOML.
#[derive(Clone)]
struct SceneFlags {
    camera: CameraTable,
    /// Which of the TOML's cameras.
    camera_name: Option<String>,
    size: Option<SizeFlag>,
    environment: EnvironmentFlags,
    roughness_threshold: f32,
    reading: ReadingArgs,
    /// Whether it shall be known to which objects triangles belong.
    objects: bool,
}

/// What flags say of the light from where there is nothing.
#[derive(Clone, Default)]
struct EnvironmentFlags {
    source: Option<EnvironmentFlag>,
    sun: Option<[f32; 2]>,
    rotation: Option<f32>,
    scale: Option<f32>,
    background: Option<Background>,
}

impl EnvironmentFlags {
    /// The table with what the flags say in its place.
    fn over(self, mut table: EnvironmentTable) -> Result<EnvironmentTable> {
        let sky = EnvironmentFlag::Model(Model::Sky);
        let source = match (self.source, self.sun) {
            (None, Some(_)) => Some(sky.clone()),
            (Some(source), Some(_)) if source != sky => {
                let message = "--sun is of a sky: it goes with --environment sky alone";
                return Err(Error::Setting(message.into()));
            }
            (source, _) => source,
        };
        if let Some(source) = source {
            // Another map is turned and scaled as the TOML's; no other light is.
            let is_map = matches!(source, EnvironmentFlag::Map(_));
            let of_map = |value: Option<f32>| value.filter(|_| is_map);
            table = EnvironmentTable {
                sun: self.sun.or(table.sun.filter(|_| source == sky)),
                rotation: of_map(table.rotation),
                scale: of_map(table.scale),
                background: table.background,
                ..Default::default()
            };
            match source {
                EnvironmentFlag::Radiance(radiance) => table.radiance = Some(radiance),
                EnvironmentFlag::Model(model) => table.model = Some(model),
                EnvironmentFlag::Map(map) => {
                    table.map = Some(map);
                    table.read_map()?;
                }
            }
        }
        table.rotation = self.rotation.or(table.rotation);
        table.scale = self.scale.or(table.scale);
        table.background = self.background.or(table.background);
        Ok(table)
    }
}

impl SceneFlags {
    /// Nothing but how it is read, and a size, where one is given.
    fn of_size(size: Option<SizeFlag>, reading: &ReadingArgs) -> Self {
        Self {
            camera: CameraTable::default(),
            camera_name: None,
            size,
            environment: EnvironmentFlags::default(),
            roughness_threshold: ROUGHNESS_THRESHOLD,
            reading: reading.clone(),
            objects: false,
        }
    }
}

/// What a picture is written as where neither its name nor a flag says it.
const MADE_UP_FORMAT: Format = Format::Display(Encoding::Png);
/// The share of each pixel that the scene covers, of pictures without alpha.
const COVERAGE: &str = "coverage.A";
/// Before the names of layers that hold half A of the samples.
const HALF_A: &str = "half_a.";
const MAX_THREADS: usize = 1024;
const DEFAULT_SIZE: u32 = 512;

/// Reads the OBJ and the TOML beside it.
fn load_scene(path: &Path, flags: SceneFlags, warnings: &mut Warnings) -> Result<Scene> {
    let toml = sidecar::load(path)?;
    if let Some(folder) = flags.reading.textures.as_deref().filter(|f| !f.is_dir()) {
        return Err(Error::Setting(format!(
            "--textures {}: there is no such folder",
            folder.display()
        )));
    }
    let options = obj::Options {
        textures: flags.reading.textures,
        repairs: toml.repairs.clone(),
        objects: flags.objects,
    };
    let mut file = obj::load_with(path, &options, warnings)?;
    if let Some(degrees) = flags.reading.smooth {
        smoothing::smooth_edges(&mut file, degrees);
    }
    let camera = toml.camera_named(flags.camera_name.as_deref())?;
    let camera = flags.camera.or(&camera);
    let film = (
        toml.film.width.unwrap_or(DEFAULT_SIZE),
        toml.film.height.unwrap_or(DEFAULT_SIZE),
    );
    let size = flags.size.map_or(film, |size| size.of_film(film));
    let settings = SceneSettings {
        camera,
        size,
        environment: EnvironmentSetting::of_table(&flags.environment.over(toml.environment)?),
        lights: toml.lights,
        roughness_threshold: flags.roughness_threshold,
    };
    Scene::build(path, file, &settings, warnings)
}

/// Reads the OBJ and the TOML beside it, and has the camera stand where most is seen if that is open.
fn load_with_camera(path: &Path, flags: SceneFlags, warnings: &mut Warnings) -> Result<Scene> {
    let mut scene = load_scene(path, flags, warnings)?;
    if scene.framing.open() != Open::Nothing {
        let tracer = Backend::DEFAULT.build(&scene.mesh, rayon::current_num_threads())?;
        settle(&mut scene, &*tracer, warnings)?;
    }
    Ok(scene)
}

/// Has the camera stand where most is seen if that is open. Works on the current pool.
fn settle(scene: &mut Scene, tracer: &dyn Traverse, warnings: &mut Warnings) -> Result<()> {
    if let Some(note) = vantage::settle(scene, tracer)? {
        warnings.note(note);
    }
    Ok(())
}

/// The reconstruction of what `method` has rendered: the one that is named, or the one that is meant where none is.
fn kind_for(method: RenderMethod, named: Option<Kind>, denoise: bool) -> Result<Kind> {
    let is_pt = method == RenderMethod::Pt;
    match named {
        Some(kind) if is_pt && kind.needs_gradients() => {
            let others = Kind::names(|kind| !kind.needs_gradients());
            Err(Error::Setting(format!(
                "--reconstruct needs gradients, which --method pt does not have ({others} do not)"
            )))
        }
        Some(kind) => Ok(kind),
        None => Ok(match (is_pt, denoise) {
            (true, true) => Kind::Oidn,
            (true, false) => Kind::None,
            (false, true) => Kind::Guided,
            (false, false) => Kind::Weighted,
        }),
    }
}

/// The method that the flags name, with a denoiser of so many threads.
fn reconstruction(
    kind: Kind,
    alpha: Option<Alpha>,
    threads: usize,
    warnings: &mut Warnings,
) -> Result<Method> {
    if alpha.is_some() && !kind.has_alpha() {
        let those = Kind::names(Kind::has_alpha);
        warnings.push(format!("--alpha matters for --reconstruct {those} alone"))?;
    }
    kind.method(alpha, threads)
}

/// The channel that has the share of each pixel that the scene covers: alpha, where that is the picture's.
fn coverage_channel(background: Background) -> &'static str {
    match background {
        Background::Environment | Background::Colour(_) => COVERAGE,
        Background::Transparent => "A",
    }
}

/// Refuses an image that is not of the size of another.
fn check_same_size(path: &Path, image: &Image, other_path: &Path, other: &Image) -> Result<()> {
    if (image.width, image.height) == (other.width, other.height) {
        return Ok(());
    }
    let message = format!(
        "is {}x{}, but {} is {}x{}",
        image.width,
        image.height,
        other_path.display(),
        other.width,
        other.height
    );
    Err(Error::input(path, None, message))
}

/// What `values` holds, each once.
fn distinct<T: PartialEq + Copy>(values: &[T]) -> Vec<T> {
    let mut distinct = Vec::new();
    for &value in values {
        if !distinct.contains(&value) {
            distinct.push(value);
        }
    }
    distinct
}

/// A pool of `threads` threads, or of as many as the machine has.
fn thread_pool(threads: Option<usize>) -> Result<rayon::ThreadPool> {
    if threads.is_some_and(|n| n == 0 || n > MAX_THREADS) {
        return Err(Error::Setting(format!(
            "--threads must be from 1 to {MAX_THREADS}"
        )));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|e| Error::Setting(format!("the threads could not be started: {e}")))
}
