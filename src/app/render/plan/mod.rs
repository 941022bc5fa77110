//! From flags to a plan: all that `gdpt render` is to do, checked as far as that can be before a scene is read. What
//! comes after knows no flags.

mod frames;
mod limits;
mod targets;

pub(super) use targets::Target;

use crate::app::finish;
use crate::app::{EnvironmentFlags, SceneFlags, kind_for};
use crate::checkpoint::Identity;
use crate::cli::{CropFlag, RenderArgs};
use crate::error::{Error, Result};
use crate::exposure::Exposure;
use crate::film::Window;
use crate::load::sidecar::{CameraTable, Up};
use crate::output;
use crate::output::format::Encoding;
use crate::path::PathSettings;
use crate::reconstruct::{Alpha, Kind};
use crate::render::{Limits, Method};
use crate::tone::Tone;
use crate::trace::Backend;
use std::path::Path;
use std::time::Duration;

/// What a call is to do.
pub(super) struct Plan<'a> {
    pub(super) task: Task<'a>,
    /// How scenes are read, and what of them is said by flags.
    pub(super) scene: SceneFlags,
    pub(super) backend: Backend,
    pub(super) method: Method,
    pub(super) paths: PathSettings,
    pub(super) ends: Ends,
    pub(super) keeping: Keeping<'a>,
    pub(super) making: Making<'a>,
    crop: Option<CropFlag>,
    pub(super) threads: Option<usize>,
    /// Where a viewer listens.
    pub(super) watch: Option<&'a str>,
    pub(super) strict: bool,
    pub(super) quiet: bool,
}

/// What is rendered.
pub(super) enum Task<'a> {
    /// Pictures or films of scenes; at least one.
    Pictures(Vec<Target<'a>>),
    /// One sample of a scene, in words.
    Sample {
        scene: &'a Path,
        pixel: (u32, u32),
        number: u64,
    },
}

/// When a render ends.
#[derive(Clone, Copy)]
pub(super) struct Ends {
    pub(super) limits: Limits,
    /// The estimated relMSE that is small enough.
    pub(super) error: Option<f64>,
    /// Whether nothing else ends it.
    pub(super) by_error_alone: bool,
}

/// How samples are kept while it renders.
#[derive(Clone, Copy)]
pub(super) struct Keeping<'a> {
    pub(super) checkpoint: Option<&'a Path>,
    pub(super) every: Duration,
    pub(super) resume: bool,
}

/// How pictures are made of films, and shown.
#[derive(Clone, Copy)]
pub(super) struct Making<'a> {
    pub(super) reconstruct: Kind,
    pub(super) alpha: Option<Alpha>,
    pub(super) preview: Option<(&'a Path, Encoding)>,
    pub(super) stats: Option<&'a Path>,
    pub(super) mattes: bool,
    pub(super) exposure: Exposure,
    pub(super) tone: Tone,
    /// Whether it is one view of a turntable, to be shown as the others are.
    pub(super) one_of_several: bool,
}

/// Time between two checkpoints.
const EVERY: Duration = Duration::from_secs(60);

impl<'a> Plan<'a> {
    /// What the flags ask for. Folders for outputs are made.
    pub(super) fn of_flags(args: &'a RenderArgs) -> Result<Self> {
        let limits = limits::of_flags(args)?;
        let paths = path_settings(args)?;
        let scene = scene(args)?;
        let reconstruct = kind_for(args.method, args.reconstruct, args.denoise)?;
        let task = match args.pixel {
            Some(pixel) => {
                let [scene] = &args.scenes[..] else {
                    let message = "--pixel is of one scene; name one";
                    return Err(Error::Setting(message.into()));
                };
                Task::Sample {
                    scene,
                    pixel,
                    number: args.sample,
                }
            }
            None => Task::Pictures(targets::of_flags(args)?),
        };
        Ok(Self {
            scene,
            backend: args.backend,
            method: args.method,
            paths,
            ends: Ends {
                limits,
                error: args.error,
                by_error_alone: args.error.is_some() && args.spp.is_none() && args.time.is_none(),
            },
            keeping: keeping(args, &task)?,
            making: Making {
                reconstruct,
                alpha: args.alpha,
                preview: finish::preview(args.preview.as_deref())?,
                stats: args.stats.as_deref(),
                mattes: args.cryptomatte,
                exposure: args.exposure,
                tone: args.tone,
                one_of_several: args.frame.is_some(),
            },
            task,
            crop: args.crop,
            threads: args.threads,
            watch: args.watch.as_deref(),
            strict: args.strict,
            quiet: args.quiet,
        })
    }

    /// The pixels to be rendered of a picture of this size.
    pub(super) fn window(&self, width: u32, height: u32) -> Result<Window> {
        let whole = Window::whole(width, height);
        let Some(CropFlag { first, end }) = self.crop else {
            return Ok(whole);
        };
        if end.0 > width || end.1 > height {
            return Err(Error::Setting(format!(
                "--crop must be within 0,0,{width},{height}: it ends at {},{}",
                end.0, end.1
            )));
        }
        Ok(Window {
            x: first.0,
            y: first.1,
            width: end.0 - first.0,
            height: end.1 - first.1,
            ..whole
        })
    }

    /// The settings that the film depends on, by name.
    pub(super) fn identity(&self) -> Identity {
        let lower = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
        let PathSettings {
            depth,
            seed,
            sampler,
            weights,
            filter,
            manifold,
        } = &self.paths;
        let settings = [
            ("method", lower(&self.method)),
            ("weights", lower(weights)),
            ("depth", depth.to_string()),
            ("sampler", lower(sampler)),
            ("seed", seed.to_string()),
            (
                "roughness_threshold",
                self.scene.roughness_threshold.to_string(),
            ),
            ("filter", lower(filter)),
            ("manifold", lower(manifold)),
            ("backend", self.backend.name().to_owned()),
        ];
        let named = settings.map(|(name, value)| (name.to_owned(), value));
        Identity::from_iter(named)
    }
}

fn path_settings(args: &RenderArgs) -> Result<PathSettings> {
    if args.depth == 0 {
        return Err(Error::Setting("--depth must be at least 1".into()));
    }
    Ok(PathSettings {
        depth: args.depth,
        seed: args.seed,
        sampler: args.sampler,
        weights: args.weights,
        filter: args.filter,
        manifold: args.manifold,
    })
}

fn scene(args: &RenderArgs) -> Result<SceneFlags> {
    if !(0.0..=1.0).contains(&args.roughness_threshold) {
        return Err(Error::Setting(
            "--roughness-threshold must be from 0 to 1".into(),
        ));
    }
    // A camera that is placed here has the scene's up; one of the TOML's may count on y.
    let up = args.up.or(args.origin.map(|_| Up::Auto));
    let camera = CameraTable {
        origin: args.origin,
        target: args.target,
        view: args.view,
        azimuth: args.azimuth,
        elevation: args.elevation,
        zoom: args.zoom,
        up,
        fov: args.fov,
        aperture: args.aperture,
        focus: args.focus,
        all_around: args.turntable.is_some(),
    };
    Ok(SceneFlags {
        camera,
        camera_name: args.camera.clone(),
        size: args.size,
        environment: EnvironmentFlags {
            source: args.environment.clone(),
            sun: args.sun,
            rotation: args.rotate_environment,
            scale: args.environment_scale.map(|scale| scale as f32),
            background: args.background,
        },
        roughness_threshold: args.roughness_threshold,
        reading: args.reading.clone(),
        objects: args.cryptomatte,
    })
}

/// How samples are kept, where they can be.
fn keeping<'a>(args: &'a RenderArgs, task: &Task) -> Result<Keeping<'a>> {
    let targets = match task {
        Task::Pictures(targets) => &targets[..],
        Task::Sample { .. } => &[],
    };
    for target in targets {
        let kept = [args.checkpoint.as_deref(), target.film()];
        let mut kept = kept.into_iter().flatten().peekable();
        let needing = [("--resume", args.resume), ("--every", args.every.is_some())];
        if let (None, Some((flag, _))) = (kept.peek(), needing.iter().find(|(_, given)| *given)) {
            let message = format!("{flag} needs --checkpoint FILE, or a .gdpt as output");
            return Err(Error::Setting(message));
        }
        for path in kept {
            if output::regular_file(path)?.exists() && !args.resume {
                let message =
                    "there is a checkpoint already: --resume goes on from it, or remove it";
                return Err(Error::input(path, None, message));
            }
        }
    }
    Ok(Keeping {
        checkpoint: args.checkpoint.as_deref(),
        every: args.every.unwrap_or(EVERY),
        resume: args.resume,
    })
}
