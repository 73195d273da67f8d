//! What an analysis is given, and told of how it decides.

use recordings::Recording;

use crate::search::Thresholds;

/// One run as it was given.
#[derive(Debug)]
pub struct Given {
    /// Name for the report.
    pub id: String,
    /// The recording.
    pub real: Recording,
    /// SHA-256 of its file.
    pub real_sha256: String,
    /// Where the files of recording and simulation end early, and what should be known of them.
    pub notes: Vec<String>,
    /// What a simulator made of the same commands, with the SHA-256 of its file.
    pub sim: Option<(Recording, String)>,
}

/// What decides and what is told of it.
#[derive(Debug, Clone)]
pub struct Options {
    /// Limits of the search.
    pub thresholds: Thresholds,
    /// Written into the report; the engine itself draws nothing.
    pub seed: u64,
    /// SHA-256 of the robot model and the options.
    pub config_sha256: String,
    /// Says on standard error what the search tries.
    pub trace: bool,
    /// SHA-256 of the URDF, if the robot came as one.
    pub urdf_sha256: Option<String>,
    /// Bytes of memory that are free at the moment; none where nobody knows.
    pub free_bytes: fn() -> Option<u64>,
}

impl Default for Options {
    /// The usual limits, and a hash of nothing.
    fn default() -> Self {
        Self {
            thresholds: Thresholds::default(),
            seed: 0,
            config_sha256: "0".repeat(64),
            trace: false,
            urdf_sha256: None,
            free_bytes: || None,
        }
    }
}
