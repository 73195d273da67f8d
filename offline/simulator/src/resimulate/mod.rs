//! A recording of any arm once more, in a model: what would that robot have done?
//!
//! - [`open_loop`]: the recorded torque drives the plant; short windows, each from the measured state.
//! - [`closed_loop`]: the controller drives it along the recorded commands; of a RAVEN-II its control software.
//! - [`inverse`]: the recorded motion is given, the torque is computed: no time steps, the cheap prediction.
//!
//! All give the columns of a run at the times of the recording ([`Simulated`]), so that two runs can be subtracted. No random
//! numbers, no clocks: the same bits on every run.

mod closed_loop;
mod commands;
mod hold;
mod inverse;
mod open_loop;
mod run;
mod simulated;

pub use closed_loop::{ClosedLoop, closed_loop};
pub use commands::Commands;
pub use hold::Hold;
pub use inverse::{Motion, inverse};
pub use open_loop::{OpenLoop, open_loop};
pub use run::Run;
pub use simulated::{ArmColumns, Simulated};

use crate::model::RobotError;
use crate::plant::PlantError;

/// Why a recording cannot be simulated again.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ResimulateError {
    /// A column that is needed.
    #[error("{recording}: has no column {column}; {why}")]
    Column {
        /// The recording.
        recording: String,
        /// Its name.
        column: String,
        /// What needs it.
        why: &'static str,
    },
    /// Too short, or not a run.
    #[error("{recording}: {what}")]
    Run {
        /// The recording.
        recording: String,
        /// What is wrong and what would do.
        what: String,
    },
    /// The robot.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// Effects that cannot be where they are.
    #[error(transparent)]
    Plant(#[from] PlantError),
}
