//! What can be wrong with data, models and files.

use std::path::Path;
use thiserror::Error;

/// Why nothing was trained or evaluated: one line with file, place, what is wrong and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum TrainingError {
    /// A file cannot be read or written.
    #[error("{file}: {what}; {remedy}")]
    File {
        /// The file.
        file: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A recording that its reader refuses; its own line says all.
    #[error("{0}")]
    Recording(String),
    /// No true position in a recording.
    #[error("{file}: has no truth ({looked_for}); pair it with a tracker's truth first, or name the columns with --truth")]
    NoTruth {
        /// The file.
        file: String,
        /// What was looked for.
        looked_for: String,
    },
    /// Nothing to learn from in a recording.
    #[error("{file}: {what}; {remedy}")]
    Unfit {
        /// The file.
        file: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Too few trajectories for three sets.
    #[error(
        "{found} trajectories: at least 3 are needed, whole ones for training, validation and test; record more runs, or cut a long one up with \
             `ravenpose convert --from S --to S`"
    )]
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// Every input is constant.
    #[error("all {inputs} inputs are constant in training; nothing can be learnt from them, record while the arm moves")]
    Constant {
        /// Number of inputs.
        inputs: usize,
    },
    /// A checkpoint of something else.
    #[error("{file}: belongs to another run ({what}); remove it or repeat the options of that run")]
    Checkpoint {
        /// The file.
        file: String,
        /// What differs.
        what: String,
    },
    /// Training left the finite numbers.
    #[error("training diverged in epoch {epoch}; lower the learning rate")]
    Diverged {
        /// Where.
        epoch: usize,
    },
    /// A model that this crate cannot evaluate.
    #[error("{file}: {what}; give a model that `ravenpose train` wrote")]
    Model {
        /// The file.
        file: String,
        /// What is wrong.
        what: String,
    },
}

impl TrainingError {
    /// A file that could not be read or written.
    pub(crate) fn file(path: &Path, what: impl Into<String>, remedy: &'static str) -> Self {
        Self::File { file: shown(path), what: what.into(), remedy }
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// A path on one line.
pub(crate) fn shown(path: &Path) -> String {
    path.display().to_string().escape_debug().to_string()
}
