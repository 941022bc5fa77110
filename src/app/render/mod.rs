//! `gdpt render`: flags to a plan, and the plan to pictures.

mod error_check;
mod lock;
mod nothing;
mod plan;
mod replay;
mod saving;
mod session;
mod turntable;
mod watching;

use super::{Ended, finish, load_scene, memory, reconstruction, settle, thread_pool};
use crate::checkpoint::About;
use crate::cli::RenderArgs;
use crate::error::{Error, Result, Warnings};
use crate::exposure::Exposure;
use crate::machine;
use crate::part::Share;
use crate::progress::Reporter;
use crate::render::Limits;
use crate::watch::Watcher;
use plan::{Plan, Target, Task};
use session::Session;
use std::cell::OnceCell;
use std::io::Write;
use std::time::Instant;

/// Renders scenes. One that fails does not keep the others from being rendered. `stop` is asked between passes whether
/// to end early.
pub fn render(args: &RenderArgs, stop: &(dyn Fn() -> bool + Sync)) -> Result<Ended> {
    let plan = Plan::of_flags(args)?;
    let targets = match &plan.task {
        Task::Sample {
            scene,
            pixel,
            number,
        } => return replay::replay(&plan, scene, *pixel, *number),
        Task::Pictures(targets) => targets,
    };
    if let [target] = &targets[..] {
        return render_scene(&plan, target, stop);
    }
    let mut failed = 0;
    for target in targets {
        Reporter::new(plan.quiet).say(&format!("{}:", target.scene.display()));
        match render_scene(&plan, target, stop) {
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
fn render_scene(plan: &Plan, target: &Target, stop: &(dyn Fn() -> bool + Sync)) -> Result<Ended> {
    let pool = thread_pool(plan.threads)?;
    let mut warnings = Warnings::new(plan.strict);
    let threads = pool.current_num_threads();
    let making = &plan.making;
    let method = reconstruction(making.reconstruct, making.alpha, threads, &mut warnings)?;

    // Scene.
    let start = Instant::now();
    let reporter = Reporter::new(plan.quiet);
    let mut scene = load_scene(target.scene, plan.scene.clone(), &mut warnings)?;
    let seconds_loading = start.elapsed().as_secs_f64();
    if let Some(format) = target.format {
        finish::check_background(format, scene.background)?;
    }
    let window = plan.window(scene.camera.width, scene.camera.height)?;
    memory::check(
        window,
        target.film().is_some(),
        "make it smaller with --size, or render it in pieces with --crop",
    )?;
    let start = Instant::now();
    let tracer = plan.backend.build(&scene.mesh, threads)?;
    let seconds_building = start.elapsed().as_secs_f64();
    pool.install(|| settle(&mut scene, &*tracer, &mut warnings))?;
    reporter.warnings(warnings.list());

    let (samples, limits) = (target.samples, plan.ends.limits);
    let range = samples.range();
    let session = Session {
        plan,
        limits: Limits {
            samples: limits.samples.min(range.end - range.start),
            ..limits
        },
        share: Share { window, samples },
        method,
        target,
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
        watcher: plan.watch.map(|address| Watcher::new(address.to_owned())),
    };
    let Some(frames) = &target.frames else {
        return session.render(&scene, &target.output);
    };
    let camera = scene.camera.clone();
    if making.one_of_several && making.exposure == Exposure::Auto && session.is_shown() {
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
