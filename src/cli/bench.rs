//! `gdpt bench`: definitions.

use super::ReadingArgs;
use super::values::{SizeFlag, size};
use clap::Args;
use std::path::PathBuf;

/// `gdpt bench`
#[derive(Debug, Args)]
#[command(after_help = "\
The rays are those of a real render of the scene: base and offset rays at every bounce, in
the batches of the renderer. All ways are measured in turn, several times over; compare them
within one run. The number of hits is a checksum: it may differ by the few rays that meet an
edge. A star marks the way that gdpt render goes. \"embree fast\" is Embree without its robust
edge tests; gdpt render uses the robust ones.

Examples:
  gdpt bench scene.obj
  gdpt bench scene.obj --threads 1 --runs 9 --csv bench.csv --plot bench.svg")]
pub struct BenchArgs {
    /// The scene, as for `gdpt render`
    pub scene: PathBuf,

    /// Also write the measurements as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Also write the measurements as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,

    /// Also draw them
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Runs of which the median is taken
    #[arg(long, default_value_t = 5)]
    pub runs: usize,

    /// Rays of each kind, in thousands
    #[arg(long, default_value_t = 200)]
    pub kilorays: usize,

    /// Longest light path in segments
    #[arg(long, default_value_t = 12)]
    pub depth: u32,

    /// Picture size in pixels, or its width [default: the film's, or 512x512]
    #[arg(long, value_name = "WxH|W", value_parser = size)]
    pub size: Option<SizeFlag>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub reading: ReadingArgs,
}
