//! What can go wrong, in one line that says where and what to do.

use std::path::{Path, PathBuf};

/// An error that ends the program with a message.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that cannot be read or written.
    #[error("{path}: {what}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        what: &'static str,
        /// The system's word.
        source: std::io::Error,
    },
    /// Something wrong inside a file; `line` counts from 1.
    #[error("{path}{line}: {message}", path = path.display(), line = line.map(|l| format!(":{l}")).unwrap_or_default())]
    Input {
        /// The file.
        path: PathBuf,
        /// The line, where it is known.
        line: Option<usize>,
        /// What is wrong and what to do.
        message: String,
    },
    /// A setting outside of what is possible.
    #[error("{0}")]
    Setting(String),
    /// The traversal library failed.
    #[error("ray traversal: {0}")]
    Traversal(String),
    /// A picture or a film that could not be written where it should be, but elsewhere.
    #[error("{error}; the {what} is in {place}", place = place.display())]
    Elsewhere {
        /// What it is.
        what: &'static str,
        /// Where it is.
        place: PathBuf,
        /// Why it is not where it should be.
        error: Box<Error>,
    },
    /// A picture that could not be written at all, but for its samples.
    #[error("{error}; the samples are kept in {checkpoint}: the same command with --resume writes the picture", checkpoint = checkpoint.display())]
    Kept {
        /// The checkpoint.
        checkpoint: PathBuf,
        /// Why there is no picture.
        error: Box<Error>,
    },
    /// What fails now and may go well later, such as a file that another process is writing.
    #[error("{0}")]
    Later(Box<Error>),
    /// Some of several scenes could not be rendered, each with an error of its own.
    #[error("{failed} of {all} scenes failed")]
    Scenes {
        /// How many.
        failed: usize,
        /// Of how many.
        all: usize,
    },
    /// Warnings under `--strict`.
    #[error("{0} (an error because of --strict)")]
    Strict(String),
}

/// Result with [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error inside the file `path`.
    pub fn input(path: &Path, line: Option<usize>, message: impl Into<String>) -> Self {
        Self::Input {
            path: path.to_path_buf(),
            line,
            message: message.into(),
        }
    }

    /// Whether nobody reads what was written: no reason to say so, to whom the reader's end is no surprise.
    pub fn is_closed_pipe(&self) -> bool {
        matches!(self, Self::Io { source, .. } if source.kind() == std::io::ErrorKind::BrokenPipe)
    }

    /// For `map_err` on operations with the file `path`.
    pub fn io(path: &Path, what: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, what, source }
    }
}

/// Names that a message lists at most.
const LISTED: usize = 12;

/// Names in quotes with commas between them; of many the first ones.
pub fn listed<T: AsRef<str>>(names: &[T]) -> String {
    let quoted = |name: &T| format!("'{}'", name.as_ref());
    let first: Vec<String> = names.iter().take(LISTED).map(quoted).collect();
    match names.len().saturating_sub(LISTED) {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// Collects warnings, or refuses the first one.
#[derive(Debug, Default)]
pub struct Warnings {
    strict: bool,
    list: Vec<String>,
}

impl Warnings {
    /// With `strict` every warning is an error.
    pub fn new(strict: bool) -> Self {
        Self {
            strict,
            list: Vec::new(),
        }
    }

    /// Adds one; an error if warnings are not allowed.
    pub fn push(&mut self, message: impl Into<String>) -> Result<()> {
        let message = message.into();
        if self.strict {
            return Err(Error::Strict(message));
        }
        self.list.push(message);
        Ok(())
    }

    /// Adds a remark that is fine even where warnings are not allowed.
    pub fn note(&mut self, message: impl Into<String>) {
        self.list.push(message.into());
    }

    /// All so far, in order.
    pub fn list(&self) -> &[String] {
        &self.list
    }
}
