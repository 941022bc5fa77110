//! What the user sees while it works: a bar on a terminal, plain lines elsewhere, nothing if quiet.

use crate::error::Result;
use crate::output::stats::Stats;
use crate::output::{name_of, print_beside};
use crate::render::{Limits, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(60);

/// A bar of 1000 steps on a terminal that is to be written to.
fn bar(quiet: bool) -> Option<ProgressBar> {
    if quiet || !std::io::stderr().is_terminal() {
        return None;
    }
    let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
    let style = "{bar:30} {percent}% {msg}";
    bar.set_style(ProgressStyle::with_template(style).expect("a valid template"));
    Some(bar)
}

/// Writes to standard error; the summary to standard output.
pub struct Reporter {
    quiet: bool,
    bar: Option<ProgressBar>,
    limits: Option<Limits>,
    last_line: Instant,
}

impl Reporter {
    /// Silent but for errors if `quiet`.
    pub fn new(quiet: bool) -> Self {
        Self {
            quiet,
            bar: None,
            limits: None,
            last_line: Instant::now(),
        }
    }

    /// Prints warnings, a line each.
    pub fn warnings(&self, list: &[String]) {
        if !self.quiet {
            list.iter()
                .for_each(|w| _ = writeln!(std::io::stderr(), "warning: {w}"));
        }
    }

    /// Prints a remark.
    pub fn say(&self, line: &str) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }

    /// Tracing begins.
    pub fn start(&mut self, limits: &Limits) {
        self.limits = Some(*limits);
        self.last_line = Instant::now();
        self.bar = bar(self.quiet);
    }

    /// A pass is done.
    pub fn pass(&mut self, progress: Progress) {
        let Some(limits) = self.limits else { return };
        let seconds = progress.elapsed.as_secs_f64().max(1e-6);
        let by_samples = progress.samples as f64 / limits.samples as f64;
        let by_time = limits.time.map_or(0.0, |t| seconds / t.as_secs_f64());
        let share = by_samples.max(by_time).min(1.0);
        let left = seconds * (1.0 / share - 1.0);
        let message = format!(
            "{} samples, {:.1} Mray/s, {left:.0} s left",
            progress.samples,
            progress.rays as f64 / 1e6 / seconds,
        );
        if let Some(bar) = &self.bar {
            bar.set_position((share * 1000.0) as u64);
            bar.set_message(message);
        } else if !self.quiet && self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            let _ = writeln!(std::io::stderr(), "{:.0}%: {message}", share * 100.0);
        }
    }

    /// Tracing is done, the solve begins.
    pub fn end_tracing(&mut self) {
        if let Some(bar) = &self.bar {
            bar.set_message("reconstructing");
        }
    }

    /// The bar goes.
    pub fn end(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }

    /// All is written: the picture to `output`, and what else there is to `others`.
    pub fn summary(&mut self, stats: &Stats, output: &Path, others: &[&Path]) -> Result<()> {
        self.end();
        if self.quiet {
            return Ok(());
        }
        let word = if stats.interrupted {
            "interrupted; wrote"
        } else {
            "wrote"
        };
        let text = format!("{}\n{word} {}\n", stats.summary(), name_of(output));
        print_beside(&[&[output], others].concat(), &text)
    }
}

/// Progress through steps whose lengths are known beforehand, in seconds or in any other unit: a bar on a
/// terminal, a line now and then elsewhere.
pub struct Steps {
    quiet: bool,
    bar: Option<ProgressBar>,
    total: f64,
    done: f64,
    last_line: Option<Instant>,
}

impl Steps {
    /// Of the length `total` in all; silent but for errors if `quiet`.
    pub fn new(quiet: bool, total: f64) -> Self {
        Self {
            quiet,
            bar: bar(quiet),
            total,
            done: 0.0,
            last_line: None,
        }
    }

    /// A step begins.
    pub fn begin(&mut self, step: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(step.to_owned());
        } else if !self.quiet && self.last_line.is_none_or(|t| t.elapsed() >= LINE_EVERY) {
            self.last_line = Some(Instant::now());
            let percent = 100.0 * self.done / self.total;
            let _ = writeln!(std::io::stderr(), "{percent:.0}%: {step}");
        }
    }

    /// A step of this length is done.
    pub fn done(&mut self, length: f64) {
        self.done += length;
        if let Some(bar) = &self.bar {
            bar.set_position((1000.0 * self.done / self.total) as u64);
        }
    }

    /// Prints warnings, a line each.
    pub fn warnings(&self, list: &[String]) {
        list.iter().for_each(|w| self.say(&format!("warning: {w}")));
    }

    /// Prints a remark.
    pub fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None if self.quiet => (),
            None => _ = writeln!(std::io::stderr(), "{line}"),
        }
    }

    /// All is done.
    pub fn end(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}
