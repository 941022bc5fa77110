//! `gdpt info`: definitions.

use super::values::size;
use clap::Args;
use std::path::PathBuf;

/// `gdpt info`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gdpt info scene.obj                    materials, lights, textures, camera, warnings, memory, kernels
  gdpt info scene.obj --json info.json   the same for machines")]
pub struct InfoArgs {
    /// The scene, as for `gdpt render`
    pub scene: PathBuf,

    /// Also write it as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Picture size in pixels [default: the scene's, or 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
}
