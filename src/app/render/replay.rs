//! `--pixel` and `--sample`: one sample again, in words.

use super::plan::Plan;
use crate::app::{Ended, load_scene, settle};
use crate::error::{Error, Result, Warnings};
use crate::output::print;
use crate::path::replay;
use crate::progress::Reporter;
use crate::render::Method;
use std::path::Path;

/// Prints what the sample `number` of a pixel is made of.
pub(super) fn replay(plan: &Plan, scene: &Path, (x, y): (u32, u32), number: u64) -> Result<Ended> {
    let mut warnings = Warnings::new(plan.strict);
    let mut scene = load_scene(scene, plan.scene.clone(), &mut warnings)?;
    let tracer = plan.backend.build(&scene.mesh, 1)?;
    settle(&mut scene, &*tracer, &mut warnings)?;
    Reporter::new(plan.quiet).warnings(warnings.list());
    let (width, height) = (scene.camera.width, scene.camera.height);
    if x >= width || y >= height {
        return Err(Error::Setting(format!(
            "--pixel {x},{y} is outside of the picture: columns are 0 to {}, rows 0 to {}",
            width - 1,
            height - 1
        )));
    }
    let replay = match plan.method {
        Method::Pt => replay::replay::<0>,
        Method::Gpt => replay::replay::<4>,
    };
    let told = replay(&scene, &*tracer, &plan.paths, (x, y), number);
    let seed = plan.paths.seed;
    let lines = told.lines.join("\n");
    print(&format!(
        "pixel {x},{y}, sample {number}, seed {seed}\n{lines}\n"
    ))?;
    Ok(Ended::Done)
}
