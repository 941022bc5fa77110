//! `gdpt chart` from scenes to a folder with table, figures and report.

use super::{Ended, ROUGHNESS_THRESHOLD, SceneFlags, load_scene, reconstruction, thread_pool};
use crate::chart::report::{SceneReport, View};
use crate::chart::run::{Finished, Run};
use crate::chart::store::Store;
use crate::chart::{Row, Tracing, curves, figures, name_of, report};
use crate::cli::{ChartArgs, ChartMethod, Reconstruct};
use crate::compare::{self, References};
use crate::error::{Error, Result, Warnings};
use crate::gradient::Weights;
use crate::image::Image;
use crate::load::sidecar::CameraTable;
use crate::output::png::Pixels;
use crate::output::{check_outputs, colour_map, write_whole};
use crate::path::PathSettings;
use crate::picture;
use crate::progress::Steps;
use crate::reconstruct;
use crate::render::Method;
use crate::scene::Scene;
use crate::trace::{Backend, Traverse};
use std::io::Write;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// Seeds of the references, far from those of the runs.
const REFERENCE_SEEDS: [u64; 2] = [0x7265_6665_7265_6e63, 0x7265_6665_7265_6e64];
/// Length of a reference where none is given, in lengths of a run.
const REFERENCE_LENGTH: f64 = 5.0;
/// Differences are shown this much brighter than pictures, in stops.
const DIFFERENCE_STOPS: f32 = 2.0;

/// What all scenes have in common.
struct Plan<'a> {
    args: &'a ChartArgs,
    pool: rayon::ThreadPool,
    store: Store,
    /// What is done with the film of gradient-domain path tracing.
    reconstructions: Vec<reconstruct::Method>,
    tracings: Vec<Tracing>,
    run_seconds: f64,
    reference_seconds: f64,
    stop: &'a (dyn Fn() -> bool + Sync),
}

/// Measures error against time. `stop` is asked between passes whether to end early.
pub fn chart(args: &ChartArgs, stop: &(dyn Fn() -> bool + Sync)) -> Result<Ended> {
    let plan = Plan::new(args, stop)?;
    let mut warnings = Warnings::new(args.strict);
    let scenes = args
        .scenes
        .iter()
        .map(|path| load(args, path, &mut warnings));
    let scenes = scenes.collect::<Result<Vec<(String, Scene)>>>()?;
    let mut rows = Vec::new();
    let mut reports = Vec::new();
    let seconds = plan.seconds() * args.scenes.len() as f64;
    let mut steps = Steps::new(args.quiet, seconds);
    let minutes = (seconds / 60.0).ceil();
    steps.say(&format!(
        "about {minutes} min, less what is kept from before; Ctrl-C keeps what is finished"
    ));
    let mut ended = Ended::Done;
    for warning in warnings.list() {
        steps.say(&format!("warning: {warning}"));
    }
    for (name, scene) in &scenes {
        match plan.scene(name, scene, &mut rows, &mut steps)? {
            Some(report) => reports.push(report),
            None => {
                ended = Ended::Interrupted;
                break;
            }
        }
    }
    steps.end();
    if ended == Ended::Interrupted {
        let message = "interrupted; finished runs are kept: the same command goes on from there";
        let _ = writeln!(std::io::stderr(), "{message}");
        return Ok(ended);
    }
    plan.write(&rows, &reports)?;
    Ok(ended)
}

/// A scene with its name.
fn load(args: &ChartArgs, path: &Path, warnings: &mut Warnings) -> Result<(String, Scene)> {
    let flags = SceneFlags {
        camera: CameraTable::default(),
        size: args.size,
        environment: None,
        roughness_threshold: ROUGHNESS_THRESHOLD,
    };
    let stem = path.file_stem().unwrap_or_default();
    Ok((
        stem.to_string_lossy().into_owned(),
        load_scene(path, flags, warnings)?,
    ))
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

impl<'a> Plan<'a> {
    fn new(args: &'a ChartArgs, stop: &'a (dyn Fn() -> bool + Sync)) -> Result<Self> {
        if args.seeds == 0 || args.depth == 0 {
            return Err(Error::Setting(
                "--seeds and --depth must be at least 1".into(),
            ));
        }
        if !args.exposure.is_finite() {
            return Err(Error::Setting("--exposure must be a number".into()));
        }
        for path in &args.scenes {
            std::fs::metadata(path).map_err(Error::io(path, "cannot be read"))?;
            let stems = args
                .scenes
                .iter()
                .filter(|p| p.file_stem() == path.file_stem());
            if stems.count() > 1 {
                let message = "another scene has the same name; chart them into two folders";
                return Err(Error::input(path, None, message));
            }
        }
        let mut reconstructions = Vec::new();
        for method in distinct(&args.methods) {
            let flag = match method {
                ChartMethod::Pt => continue,
                ChartMethod::L2 => Reconstruct::L2,
                ChartMethod::L1 => Reconstruct::L1,
                ChartMethod::Weighted => Reconstruct::Weighted,
            };
            let alpha = args.alpha.filter(|_| flag != Reconstruct::Weighted);
            reconstructions.push(reconstruction(flag, alpha, &mut Warnings::new(true))?);
        }
        let mut tracings = Vec::new();
        for backend in distinct(&args.backends) {
            let tracing = |method, weights| Tracing {
                method,
                weights,
                backend,
            };
            if args.methods.contains(&ChartMethod::Pt) {
                tracings.push(tracing(Method::Pt, Weights::Mis));
            }
            if !reconstructions.is_empty() {
                tracings.extend(
                    distinct(&args.weights)
                        .into_iter()
                        .map(|w| tracing(Method::Gpt, w)),
                );
            }
        }
        let store = Store::new(args.output.join("cache"))?;
        let page = args.output.join("report.html");
        for scene in &args.scenes {
            check_outputs(scene, &[&page])?;
        }
        let run_seconds = args.time.as_secs_f64();
        Ok(Self {
            args,
            pool: thread_pool(args.threads)?,
            store,
            reconstructions,
            tracings,
            run_seconds,
            reference_seconds: args
                .reference_time
                .map_or(REFERENCE_LENGTH * run_seconds, |t| t.as_secs_f64()),
            stop,
        })
    }

    /// What a scene takes if nothing is kept from before.
    fn seconds(&self) -> f64 {
        let runs = self.tracings.len() as u64 * self.args.seeds;
        2.0 * self.reference_seconds + runs as f64 * self.run_seconds
    }

    /// Measures one scene; `None` if it was interrupted.
    fn scene(
        &self,
        name: &str,
        scene: &Scene,
        rows: &mut Vec<Row>,
        steps: &mut Steps,
    ) -> Result<Option<SceneReport>> {
        // References.
        let backend = self.args.backends.first().copied();
        let backend = backend.unwrap_or(Backend::DEFAULT);
        let tracer = self.build(scene, backend)?;
        let mut references = Vec::new();
        for (index, seed) in REFERENCE_SEEDS.into_iter().enumerate() {
            steps.begin(&format!("{name}: reference {} of 2", index + 1));
            let tracing = Tracing {
                method: self.args.reference,
                weights: Weights::Mis,
                backend,
            };
            let run = self.run(scene, &*tracer, tracing, seed, self.reference_seconds);
            let what = format!("{name}-reference-{}", index + 1);
            let key = self.key(&run);
            let kept = self.store.images(&what, &key, &[""]);
            let image = match kept.and_then(|mut images| images.pop()) {
                Some(image) => image,
                None => match self.pool.install(|| run.reference(self.stop)) {
                    Some(image) => {
                        self.store.keep_images(&what, &key, &[("", &image)])?;
                        image
                    }
                    None => return Ok(None),
                },
            };
            references.push(image);
            steps.done(self.reference_seconds);
        }
        let references = References::Two(&references[0], &references[1]);

        // Runs.
        let reference = References::mean(&references);
        let mut report = SceneReport {
            about: format!(
                "{}x{} pixels, {} triangles; two references of {} s each",
                scene.camera.width,
                scene.camera.height,
                scene.mesh.triangles.len(),
                self.reference_seconds
            ),
            views: vec![View {
                name: "reference".into(),
                picture: Pixels::tone_mapped(&reference, self.args.exposure),
                heat: None,
            }],
            differences: Vec::new(),
            name: name.to_owned(),
        };
        let mut built = (backend, tracer);
        for &tracing in &self.tracings {
            if built.0 != tracing.backend {
                built = (tracing.backend, self.build(scene, tracing.backend)?);
            }
            for seed in 0..self.args.seeds {
                let label = [name_of(tracing.method), name_of(tracing.weights)].join(" ");
                steps.begin(&format!(
                    "{name}: {label}, {}, seed {} of {}",
                    tracing.backend.name(),
                    seed + 1,
                    self.args.seeds
                ));
                let run = self.run(scene, &*built.1, tracing, seed, self.run_seconds);
                let Some((found, images)) = self.measure(name, &run, references)? else {
                    return Ok(None);
                };
                if seed == 0 {
                    self.show(&found, &images, references, &mut report);
                }
                rows.extend(found);
                self.write_csv(rows)?;
                steps.done(self.run_seconds);
            }
        }
        Ok(Some(report))
    }

    fn build(&self, scene: &Scene, backend: Backend) -> Result<Box<dyn Traverse>> {
        backend.build(&scene.mesh, self.pool.current_num_threads())
    }

    fn run<'s>(
        &self,
        scene: &'s Scene,
        tracer: &'s dyn Traverse,
        tracing: Tracing,
        seed: u64,
        seconds: f64,
    ) -> Run<'s> {
        Run {
            scene,
            tracer,
            tracing,
            settings: PathSettings {
                depth: self.args.depth,
                seed,
                points: self.args.sampler,
                weights: tracing.weights,
            },
            seconds,
        }
    }

    /// All that a run depends on, but for the references.
    fn key(&self, run: &Run) -> String {
        format!(
            "{:016x} {:?} {:?} {} {}",
            run.scene.hash(),
            run.tracing,
            run.settings,
            run.seconds,
            self.pool.current_num_threads()
        )
    }

    /// A run's rows, and for the first seed its pictures and differences; from the store where it has
    /// them. `None` if it was interrupted.
    fn measure(
        &self,
        name: &str,
        run: &Run,
        references: References,
    ) -> Result<Option<(Vec<Row>, Vec<Image>)>> {
        let primal = [reconstruct::Method::Primal];
        let reconstructions = match run.tracing.method {
            Method::Pt => &primal[..],
            Method::Gpt => &self.reconstructions[..],
        };
        let what = format!(
            "{name}-{}-{}-{}",
            name_of(run.tracing.method),
            run.tracing.backend.name(),
            run.settings.seed
        );
        let key = format!(
            "{} {reconstructions:?} {:016x}",
            self.key(run),
            hash(references)
        );
        let names = || reconstructions.iter().map(|&m| picture::describe(m).0);
        let layers: Vec<&str> = names().chain(["dx", "dy"]).collect();
        let with_pictures = run.settings.seed == 0;
        if let Some(rows) = self.store.rows(&what, &key) {
            if !with_pictures {
                return Ok(Some((rows, Vec::new())));
            }
            if let Some(images) = self.store.images(&what, &key, &layers) {
                return Ok(Some((rows, images)));
            }
        }
        let measure = || run.measure(name, reconstructions, references, self.stop);
        let Some(finished) = self.pool.install(measure) else {
            return Ok(None);
        };
        let Finished {
            rows,
            pictures: mut images,
            estimate,
        } = finished;
        if with_pictures {
            images.extend([estimate.dx, estimate.dy]);
            let named = layers.iter().copied().zip(&images);
            self.store
                .keep_images(&what, &key, &named.collect::<Vec<_>>())?;
        }
        self.store.keep_rows(&what, &key, &rows)?;
        Ok(Some((rows, images)))
    }

    /// Adds what the first run of a kind made to the report.
    fn show(
        &self,
        rows: &[Row],
        images: &[Image],
        references: References,
        report: &mut SceneReport,
    ) {
        let [pictures @ .., dx, dy] = images else {
            return;
        };
        for (row, picture) in rows.iter().filter(|r| r.last).zip(pictures) {
            let errors = compare::relative_errors(picture, references);
            report.views.push(View {
                name: format!("{} ({:.1} s)", row.curve(), row.seconds),
                picture: Pixels::tone_mapped(picture, self.args.exposure),
                heat: Some(colour_map::heat_map(&errors, picture.width)),
            });
        }
        let is_pt = rows.iter().any(|r| r.method == name_of(Method::Pt));
        if !is_pt && report.differences.is_empty() {
            let exposure = self.args.exposure + DIFFERENCE_STOPS;
            for (name, image) in [("to the right", dx), ("downwards", dy)] {
                let pixels = colour_map::signed(image, exposure);
                report.differences.push((name.to_owned(), pixels));
            }
        }
    }

    fn write_csv(&self, rows: &[Row]) -> Result<()> {
        write_whole(&self.args.output.join("chart.csv"), |file| {
            let mut csv = csv::Writer::from_writer(file);
            for row in rows {
                csv.serialize(row).map_err(std::io::Error::other)?;
            }
            csv.flush()
        })
    }

    /// Writes figures and report, and prints the gains.
    fn write(&self, rows: &[Row], reports: &[SceneReport]) -> Result<()> {
        let folder = &self.args.output;
        let times = report::times(self.run_seconds);
        for scene in reports {
            let curves = curves(rows, &scene.name);
            let file = |kind: &str| folder.join(format!("{}-{kind}", scene.name));
            figures::against_seconds(&scene.name, &curves).write(&file("seconds.svg"))?;
            figures::against_samples(&scene.name, &curves).write(&file("samples.svg"))?;
            let text = gains(&scene.name, &report::gain_table(&curves, &times), &times);
            if !self.args.quiet {
                let _ = write!(std::io::stdout(), "{text}");
            }
        }
        let page = folder.join("report.html");
        report::write(&page, reports, rows, &times, &self.settings())?;
        if !self.args.quiet {
            let _ = writeln!(std::io::stdout(), "wrote {}", page.display());
        }
        Ok(())
    }

    fn settings(&self) -> Vec<(&'static str, String)> {
        let args = self.args;
        let alpha = args
            .alpha
            .unwrap_or(reconstruct::Alpha::Fixed(reconstruct::PAPER_ALPHA));
        let (_, alpha) = picture::describe(reconstruct::Method::L2(alpha));
        vec![
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("seconds of a run", self.run_seconds.to_string()),
            ("seeds", args.seeds.to_string()),
            (
                "references",
                match args.reference {
                    Method::Pt => "path tracing".to_owned(),
                    Method::Gpt => "gradient-domain path tracing with l2".to_owned(),
                },
            ),
            ("depth", args.depth.to_string()),
            ("sampler", name_of(args.sampler)),
            ("alpha of l2 and l1", alpha),
            ("threads", self.pool.current_num_threads().to_string()),
        ]
    }
}

/// A fingerprint of references.
fn hash(references: References) -> u64 {
    let mean = references.mean();
    let values = mean.channels.iter().flatten();
    xxh3_64(&values.flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
}

/// The gains of a scene for the terminal.
fn gains(scene: &str, table: &[(String, Vec<String>)], times: &[f64]) -> String {
    if table.is_empty() {
        return String::new();
    }
    let line = |first: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|c| format!("{c:>16}")).collect();
        format!("{first:<20}{cells}\n")
    };
    let title = "error of path tracing over that of the method, at equal time";
    let heads = times.iter().map(|t| format!("{t:.2} s")).collect();
    let mut text = format!("{scene}: {title}\n{}", line("", heads));
    for (name, cells) in table {
        text += &line(name, cells.clone());
    }
    text
}
