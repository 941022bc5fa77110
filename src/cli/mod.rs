//! The command line: definitions only.

mod bench;
mod chart;
mod compare;
mod info;
mod making;
mod manual;
mod merge;
mod reading;
mod reconstruct;
mod render;
mod spectrum;
mod suggest;
mod values;

pub use bench::BenchArgs;
pub use chart::{ChartArgs, ChartMethod};
pub use compare::CompareArgs;
pub use info::InfoArgs;
pub use making::MakingArgs;
pub use manual::{CompletionsArgs, ManArgs};
pub use merge::MergeArgs;
pub use reading::ReadingArgs;
pub use reconstruct::ReconstructArgs;
pub use render::RenderArgs;
pub use spectrum::SpectrumArgs;
pub use values::{CropFlag, EnvironmentFlag, SizeFlag};

use clap::{Parser, Subcommand};
use std::ffi::OsString;

/// A gradient-domain path tracer for OBJ scenes.
#[derive(Debug, Parser)]
#[command(
    name = "gdpt",
    version,
    about,
    max_term_width = 100,
    args_override_self = true
)]
#[command(after_help = "\
Examples:
  gdpt render scene.obj                   render it into scene.png
  gdpt info scene.obj                     see what its materials became
  gdpt help render                        all flags of a command")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

impl Cli {
    /// Reads the arguments, of which the first is the program; an error says what was meant, where that can
    /// be told.
    pub fn of(arguments: &[OsString]) -> Result<Self, clap::Error> {
        Self::try_parse_from(arguments).map_err(|e| suggest::improve(e, arguments))
    }
}

/// What the program can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render an OBJ scene
    Render(Box<RenderArgs>),
    /// Put parts and crops of a render, rendered on several machines, together into its picture
    Merge(MergeArgs),
    /// Make the picture again from a render's file, or from primal and differences of another renderer
    Reconstruct(ReconstructArgs),
    /// Measure how far an image is from one or two references
    Compare(CompareArgs),
    /// Chart error against time: every method, several times and seeds, against two references
    Chart(ChartArgs),
    /// Measure where the error theory of gradient-domain rendering holds, by frequency
    Spectrum(SpectrumArgs),
    /// Tell what a scene holds, what its materials became, and what memory its render takes
    Info(InfoArgs),
    /// Compare ray-traversal backends on the rays of a scene's own render
    Bench(BenchArgs),
    /// Print completions for a shell
    Completions(CompletionsArgs),
    /// Print the manual page, or write one for each command
    Man(ManArgs),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_definitions_are_consistent() {
        <Cli as clap::CommandFactory>::command().debug_assert();
    }
}
