//! Flags of the commands that make a picture of samples that are there.

use super::values::alpha;
use crate::exposure::Exposure;
use crate::reconstruct::Alpha;
use crate::tone::Tone;
use clap::Args;

/// How a picture is made and shown.
#[derive(Clone, Debug, Args)]
pub struct MakingArgs {
    /// Weight of the primal against the gradients for l2 and l1: a number, or auto to take it from their
    /// variances [default: 0.2]
    #[arg(long, value_parser = alpha)]
    pub alpha: Option<Alpha>,

    /// Brighten 8-bit pictures by this many stops; auto meters what the scene's surfaces send to the camera
    #[arg(
        long,
        value_name = "auto|STOPS",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    pub exposure: Exposure,

    /// Tone curve of 8-bit pictures
    #[arg(long, default_value = "neutral")]
    pub tone: Tone,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Print errors only
    #[arg(long)]
    pub quiet: bool,
}
