//! One scene, from what is planned to files.

use super::error_check::ErrorCheck;
use super::nothing::Lookout;
use super::plan::{Plan, Target};
use super::saving::Saving;
use super::watching::Watching;
use crate::app::Ended;
use crate::app::finish::{Outputs, Rendered};
use crate::checkpoint::{About, Header, Progress};
use crate::error::{Error, Result};
use crate::film::{Film, Halves, Window};
use crate::mattes;
use crate::output;
use crate::output::format::Format;
use crate::part::{Samples, Share};
use crate::path::{Counts, PathSettings};
use crate::picture;
use crate::progress::Reporter;
use crate::reconstruct;
use crate::render::{Ending, Job, Limits, TILE_SIZE};
use crate::scene::Scene;
use crate::trace::Traverse;
use crate::watch::Watcher;
use std::cell::OnceCell;
use std::io::Write;
use std::path::Path;

/// Most samples by whose camera rays the mattes of a pixel are made.
const MATTE_SAMPLES: u64 = 64;

/// What all views of a scene have in common.
pub(super) struct Session<'a> {
    pub(super) plan: &'a Plan<'a>,
    pub(super) limits: Limits,
    pub(super) share: Share,
    pub(super) method: reconstruct::Method,
    pub(super) target: &'a Target<'a>,
    pub(super) pool: rayon::ThreadPool,
    pub(super) tracer: &'a dyn Traverse,
    pub(super) warnings: &'a [String],
    pub(super) about: About,
    /// In stops: that of the first picture, for all of them.
    pub(super) exposure: OnceCell<f32>,
    pub(super) stop: &'a (dyn Fn() -> bool + Sync),
    pub(super) watcher: Option<Watcher>,
}

impl Session<'_> {
    /// Whether a picture of 8 bits is made.
    pub(super) fn is_shown(&self) -> bool {
        let of_format = |format| Outputs::shows(format, self.plan.making.preview);
        self.target.format.is_some_and(of_format)
    }

    /// What is rendered of the scene.
    pub(super) fn job<'a>(&'a self, scene: &'a Scene) -> Job<'a> {
        let paths = self.plan.paths;
        Job {
            scene,
            tracer: self.tracer,
            method: self.plan.method,
            settings: PathSettings {
                seed: self.share.samples.seed(paths.seed),
                ..paths
            },
            first: self.share.samples.range().start,
            limits: self.limits,
        }
    }

    /// Renders the scene to a file.
    pub(super) fn render(&self, scene: &Scene, output: &Path) -> Result<Ended> {
        let Session {
            plan,
            limits,
            method,
            target,
            ref pool,
            stop,
            ..
        } = *self;
        let mut reporter = Reporter::new(plan.quiet);

        // Film, and what a checkpoint holds of it.
        let mut film = Film::of(self.share.window, TILE_SIZE);
        let header = self.header(scene);
        let mut saving = Saving::new(&plan.keeping, target.film().map(|_| output), header.clone())?;
        saving.lock()?;
        if let Some(samples) = saving.resume(&mut film)? {
            reporter.say(&format!("going on from {samples} samples"));
            if samples > limits.samples {
                reporter.say("that is more than --spp asks for: all of them are used");
            }
        }

        // Paths.
        let job = Job {
            limits: saving.left(limits),
            ..self.job(scene)
        };
        reporter.start(&job.limits);
        let mut check = ErrorCheck::new(plan.ends.error, saving.next_check());
        let mut lookout = Lookout::new(plan.ends.by_error_alone, self.share.window, plan.quiet);
        let watcher = self.watcher.as_ref();
        let mut watching =
            Watching::new(watcher, output, plan.method, scene.background, plan.quiet);
        let mut ask = |film: &Film, counts: &Counts| {
            saving.now_and_then(film, counts, check.next);
            watching.now_and_then(film, method);
            if stop() {
                Some(Ending::Interrupted)
            } else if lookout.gives_up(scene, film) {
                Some(Ending::Nothing)
            } else {
                check.reached(film, method).then_some(Ending::Error)
            }
        };
        let outcome = pool.install(|| job.run(&mut film, &mut ask, &mut |p| reporter.pass(p)));
        let progress = saving.end(&film, &outcome, check.next)?;
        let interrupted = outcome.ended == Ending::Interrupted;
        if film.samples == [0; 2] {
            reporter.end();
            let _ = writeln!(
                std::io::stderr(),
                "ended before the first pass; nothing is written"
            );
            return Ok(self.interrupted());
        }
        // Under --strict these end the program too, once all is written.
        let mut late = saving.complaints();
        let counts = &progress.counts;
        if counts.dropped > 0 {
            late.push(dropped(counts, job.settings.seed));
        }
        reporter.warnings(&late);
        late.extend(lookout.end(scene, &film));

        if let Some(format) = target.format {
            // Picture.
            reporter.end_tracing();
            let hits = film.first_hits();
            let picture = match check.last {
                // The film has not changed since.
                Some(picture) if outcome.ended == Ending::Error => picture,
                _ => pool.install(|| picture::of_film(&film, method)),
            };
            late.extend(watching.end(&picture, &hits, &film));

            // Files.
            let mattes = plan.making.mattes.then(|| {
                let samples = 0..film.count(Halves::Both).min(MATTE_SAMPLES);
                let (tracer, window) = (self.tracer, self.share.window);
                pool.install(|| mattes::of_scene(scene, tracer, &plan.paths, window, samples))
            });
            let outputs = self.outputs((output, format), saving.kept());
            let shown = outputs.shown(&self.exposure, &film, &picture, &hits);
            let rendered = Rendered {
                film: &film,
                method: plan.method,
                background: scene.background,
                identity: &header.identity,
                about: &header.about,
                progress: &progress,
                ended: outcome.ended.name(),
                mattes: mattes.as_ref(),
                warnings: [self.warnings, &late].concat(),
            };
            outputs.write(rendered, (&picture, method), &hits, shown, &mut reporter)?;
        } else {
            reporter.end();
            if self.watcher.is_some() {
                let picture = pool.install(|| picture::of_film(&film, method));
                late.extend(watching.end(&picture, &film.first_hits(), &film));
            }
            if !plan.quiet {
                let text = self.summary(&film, &progress, interrupted, output);
                output::print_beside(&[output], &text)?;
            }
        }
        let interrupted = interrupted.then(|| self.interrupted());
        match (late.into_iter().next(), interrupted) {
            // Whoever runs it again hears of it again.
            (_, Some(Ended::Unfinished)) => Ok(Ended::Unfinished),
            (Some(first), _) if plan.strict => Err(Error::Strict(first)),
            (_, interrupted) => Ok(interrupted.unwrap_or(Ended::Done)),
        }
    }

    /// What has been interrupted: a film goes on when the same command runs again.
    fn interrupted(&self) -> Ended {
        match self.target.format {
            Some(_) => Ended::Interrupted,
            None => Ended::Unfinished,
        }
    }

    /// What stands in a checkpoint of the scene, before anything is done.
    fn header(&self, scene: &Scene) -> Header {
        let Share { window, samples } = self.share;
        let mut identity = self.plan.identity();
        let (width, height) = window.picture;
        let more = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", format!("{:016x}", scene.hash())),
            ("size", format!("{width}x{height}")),
        ];
        let crop = (!window.is_whole()).then(|| ("crop", window.to_string()));
        let of_share = samples.identity().into_iter().chain(crop);
        for (name, value) in more.into_iter().chain(of_share) {
            identity.insert(name.to_owned(), value);
        }
        Header {
            identity,
            share: self.share,
            progress: Progress::default(),
            about: About {
                camera: scene.framing.describe(&scene.camera),
                ..self.about.clone()
            },
        }
    }

    fn outputs<'a>(
        &'a self,
        (picture, format): (&'a Path, Format),
        checkpoint: Option<&'a Path>,
    ) -> Outputs<'a> {
        let making = &self.plan.making;
        Outputs {
            picture,
            format,
            preview: making.preview,
            stats: making.stats,
            exposure: making.exposure,
            tone: making.tone,
            checkpoint,
        }
    }

    /// What is said of a film.
    fn summary(
        &self,
        film: &Film,
        progress: &Progress,
        interrupted: bool,
        output: &Path,
    ) -> String {
        let samples = film.count(Halves::Both);
        let of = match self.share.samples {
            Samples::Some { part, all } if part.parts > 1 => format!(" (part {part} of {all})"),
            Samples::Own(part) => format!(" (part {part})"),
            _ => String::new(),
        };
        let Window { width, height, .. } = film.window;
        let word = if interrupted {
            "interrupted, and can go on with --resume; wrote"
        } else {
            "wrote"
        };
        format!(
            "{samples} samples per pixel{of}, {width}x{height}: {:.2} s tracing\n{word} {}\n",
            progress.seconds,
            output::name_of(output)
        )
    }
}

/// What is said of samples that were not finite, with what renders the first of them again.
fn dropped(counts: &Counts, seed: u64) -> String {
    let first = counts.first_dropped.iter().flatten();
    let first: Vec<String> = first
        .map(|(x, y, sample)| format!("--pixel {x},{y} --sample {sample}"))
        .collect();
    format!(
        "{} samples were not finite and dropped; with --seed {seed}, {} shows what happened",
        counts.dropped,
        first.join(" or ")
    )
}
