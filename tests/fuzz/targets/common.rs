//! What all targets share: bytes as a file, and a panic hook.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A folder of this process, in memory where there is such a place.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let temporary = std::env::temp_dir();
    let place = if memory.is_dir() { memory } else { &temporary };
    let folder = place.join(format!("gdpt-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for inputs");
    folder
});

/// Panics inside other crates' parsers are caught at the border and are errors for the user; all others
/// are found bugs.
pub fn abort_on_panic() {
    std::panic::set_hook(Box::new(|info| {
        if !gdpt::load::inside_parser() {
            eprintln!("{info}");
            std::process::abort();
        }
    }));
}

/// Writes `data` to a file of this name.
pub fn file(name: &str, data: &[u8]) -> PathBuf {
    let path = FOLDER.join(name);
    std::fs::write(&path, data).expect("room for an input");
    path
}
