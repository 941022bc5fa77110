//! `--pixel` and `--sample`: one sample again, in words.

use super::{load, path_settings};
use crate::app::Ended;
use crate::cli::RenderArgs;
use crate::error::{Error, Result, Warnings};
use crate::path::replay;
use crate::progress::Reporter;
use crate::render::Method;
use std::io::Write;

/// Prints what the sample is made of.
pub(super) fn replay(args: &RenderArgs) -> Result<Ended> {
    let Some((x, y)) = args.pixel else {
        return Err(Error::Setting("--output or --pixel is needed".into()));
    };
    let mut warnings = Warnings::new(args.strict);
    let scene = load(args, &mut warnings)?;
    Reporter::new(args.quiet).warnings(warnings.list());
    let (width, height) = (scene.camera.width, scene.camera.height);
    if x >= width || y >= height {
        return Err(Error::Setting(format!(
            "--pixel {x},{y} is outside of the picture: columns are 0 to {}, rows 0 to {}",
            width - 1,
            height - 1
        )));
    }
    let tracer = args.backend.build(&scene.mesh, 1)?;
    let replay = match args.method {
        Method::Pt => replay::replay::<0>,
        Method::Gpt => replay::replay::<4>,
    };
    let told = replay(&scene, &*tracer, &path_settings(args), (x, y), args.sample);
    let mut out = std::io::stdout().lock();
    // A closed pipe is no failure.
    let _ = writeln!(
        out,
        "pixel {x},{y}, sample {}, seed {}",
        args.sample, args.seed
    );
    for line in told.lines {
        let _ = writeln!(out, "{line}");
    }
    Ok(Ended::Done)
}
