//! What is refused before anything is allocated or rendered.

use crate::app::picture_bytes;
use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::film::{BYTES_PER_PIXEL, MAX_SAMPLES, Window};
use crate::machine;
use crate::part::{Part, Samples};
use crate::reconstruct::Kind;
use crate::render::{Limits, Method, PASS};

const DEFAULT_SPP: u64 = 64;

/// The limits that the flags set.
pub(super) fn of_flags(args: &RenderArgs) -> Result<Limits> {
    let samples = match args.spp {
        Some(n) if !(1..=MAX_SAMPLES).contains(&n) => {
            return Err(Error::Setting(format!(
                "--spp must be from 1 to {MAX_SAMPLES}: sums of more samples are not exact any more"
            )));
        }
        Some(n) => n,
        None if args.time.is_some() || args.error.is_some() => MAX_SAMPLES,
        None => DEFAULT_SPP,
    };
    if args.depth == 0 {
        return Err(Error::Setting("--depth must be at least 1".into()));
    }
    if args.error.is_some_and(|e| !(e > 0.0 && e.is_finite())) {
        return Err(Error::Setting("--error must be above 0".into()));
    }
    if !(0.0..=1.0).contains(&args.roughness_threshold) {
        return Err(Error::Setting(
            "--roughness-threshold must be from 0 to 1".into(),
        ));
    }
    if args.method == Method::Pt && args.reconstruct.is_some_and(Kind::needs_gradients) {
        let message =
            "--reconstruct needs gradients, which --method pt does not have (none and oidn do not)";
        return Err(Error::Setting(message.into()));
    }
    Ok(Limits {
        samples,
        time: args.time,
    })
}

/// Which samples the flags ask for, into a film where `is_film`.
pub(super) fn samples(args: &RenderArgs, is_film: bool) -> Result<Samples> {
    if args.part.is_some() && !is_film {
        let message = "--part makes a film for gdpt merge: give -o a name that ends in .gdpt";
        return Err(Error::Setting(message.into()));
    }
    if !is_film {
        return Ok(Samples::All);
    }
    let of_pictures = [
        ("--error", args.error.is_some()),
        ("--preview", args.preview.is_some()),
        ("--stats", args.stats.is_some()),
        ("--reconstruct", args.reconstruct.is_some()),
        ("--denoise", args.denoise),
        ("--alpha", args.alpha.is_some()),
        ("--format", args.format.is_some()),
    ];
    if let Some((flag, _)) = of_pictures.iter().find(|(_, given)| *given) {
        let message =
            format!("{flag} is for pictures: a .gdpt holds samples, of which gdpt merge makes one");
        return Err(Error::Setting(message));
    }
    // Samples that did not fit would be missing for ever.
    if args.time.is_some() && args.spp.is_some() {
        let message =
            "a .gdpt has --spp samples, or as many as fit into --time: leave one of them out";
        return Err(Error::Setting(message.into()));
    }
    if args.time.is_some() && args.crop.is_some() {
        let message = "crops are merged where all have the same samples: a .gdpt of a --crop needs --spp in place of --time";
        return Err(Error::Setting(message.into()));
    }
    match (args.part, args.spp) {
        (Some(part), None) if args.time.is_some() => Ok(Samples::Own(part)),
        (None, None) if args.time.is_some() => Ok(Samples::All),
        (part, spp) => {
            let part = part.unwrap_or(Part {
                number: 1,
                parts: 1,
            });
            let all = spp.unwrap_or(DEFAULT_SPP);
            let least = u64::from(part.parts) * PASS;
            if part.parts > 1 && all < least {
                return Err(Error::Setting(format!(
                    "--part {part} needs --spp {least} or more: each part has at least {PASS} samples"
                )));
            }
            Ok(Samples::Some { part, all })
        }
    }
}

/// The pixels that the flags ask for, of a picture of this size.
pub(super) fn window(args: &RenderArgs, width: u32, height: u32) -> Result<Window> {
    let whole = Window::whole(width, height);
    let Some(crop) = args.crop else {
        return Ok(whole);
    };
    if crop.end.0 > width || crop.end.1 > height {
        return Err(Error::Setting(format!(
            "--crop must be within 0,0,{width},{height}: it ends at {},{}",
            crop.end.0, crop.end.1
        )));
    }
    Ok(Window {
        x: crop.first.0,
        y: crop.first.1,
        width: crop.end.0 - crop.first.0,
        height: crop.end.1 - crop.first.1,
        ..whole
    })
}

/// Whether these pixels of a film, and the images of a picture where it is to be one, fit into the machine's memory;
/// `advice` says what to do where they do not.
pub(in crate::app) fn memory(window: Window, is_film: bool, advice: &str) -> Result<()> {
    let Window { width, height, .. } = window;
    let needed = if is_film {
        window.pixels() as u64 * BYTES_PER_PIXEL as u64
    } else {
        picture_bytes(width, height)
    };
    let there = machine::memory();
    if needed > there {
        let gigabytes = |bytes: u64| bytes as f64 / 1e9;
        let what = if is_film { "film" } else { "picture" };
        return Err(Error::Setting(format!(
            "a {what} of {width}x{height} needs about {:.1} GB of memory, and this machine has {:.1} GB: \
             {advice}",
            gigabytes(needed),
            gigabytes(there)
        )));
    }
    Ok(())
}
