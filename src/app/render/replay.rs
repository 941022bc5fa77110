//! `--pixel` and `--sample`: one sample again, in words.

use super::{load, path_settings};
use crate::app::{Ended, settle};
use crate::cli::RenderArgs;
use crate::error::{Error, Result, Warnings};
use crate::output::print;
use crate::path::replay;
use crate::progress::Reporter;
use crate::render::Method;

/// Prints what the sample is made of.
pub(super) fn replay(args: &RenderArgs, (x, y): (u32, u32)) -> Result<Ended> {
    let [scene] = &args.scenes[..] else {
        let message = "--pixel is of one scene; name one";
        return Err(Error::Setting(message.into()));
    };
    let mut warnings = Warnings::new(args.strict);
    let mut scene = load(args, scene, &mut warnings)?;
    let tracer = args.backend.build(&scene.mesh, 1)?;
    settle(&mut scene, &*tracer, &mut warnings)?;
    Reporter::new(args.quiet).warnings(warnings.list());
    let (width, height) = (scene.camera.width, scene.camera.height);
    if x >= width || y >= height {
        return Err(Error::Setting(format!(
            "--pixel {x},{y} is outside of the picture: columns are 0 to {}, rows 0 to {}",
            width - 1,
            height - 1
        )));
    }
    let replay = match args.method {
        Method::Pt => replay::replay::<0>,
        Method::Gpt => replay::replay::<4>,
    };
    let told = replay(&scene, &*tracer, &path_settings(args), (x, y), args.sample);
    let (sample, seed) = (args.sample, args.seed);
    let lines = told.lines.join("\n");
    print(&format!(
        "pixel {x},{y}, sample {sample}, seed {seed}\n{lines}\n"
    ))?;
    Ok(Ended::Done)
}
