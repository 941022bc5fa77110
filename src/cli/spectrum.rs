//! `gdpt spectrum`: definitions.

use super::ReadingArgs;
use super::values::{SizeFlag, positive, size};
use crate::gradient::Weights;
use crate::sampler::SamplerKind;
use crate::trace::Backend;
use clap::Args;
use std::path::PathBuf;

/// `gdpt spectrum`
#[derive(Debug, Args)]
#[command(after_help = "\
From many independent renders: the variances of primal and gradients, and the errors of primal,
gradients alone (alpha 0) and screened solve (l2) at every frequency, beside what the theory
predicts from the two variances if both errors are stationary and independent. Writes
SCENE-spectrum (.csv, .svg, .png: errors by frequency), SCENE-alpha (.svg, .png: error over alpha)
and maps of both variances; prints measured over predicted for each octave, and how far
independence and stationarity fail. --one-dimensional does the experiment for which the theory is
exact.

Examples:
  gdpt spectrum scene.obj -o spectra
  gdpt spectrum scene.obj -o spectra --renders 256 --size 128x128 --alphas 0.05,0.5
  gdpt spectrum --one-dimensional -o spectra")]
pub struct SpectrumArgs {
    /// The scene, as for `gdpt render`
    #[arg(value_name = "SCENE.obj", required_unless_present = "one_dimensional")]
    pub scene: Option<PathBuf>,

    /// An image of one dimension on a torus, with a known spectrum, in place of a scene
    #[arg(long, conflicts_with = "scene")]
    pub one_dimensional: bool,

    /// Folder for all that is written
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Independent renders
    #[arg(long, default_value_t = 64)]
    pub renders: u64,

    /// Samples per pixel of each
    #[arg(long, default_value_t = 4)]
    pub spp: u64,

    /// Values of alpha to draw, beside 0 and the best one
    #[arg(long, value_delimiter = ',', value_parser = positive, default_value = "0.2,1")]
    pub alphas: Vec<f64>,

    /// How the samples of a pixel are spread
    #[arg(long, default_value = "independent")]
    pub sampler: SamplerKind,

    /// Weights of the two directions of a shift
    #[arg(long, default_value = "mis")]
    pub weights: Weights,

    /// Longest light path in segments
    #[arg(long, default_value_t = 12)]
    pub depth: u32,

    /// Ray traversal
    #[arg(long, default_value = Backend::DEFAULT.name())]
    pub backend: Backend,

    /// Picture size in pixels, or its width [default: the film's, or 512x512]
    #[arg(long, value_name = "WxH|W", value_parser = size)]
    pub size: Option<SizeFlag>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub reading: ReadingArgs,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Print errors only
    #[arg(long)]
    pub quiet: bool,
}
