//! `gdpt merge`: definitions.

use super::MakingArgs;
use crate::output::format::Format;
use crate::reconstruct::Kind;
use clap::Args;
use std::path::PathBuf;

/// `gdpt merge`
#[derive(Debug, Args)]
#[command(after_help = "\
The order of the files does not matter. Parts must be of one scene with the same settings, rendered
by the same version; what does not belong, or is there twice, is named and nothing is written. A
checkpoint is such a file too.

Examples:
  gdpt merge part-*.gdpt -o out.exr
  gdpt merge part-*.gdpt -o out.png --partial          some parts are not done yet
  gdpt merge left.gdpt right.gdpt -o out.exr --reconstruct mix")]
pub struct MergeArgs {
    /// What gdpt render has written with --part or --crop
    #[arg(required = true, value_name = "PART.gdpt")]
    pub parts: Vec<PathBuf>,

    /// Where the picture goes: a .exr (all layers, 32-bit float), .png or .jpg (exposed and tone-mapped), or - for
    /// standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// What is written where the output's name does not say it [default: png]
    #[arg(long, value_enum)]
    pub format: Option<Format>,

    /// Also write a .png or .jpg, exposed and tone-mapped
    #[arg(long, value_name = "FILE")]
    pub preview: Option<PathBuf>,

    /// Also write the summary as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Make the picture of what is there, though parts are missing or not finished
    #[arg(long)]
    pub partial: bool,

    /// How the picture is made of primal and gradients [default: weighted for gpt, none for pt]
    #[arg(long)]
    pub reconstruct: Option<Kind>,

    /// A cleaner picture by Open Image Denoise: --reconstruct guided, or oidn for path tracing
    #[arg(long, conflicts_with = "reconstruct")]
    pub denoise: bool,

    /// Warnings are errors
    #[arg(long)]
    pub strict: bool,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub making: MakingArgs,
}
