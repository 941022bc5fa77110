//! Files to data: OBJ, MTL and the TOML beside them, EXR and other pictures, as written. Nothing is interpreted here; what a
//! material means is for `scene` to say.

mod ahead;
pub mod bitmap;
mod dds;
pub mod environment;
pub mod exr;
mod face;
mod find;
mod kind;
mod library;
pub mod lights;
mod line;
pub mod map;
pub mod mtl;
mod names;
pub mod obj;
mod objects;
mod passed_over;
mod polygon;
mod regroup;
pub mod repair;
mod scan;
pub mod sidecar;
pub mod tally;
mod text;
mod textures;

use crate::error::{Error, Result};
use std::path::Path;

/// Largest number of pixels along one side of a picture.
pub const MAX_SIDE: u32 = 1 << 16;
/// Largest number of pixels of a picture.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Runs a parser of another crate and turns a panic inside it into an error message. The hook that
/// prints panics must be silenced by [`inside_parser`].
pub(crate) fn guarded<T>(parse: impl FnOnce() -> T) -> std::result::Result<T, ()> {
    PARSING.with(|p| p.set(true));
    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(parse));
    PARSING.with(|p| p.set(false));
    result.map_err(|_| ())
}

thread_local! {
    static PARSING: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// Whether this thread is inside another crate's parser, whose panics become errors.
pub fn inside_parser() -> bool {
    PARSING.with(std::cell::Cell::get)
}

/// The name of a scene, for what belongs to it: its file's without `.obj` or `.obj.gz`; `stdin` for `-`,
/// standard input.
pub fn scene_name(path: &Path) -> String {
    if path == Path::new("-") {
        return "stdin".to_owned();
    }
    let without = find::beside(path, "");
    let name = without.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// The bytes of a file; a directory or an empty file is an error that says so.
fn check_readable(path: &Path) -> Result<()> {
    let meta = std::fs::metadata(path).map_err(Error::io(path, "cannot be read"))?;
    if meta.is_dir() {
        return Err(Error::input(path, None, "is a directory, not a file"));
    }
    if meta.len() == 0 {
        return Err(Error::input(path, None, "is empty"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_named_without_what_says_that_they_are_scenes() {
        for (path, name) in [
            ("a/house.obj", "house"),
            ("house.v2.OBJ", "house.v2"),
            ("house.obj.gz", "house"),
            ("house.gz", "house"),
            ("house", "house"),
            ("-", "stdin"),
        ] {
            assert_eq!(scene_name(Path::new(path)), name, "{path}");
        }
    }
}
