//! `gdpt render` from flags to files.

use super::{Ended, Format, HALF_A, SceneFlags, load_scene, reconstruction, thread_pool};
use crate::cli::{Reconstruct, RenderArgs};
use crate::error::{Error, Result, Warnings};
use crate::film::{BYTES_PER_PIXEL, Film, FirstHits, Halves};
use crate::load::sidecar::CameraTable;
use crate::output::{self, exr::Layers, png::Pixels, stats::Stats};
use crate::path::PathSettings;
use crate::picture::{self, Picture};
use crate::progress::Reporter;
use crate::reconstruct;
use crate::render::{Ending, Job, Limits, Method, TILE_SIZE};
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

const DEFAULT_SPP: u64 = 64;
/// Samples before the error is estimated for the first time.
const FIRST_CHECK: u64 = 16;

/// Renders a scene. `stop` is asked between passes whether to end early.
pub fn render(args: &RenderArgs, stop: &(dyn Fn() -> bool + Sync)) -> Result<Ended> {
    // Everything that can be refused is refused before the scene is read.
    let limits = check_limits(args)?;
    let format = Format::of(&args.output)?;
    if let Some(preview) = &args.preview
        && Format::of(preview)? != Format::Png
    {
        return Err(Error::input(preview, None, "--preview writes a .png"));
    }
    let outputs = [
        Some(&args.output),
        args.preview.as_ref(),
        args.stats.as_ref(),
    ];
    let outputs: Vec<&Path> = outputs.into_iter().flatten().map(|p| p.as_path()).collect();
    output::check_outputs(&args.scene, &outputs)?;
    let pool = thread_pool(args.threads)?;
    let mut warnings = Warnings::new(args.strict);
    let method = reconstruction(reconstruct(args), args.alpha, &mut warnings)?;

    // Scene.
    let start = Instant::now();
    let mut reporter = Reporter::new(args.quiet);
    let scene = load(args, &mut warnings)?;
    let seconds_loading = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let tracer = args
        .backend
        .build(&scene.mesh, pool.current_num_threads())?;
    let seconds_building = start.elapsed().as_secs_f64();
    reporter.warnings(warnings.list());

    // Paths.
    let (width, height) = (scene.camera.width, scene.camera.height);
    let mut film = Film::new(width, height, TILE_SIZE);
    let job = Job {
        scene: &scene,
        tracer: &*tracer,
        method: args.method,
        settings: PathSettings {
            depth: args.depth,
            seed: args.seed,
            points: args.sampler,
            weights: args.weights,
        },
        limits,
    };
    reporter.start(&limits);
    let mut check = ErrorCheck::new(args.error);
    let mut ask = |film: &Film| {
        if stop() {
            Some(Ending::Interrupted)
        } else {
            check.reached(film, method).then_some(Ending::Error)
        }
    };
    let outcome = pool.install(|| job.run(&mut film, &mut ask, &mut |p| reporter.pass(p)));
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
    let seen = warnings.list().len();
    if outcome.counts.rays[0] > 0 && hits.depth.iter().all(|&d| d == 0.0) {
        warnings.push("the camera sees nothing of the scene; check --origin, --target and --up")?;
    }
    if let Some((x, y, sample)) = outcome.counts.first_dropped {
        warnings.push(format!(
            "{} samples were not finite and dropped; the first in pixel {x},{y}, sample {sample}, seed {}",
            outcome.counts.dropped, args.seed
        ))?;
    }
    reporter.warnings(&warnings.list()[seen..]);

    // Picture.
    let picture = match check.last {
        // The film has not changed since.
        Some(picture) if outcome.ended == Ending::Error => picture,
        _ => pool.install(|| picture::of_film(&film, method)),
    };

    // Files.
    let mut stats = Stats {
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.display().to_string(),
        scene_hash: format!("{:016x}", scene.hash()),
        settings: settings(args, method),
        width,
        height,
        triangles: scene.mesh.triangles.len(),
        samples: film.samples[0] + film.samples[1],
        interrupted,
        ended: outcome.ended.name(),
        seconds_loading,
        seconds_building,
        seconds_tracing: outcome.elapsed.as_secs_f64(),
        seconds_solving: picture.seconds,
        solver_iterations: picture.solution.iterations,
        solver_residual: picture.solution.residual,
        estimated_rel_mse: picture.error.as_ref().map(|e| e.rel_mse),
        rays: BTreeMap::new(),
        mrays_per_second: 0.0,
        dead_shifts: BTreeMap::new(),
        dropped: 0,
        film_bytes_per_pixel: BYTES_PER_PIXEL,
        warnings: warnings.list().to_vec(),
    };
    stats.count(&outcome.counts);
    match format {
        Format::Exr => write_exr(args, &picture, &hits, &film, &stats)?,
        Format::Png => Pixels::tone_mapped(&picture.image, args.exposure).write(&args.output)?,
    }
    if let Some(path) = &args.preview {
        Pixels::tone_mapped(&picture.image, args.exposure).write(path)?;
    }
    if let Some(path) = &args.stats {
        stats.write(path)?;
    }
    reporter.summary(&stats, &args.output);
    Ok(if interrupted {
        Ended::Interrupted
    } else {
        Ended::Done
    })
}

fn check_limits(args: &RenderArgs) -> Result<Limits> {
    let samples = match args.spp {
        Some(0) => return Err(Error::Setting("--spp must be at least 1".into())),
        Some(n) => n,
        None if args.time.is_some() || args.error.is_some() => u64::MAX,
        None => DEFAULT_SPP,
    };
    if args.depth == 0 {
        return Err(Error::Setting("--depth must be at least 1".into()));
    }
    if args.error.is_some_and(|e| !(e > 0.0 && e.is_finite())) {
        return Err(Error::Setting("--error must be above 0".into()));
    }
    if !(0.0..=1.0).contains(&args.roughness_threshold) {
        return Err(Error::Setting(
            "--roughness-threshold must be from 0 to 1".into(),
        ));
    }
    if !args.exposure.is_finite() {
        return Err(Error::Setting("--exposure must be a number".into()));
    }
    if args.method == Method::Pt && args.reconstruct.is_some_and(|r| r != Reconstruct::None) {
        let message = "--reconstruct needs gradients, which --method pt does not have";
        return Err(Error::Setting(message.into()));
    }
    Ok(Limits {
        samples,
        time: args.time,
    })
}

fn load(args: &RenderArgs, warnings: &mut Warnings) -> Result<Scene> {
    let camera = CameraTable {
        origin: args.origin,
        target: args.target,
        up: args.up,
        fov: args.fov,
    };
    let flags = SceneFlags {
        camera,
        size: args.size,
        environment: args.environment,
        roughness_threshold: args.roughness_threshold,
    };
    load_scene(&args.scene, flags, warnings)
}

/// The method of reconstruction that is meant where none is named.
fn reconstruct(args: &RenderArgs) -> Reconstruct {
    args.reconstruct.unwrap_or(match args.method {
        Method::Pt => Reconstruct::None,
        Method::Gpt => Reconstruct::Weighted,
    })
}

/// Whether the error is small enough for `--error`: asked after every pass, answered by a solve whenever
/// the samples may suffice. As it goes down as one over the samples or faster, the next time is known.
struct ErrorCheck {
    target: Option<f64>,
    next: u64,
    /// The picture of the last solve.
    last: Option<Picture>,
}

impl ErrorCheck {
    fn new(target: Option<f64>) -> Self {
        Self {
            target,
            next: FIRST_CHECK,
            last: None,
        }
    }

    fn reached(&mut self, film: &Film, method: reconstruct::Method) -> bool {
        let done = film.count(Halves::Both);
        let Some(target) = self.target.filter(|_| done >= self.next) else {
            return false;
        };
        let picture = self.last.insert(picture::of_film(film, method));
        let error = picture.error.as_ref().map_or(f64::INFINITY, |e| e.rel_mse);
        let missing = error / target;
        self.next = (done as f64 * missing.clamp(1.1, 2.0)) as u64;
        missing <= 1.0
    }
}

fn write_exr(
    args: &RenderArgs,
    picture: &Picture,
    hits: &FirstHits,
    film: &Film,
    stats: &Stats,
) -> Result<()> {
    let mut layers = Layers::default();
    layers.picture(&picture.image);
    if let Some(error) = &picture.error {
        layers.colour("error", &error.standard);
    }
    // Both halves together, and half A: half B is the rest.
    for (prefix, halves) in [("", Halves::Both), (HALF_A, Halves::A)] {
        let e = film.estimate(halves);
        let mut colour = |name: &str, image| layers.colour(&format!("{prefix}{name}"), image);
        colour("primal", &e.primal);
        colour("primal_variance", &e.primal_variance);
        if args.method == Method::Gpt {
            colour("dx", &e.dx);
            colour("dy", &e.dy);
            colour("dx_variance", &e.dx_variance);
            colour("dy_variance", &e.dy_variance);
        }
        colour("direct", &film.direct(halves));
    }
    layers.colour("albedo", &hits.albedo);
    layers.vector("normal", &hits.normal);
    layers.channel("depth.Z", hits.depth.clone());
    layers.channel("samples.dropped", hits.dropped.clone());
    let total = (film.samples[0] + film.samples[1]) as f32;
    layers.channel(
        "samples.count",
        hits.dropped.iter().map(|d| total - d).collect(),
    );
    layers.attribute("gdpt.version", stats.version);
    layers.attribute("gdpt.scene", stats.scene.clone());
    layers.attribute("gdpt.scene_hash", stats.scene_hash.clone());
    layers.attribute("gdpt.samples", stats.samples.to_string());
    layers.attribute(
        "gdpt.seconds",
        format!("{:.3}", stats.seconds_tracing + stats.seconds_solving),
    );
    for (name, value) in &stats.settings {
        layers.attribute(&format!("gdpt.{name}"), value.clone());
    }
    layers.write(&args.output, picture.image.width, picture.image.height)
}

/// The settings that the picture depends on, by name.
fn settings(args: &RenderArgs, method: reconstruct::Method) -> BTreeMap<&'static str, String> {
    let mut map = BTreeMap::new();
    map.insert("method", format!("{:?}", args.method).to_lowercase());
    map.insert("weights", format!("{:?}", args.weights).to_lowercase());
    let (reconstruct, alpha) = picture::describe(method);
    map.insert("reconstruct", reconstruct.to_owned());
    if !alpha.is_empty() {
        map.insert("alpha", alpha);
    }
    map.insert("depth", args.depth.to_string());
    map.insert("sampler", format!("{:?}", args.sampler).to_lowercase());
    map.insert("seed", args.seed.to_string());
    map.insert("roughness_threshold", args.roughness_threshold.to_string());
    map.insert("filter", format!("{:?}", args.filter).to_lowercase());
    map.insert("backend", args.backend.name().to_owned());
    map
}
