//! The commands, from flags to files.

pub mod bench;
pub mod chart;
pub mod compare;
pub mod info;
pub mod manual;
pub mod reconstruct;
pub mod render;
pub mod spectrum;

use crate::cli::{EnvironmentFlag, ReadingArgs, Reconstruct, SizeFlag};
use crate::error::{Error, Result, Warnings};
use crate::film::BYTES_PER_PIXEL;
use crate::image::Image;
use crate::load::sidecar::{CameraTable, EnvironmentTable};
use crate::load::{obj, sidecar};
use crate::output::format::{Encoding, Format};
use crate::reconstruct::{Alpha, Method, PAPER_ALPHA};
use crate::scene::framing::Open;
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
}

/// What flags say of the scene. They win over the TOML.
struct SceneFlags {
    camera: CameraTable,
    /// Which of the TOML's cameras.
    camera_name: Option<String>,
    size: Option<SizeFlag>,
    environment: Option<EnvironmentFlag>,
    roughness_threshold: f32,
    reading: ReadingArgs,
}

impl SceneFlags {
    /// Nothing but how it is read, and a size, where one is given.
    fn of_size(size: Option<SizeFlag>, reading: &ReadingArgs) -> Self {
        Self {
            camera: CameraTable::default(),
            camera_name: None,
            size,
            environment: None,
            roughness_threshold: ROUGHNESS_THRESHOLD,
            reading: reading.clone(),
        }
    }
}

/// What a picture is written as where neither its name nor a flag says it.
const MADE_UP_FORMAT: Format = Format::Display(Encoding::Png);
/// Before the names of layers that hold half A of the samples.
const HALF_A: &str = "half_a.";
const MAX_THREADS: usize = 1024;
const DEFAULT_SIZE: u32 = 512;
/// Vertices at most this rough copy half vectors. Chosen by the last table of scenes/failures/README.md:
/// up to 0.01 that has 0.6 to 0.7 of the error of reconnecting; at 0.0225, on scenes/mirrors.obj, 1.2 times.
pub const ROUGHNESS_THRESHOLD: f32 = 0.01;

/// Reads the OBJ and the TOML beside it.
fn load_scene(path: &Path, flags: SceneFlags, warnings: &mut Warnings) -> Result<Scene> {
    let options = obj::Options {
        textures: flags.reading.textures,
    };
    let file = obj::load_with(path, &options, warnings)?;
    let toml = sidecar::load(path)?;
    let camera = toml.camera_named(flags.camera_name.as_deref())?;
    let camera = flags.camera.or(&camera);
    let film = (
        toml.film.width.unwrap_or(DEFAULT_SIZE),
        toml.film.height.unwrap_or(DEFAULT_SIZE),
    );
    let size = flags.size.map_or(film, |size| size.of_film(film));
    let mut environment = toml.environment;
    match flags.environment {
        Some(EnvironmentFlag::Radiance(radiance)) => {
            environment = EnvironmentTable {
                radiance: Some(radiance),
                ..Default::default()
            };
        }
        // Rotation and scale are still the TOML's.
        Some(EnvironmentFlag::Map(map)) => {
            environment.map = Some(map);
            environment.read_map()?;
        }
        None => {}
    }
    let settings = SceneSettings {
        camera,
        size,
        environment: EnvironmentSetting::of_table(&environment),
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

/// The method that the flags name.
fn reconstruction(
    reconstruct: Reconstruct,
    alpha: Option<Alpha>,
    warnings: &mut Warnings,
) -> Result<Method> {
    if alpha.is_some() && !matches!(reconstruct, Reconstruct::L2 | Reconstruct::L1) {
        warnings.push("--alpha matters for --reconstruct l2 and l1 alone")?;
    }
    let alpha = alpha.unwrap_or(Alpha::Fixed(PAPER_ALPHA));
    Ok(match reconstruct {
        Reconstruct::Weighted => Method::Weighted,
        Reconstruct::L2 => Method::L2(alpha),
        Reconstruct::L1 => Method::L1(alpha),
        Reconstruct::None => Method::Primal,
    })
}

/// Bytes of a pixel beside the film while the picture is made and written with all its layers (measured).
const BYTES_OF_IMAGES: usize = 460;

/// Memory for the film and the images made of it.
fn picture_bytes(width: u32, height: u32) -> u64 {
    u64::from(width) * u64::from(height) * (BYTES_PER_PIXEL + BYTES_OF_IMAGES) as u64
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
