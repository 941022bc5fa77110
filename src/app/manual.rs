//! `gdpt completions` and `gdpt man`.

use super::Ended;
use crate::cli::{Cli, CompletionsArgs, ManArgs};
use crate::error::{Error, Result};
use crate::output::print;
use clap::CommandFactory;

/// Prints what makes a shell complete commands and flags.
pub fn completions(args: &CompletionsArgs) -> Result<Ended> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "gdpt", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(Ended::Done)
}

/// Prints the manual page, or writes one for each command.
pub fn man(args: &ManArgs) -> Result<Ended> {
    let Some(folder) = &args.folder else {
        let mut page = Vec::new();
        let rendered = clap_mangen::Man::new(Cli::command()).render(&mut page);
        rendered.expect("memory takes everything");
        print(&String::from_utf8_lossy(&page))?;
        return Ok(Ended::Done);
    };
    std::fs::create_dir_all(folder).map_err(Error::io(folder, "the folder cannot be made"))?;
    clap_mangen::generate_to(Cli::command(), folder)
        .map_err(Error::io(folder, "the pages cannot be written"))?;
    Ok(Ended::Done)
}
