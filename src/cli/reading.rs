//! How scenes are read: definitions for all commands that do.

use clap::Args;
use std::path::PathBuf;

/// Flags of all commands that read scenes.
#[derive(Clone, Debug, Default, Args)]
pub struct ReadingArgs {
    /// One more folder in which textures are looked for
    #[arg(long, value_name = "DIR")]
    pub textures: Option<PathBuf>,
}
