//! `gdpt compare` from files to figures.

use super::{Ended, check_same_size};
use crate::cli::CompareArgs;
use crate::compare::{self, Comparison, Measured, References};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::load::exr;
use crate::output::format::Encoding;
use crate::output::{self, colour_map, write_json};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `--json` writes.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    image: String,
    references: Vec<String>,
    width: usize,
    height: usize,
    #[serde(flatten)]
    comparison: &'a Comparison,
}

/// Compares an image to one or two references.
pub fn compare(args: &CompareArgs) -> Result<Ended> {
    let paths = || {
        [&args.image, &args.reference]
            .into_iter()
            .chain(&args.second)
    };
    let heatmap = args.heatmap.as_deref();
    let heatmap = heatmap.map(|path| Ok((path, Encoding::of("--heatmap", path)?)));
    let heatmap = heatmap.transpose()?;
    let outputs = [&args.json, &args.heatmap];
    let outputs: Vec<&Path> = outputs.into_iter().flatten().map(|p| p.as_path()).collect();
    let inputs: Vec<&Path> = paths().map(PathBuf::as_path).collect();
    output::check_outputs(&inputs, &outputs)?;

    let image = picture(&args.image)?;
    let of_same_size = |path: &Path| {
        let reference = picture(path)?;
        check_same_size(path, &reference, &args.image, &image)?;
        Ok(reference)
    };
    let first = of_same_size(&args.reference)?;
    let second = args.second.as_deref().map(of_same_size).transpose()?;
    if second.as_ref() == Some(&first) {
        let message =
            "is the same picture as the first reference: two must be independent, of other seeds";
        let path = args.second.as_ref().unwrap_or(&args.reference);
        return Err(Error::input(path, None, message));
    }
    let references = match &second {
        Some(second) => References::Two(&first, second),
        None => References::One(&first),
    };

    let comparison = compare::compare(&image, references);
    if let Some(path) = &args.json {
        let report = Report {
            version: env!("CARGO_PKG_VERSION"),
            image: args.image.display().to_string(),
            references: paths().skip(1).map(|p| p.display().to_string()).collect(),
            width: image.width,
            height: image.height,
            comparison: &comparison,
        };
        write_json(path, &report)?;
    }
    if let Some((path, encoding)) = heatmap {
        let errors = compare::relative_errors(&image, references);
        colour_map::heat_map(&errors, image.width).write(path, encoding)?;
    }
    output::print_beside(&outputs, &table(&comparison))?;
    Ok(Ended::Done)
}

/// The channels R, G and B of a file.
fn picture(path: &Path) -> Result<Image> {
    let file = exr::load(path)?;
    let Some(channels) = file.colour("") else {
        let message = "has no picture: the channels R, G and B are needed";
        return Err(Error::input(path, None, message));
    };
    let (width, height) = file.size;
    let bad = (0..width * height).find(|&i| channels.iter().any(|c| !c[i].is_finite()));
    if let Some(i) = bad {
        let message = format!("pixel {},{} is not a finite number", i % width, i / width);
        return Err(Error::input(path, None, message));
    }
    Ok(Image {
        width,
        height,
        channels: channels.map(Vec::clone),
    })
}

fn table(c: &Comparison) -> String {
    let measured = |m: &Measured| match m.interval {
        Some(interval) => format!("{:.4e} ± {interval:.1e}", m.value),
        None => format!("{:.4e}", m.value),
    };
    let mut text = format!(
        "MSE              {}\nrelMSE           {}\n",
        measured(&c.errors.mse),
        measured(&c.errors.rel_mse)
    );
    text += &format!("  trimmed        {:.4e}\n", c.errors.rel_mse_trimmed);
    text += &format!("  specks         {:.4e}\n", c.errors.rel_mse_specks);
    let share = c.errors.rel_bias.map(|b| format!(" ({:+.3} %)", b * 100.0));
    text += &format!(
        "bias             {:+.4e}{}\n",
        c.errors.bias,
        share.unwrap_or_default()
    );
    text += &format!("PSNR             {:.2} dB\n", c.psnr);
    if let Some(ssim) = c.ssim {
        text += &format!("SSIM             {ssim:.5}\n");
    }
    text += match c.errors.mse.interval {
        None => {
            "with one reference, its own noise counts as error; give a second one to take it out\n"
        }
        Some(_) => {
            "PSNR and SSIM are against the mean of the references, whose noise counts there\n"
        }
    };
    text
}
