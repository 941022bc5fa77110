//! How many samples the flags ask for, and which.

use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::film::MAX_SAMPLES;
use crate::part::{Part, Samples};
use crate::render::{Limits, PASS};

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
    if args.error.is_some_and(|e| !(e > 0.0 && e.is_finite())) {
        return Err(Error::Setting("--error must be above 0".into()));
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
        ("--cryptomatte", args.cryptomatte),
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
