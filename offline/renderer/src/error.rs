//! Why nothing was rendered, in one line.

use std::path::Path;

/// Why nothing was rendered.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read.
    #[error("{file}: cannot be read: {source}; check the path and its permissions")]
    Read {
        /// Path.
        file: String,
        /// From the system.
        source: std::io::Error,
    },
    /// A file or folder cannot be written.
    #[error("{file}: cannot be written: {what}; check the folder and its permissions")]
    Write {
        /// Path.
        file: String,
        /// From the system or the encoder.
        what: String,
    },
    /// The folder holds something already.
    #[error("{folder}: is not empty, or has no name of its own; give a new folder by its name")]
    Occupied {
        /// Path.
        folder: String,
    },
    /// A scene that cannot be.
    #[error("{file}: {place}: {what}; {remedy}")]
    Scene {
        /// Path, or the name of a built-in scene.
        file: String,
        /// Line or key.
        place: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// A motion that cannot be followed.
    #[error("{recording}: {what}; {remedy}")]
    Motion {
        /// Name of the recording.
        recording: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
}

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A fault of writing.
    pub(crate) fn write(file: &Path, what: &impl std::fmt::Display) -> Self {
        Self::Write { file: file.display().to_string(), what: what.to_string().replace('\n', " ") }
    }
}
