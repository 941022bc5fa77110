//! `gdpt render`: definitions.

use super::ReadingArgs;
use super::values::{
    CropFlag, EnvironmentFlag, SizeFlag, address, alpha, crop, duration, environment, pixel,
    positive, size, sun, up, vector,
};
use crate::exposure::Exposure;
use crate::filter::Filter;
use crate::gradient::Weights;
use crate::load::environment::Background;
use crate::load::sidecar::{Up, View};
use crate::output::format::Format;
use crate::part::Part;
use crate::path::Manifold;
use crate::reconstruct::{Alpha, Kind};
use crate::render::Method;
use crate::sampler::SamplerKind;
use crate::scene::material::ROUGHNESS_THRESHOLD;
use crate::tone::Tone;
use crate::trace::Backend;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// The headings under which the flags stand, in this order.
const OUTPUT: &str = "Output";
const ENDS: &str = "When it ends, and goes on";
const MACHINES: &str = "On several machines";
const PICTURE: &str = "Picture";
const CAMERA: &str = "Camera";
const LIGHT: &str = "Light";
const METHOD: &str = "Method";
const SAMPLE: &str = "One sample, told";
const RUNNING: &str = "Running";

/// `gdpt render`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gdpt render scene.obj                                64 samples into scene.png
  gdpt render scene.obj -o out.exr                     all layers in 32-bit float
  gdpt render scene.obj -o out.png --time 30s          as many samples as fit in 30 seconds
  gdpt render scene.obj -o out.png --spp 16 --denoise  a clean picture of few samples
  gdpt render scene.obj -o out.exr --error 0.001       until the estimated relMSE is that small
  gdpt render scene.obj -o out.exr --method pt         plain path tracing, to compare
  gdpt render scene.obj -o out.exr --size 1920x1080 --origin 0,1,4 --target 0,1,0 --fov 35
  gdpt render scene.obj --view left --zoom 1.5         all of it from the left, larger
  gdpt render scene.obj -o out.jpg --up z --environment sky.hdr
  gdpt render scene.obj -o out.png --environment sky --sun 60,25 --background transparent
  gdpt render a.obj b.obj.gz -o pictures/ --time 1m    a picture of each, a minute for each
  gdpt render scene.obj -o spin.png --turntable 36     36 views in the folder spin
  gdpt render scene.obj -o out.exr --time 8h --checkpoint out.gdpt --resume
  gdpt render scene.obj --spp 4096 --part 3/16 -o part-03.gdpt --resume    for gdpt merge
  gdpt render scene.obj --pixel 12,40 --sample 7       tell how this sample comes about

Outputs may be pipes and devices, which are written into. Where one is standard output (-), the
summary goes to standard error. A flag given twice counts as given last.

Exit codes: 0 done; 1 failed (one scene of several, too), or a setting that is not possible;
2 flags that cannot be read; 75 a .gdpt ended by Ctrl-C or SIGTERM (what there was is kept, --resume
goes on); 130 a picture ended so (what there was is written); 141 nobody reads standard output any
more.")]
pub struct RenderArgs {
    /// The scenes; materials from the MTL; camera, lights and environment from SCENE.toml beside each
    #[arg(required = true, value_name = "SCENE.obj")]
    pub scenes: Vec<PathBuf>,

    /// Where the picture goes: a .exr (all layers, 32-bit float), .png or .jpg (exposed and tone-mapped); a folder/ in
    /// which each scene gets its SCENE.png; or - for standard output [default: SCENE.png in the current folder,
    /// where there is none yet]. A .gdpt holds the samples alone, for gdpt merge
    #[arg(help_heading = OUTPUT, short, long, value_name = "FILE|DIR/")]
    pub output: Option<PathBuf>,

    /// What is written where the output's name does not say it [default: png]
    #[arg(help_heading = OUTPUT, long, value_enum)]
    pub format: Option<Format>,

    /// Also write a .png or .jpg, exposed and tone-mapped
    #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
    pub preview: Option<PathBuf>,

    /// Also write the summary as JSON
    #[arg(help_heading = OUTPUT, long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Have the layers of Cryptomatte in the .exr: which objects (o, or g) and materials each pixel shows
    #[arg(help_heading = OUTPUT, long, conflicts_with = "pixel")]
    pub cryptomatte: bool,

    /// Render this many views around the target, into a folder named as the output without its extension
    #[arg(help_heading = OUTPUT, long, value_name = "VIEWS", conflicts_with = "pixel")]
    pub turntable: Option<u32>,

    /// Render only this one of them, from 0 on; --exposure auto then meters a few samples of view 0
    #[arg(help_heading = OUTPUT, long, value_name = "N", requires = "turntable")]
    pub frame: Option<u32>,

    /// Samples per pixel [default: 64, or no limit with --time or --error]
    #[arg(help_heading = ENDS, long)]
    pub spp: Option<u64>,

    /// Stop after this time, such as 30s, 5m or 1h30m
    #[arg(help_heading = ENDS, long, value_parser = duration)]
    pub time: Option<Duration>,

    /// Stop when the estimated relMSE is this small, such as 0.001
    #[arg(help_heading = ENDS, long, value_name = "RELMSE")]
    pub error: Option<f64>,

    /// Keep the samples in this file while rendering, to go on from there
    #[arg(help_heading = ENDS, long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Time between two checkpoints [default: 60s]
    #[arg(help_heading = ENDS, long, value_name = "TIME", value_parser = duration)]
    pub every: Option<Duration>,

    /// Go on from the checkpoint if there is one: --spp and --time count what is in it. A .gdpt is its own checkpoint
    #[arg(help_heading = ENDS, long)]
    pub resume: bool,

    /// Render one of several parts of the samples into a .gdpt, for gdpt merge: the third of sixteen for 3/16. Parts
    /// of --spp share its samples; with --time alone each takes as many as fit, of a sequence of its own
    #[arg(help_heading = MACHINES, long, value_name = "K/N", conflicts_with = "pixel")]
    pub part: Option<Part>,

    /// Render only these pixels: columns from X0 to before X1, rows from Y0 to before Y1, from the upper left
    #[arg(help_heading = MACHINES, long, value_name = "X0,Y0,X1,Y1", value_parser = crop)]
    #[arg(conflicts_with = "pixel")]
    pub crop: Option<CropFlag>,

    /// Picture size in pixels; a width alone takes the height by the shape that the TOML's film has, or
    /// square [default: the film's, or 512x512]
    #[arg(help_heading = PICTURE, long, value_name = "WxH|W", value_parser = size)]
    pub size: Option<SizeFlag>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub reading: ReadingArgs,

    /// Pixel filter
    #[arg(help_heading = PICTURE, long, default_value = "box")]
    pub filter: Filter,

    /// Brighten 8-bit pictures by this many stops; auto meters what the scene's surfaces send to the camera
    #[arg(
        help_heading = PICTURE,
        long,
        value_name = "auto|STOPS",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    pub exposure: Exposure,

    /// Tone curve of 8-bit pictures
    #[arg(help_heading = PICTURE, long, default_value = "neutral")]
    pub tone: Tone,

    /// A camera of the TOML's [cameras.NAME]
    #[arg(help_heading = CAMERA, long, value_name = "NAME")]
    pub camera: Option<String>,

    /// Camera position
    #[arg(help_heading = CAMERA, long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub origin: Option<[f32; 3]>,

    /// Point that the camera looks at
    #[arg(help_heading = CAMERA, long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub target: Option<[f32; 3]>,

    /// Side from which all of the scene is seen, in place of a position [default: three-quarter]
    #[arg(help_heading = CAMERA, long, value_name = "SIDE", conflicts_with = "origin")]
    pub view: Option<View>,

    /// Degrees from the front, to the right, from where all of the scene is seen
    #[arg(help_heading = CAMERA, long, value_name = "DEGREES", allow_hyphen_values = true)]
    #[arg(conflicts_with = "origin")]
    pub azimuth: Option<f32>,

    /// Degrees above the horizon from where all of the scene is seen
    #[arg(help_heading = CAMERA, long, value_name = "DEGREES", allow_hyphen_values = true)]
    #[arg(conflicts_with = "origin")]
    pub elevation: Option<f32>,

    /// Show everything this many times as large, about the middle of the picture
    #[arg(help_heading = CAMERA, long, value_name = "FACTOR")]
    pub zoom: Option<f32>,

    /// Direction that is upwards: x, y, z, a vector, or auto, by the shape of the scene [default: the TOML's, or
    /// auto]
    #[arg(help_heading = CAMERA, long, value_name = "AXIS", value_parser = up, allow_hyphen_values = true)]
    pub up: Option<Up>,

    /// Vertical field of view in degrees
    #[arg(help_heading = CAMERA, long, allow_hyphen_values = true)]
    pub fov: Option<f32>,

    /// Diameter of the lens; 0 has everything in focus
    #[arg(help_heading = CAMERA, long, allow_hyphen_values = true)]
    pub aperture: Option<f32>,

    /// Distance at which things are in focus [default: the target's]
    #[arg(help_heading = CAMERA, long, value_name = "DISTANCE", allow_hyphen_values = true)]
    pub focus: Option<f32>,

    /// Light from all directions: constant radiance R,G,B (1 or white for short), a picture (.exr, .hdr, ...;
    /// longitude across, latitude down), sky (a clear one with the sun) or studio (lamps about the camera)
    /// [default: the scene's, or studio where the scene has no light]
    #[arg(help_heading = LIGHT, long, value_name = "R,G,B|FILE|sky|studio", value_parser = environment)]
    #[arg(allow_hyphen_values = true)]
    pub environment: Option<EnvironmentFlag>,

    /// The sun of the sky, in degrees: from the front (+z, or -y where z is up) counter-clockwise seen from
    /// above, and from the horizon [default: -30,40]
    #[arg(help_heading = LIGHT, long, value_name = "AZIMUTH,ELEVATION", value_parser = sun, allow_hyphen_values = true)]
    pub sun: Option<[f32; 2]>,

    /// Turn the environment about the vertical axis, counter-clockwise seen from above
    #[arg(help_heading = LIGHT, long, value_name = "DEGREES", allow_hyphen_values = true)]
    pub rotate_environment: Option<f32>,

    /// Factor on the environment's radiance
    #[arg(help_heading = LIGHT, long, value_name = "FACTOR", value_parser = positive)]
    pub environment_scale: Option<f64>,

    /// What the camera sees where there is nothing: a colour (linear; neither exposed nor tone-mapped), the
    /// environment, or nothing, which gives pictures an alpha channel [default: light grey in a studio, else
    /// environment]
    #[arg(
        help_heading = LIGHT,
        long,
        value_name = "R,G,B|environment|transparent",
        allow_hyphen_values = true
    )]
    pub background: Option<Background>,

    /// Path tracing (pt) or gradient-domain path tracing (gpt)
    #[arg(help_heading = METHOD, long, default_value = "gpt")]
    pub method: Method,

    /// How the picture is made of primal and gradients [default: weighted for gpt, none for pt]
    #[arg(help_heading = METHOD, long)]
    pub reconstruct: Option<Kind>,

    /// A cleaner picture by Open Image Denoise: --reconstruct guided, or oidn with --method pt
    #[arg(help_heading = METHOD, long, conflicts_with = "reconstruct")]
    pub denoise: bool,

    /// Weight of the primal against the gradients for l2 and l1: a number, or auto to take it from their
    /// variances [default: 0.2]
    #[arg(help_heading = METHOD, long, value_parser = alpha)]
    pub alpha: Option<Alpha>,

    /// Weights of the two directions of a shift
    #[arg(help_heading = METHOD, long, default_value = "mis")]
    pub weights: Weights,

    /// Longest light path in segments; 1 is light seen directly, 2 direct lighting
    #[arg(help_heading = METHOD, long, default_value_t = 12)]
    pub depth: u32,

    /// Sample light through mirrors and glass, where a scene has any
    #[arg(help_heading = METHOD, long, default_value = "auto")]
    pub manifold: Manifold,

    /// Metal of at most this GGX roughness (alpha) copies half vectors, glass of half of it; on planes of twice as much
    #[arg(help_heading = METHOD, long, default_value_t = ROUGHNESS_THRESHOLD)]
    pub roughness_threshold: f32,

    /// Seed of the random numbers
    #[arg(help_heading = METHOD, long, default_value_t = 0)]
    pub seed: u64,

    /// How the samples of a pixel are spread
    #[arg(help_heading = METHOD, long, default_value = "sobol")]
    pub sampler: SamplerKind,

    /// Ray traversal
    #[arg(help_heading = METHOD, long, default_value = Backend::DEFAULT.name())]
    pub backend: Backend,

    /// In place of a picture, tell how one sample of this pixel comes about, vertex by vertex
    #[arg(help_heading = SAMPLE, long, value_name = "X,Y", value_parser = pixel)]
    #[arg(conflicts_with_all = ["output", "preview", "stats", "checkpoint"])]
    pub pixel: Option<(u32, u32)>,

    /// The sample of that pixel
    #[arg(help_heading = SAMPLE, long, value_name = "N", default_value_t = 0, requires = "pixel")]
    pub sample: u64,

    /// Number of threads [default: all]
    #[arg(help_heading = RUNNING, long)]
    pub threads: Option<usize>,

    /// Show the picture as it grows in tev, which listens at localhost:14158 unless told otherwise
    #[arg(help_heading = RUNNING, long, value_name = "HOST:PORT", value_parser = address)]
    #[arg(num_args = 0..=1, default_missing_value = "localhost:14158")]
    pub watch: Option<String>,

    /// Warnings are errors
    #[arg(help_heading = RUNNING, long)]
    pub strict: bool,

    /// Print errors only
    #[arg(help_heading = RUNNING, long)]
    pub quiet: bool,
}
