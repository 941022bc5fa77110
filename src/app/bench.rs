//! `gdpt bench` from flags to tables.

use super::{Ended, SceneFlags, load_with_camera, thread_pool};
use crate::bench::{measure, plot, record, report};
use crate::cli::BenchArgs;
use crate::error::{Error, Result, Warnings};
use crate::output;
use crate::progress::Reporter;
use crate::scene::Scene;
use crate::trace::{Traverse, bvh::Bvh};
use measure::Subject;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

/// Compares the backends on a scene.
pub fn bench(args: &BenchArgs) -> Result<Ended> {
    if args.runs == 0 || args.kilorays == 0 || args.depth == 0 {
        return Err(Error::Setting(
            "--runs, --kilorays and --depth must be at least 1".into(),
        ));
    }
    if args
        .plot
        .as_ref()
        .is_some_and(|p| p.extension().is_none_or(|e| e != "svg"))
    {
        return Err(Error::Setting("--plot writes a .svg".into()));
    }
    let outputs = [&args.json, &args.csv, &args.plot];
    let outputs: Vec<&Path> = outputs.into_iter().flatten().map(|p| p.as_path()).collect();
    output::check_outputs(&[&args.scene], &outputs)?;
    let pool = thread_pool(args.threads)?;
    let mut warnings = Warnings::new(false);
    let flags = SceneFlags::of_size(args.size, &args.reading);
    let scene = load_with_camera(&args.scene, flags, &mut warnings)?;
    Reporter::new(false).warnings(warnings.list());

    let subjects = build(&scene, pool.current_num_threads())?;
    let enough = args.kilorays * 1000;
    let recordings =
        pool.install(|| record::record(&scene, &*subjects[0].tracer, args.depth, enough));
    let mut progress = |share: f64| {
        let _ = write!(std::io::stderr(), "\rmeasuring: {:.0}% ", share * 100.0);
    };
    let rows = pool.install(|| measure::measure(&subjects, &recordings, args.runs, &mut progress));
    let _ = writeln!(std::io::stderr());

    if let Some(path) = &args.json {
        report::json(path, &rows)?;
    }
    if let Some(path) = &args.csv {
        report::csv(path, &rows)?;
    }
    if let Some(path) = &args.plot {
        let triangles = scene.mesh.triangles.len();
        let title = format!("{}: {triangles} triangles", args.scene.display());
        plot::svg(path, &title, &rows)?;
    }
    output::print_beside(&outputs, &report::table(&rows))?;
    Ok(Ended::Done)
}

/// Every backend over the scene, with the time that its tree took.
fn build(scene: &Scene, threads: usize) -> Result<Vec<Subject>> {
    let mut subjects = Vec::new();
    let mut add = |name, make: &dyn Fn() -> Result<Box<dyn Traverse>>| -> Result<()> {
        let start = Instant::now();
        let tracer = make()?;
        subjects.push(Subject {
            name,
            tracer,
            build_seconds: start.elapsed().as_secs_f64(),
        });
        Ok(())
    };
    #[cfg(feature = "embree")]
    {
        use crate::trace::embree::{Build, Embree};
        let embree = |build| -> Result<Box<dyn Traverse>> {
            Ok(Box::new(Embree::new(scene.mesh.clone(), threads, build)?))
        };
        add("embree", &|| embree(Build::Robust))?;
        add("embree fast", &|| embree(Build::Fast))?;
    }
    #[cfg(not(feature = "embree"))]
    let _ = threads;
    add("bvh", &|| Ok(Box::new(Bvh::new(&scene.mesh))))?;
    Ok(subjects)
}
