//! What is refused before anything is allocated or rendered.

use crate::app::picture_bytes;
use crate::cli::RenderArgs;
use crate::error::{Error, Result};
use crate::memory;
use crate::reconstruct::Kind;
use crate::render::{Limits, Method};

const DEFAULT_SPP: u64 = 64;
/// The film's sums are 32-bit floats, to which nothing can be added beyond 2²⁴ samples of one size.
const MAX_SPP: u64 = 1 << 24;

/// The limits that the flags set.
pub(super) fn of_flags(args: &RenderArgs) -> Result<Limits> {
    let samples = match args.spp {
        Some(n) if !(1..=MAX_SPP).contains(&n) => {
            return Err(Error::Setting(format!(
                "--spp must be from 1 to {MAX_SPP}: sums of more samples are not exact any more"
            )));
        }
        Some(n) => n,
        None if args.time.is_some() || args.error.is_some() => MAX_SPP,
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

/// Whether film and images of this size fit into the machine's memory.
pub(super) fn memory(width: u32, height: u32) -> Result<()> {
    let needed = picture_bytes(width, height);
    let there = memory::total();
    if needed > there {
        let gigabytes = |bytes: u64| bytes as f64 / 1e9;
        return Err(Error::Setting(format!(
            "a picture of {width}x{height} needs about {:.1} GB of memory, and this machine has {:.1} GB: \
             make it smaller with --size",
            gigabytes(needed),
            gigabytes(there)
        )));
    }
    Ok(())
}
