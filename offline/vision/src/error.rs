//! What can be wrong with a scene, one line each.

use std::path::Path;

/// Why a command of this crate ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or folder cannot be read.
    #[error("{file}: cannot be read: {source}; check the path and its permissions")]
    Read {
        /// Path.
        file: String,
        /// From the system.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{file}: cannot be written: {source}; check the folder and its permissions")]
    Write {
        /// Path.
        file: String,
        /// From the system.
        source: std::io::Error,
    },
    /// The content of a file is not what it should be.
    #[error("{file}: {place}: {what}; {remedy}")]
    Content {
        /// Path.
        file: String,
        /// Line, key or camera.
        place: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
}

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A fault of content.
    pub fn content(file: &Path, place: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Content { file: file.display().to_string(), place: place.into(), what: what.into(), remedy: remedy.into() }
    }

    /// A fault of reading, for `map_err`.
    pub fn read(file: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Read { file: file.display().to_string(), source }
    }

    /// A fault of writing, for `map_err`.
    pub fn write(file: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Write { file: file.display().to_string(), source }
    }
}
