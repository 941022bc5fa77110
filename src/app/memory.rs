//! Whether a picture fits into the machine's memory.

use crate::error::{Error, Result};
use crate::film::{BYTES_PER_PIXEL, Window};
use crate::machine;

/// Bytes of a pixel beside the film while the picture is made and written with all its layers (measured).
const BYTES_OF_IMAGES: usize = 460;

/// Memory for the film and the images made of it.
pub(super) fn picture_bytes(width: u32, height: u32) -> u64 {
    u64::from(width) * u64::from(height) * (BYTES_PER_PIXEL + BYTES_OF_IMAGES) as u64
}

/// Whether these pixels of a film, and the images of a picture where it is to be one, fit into the machine's memory;
/// `advice` says what to do where they do not.
pub(super) fn check(window: Window, is_film: bool, advice: &str) -> Result<()> {
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
