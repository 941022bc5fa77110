//! `gdpt reconstruct`: definitions.

use super::MakingArgs;
use crate::output::format::Format;
use crate::reconstruct::Kind;
use clap::Args;
use std::path::PathBuf;

/// `gdpt reconstruct`
#[derive(Debug, Args)]
#[command(after_help = "\
A render's own file holds what every method needs. From three files (channels R, G, B) there are no
variances, so the methods are l2 and l1. Differences are the right or lower neighbour minus the pixel;
the last column of dx and the last row of dy do not count.

Examples:
  gdpt reconstruct out.exr -o l1.exr --reconstruct l1 --alpha auto
  gdpt reconstruct --primal p.exr --dx dx.exr --dy dy.exr -o out.exr")]
pub struct ReconstructArgs {
    /// What gdpt render wrote
    #[arg(required_unless_present = "primal", conflicts_with = "primal")]
    pub input: Option<PathBuf>,

    /// The path-traced image, without light seen directly
    #[arg(long, value_name = "FILE.exr", requires = "dx", requires = "dy")]
    pub primal: Option<PathBuf>,

    /// Differences to the right
    #[arg(long, value_name = "FILE.exr", requires = "primal")]
    pub dx: Option<PathBuf>,

    /// Differences downwards
    #[arg(long, value_name = "FILE.exr", requires = "primal")]
    pub dy: Option<PathBuf>,

    /// Light seen directly, to be added to the picture
    #[arg(long, value_name = "FILE.exr", requires = "primal")]
    pub direct: Option<PathBuf>,

    /// Where the picture goes: a .exr (linear), .png or .jpg (exposed and tone-mapped), or - for standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// What is written where the output's name does not say it [default: png]
    #[arg(long, value_enum)]
    pub format: Option<Format>,

    /// How the picture is made [default: weighted, or l2 from three files]
    #[arg(long)]
    pub reconstruct: Option<Kind>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub making: MakingArgs,
}
