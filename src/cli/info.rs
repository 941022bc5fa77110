//! `gdpt info`: definitions.

use super::ReadingArgs;
use super::values::{SizeFlag, size};
use clap::Args;
use std::path::PathBuf;

/// `gdpt info`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gdpt info scene.obj                    materials, lights, textures, camera, warnings, memory, kernels
  gdpt info scene.obj --json info.json   the same for machines
  gdpt info *.obj --json - | jq          of several scenes, a list")]
pub struct InfoArgs {
    /// The scenes, as for `gdpt render`
    #[arg(required = true, value_name = "SCENE.obj")]
    pub scenes: Vec<PathBuf>,

    /// Also write it as JSON (- for standard output); of several scenes, as a list
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Picture size in pixels, or its width [default: the film's, or 512x512]
    #[arg(long, value_name = "WxH|W", value_parser = size)]
    pub size: Option<SizeFlag>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub reading: ReadingArgs,
}
