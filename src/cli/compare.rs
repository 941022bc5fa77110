//! `gdpt compare`: definitions.

use clap::Args;
use std::path::PathBuf;

/// `gdpt compare`
#[derive(Debug, Args)]
#[command(after_help = "\
relMSE is the mean of the squared error over the square of the reference + 0.01; trimmed, it is
without the worst 0.1 % of pixels. Specks is what of it is dots and dashes: the error of the
Laplacian, which is relMSE for white noise and next to nothing for blotches. The noise of one
reference counts as error. With two that are independent (other seeds) and of the same quality, it
cancels: (image - ref 1)(image - ref 2) is an unbiased estimate of the squared error, and ± is the
95 % interval that the references' noise leaves, for this image (for relMSE, where the references'
noise is small against their values).
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

    /// Also write a picture (.png or .jpg) of the relative squared errors: violet 1e-6 or less, green 1e-3,
    /// yellow 1 or more
    #[arg(long, value_name = "FILE")]
    pub heatmap: Option<PathBuf>,
}
