//! `gdpt render`: definitions.

use super::reconstruct::Reconstruct;
use super::values::{EnvironmentFlag, alpha, duration, environment, pixel, size, up, vector};
use crate::filter::Filter;
use crate::gradient::Weights;
use crate::reconstruct::Alpha;
use crate::render::Method;
use crate::sampler::Points;
use crate::trace::Backend;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// `gdpt render`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gdpt render scene.obj -o out.exr                     64 samples, default camera or scene.toml
  gdpt render scene.obj -o out.png --time 30s          as many samples as fit in 30 seconds
  gdpt render scene.obj -o out.exr --error 0.001       until the estimated relMSE is that small
  gdpt render scene.obj -o out.exr --method pt         plain path tracing, to compare
  gdpt render scene.obj -o out.exr --size 1920x1080 --origin 0,1,4 --target 0,1,0 --fov 35
  gdpt render scene.obj -o out.png --up z --environment sky.hdr
  gdpt render scene.obj -o spin.png --turntable 36     36 views in the folder spin
  gdpt render scene.obj -o out.exr --time 8h --checkpoint out.gdpt --resume
  gdpt render scene.obj --pixel 12,40 --sample 7       tell how this sample comes about

Exit codes: 0 done; 1 failed, or a setting that is not possible; 2 flags that cannot be read;
130 ended by Ctrl-C (what there was is written).")]
pub struct RenderArgs {
    /// The scene; materials from its MTL, camera and environment from SCENE.toml beside it
    pub scene: PathBuf,

    /// Where the picture goes: .exr (all layers, 32-bit float) or .png (tone-mapped)
    #[arg(short, long, required_unless_present = "pixel")]
    pub output: Option<PathBuf>,

    /// Also write a tone-mapped PNG
    #[arg(long, value_name = "FILE")]
    pub preview: Option<PathBuf>,

    /// Also write the summary as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Path tracing (pt) or gradient-domain path tracing (gpt)
    #[arg(long, default_value = "gpt")]
    pub method: Method,

    /// Samples per pixel [default: 64, or no limit with --time or --error]
    #[arg(long)]
    pub spp: Option<u64>,

    /// Stop after this time, such as 30s, 5m or 1h30m
    #[arg(long, value_parser = duration)]
    pub time: Option<Duration>,

    /// Longest light path in segments; 1 is light seen directly, 2 direct lighting
    #[arg(long, default_value_t = 12)]
    pub depth: u32,

    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    pub seed: u64,

    /// How the samples of a pixel are spread
    #[arg(long, default_value = "sobol")]
    pub sampler: Points,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Stop when the estimated relMSE is this small, such as 0.001
    #[arg(long, value_name = "RELMSE")]
    pub error: Option<f64>,

    /// Keep the samples in this file while rendering, to go on from there
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Time between two checkpoints [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = duration, requires = "checkpoint")]
    pub every: Option<Duration>,

    /// Go on from the checkpoint if there is one: --spp and --time count what is in it
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,

    /// How the picture is made of primal and gradients [default: weighted for gpt, none for pt]
    #[arg(long)]
    pub reconstruct: Option<Reconstruct>,

    /// Weight of the primal against the gradients for l2 and l1: a number, or auto to take it from their
    /// variances [default: 0.2]
    #[arg(long, value_parser = alpha)]
    pub alpha: Option<Alpha>,

    /// Weights of the two directions of a shift
    #[arg(long, default_value = "mis")]
    pub weights: Weights,

    /// Surfaces of at most this GGX roughness (alpha) copy half vectors and take no light samples
    #[arg(long, default_value_t = 0.01)]
    pub roughness_threshold: f32,

    /// Pixel filter
    #[arg(long, default_value = "box")]
    pub filter: Filter,

    /// Ray traversal
    #[arg(long, default_value = Backend::DEFAULT.name())]
    pub backend: Backend,

    /// Picture size in pixels [default: the scene's, or 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,

    /// A camera of the TOML's [cameras.NAME]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,

    /// Camera position
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub origin: Option<[f32; 3]>,

    /// Point that the camera looks at
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub target: Option<[f32; 3]>,

    /// Direction that is upwards in the picture: x, y or z, or a vector
    #[arg(long, value_name = "AXIS", value_parser = up, allow_hyphen_values = true)]
    pub up: Option<[f32; 3]>,

    /// Vertical field of view in degrees
    #[arg(long, allow_hyphen_values = true)]
    pub fov: Option<f32>,

    /// Diameter of the lens; 0 has everything in focus
    #[arg(long, allow_hyphen_values = true)]
    pub aperture: Option<f32>,

    /// Distance at which things are in focus [default: the target's]
    #[arg(long, value_name = "DISTANCE", allow_hyphen_values = true)]
    pub focus: Option<f32>,

    /// Render this many views around the target, into a folder named as the output without its extension
    #[arg(long, value_name = "VIEWS")]
    #[arg(conflicts_with_all = ["preview", "stats", "checkpoint", "pixel"])]
    pub turntable: Option<u32>,

    /// Light from all directions: constant radiance R,G,B, or a picture (.exr, .hdr, ...; longitude across,
    /// latitude down)
    #[arg(long, value_name = "R,G,B|FILE", value_parser = environment, allow_hyphen_values = true)]
    pub environment: Option<EnvironmentFlag>,

    /// Brighten PNG pictures by this many stops
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub exposure: f32,

    /// In place of a picture, tell how one sample of this pixel comes about, vertex by vertex
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    #[arg(conflicts_with_all = ["output", "preview", "stats", "checkpoint"])]
    pub pixel: Option<(u32, u32)>,

    /// The sample of that pixel
    #[arg(long, value_name = "N", default_value_t = 0, requires = "pixel")]
    pub sample: u64,

    /// Warnings are errors
    #[arg(long)]
    pub strict: bool,

    /// Print errors only
    #[arg(long)]
    pub quiet: bool,
}
