//! The one error type: every failure that input, options or the machine can cause.
//!
//! Each message is one line that names the file or the option and says what to do.

use std::io;
use std::path::{Path, PathBuf};

/// `std::result::Result` with [`enum@Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong outside of the program itself.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file's ending names no format that is known here.
    #[error("{}: unknown kind of file{}; {expected}", path.display(), ending(path))]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// What would be understood, as a sentence: "a model is a .obj or .ply file".
        expected: &'static str,
    },
    /// A file was read but does not hold what its format demands.
    #[error("{}: {message}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what to do.
        message: String,
    },
    /// A mesh that nothing can be built from: no triangles, too many, an index out of range.
    #[error("unusable mesh: {0}")]
    Mesh(String),
    /// A file could not be written; nothing was left behind.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// An option, a profile key or a parameter has a value that makes no sense.
    #[error("{option}: {message}")]
    Option {
        /// The option as the user writes it, such as `--size`.
        option: String,
        /// What is wrong and what is accepted.
        message: String,
    },
    /// Something optional is not on this machine.
    #[error("{what} is not here: {remedy}")]
    Missing {
        /// What is missing.
        what: String,
        /// How to get it.
        remedy: String,
    },
}

/// " (.xyz)" for a path with an ending, nothing otherwise.
fn ending(path: &Path) -> String {
    path.extension().map_or_else(String::new, |e| format!(" (.{})", e.to_string_lossy()))
}

impl Error {
    /// An [`Error::Option`].
    pub fn option(option: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Option { option: option.into(), message: message.into() }
    }

    /// An [`Error::Malformed`]. What a file's own words bring into the message stays on its line.
    pub fn malformed(path: impl Into<PathBuf>, message: impl Into<String>) -> Self {
        let mut message = message.into();
        if message.contains(char::is_control) {
            let shown = |c: char| if c.is_control() { c.escape_default().collect() } else { String::from(c) };
            message = message.chars().map(shown).collect();
        }
        Self::Malformed { path: path.into(), message }
    }

    /// An [`Error::Malformed`] of what the TOML parser found wrong with a file's text: its first
    /// line, with the number of the line at fault.
    pub fn toml(path: impl Into<PathBuf>, text: &str, error: &toml::de::Error) -> Self {
        let said = error.message().lines().next().unwrap_or_default();
        match error.span() {
            Some(span) if span.end > 0 => {
                let line = 1 + text.bytes().take(span.start).filter(|&b| b == b'\n').count();
                Self::malformed(path, format!("line {line}: {said}"))
            }
            _ => Self::malformed(path, said),
        }
    }
}
