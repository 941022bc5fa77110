//! The command line: definitions only.

use crate::gradient::Weights;
use crate::reconstruct::Alpha;
use crate::render::Method;
use crate::sampler::Points;
use crate::trace::Backend;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// A gradient-domain path tracer for OBJ scenes.
#[derive(Debug, Parser)]
#[command(name = "gdpt", version, about, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What the program can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render an OBJ scene
    Render(Box<RenderArgs>),
    /// Make the picture again from a render's file, or from primal and differences of another renderer
    Reconstruct(ReconstructArgs),
    /// Measure how far an image is from one or two references
    Compare(CompareArgs),
    /// Chart error against time: every method, several times and seeds, against two references
    Chart(ChartArgs),
    /// Measure where the error theory of gradient-domain rendering holds, by frequency
    Spectrum(SpectrumArgs),
    /// Tell what a scene holds, what its materials became, and what memory its render takes
    Info(InfoArgs),
    /// Compare ray-traversal backends on the rays of a scene's own render
    Bench(BenchArgs),
}

/// `gdpt bench`
#[derive(Debug, Args)]
#[command(after_help = "\
The rays are those of a real render of the scene: base and offset rays at every bounce, in
the batches of the renderer. All ways are measured in turn, several times over; compare them
within one run. The number of hits is a checksum: it may differ by the few rays that meet an
edge. A star marks the way that gdpt render goes. \"embree fast\" is Embree without its robust
edge tests; gdpt render uses the robust ones.

Examples:
  gdpt bench scene.obj
  gdpt bench scene.obj --threads 1 --runs 9 --csv bench.csv --plot bench.svg")]
pub struct BenchArgs {
    /// The scene, as for `gdpt render`
    pub scene: PathBuf,

    /// Also write the measurements as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Also write the measurements as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,

    /// Also draw them
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Runs of which the median is taken
    #[arg(long, default_value_t = 5)]
    pub runs: usize,

    /// Rays of each kind, in thousands
    #[arg(long, default_value_t = 200)]
    pub kilorays: usize,

    /// Longest light path in segments
    #[arg(long, default_value_t = 12)]
    pub depth: u32,

    /// Picture size in pixels [default: the scene's, or 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
}

/// `gdpt render`
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gdpt render scene.obj -o out.exr                     64 samples, default camera or scene.toml
  gdpt render scene.obj -o out.png --time 30s          as many samples as fit in 30 seconds
  gdpt render scene.obj -o out.exr --error 0.001       until the estimated relMSE is that small
  gdpt render scene.obj -o out.exr --method pt         plain path tracing, to compare
  gdpt render scene.obj -o out.exr --size 1920x1080 --origin 0,1,4 --target 0,1,0 --fov 35
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

    /// Camera position
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub origin: Option<[f32; 3]>,

    /// Point that the camera looks at
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub target: Option<[f32; 3]>,

    /// Direction that is upwards in the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub up: Option<[f32; 3]>,

    /// Vertical field of view in degrees
    #[arg(long, allow_hyphen_values = true)]
    pub fov: Option<f32>,

    /// Constant radiance from all directions
    #[arg(long, value_name = "R,G,B", value_parser = vector, allow_hyphen_values = true)]
    pub environment: Option<[f32; 3]>,

    /// Brighten PNG pictures by this many stops
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub exposure: f32,

    /// In place of a picture, tell how one sample of this pixel comes about, vertex by vertex
    #[arg(long, value_name = "X,Y", value_parser = pixel, conflicts_with = "output")]
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
    pub sampler: Points,

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

    /// Picture size in pixels [default: the scene's, or 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,

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

/// What a chart measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, ValueEnum)]
pub enum ChartMethod {
    /// Path tracing.
    Pt,
    /// Gradient-domain path tracing, reconstructed by L2.
    L2,
    /// The same by L1.
    L1,
    /// The same, weighted.
    Weighted,
}

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
    pub sampler: Points,

    /// Weights of the two directions of a shift
    #[arg(long, default_value = "mis")]
    pub weights: Weights,

    /// Longest light path in segments
    #[arg(long, default_value_t = 12)]
    pub depth: u32,

    /// Ray traversal
    #[arg(long, default_value = Backend::DEFAULT.name())]
    pub backend: Backend,

    /// Picture size in pixels [default: the scene's, or 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Print errors only
    #[arg(long)]
    pub quiet: bool,
}

/// `gdpt info`
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// The scene, as for `gdpt render`
    pub scene: PathBuf,

    /// Also write it as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Picture size in pixels [default: the scene's, or 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
}

/// `gdpt compare`
#[derive(Debug, Args)]
#[command(after_help = "\
relMSE is the mean of the squared error over the square of the reference + 0.01; trimmed, it is
without the worst 0.1 % of pixels. The noise of one reference counts as error. With two that are
independent (other seeds) and of the same quality, it cancels: (image - ref 1)(image - ref 2) is
an unbiased estimate of the squared error, and ± is the 95 % interval that the references' noise
leaves, for this image (for relMSE, where the references' noise is small against their values).
PSNR and SSIM are those of the pictures as PNG shows them (sRGB).

Examples:
  gdpt compare out.exr reference.exr
  gdpt compare out.exr reference1.exr reference2.exr --json error.json --heatmap error.png")]
pub struct CompareArgs {
    /// The image: the channels R, G and B of an EXR file
    #[arg(value_name = "IMAGE.exr")]
    pub image: PathBuf,

    /// What it should be
    #[arg(value_name = "REF.exr")]
    pub reference: PathBuf,

    /// Another reference, independent of the first
    #[arg(value_name = "REF2.exr")]
    pub second: Option<PathBuf>,

    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Also write a picture of the relative squared errors: violet 1e-6 or less, green 1e-3, yellow 1 or
    /// more
    #[arg(long, value_name = "FILE.png")]
    pub heatmap: Option<PathBuf>,
}

/// `gdpt reconstruct`
#[derive(Debug, Args)]
#[command(after_help = "\
A render's own file holds what every method needs. From three files (channels R, G, B) there are no
variances, so the methods are l2 and l1. Differences are the right or lower neighbour minus the pixel;
the last column of dx and the last row of dy do not count.

Examples:
  gdpt reconstruct out.exr -o l1.exr --reconstruct l1 --alpha auto
  gdpt reconstruct --primal p.exr --dx dx.exr --dy dy.exr -o out.exr")]
pub struct ReconstructArgs {
    /// What gdpt render wrote
    #[arg(required_unless_present = "primal", conflicts_with = "primal")]
    pub input: Option<PathBuf>,

    /// The path-traced image, without light seen directly
    #[arg(long, value_name = "FILE.exr", requires = "dx", requires = "dy")]
    pub primal: Option<PathBuf>,

    /// Differences to the right
    #[arg(long, value_name = "FILE.exr", requires = "primal")]
    pub dx: Option<PathBuf>,

    /// Differences downwards
    #[arg(long, value_name = "FILE.exr", requires = "primal")]
    pub dy: Option<PathBuf>,

    /// Light seen directly, to be added to the picture
    #[arg(long, value_name = "FILE.exr", requires = "primal")]
    pub direct: Option<PathBuf>,

    /// Where the picture goes: .exr or .png (tone-mapped)
    #[arg(short, long)]
    pub output: PathBuf,

    /// How the picture is made [default: weighted, or l2 from three files]
    #[arg(long)]
    pub reconstruct: Option<Reconstruct>,

    /// Weight of the primal against the gradients for l2 and l1: a number, or auto to take it from their
    /// variances [default: 0.2]
    #[arg(long, value_parser = alpha)]
    pub alpha: Option<Alpha>,

    /// Brighten PNG pictures by this many stops
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    pub exposure: f32,

    /// Number of threads [default: all]
    #[arg(long)]
    pub threads: Option<usize>,

    /// Print errors only
    #[arg(long)]
    pub quiet: bool,
}

/// How the picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, ValueEnum)]
pub enum Reconstruct {
    /// Least squares, each value weighted by its own variance.
    Weighted,
    /// Least squares with one weight, exactly; unbiased.
    L2,
    /// Least absolute residuals; robust, slightly biased.
    L1,
    /// The primal as it is.
    None,
}

/// Pixel filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, ValueEnum)]
pub enum Filter {
    /// The pixel's area.
    Box,
}

fn alpha(text: &str) -> Result<Alpha, String> {
    match text.parse() {
        _ if text == "auto" => Ok(Alpha::Auto),
        Ok(alpha) if alpha >= 0.0 && f32::is_finite(alpha) => Ok(Alpha::Fixed(alpha)),
        _ => Err("needs auto or a number, not negative".into()),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(value) if value > 0.0 && f64::is_finite(value) => Ok(value),
        _ => Err("needs a number above 0".into()),
    }
}

fn vector(text: &str) -> Result<[f32; 3], String> {
    let numbers: Vec<f32> = text
        .split(',')
        .filter_map(|x| x.trim().parse().ok())
        .filter(|x: &f32| x.is_finite())
        .collect();
    match numbers.try_into() {
        Ok(v) if text.split(',').count() == 3 => Ok(v),
        _ => Err("needs three numbers with commas between, such as 0,1,4.2".into()),
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let parts = text
        .split_once(['x', 'X'])
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    parts.ok_or_else(|| "needs two whole numbers with x between, such as 640x480".into())
}

fn pixel(text: &str) -> Result<(u32, u32), String> {
    let parts = text
        .split_once(',')
        .and_then(|(x, y)| Some((x.trim().parse().ok()?, y.trim().parse().ok()?)));
    parts.ok_or_else(|| "needs column and row with a comma between, such as 12,40".into())
}

/// `90`, `90s`, `5m`, `1h30m`, `1.5m`.
fn duration(text: &str) -> Result<Duration, String> {
    let wrong = || "needs a time such as 30s, 5m or 1h30m".to_owned();
    let mut seconds = 0.0;
    let mut rest = text;
    while !rest.is_empty() {
        let digits = rest
            .find(|c: char| !(c.is_ascii_digit() || c == '.'))
            .unwrap_or(rest.len());
        let value: f64 = rest[..digits].parse().map_err(|_| wrong())?;
        let (unit, length) = match rest[digits..].chars().next() {
            None | Some('s') => (1.0, 1),
            Some('m') => (60.0, 1),
            Some('h') => (3600.0, 1),
            Some(_) => return Err(wrong()),
        };
        seconds += value * unit;
        rest = rest.get(digits + length..).unwrap_or("");
    }
    if seconds > 0.0 && seconds < 1e9 {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_parsed() {
        assert_eq!(vector("0, -1,4.5"), Ok([0.0, -1.0, 4.5]));
        for bad in ["1,2", "1,2,3,4", "1,2,x", "1,2,nan", ""] {
            assert!(vector(bad).is_err(), "{bad}");
        }
        assert_eq!(alpha("auto"), Ok(Alpha::Auto));
        assert_eq!(alpha("0.3"), Ok(Alpha::Fixed(0.3)));
        for bad in ["-1", "nan", "inf", "x", ""] {
            assert!(alpha(bad).is_err(), "{bad}");
        }
        assert_eq!(size("640x480"), Ok((640, 480)));
        for bad in ["640", "640x", "-1x3", "1e9x2"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        for (text, want) in [
            ("30s", 30.0),
            ("5m", 300.0),
            ("1h30m", 5400.0),
            ("2", 2.0),
            ("0.5s", 0.5),
        ] {
            assert_eq!(duration(text).unwrap().as_secs_f64(), want);
        }
        for bad in ["", "0s", "s", "3d", "1.2.3s", "-1s"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_definitions_are_consistent() {
        <Cli as clap::CommandFactory>::command().debug_assert();
    }
}
