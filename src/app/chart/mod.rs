//! `gdpt chart` from scenes to a folder with table, figures and report.

mod scene;

use super::{Ended, SceneFlags, distinct, load_with_camera, reconstruction, thread_pool};
use crate::chart::report::SceneReport;
use crate::chart::store::Store;
use crate::chart::{Row, Tracing, curves, figures, name_of, report};
use crate::cli::ChartArgs;
use crate::error::{Error, Result, Warnings};
use crate::gradient::Weights;
use crate::load::scene_name;
use crate::output::{check_outputs, print, write_whole};
use crate::picture;
use crate::progress::Steps;
use crate::reconstruct;
use crate::render::Method;
use crate::scene::Scene;
use std::io::Write;
use std::path::Path;

/// Length of a reference where none is given, in lengths of a run.
const REFERENCE_LENGTH: f64 = 5.0;

/// What all scenes have in common.
struct Plan<'a> {
    args: &'a ChartArgs,
    pool: rayon::ThreadPool,
    store: Store,
    /// What is done with the film of gradient-domain path tracing.
    reconstructions: Vec<reconstruct::Method>,
    /// What is made of path tracing's primal.
    primals: Vec<reconstruct::Method>,
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
    steps.warnings(warnings.list());
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
    let flags = SceneFlags::of_size(args.size, &args.reading);
    Ok((scene_name(path), load_with_camera(path, flags, warnings)?))
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
            let name = scene_name(path);
            if args.scenes.iter().filter(|p| scene_name(p) == name).count() > 1 {
                let message = "another scene has the same name; chart them into two folders";
                return Err(Error::input(path, None, message));
            }
        }
        let pool = thread_pool(args.threads)?;
        let (mut reconstructions, mut primals) = (Vec::new(), Vec::new());
        for method in distinct(&args.methods) {
            let alpha = args.alpha.filter(|_| method.kind.has_alpha());
            let threads = pool.current_num_threads();
            let made = reconstruction(method.kind, alpha, threads, &mut Warnings::new(true))?;
            match method.tracing {
                Method::Pt => primals.push(made),
                Method::Gpt => reconstructions.push(made),
            }
        }
        let mut tracings = Vec::new();
        for backend in distinct(&args.backends) {
            let tracing = |method, weights| Tracing {
                method,
                weights,
                backend,
            };
            if !primals.is_empty() {
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
        let inputs: Vec<&Path> = args.scenes.iter().map(|p| p.as_path()).collect();
        check_outputs(&inputs, &[&page])?;
        let run_seconds = args.time.as_secs_f64();
        Ok(Self {
            args,
            pool,
            store,
            reconstructions,
            primals,
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
        let mut told = String::new();
        for scene in reports {
            let curves = curves(rows, &scene.name);
            let file = |kind: &str| folder.join(format!("{}-{kind}", scene.name));
            figures::against_seconds(&scene.name, &curves).write(&file("seconds.svg"))?;
            figures::against_samples(&scene.name, &curves).write(&file("samples.svg"))?;
            told += &gains(&scene.name, &report::gain_table(&curves, &times), &times);
        }
        let page = folder.join("report.html");
        report::write(&page, reports, rows, &times, &self.settings())?;
        if self.args.quiet {
            return Ok(());
        }
        print(&format!("{told}wrote {}\n", page.display()))
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
