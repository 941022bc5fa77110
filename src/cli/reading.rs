//! How scenes are read: definitions for all commands that do.

use super::values::angle;
use clap::Args;
use std::path::PathBuf;

/// Flags of all commands that read scenes.
#[derive(Clone, Debug, Default, Args)]
pub struct ReadingArgs {
    /// One more folder in which textures are looked for
    #[arg(long, value_name = "DIR")]
    pub textures: Option<PathBuf>,
    /// Smooth edges less sharp than this, of faces with neither normals nor a smoothing group
    #[arg(long, value_name = "DEGREES", value_parser = angle)]
    pub smooth: Option<f32>,
}
