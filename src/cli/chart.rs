//! `gdpt chart`: definitions.

use super::ReadingArgs;
use super::values::{SizeFlag, alpha, duration, size};
use crate::gradient::Weights;
use crate::reconstruct::{Alpha, Kind};
use crate::render::Method;
use crate::sampler::SamplerKind;
use crate::trace::Backend;
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::sync::LazyLock;
use std::time::Duration;

/// `gdpt chart`
#[derive(Debug, Args)]
#[command(after_help = "\
Renders two independent references, then each method with each seed as one progressive render
that is measured at 4, 8, 16... samples and when its time is over, making the picture included.
Writes into the folder: chart.csv (all measurements), SCENE-seconds and SCENE-samples (.svg and
.png), and report.html (one file: pictures side by side, errors, figures, gains). Finished runs
are kept in its folder cache; the same command again renders only what is missing.

Examples:
  gdpt chart scene.obj -o charts
  gdpt chart a.obj b.obj -o charts --time 30s --seeds 8 --methods pt,weighted
  gdpt chart scene.obj -o charts --sampler independent --reference pt")]
pub struct ChartArgs {
    /// Scenes, as for `gdpt render`
    #[arg(required = true, value_name = "SCENE.obj")]
    pub scenes: Vec<PathBuf>,

    /// Folder for all that is written
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// What to measure
    #[arg(long, value_delimiter = ',', default_value = "pt,l2,l1,weighted")]
    pub methods: Vec<ChartMethod>,

    /// Weights of the two directions of a shift
    #[arg(long, value_delimiter = ',', default_value = "mis")]
    pub weights: Vec<Weights>,

    /// Ray traversal
    #[arg(long, value_delimiter = ',', default_value = Backend::DEFAULT.name())]
    pub backends: Vec<Backend>,

    /// Time of each run
    #[arg(long, value_parser = duration, default_value = "8s")]
    pub time: Duration,

    /// Runs of each method, with seeds from 0 up
    #[arg(long, default_value_t = 4)]
    pub seeds: u64,

    /// How the samples of a pixel are spread
    #[arg(long, default_value = "sobol")]
    pub sampler: SamplerKind,

    /// Method of the references: gpt (with l2, which has no bias) or pt
    #[arg(long, default_value = "gpt")]
    pub reference: Method,

    /// Time of each of the two references [default: 5 times that of a run]
    #[arg(long, value_parser = duration)]
    pub reference_time: Option<Duration>,

    /// Weight of the primal against the gradients for l2 and l1: a number, or auto [default: 0.2]
    #[arg(long, value_parser = alpha)]
    pub alpha: Option<Alpha>,

    /// Longest light path in segments
    #[arg(long, default_value_t = 12)]
    pub depth: u32,

    /// Picture size in pixels, or its width [default: the film's, or 512x512]
    #[arg(long, value_name = "WxH|W", value_parser = size)]
    pub size: Option<SizeFlag>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub reading: ReadingArgs,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Brighten the pictures of the report by this many stops
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub exposure: f32,

    /// Warnings are errors
    #[arg(long)]
    pub strict: bool,

    /// Print errors only
    #[arg(long)]
    pub quiet: bool,
}

/// What a chart measures: how paths are traced, and what is made of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ChartMethod {
    /// How paths are traced.
    pub tracing: Method,
    /// How the picture is made.
    pub kind: Kind,
}

impl ValueEnum for ChartMethod {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<ChartMethod>> = LazyLock::new(|| {
            let kinds = || Kind::value_variants().iter().copied();
            let pt = kinds().filter(|kind| !kind.needs_gradients()).rev();
            let pt = pt.map(|kind| (Method::Pt, kind));
            // The primal of gradients is path tracing, at more cost.
            let gpt = kinds().filter(|kind| *kind != Kind::None);
            let gpt = gpt.map(|kind| (Method::Gpt, kind));
            let of = |(tracing, kind)| ChartMethod { tracing, kind };
            pt.chain(gpt).map(of).collect()
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match (self.tracing, self.kind) {
            (Method::Pt, Kind::None) => ("pt", "Path tracing"),
            (Method::Pt, kind) => (kind.after_pt()?, "Path tracing, so made into a picture"),
            (Method::Gpt, kind) => (
                kind.name(),
                "Gradient-domain path tracing, so reconstructed",
            ),
        };
        Some(PossibleValue::new(name).help(help))
    }
}
