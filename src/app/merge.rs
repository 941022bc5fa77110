//! `gdpt merge` from films to files.

use super::finish::{self, Outputs, Rendered};
use super::{Ended, kind_for, memory, reconstruction, thread_pool};
use crate::cli::MergeArgs;
use crate::error::{Error, Result, Warnings};
use crate::load::environment::Background;
use crate::merge::Plan;
use crate::output;
use crate::output::format::Format;
use crate::picture;
use crate::progress::{Reporter, Steps};
use crate::render::{Ending, Method};
use clap::ValueEnum;
use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// So many films take a while.
const MANY: usize = 100;

/// Puts films together into a picture.
pub fn merge(args: &MergeArgs) -> Result<Ended> {
    // Everything that can be refused is refused before the sums are read.
    let inputs: Vec<&Path> = args.parts.iter().map(PathBuf::as_path).collect();
    let others = [&args.preview, &args.stats].into_iter().flatten();
    let outputs: Vec<&Path> = std::iter::once(&args.output)
        .chain(others)
        .map(PathBuf::as_path)
        .collect();
    output::check_outputs(&inputs, &outputs)?;
    let format = Format::of(&args.output, args.format)?;
    let preview = finish::preview(args.preview.as_deref())?;
    let pool = thread_pool(args.making.threads)?;
    let plan = Plan::new(&args.parts, args.partial)?;
    let of_header = |name: &str| plan.identity.get(name).map_or("", |v| v.as_str());
    let senseless =
        |what: &str| Error::input(inputs[0], None, format!("has no {what} that makes sense"));
    let rendered_by =
        Method::from_str(of_header("method"), false).map_err(|_| senseless("method"))?;
    let background: Background = plan
        .about
        .background
        .parse()
        .map_err(|_| senseless("background"))?;
    finish::check_background(format, background)?;
    let kind = kind_for(rendered_by, args.reconstruct, args.denoise)?;
    memory::check(plan.window, false, "merge on a machine that has more")?;
    let mut warnings = Warnings::new(args.strict);
    let method = reconstruction(
        kind,
        args.making.alpha,
        pool.current_num_threads(),
        &mut warnings,
    )?;
    for remark in &plan.remarks {
        warnings.push(remark)?;
    }
    Reporter::new(args.making.quiet).warnings(warnings.list());

    // Film.
    let mut steps = Steps::new(
        args.making.quiet || plan.films() < MANY,
        plan.films() as f64,
    );
    let film = plan.sum(&mut |count| {
        steps.begin(&format!("{count} of {} films", plan.films()));
        steps.done(1.0);
    })?;
    steps.end();
    if film.samples == [0; 2] {
        return Err(Error::Setting("there are no samples in these files".into()));
    }
    let mut reporter = Reporter::new(args.making.quiet);
    if let Some(remark) = different(&plan.processors) {
        reporter.say(&remark);
    }

    // Picture.
    let hits = film.first_hits();
    let picture = pool.install(|| picture::of_film(&film, method));
    let outputs = Outputs {
        picture: &args.output,
        format,
        preview,
        stats: args.stats.as_deref(),
        exposure: args.making.exposure,
        tone: args.making.tone,
        checkpoint: None,
    };
    let shown = outputs.shown(&OnceCell::new(), &film, &picture, &hits);
    let rendered = Rendered {
        film: &film,
        method: rendered_by,
        background,
        identity: &plan.identity,
        about: &plan.about,
        progress: &plan.progress,
        ended: if plan.progress.finished {
            Ending::Samples.name()
        } else {
            "partial"
        },
        mattes: None,
        warnings: warnings.list().to_vec(),
    };
    outputs.write(rendered, (&picture, method), &hits, shown, &mut reporter)?;
    Ok(Ended::Done)
}

/// What is said of machines that compute with different processors.
fn different(processors: &BTreeSet<String>) -> Option<String> {
    let names: Vec<&str> = processors
        .iter()
        .map(|name| match name.as_str() {
            "" => "one that is not known",
            name => name,
        })
        .collect();
    (names.len() > 1).then(|| {
        format!(
            "rendered on different processors ({}): the last bits may differ from a render on one",
            names.join("; ")
        )
    })
}
