//! `gdpt render` from flags to files.

use super::{Ended, SceneFlags, load_scene, thread_pool};
use crate::cli::{Reconstruct, RenderArgs};
use crate::error::{Error, Result, Warnings};
use crate::film::{BYTES_PER_PIXEL, Estimate, Film, FirstHits, Halves};
use crate::image::Image;
use crate::load::sidecar::CameraTable;
use crate::output::{self, exr::Layers, png, stats::Stats};
use crate::path::PathSettings;
use crate::progress::Reporter;
use crate::reconstruct::{Problem, Solution, l1, l2};
use crate::render::{Job, Limits, Method, TILE_SIZE};
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

const DEFAULT_SPP: u64 = 64;

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
            weights: args.weights,
        },
        limits,
    };
    reporter.start(&limits);
    let outcome = pool.install(|| job.run(&mut film, stop, &mut |p| reporter.pass(p)));
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
    let start = Instant::now();
    let estimate = film.estimate(Halves::Both);
    let (picture, solution) = pool.install(|| solve(args, &estimate));
    let picture = picture.plus(&hits.direct);
    let seconds_solving = start.elapsed().as_secs_f64();

    // Files.
    let mut stats = Stats {
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.display().to_string(),
        scene_hash: format!("{:016x}", scene.hash()),
        settings: settings(args),
        width,
        height,
        triangles: scene.mesh.triangles.len(),
        samples: film.samples[0] + film.samples[1],
        interrupted: outcome.interrupted,
        seconds_loading,
        seconds_building,
        seconds_tracing: outcome.elapsed.as_secs_f64(),
        seconds_solving,
        solver_iterations: solution.iterations,
        solver_residual: solution.residual,
        rays: BTreeMap::new(),
        mrays_per_second: 0.0,
        dead_shifts: BTreeMap::new(),
        dropped: 0,
        film_bytes_per_pixel: BYTES_PER_PIXEL,
        warnings: warnings.list().to_vec(),
    };
    stats.count(&outcome.counts);
    match format {
        Format::Exr => write_exr(args, &picture, &estimate, &hits, &film, &stats)?,
        Format::Png => png::write(&args.output, &picture, args.exposure)?,
    }
    if let Some(path) = &args.preview {
        png::write(path, &picture, args.exposure)?;
    }
    if let Some(path) = &args.stats {
        stats.write(path)?;
    }
    reporter.summary(&stats, &args.output);
    Ok(if outcome.interrupted {
        Ended::Interrupted
    } else {
        Ended::Done
    })
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
}

impl Format {
    fn of(path: &Path) -> Result<Self> {
        match path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("exr") => Ok(Format::Exr),
            Some("png") => Ok(Format::Png),
            _ => Err(Error::input(
                path,
                None,
                "the extension must be .exr or .png",
            )),
        }
    }
}

fn check_limits(args: &RenderArgs) -> Result<Limits> {
    let samples = match (args.spp, args.time) {
        (Some(0), _) => return Err(Error::Setting("--spp must be at least 1".into())),
        (Some(n), _) => n,
        (None, Some(_)) => u64::MAX,
        (None, None) => DEFAULT_SPP,
    };
    if args.depth == 0 {
        return Err(Error::Setting("--depth must be at least 1".into()));
    }
    if !(args.alpha >= 0.0 && args.alpha.is_finite()) {
        return Err(Error::Setting(
            "--alpha must be a number, not negative".into(),
        ));
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
        Method::Gpt => Reconstruct::L2,
    })
}

fn solve(args: &RenderArgs, estimate: &Estimate) -> (Image, Solution) {
    let problem = Problem {
        primal: &estimate.primal,
        dx: &estimate.dx,
        dy: &estimate.dy,
    };
    match reconstruct(args) {
        Reconstruct::L2 => (l2::solve(&problem, args.alpha), Solution::default()),
        Reconstruct::L1 => l1::solve(&problem, args.alpha),
        Reconstruct::None => (estimate.primal.clone(), Solution::default()),
    }
}

fn write_exr(
    args: &RenderArgs,
    picture: &Image,
    estimate: &Estimate,
    hits: &FirstHits,
    film: &Film,
    stats: &Stats,
) -> Result<()> {
    let mut layers = Layers::default();
    layers.picture(picture);
    layers.colour("primal", &estimate.primal);
    layers.colour("primal_variance", &estimate.primal_variance);
    if args.method == Method::Gpt {
        layers.colour("dx", &estimate.dx);
        layers.colour("dy", &estimate.dy);
        layers.colour("dx_variance", &estimate.dx_variance);
        layers.colour("dy_variance", &estimate.dy_variance);
    }
    layers.colour("direct", &hits.direct);
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
    layers.write(&args.output, picture.width, picture.height)
}

/// The settings that the picture depends on, by name.
fn settings(args: &RenderArgs) -> BTreeMap<&'static str, String> {
    let mut map = BTreeMap::new();
    map.insert("method", format!("{:?}", args.method).to_lowercase());
    map.insert("weights", format!("{:?}", args.weights).to_lowercase());
    map.insert(
        "reconstruct",
        format!("{:?}", reconstruct(args)).to_lowercase(),
    );
    map.insert("alpha", args.alpha.to_string());
    map.insert("depth", args.depth.to_string());
    map.insert("seed", args.seed.to_string());
    map.insert("roughness_threshold", args.roughness_threshold.to_string());
    map.insert("filter", format!("{:?}", args.filter).to_lowercase());
    map.insert("backend", args.backend.name().to_owned());
    map
}
