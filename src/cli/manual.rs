//! `gdpt completions` and `gdpt man`: definitions.

use clap::Args;
use clap_complete::Shell;
use std::path::PathBuf;

/// `gdpt completions`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gdpt completions bash > ~/.local/share/bash-completion/completions/gdpt
  gdpt completions zsh > ~/.zfunc/_gdpt
  gdpt completions fish > ~/.config/fish/completions/gdpt.fish")]
pub struct CompletionsArgs {
    /// The shell
    pub shell: Shell,
}

/// `gdpt man`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gdpt man | man -l -                       read it
  gdpt man ~/.local/share/man/man1          install gdpt.1, gdpt-render.1, ...")]
pub struct ManArgs {
    /// Write a page for each command into this folder, in place of the first page to the terminal
    pub folder: Option<PathBuf>,
}
