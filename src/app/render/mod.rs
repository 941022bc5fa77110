//! `gdpt render` from flags to files.

mod error_check;
mod files;
mod layers;
mod limits;
mod nothing;
mod replay;
mod saving;
mod targets;
mod turntable;
mod watching;

use super::{Ended, EnvironmentFlags, SceneFlags, load_scene, reconstruction, settle, thread_pool};
use crate::checkpoint::Progress;
use crate::cli::RenderArgs;
use crate::develop::Plate;
use crate::error::{Error, Result, Warnings};
use crate::exposure::Metered;
use crate::film::{BYTES_PER_PIXEL, Film, Halves};
use crate::load::environment::Background;
use crate::load::sidecar::{CameraTable, Up};
use crate::output::format::{Encoding, Format};
use crate::output::stats::{Shown, Stats};
use crate::path::{Counts, PathSettings};
use crate::picture;
use crate::progress::Reporter;
use crate::reconstruct::{self, Kind};
use crate::render::{Ending, Job, Limits, Method, TILE_SIZE};
use crate::scene::Scene;
use crate::trace::Traverse;
use crate::watch::Watcher;
use error_check::ErrorCheck;
use files::Made;
use nothing::Lookout;
use saving::Saving;
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Instant;
use targets::Target;
use watching::Watching;

/// Renders scenes. One that fails does not keep the others from being rendered. `stop` is asked between passes whether to end early.
pub fn render(args: &RenderArgs, stop: &(dyn Fn() -> bool + Sync)) -> Result<Ended> {
    // Everything that can be refused is refused before the scene is read.
    let limits = limits::of_flags(args)?;
    if let Some(pixel) = args.pixel {
        return replay::replay(args, pixel);
    }
    let targets = targets::of_flags(args)?;
    saving::check(args)?;
    if let [target] = &targets[..] {
        return render_scene(args, target, limits, stop);
    }
    let mut failed = 0;
    for target in &targets {
        Reporter::new(args.quiet).say(&format!("{}:", target.scene.display()));
        match render_scene(args, target, limits, stop) {
            Ok(Ended::Done) => (),
            Ok(Ended::Interrupted) => return Ok(Ended::Interrupted),
            Err(e) if e.is_closed_pipe() => return Err(e),
            Err(e) => {
                failed += 1;
                let _ = writeln!(std::io::stderr(), "error: {e}");
            }
        }
    }
    match failed {
        0 => Ok(Ended::Done),
        _ => Err(Error::Scenes {
            failed,
            all: targets.len(),
        }),
    }
}

/// Renders one scene to one picture, or to a turntable of them.
fn render_scene(
    args: &RenderArgs,
    target: &Target,
    limits: Limits,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Ended> {
    let preview = args.preview.as_deref();
    let preview = preview.map(|path| Ok((path, Encoding::of("--preview", path)?)));
    let preview = preview.transpose()?;
    let pool = thread_pool(args.threads)?;
    let mut warnings = Warnings::new(args.strict);
    let threads = pool.current_num_threads();
    let method = reconstruction(reconstruct(args), args.alpha, threads, &mut warnings)?;

    // Scene.
    let start = Instant::now();
    let reporter = Reporter::new(args.quiet);
    let mut scene = load(args, target.scene, &mut warnings)?;
    let seconds_loading = start.elapsed().as_secs_f64();
    if scene.background == Background::Transparent
        && target.format == Format::Display(Encoding::Jpeg)
    {
        return Err(Error::Setting(
            "JPEG files cannot be transparent: give -o a name that ends in .png or .exr, or another --background"
                .into(),
        ));
    }
    limits::memory(scene.camera.width, scene.camera.height)?;
    let start = Instant::now();
    let tracer = args
        .backend
        .build(&scene.mesh, pool.current_num_threads())?;
    let seconds_building = start.elapsed().as_secs_f64();
    pool.install(|| settle(&mut scene, &*tracer, &mut warnings))?;
    reporter.warnings(warnings.list());

    let session = Session {
        args,
        limits,
        method,
        target,
        preview,
        pool,
        tracer: &*tracer,
        warnings: warnings.list(),
        seconds_loading,
        seconds_building,
        exposure: OnceCell::new(),
        stop,
        watcher: args.watch.clone().map(Watcher::new),
    };
    let Some(frames) = &target.frames else {
        return session.render(&scene, &target.output);
    };
    let camera = scene.camera.clone();
    for (index, frame) in frames.iter().enumerate() {
        let turns = index as f32 / frames.len() as f32;
        scene.look_by(camera.turned(turns * std::f32::consts::TAU));
        if session.render(&scene, frame)? == Ended::Interrupted {
            return Ok(Ended::Interrupted);
        }
    }
    Ok(Ended::Done)
}

/// What all views of a scene have in common.
struct Session<'a> {
    args: &'a RenderArgs,
    limits: Limits,
    method: reconstruct::Method,
    target: &'a Target<'a>,
    preview: Option<(&'a Path, Encoding)>,
    pool: rayon::ThreadPool,
    tracer: &'a dyn Traverse,
    warnings: &'a [String],
    seconds_loading: f64,
    seconds_building: f64,
    /// In stops: that of the first picture, for all of them.
    exposure: OnceCell<f32>,
    stop: &'a (dyn Fn() -> bool + Sync),
    watcher: Option<Watcher>,
}

impl Session<'_> {
    /// Renders the scene to a file.
    fn render(&self, scene: &Scene, output: &Path) -> Result<Ended> {
        let Session {
            args,
            limits,
            method,
            target,
            preview,
            ref pool,
            tracer,
            stop,
            ..
        } = *self;
        let (width, height) = (scene.camera.width, scene.camera.height);
        let mut reporter = Reporter::new(args.quiet);

        // Film, and what a checkpoint holds of it.
        let mut film = Film::new(width, height, TILE_SIZE);
        let mut settings = settings(args);
        let scene_hash = format!("{:016x}", scene.hash());
        let mut saving = Saving::new(args, scene, &scene_hash, &settings)?;
        saving.lock()?;
        if let Some(samples) = saving.resume(&mut film)? {
            reporter.say(&format!("going on from {samples} samples"));
            if samples > limits.samples {
                reporter.say("that is more than --spp asks for: all of them are used");
            }
        }

        // Paths.
        let job = Job {
            scene,
            tracer,
            method: args.method,
            settings: path_settings(args),
            limits: saving.left(limits),
        };
        reporter.start(&job.limits);
        let mut check = ErrorCheck::new(args.error, saving.next_check());
        let mut lookout = Lookout::new(args);
        let watcher = self.watcher.as_ref();
        let mut watching =
            Watching::new(watcher, output, args.method, scene.background, args.quiet);
        let mut ask = |film: &Film, counts: &Counts| {
            saving.now_and_then(film, counts, check.next);
            watching.now_and_then(film, method);
            if stop() {
                Some(Ending::Interrupted)
            } else if lookout.gives_up(scene, film) {
                Some(Ending::Nothing)
            } else {
                check.reached(film, method).then_some(Ending::Error)
            }
        };
        let outcome = pool.install(|| job.run(&mut film, &mut ask, &mut |p| reporter.pass(p)));
        let Progress {
            counts, seconds, ..
        } = saving.end(&film, &outcome, check.next);
        let interrupted = outcome.ended == Ending::Interrupted;
        reporter.end_tracing();
        if film.samples == [0; 2] {
            let _ = writeln!(
                std::io::stderr(),
                "ended before the first pass; nothing is written"
            );
            return Ok(Ended::Interrupted);
        }
        let hits = film.first_hits();
        // Under --strict these end the program too, once the picture is written.
        let mut late = saving.complaints();
        if counts.dropped > 0 {
            late.push(dropped(&counts, args.seed));
        }
        reporter.warnings(&late);
        if let Some(message) = lookout.end(scene, &film) {
            late.push(message);
        }

        // Picture.
        let picture = match check.last {
            // The film has not changed since.
            Some(picture) if outcome.ended == Ending::Error => picture,
            _ => pool.install(|| picture::of_film(&film, method)),
        };
        late.extend(watching.end(&picture, &hits, &film));

        let plate = Plate {
            image: &picture.image,
            coverage: &hits.coverage,
            background: scene.background,
        };
        let is_shown = target.format != Format::Exr || preview.is_some();
        let shown = is_shown.then(|| Shown {
            exposure: *self.exposure.get_or_init(|| {
                args.exposure.stops(&Metered {
                    image: &picture.image,
                    direct: &film.direct(Halves::Both),
                    coverage: &hits.coverage,
                    albedo: Some(&hits.albedo),
                })
            }),
            tone: args.tone,
        });

        // Files.
        let (name, alpha) = picture::describe(method);
        settings.insert("background", scene.background.to_string());
        settings.insert("reconstruct", name.to_owned());
        if !alpha.is_empty() {
            settings.insert("alpha", alpha);
        }
        let mut stats = Stats {
            version: env!("CARGO_PKG_VERSION"),
            scene: target.scene.display().to_string(),
            scene_hash,
            settings,
            width,
            height,
            camera: scene.framing.describe(&scene.camera),
            triangles: scene.mesh.triangles.len(),
            samples: film.samples[0] + film.samples[1],
            interrupted,
            ended: outcome.ended.name(),
            seconds_loading: self.seconds_loading,
            seconds_building: self.seconds_building,
            seconds_tracing: seconds,
            seconds_solving: picture.seconds,
            solver_iterations: picture.solution.iterations,
            solver_residual: picture.solution.residual,
            estimated_rel_mse: picture.rel_mse,
            shows_something: film.shows_something(),
            rays: BTreeMap::new(),
            mrays_per_second: 0.0,
            dead_shifts: BTreeMap::new(),
            dropped: 0,
            film_bytes_per_pixel: BYTES_PER_PIXEL,
            shown,
            warnings: [self.warnings, &late].concat(),
        };
        stats.count(&counts);
        let made = Made {
            args,
            target,
            output,
            checkpoint: saving.kept(),
            picture: &picture,
            plate: &plate,
            hits: &hits,
            film: &film,
            stats: &stats,
        };
        // What can be written is, whatever fails.
        let written = files::write(&made);
        if let (Some((path, encoding)), Some(shown)) = (preview, shown) {
            plate
                .pixels(shown.exposure, shown.tone)
                .write(path, encoding)?;
        }
        if let Some(path) = &args.stats {
            stats.write(path)?;
        }
        written?;
        let others = [preview.map(|(path, _)| path), args.stats.as_deref()];
        let others: Vec<&Path> = others.into_iter().flatten().collect();
        reporter.summary(&stats, output, &others)?;
        if let (true, Some(first)) = (args.strict, late.into_iter().next()) {
            return Err(Error::Strict(first));
        }
        Ok(if interrupted {
            Ended::Interrupted
        } else {
            Ended::Done
        })
    }
}

fn path_settings(args: &RenderArgs) -> PathSettings {
    PathSettings {
        depth: args.depth,
        seed: args.seed,
        points: args.sampler,
        weights: args.weights,
        filter: args.filter,
        manifold: args.manifold,
    }
}

fn load(args: &RenderArgs, scene: &Path, warnings: &mut Warnings) -> Result<Scene> {
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
    let flags = SceneFlags {
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
    };
    load_scene(scene, flags, warnings)
}

/// The method of reconstruction that is meant where none is named.
fn reconstruct(args: &RenderArgs) -> Kind {
    args.reconstruct.unwrap_or(match args.method {
        Method::Pt if args.denoise => Kind::Oidn,
        Method::Pt => Kind::None,
        Method::Gpt if args.denoise => Kind::Guided,
        Method::Gpt => Kind::Weighted,
    })
}

/// What is said of samples that were not finite, with what renders the first of them again.
fn dropped(counts: &Counts, seed: u64) -> String {
    let first = counts.first_dropped.iter().flatten();
    let first: Vec<String> = first
        .map(|(x, y, sample)| format!("--pixel {x},{y} --sample {sample}"))
        .collect();
    format!(
        "{} samples were not finite and dropped; with --seed {seed}, {} shows what happened",
        counts.dropped,
        first.join(" or ")
    )
}

/// The settings that the film depends on, by name.
fn settings(args: &RenderArgs) -> BTreeMap<&'static str, String> {
    let mut map = BTreeMap::new();
    let lower = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
    map.insert("method", lower(&args.method));
    map.insert("weights", lower(&args.weights));
    map.insert("depth", args.depth.to_string());
    map.insert("sampler", lower(&args.sampler));
    map.insert("seed", args.seed.to_string());
    map.insert("roughness_threshold", args.roughness_threshold.to_string());
    map.insert("filter", lower(&args.filter));
    map.insert("manifold", lower(&args.manifold));
    map.insert("backend", args.backend.name().to_owned());
    map
}
