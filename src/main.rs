//! The program `gdpt`.

use gdpt::app::{self, Ended};
use gdpt::cli::{Cli, Command};
use gdpt::error::Error;
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

static STOP: AtomicBool = AtomicBool::new(false);
/// Signals that come in such a time are one.
const AT_ONCE: Duration = Duration::from_millis(500);
const INTERRUPTED: u8 = 130;
/// `EX_TEMPFAIL` of sysexits: whoever started it starts it again.
const TRY_AGAIN: u8 = 75;
/// As a shell has it for a program that the signal ended which a closed pipe sends.
const CLOSED_PIPE: u8 = 141;

fn main() -> ExitCode {
    // Panics inside parsers of other crates become error messages; they need not be printed too.
    let print_panic = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !gdpt::load::inside_parser() {
            print_panic(info);
        }
    }));
    let stop = || STOP.load(Ordering::SeqCst);
    let arguments: Vec<OsString> = std::env::args_os().collect();
    let cli = match Cli::of(&arguments) {
        Ok(cli) => cli,
        Err(e) => return told(&e),
    };
    // All others end at once, as programs do: what they write is there as a whole or not at all.
    if matches!(
        cli.command,
        Command::Render(_) | Command::Chart(_) | Command::Spectrum(_)
    ) {
        end_by_signal();
    }
    let result = match cli.command {
        Command::Render(args) => app::render::render(&args, &stop),
        Command::Merge(args) => app::merge::merge(&args),
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
        Ok(Ended::Unfinished) => ExitCode::from(TRY_AGAIN),
        Err(e) => failure(&e),
    }
}

/// The first Ctrl-C ends after the pass and writes what there is; the second ends at once. One that comes at the same time
/// is the same one: schedulers send a signal to all processes of a job, and scripts pass it on.
fn end_by_signal() {
    let mut first: Option<Instant> = None;
    let handler = ctrlc::set_handler(move || match first {
        None => {
            first = Some(Instant::now());
            STOP.store(true, Ordering::SeqCst);
            let message = "ending after this pass; Ctrl-C again ends at once, and writes nothing";
            let _ = writeln!(std::io::stderr(), "\n{message}");
        }
        Some(first) if first.elapsed() < AT_ONCE => (),
        Some(_) => std::process::exit(i32::from(INTERRUPTED)),
    });
    if let Err(e) = handler {
        say(&format!(
            "warning: Ctrl-C will end at once, without a picture: {e}"
        ));
    }
}

/// Prints what the command line led to in place of a command: help, or what is wrong with it.
fn told(e: &clap::Error) -> ExitCode {
    let printed = e.print().and_then(|()| std::io::stdout().flush());
    match printed {
        Err(printing) if !e.use_stderr() => {
            let path = Path::new("standard output");
            failure(&Error::io(path, "cannot be written")(printing))
        }
        // An error that cannot be printed is one all the same.
        _ => ExitCode::from(e.exit_code() as u8),
    }
}

fn failure(e: &Error) -> ExitCode {
    if e.is_closed_pipe() {
        return ExitCode::from(CLOSED_PIPE);
    }
    say(&format!("error: {e}"));
    match e {
        Error::Later(_) => ExitCode::from(TRY_AGAIN),
        _ => ExitCode::FAILURE,
    }
}

/// To standard error, which may be closed or full.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
