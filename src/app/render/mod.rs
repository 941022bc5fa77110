//! `gdpt render` from flags to files.

mod error_check;
pub(super) mod limits;
mod lock;
mod nothing;
mod replay;
mod saving;
mod targets;
mod turntable;
mod watching;

use super::finish::{self, Outputs, Rendered};
use super::{
    Ended, EnvironmentFlags, SceneFlags, default_kind, load_scene, reconstruction, settle,
    thread_pool,
};
use crate::checkpoint::{About, Header, Identity, Progress};
use crate::cli::RenderArgs;
use crate::error::{Error, Result, Warnings};
use crate::exposure::Exposure;
use crate::film::{Film, Halves, Window};
use crate::load::sidecar::{CameraTable, Up};
use crate::machine;
use crate::output;
use crate::output::format::{Encoding, Format};
use crate::part::{Samples, Share};
use crate::path::{Counts, PathSettings};
use crate::picture;
use crate::progress::Reporter;
use crate::reconstruct;
use crate::render::{Ending, Job, Limits, TILE_SIZE};
use crate::scene::Scene;
use crate::trace::Traverse;
use crate::watch::Watcher;
use error_check::ErrorCheck;
use nothing::Lookout;
use saving::Saving;
use std::cell::OnceCell;
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
    saving::check(args, &targets)?;
    if let [target] = &targets[..] {
        return render_scene(args, target, limits, stop);
    }
    let mut failed = 0;
    for target in &targets {
        Reporter::new(args.quiet).say(&format!("{}:", target.scene.display()));
        match render_scene(args, target, limits, stop) {
            Ok(Ended::Done) => (),
            Ok(ended) => return Ok(ended),
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
    let preview = finish::preview(args.preview.as_deref())?;
    let pool = thread_pool(args.threads)?;
    let mut warnings = Warnings::new(args.strict);
    let threads = pool.current_num_threads();
    let kind = args
        .reconstruct
        .unwrap_or(default_kind(args.method, args.denoise));
    let method = reconstruction(kind, args.alpha, threads, &mut warnings)?;

    // Scene.
    let start = Instant::now();
    let reporter = Reporter::new(args.quiet);
    let mut scene = load(args, target.scene, &mut warnings)?;
    let seconds_loading = start.elapsed().as_secs_f64();
    if let Some(format) = target.format {
        finish::check_background(format, scene.background)?;
    }
    let window = limits::window(args, scene.camera.width, scene.camera.height)?;
    limits::memory(
        window,
        target.film().is_some(),
        "make it smaller with --size, or render it in pieces with --crop",
    )?;
    let start = Instant::now();
    let tracer = args
        .backend
        .build(&scene.mesh, pool.current_num_threads())?;
    let seconds_building = start.elapsed().as_secs_f64();
    pool.install(|| settle(&mut scene, &*tracer, &mut warnings))?;
    reporter.warnings(warnings.list());

    let samples = target.samples;
    let range = samples.range();
    let session = Session {
        args,
        limits: Limits {
            samples: limits.samples.min(range.end - range.start),
            ..limits
        },
        share: Share { window, samples },
        method,
        target,
        preview,
        pool,
        tracer: &*tracer,
        warnings: warnings.list(),
        about: About {
            scene: target.scene.display().to_string(),
            triangles: scene.mesh.triangles.len(),
            background: scene.background.to_string(),
            processor: machine::processor(),
            seconds_loading,
            seconds_building,
            ..About::default()
        },
        exposure: OnceCell::new(),
        stop,
        watcher: args.watch.clone().map(Watcher::new),
    };
    let Some(frames) = &target.frames else {
        return session.render(&scene, &target.output);
    };
    let camera = scene.camera.clone();
    if args.frame.is_some() && args.exposure == Exposure::Auto && session.is_shown() {
        scene.look_by(turntable::of_few_pixels(&camera));
        let job = session.job(&scene);
        let stops = || turntable::stops(job, stop);
        let stops = session.pool.install(stops);
        session.exposure.get_or_init(|| stops);
    }
    for frame in frames {
        let turns = frame.index as f32 / frame.views as f32;
        scene.look_by(camera.turned(turns * std::f32::consts::TAU));
        match session.render(&scene, &frame.file)? {
            Ended::Done => (),
            ended => return Ok(ended),
        }
    }
    Ok(Ended::Done)
}

/// What all views of a scene have in common.
struct Session<'a> {
    args: &'a RenderArgs,
    limits: Limits,
    share: Share,
    method: reconstruct::Method,
    target: &'a Target<'a>,
    preview: Option<(&'a Path, Encoding)>,
    pool: rayon::ThreadPool,
    tracer: &'a dyn Traverse,
    warnings: &'a [String],
    about: About,
    /// In stops: that of the first picture, for all of them.
    exposure: OnceCell<f32>,
    stop: &'a (dyn Fn() -> bool + Sync),
    watcher: Option<Watcher>,
}

impl Session<'_> {
    /// Whether a picture of 8 bits is made.
    fn is_shown(&self) -> bool {
        let of_format = |format| Outputs::shows(format, self.preview);
        self.target.format.is_some_and(of_format)
    }

    /// What is rendered of the scene.
    fn job<'a>(&'a self, scene: &'a Scene) -> Job<'a> {
        let settings = path_settings(self.args);
        Job {
            scene,
            tracer: self.tracer,
            method: self.args.method,
            settings: PathSettings {
                seed: self.share.samples.seed(settings.seed),
                ..settings
            },
            first: self.share.samples.range().start,
            limits: self.limits,
        }
    }

    /// Renders the scene to a file.
    fn render(&self, scene: &Scene, output: &Path) -> Result<Ended> {
        let Session {
            args,
            limits,
            method,
            target,
            ref pool,
            stop,
            ..
        } = *self;
        let mut reporter = Reporter::new(args.quiet);

        // Film, and what a checkpoint holds of it.
        let mut film = Film::of(self.share.window, TILE_SIZE);
        let header = self.header(scene);
        let mut saving = Saving::new(args, target.film().map(|_| output), header.clone())?;
        saving.lock()?;
        if let Some(samples) = saving.resume(&mut film)? {
            reporter.say(&format!("going on from {samples} samples"));
            if samples > limits.samples {
                reporter.say("that is more than --spp asks for: all of them are used");
            }
        }

        // Paths.
        let job = Job {
            limits: saving.left(limits),
            ..self.job(scene)
        };
        reporter.start(&job.limits);
        let mut check = ErrorCheck::new(args.error, saving.next_check());
        let mut lookout = Lookout::new(args, self.share.window);
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
        let progress = saving.end(&film, &outcome, check.next)?;
        let interrupted = outcome.ended == Ending::Interrupted;
        if film.samples == [0; 2] {
            reporter.end();
            let _ = writeln!(
                std::io::stderr(),
                "ended before the first pass; nothing is written"
            );
            return Ok(self.interrupted());
        }
        // Under --strict these end the program too, once all is written.
        let mut late = saving.complaints();
        let counts = &progress.counts;
        if counts.dropped > 0 {
            late.push(dropped(counts, job.settings.seed));
        }
        reporter.warnings(&late);
        late.extend(lookout.end(scene, &film));

        if let Some(format) = target.format {
            // Picture.
            reporter.end_tracing();
            let hits = film.first_hits();
            let picture = match check.last {
                // The film has not changed since.
                Some(picture) if outcome.ended == Ending::Error => picture,
                _ => pool.install(|| picture::of_film(&film, method)),
            };
            late.extend(watching.end(&picture, &hits, &film));

            // Files.
            let outputs = self.outputs((output, format), saving.kept());
            let shown = outputs.shown(&self.exposure, &film, &picture, &hits);
            let rendered = Rendered {
                film: &film,
                method: args.method,
                background: scene.background,
                identity: &header.identity,
                about: &header.about,
                progress: &progress,
                ended: outcome.ended.name(),
                warnings: [self.warnings, &late].concat(),
            };
            outputs.write(rendered, (&picture, method), &hits, shown, &mut reporter)?;
        } else {
            reporter.end();
            if self.watcher.is_some() {
                let picture = pool.install(|| picture::of_film(&film, method));
                late.extend(watching.end(&picture, &film.first_hits(), &film));
            }
            if !args.quiet {
                let text = self.summary(&film, &progress, interrupted, output);
                output::print_beside(&[output], &text)?;
            }
        }
        let interrupted = interrupted.then(|| self.interrupted());
        match (late.into_iter().next(), interrupted) {
            // Whoever runs it again hears of it again.
            (_, Some(Ended::Unfinished)) => Ok(Ended::Unfinished),
            (Some(first), _) if args.strict => Err(Error::Strict(first)),
            (_, interrupted) => Ok(interrupted.unwrap_or(Ended::Done)),
        }
    }

    /// What has been interrupted: a film goes on when the same command runs again.
    fn interrupted(&self) -> Ended {
        match self.target.format {
            Some(_) => Ended::Interrupted,
            None => Ended::Unfinished,
        }
    }

    /// What stands in a checkpoint of the scene, before anything is done.
    fn header(&self, scene: &Scene) -> Header {
        let Share { window, samples } = self.share;
        let mut identity = settings(self.args);
        let (width, height) = window.picture;
        let more = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", format!("{:016x}", scene.hash())),
            ("size", format!("{width}x{height}")),
        ];
        let crop = (!window.is_whole()).then(|| ("crop", window.to_string()));
        let of_share = samples.identity().into_iter().chain(crop);
        for (name, value) in more.into_iter().chain(of_share) {
            identity.insert(name.to_owned(), value);
        }
        Header {
            identity,
            share: self.share,
            progress: Progress::default(),
            about: About {
                camera: scene.framing.describe(&scene.camera),
                ..self.about.clone()
            },
        }
    }

    fn outputs<'a>(
        &'a self,
        (picture, format): (&'a Path, Format),
        checkpoint: Option<&'a Path>,
    ) -> Outputs<'a> {
        Outputs {
            picture,
            format,
            preview: self.preview,
            stats: self.args.stats.as_deref(),
            exposure: self.args.exposure,
            tone: self.args.tone,
            checkpoint,
        }
    }

    /// What is said of a film.
    fn summary(
        &self,
        film: &Film,
        progress: &Progress,
        interrupted: bool,
        output: &Path,
    ) -> String {
        let samples = film.count(Halves::Both);
        let of = match self.share.samples {
            Samples::Some { part, all } if part.parts > 1 => format!(" (part {part} of {all})"),
            Samples::Own(part) => format!(" (part {part})"),
            _ => String::new(),
        };
        let Window { width, height, .. } = film.window;
        let word = if interrupted {
            "interrupted, and can go on with --resume; wrote"
        } else {
            "wrote"
        };
        format!(
            "{samples} samples per pixel{of}, {width}x{height}: {:.2} s tracing\n{word} {}\n",
            progress.seconds,
            output::name_of(output)
        )
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
fn settings(args: &RenderArgs) -> Identity {
    let mut map = Identity::new();
    let lower = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
    map.insert("method".into(), lower(&args.method));
    map.insert("weights".into(), lower(&args.weights));
    map.insert("depth".into(), args.depth.to_string());
    map.insert("sampler".into(), lower(&args.sampler));
    map.insert("seed".into(), args.seed.to_string());
    map.insert(
        "roughness_threshold".into(),
        args.roughness_threshold.to_string(),
    );
    map.insert("filter".into(), lower(&args.filter));
    map.insert("manifold".into(), lower(&args.manifold));
    map.insert("backend".into(), args.backend.name().to_owned());
    map
}
