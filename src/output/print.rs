//! Words for people, to standard output. That it is full or closed is an error like that of any file.

use super::place::{STANDARD_OUTPUT, is_standard_output, write_standard_output};
use crate::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Prints `text`.
pub fn print(text: &str) -> Result<()> {
    print_bytes(text.as_bytes())
}

/// Prints `text`; to standard error where one of `outputs` is standard output, which then has nothing else.
pub fn print_beside(outputs: &[&Path], text: &str) -> Result<()> {
    if outputs.iter().any(|path| is_standard_output(path)) {
        // As all that goes there: who does not want to read it is not to be told.
        let _ = std::io::stderr().write_all(text.as_bytes());
        return Ok(());
    }
    print(text)
}

/// Prints bytes as they are.
pub(super) fn print_bytes(bytes: &[u8]) -> Result<()> {
    let path = Path::new(STANDARD_OUTPUT);
    write_standard_output(bytes).map_err(Error::io(path, "cannot be written"))
}
