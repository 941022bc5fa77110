//! The program `gdpt`.

use clap::Parser;
use gdpt::app::{self, Ended};
use gdpt::cli::{Cli, Command};
use std::io::Write;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    // Panics inside parsers of other crates become error messages; they need not be printed too.
    let print_panic = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !gdpt::load::inside_parser() {
            print_panic(info);
        }
    }));
    // The first Ctrl-C ends after the pass and writes what there is; the second ends at once.
    let handler = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        let message = "ending after this pass; Ctrl-C again ends at once, without a picture";
        let _ = writeln!(std::io::stderr(), "\n{message}");
    });
    if let Err(e) = handler {
        eprintln!("warning: Ctrl-C will end at once, without a picture: {e}");
    }

    let stop = || STOP.load(Ordering::SeqCst);
    let result = match Cli::parse().command {
        Command::Render(args) => app::render::render(&args, &stop),
        Command::Reconstruct(args) => app::reconstruct::reconstruct(&args),
        Command::Compare(args) => app::compare::compare(&args),
        Command::Chart(args) => app::chart::chart(&args, &stop),
        Command::Spectrum(args) => app::spectrum::spectrum(&args, &stop),
        Command::Info(args) => app::info::info(&args),
        Command::Bench(args) => app::bench::bench(&args),
        Command::Completions(args) => app::manual::completions(&args),
        Command::Man(args) => app::manual::man(&args),
    };
    match result {
        Ok(Ended::Done) => ExitCode::SUCCESS,
        Ok(Ended::Interrupted) => ExitCode::from(INTERRUPTED),
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}
