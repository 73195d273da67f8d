//! The experiment that would decide.

use serde::{Deserialize, Serialize};

use super::Extra;
use crate::Physics;
use crate::names::names;

/// A short experiment that would tell candidates apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    /// What it is for.
    pub goal: String,
    /// What it tells apart, at least one.
    pub separates: Vec<Physics>,
    /// What to do, step by step, at least one.
    pub steps: Vec<String>,
    /// The motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<Trajectory>,
    /// Duration, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// What else is needed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extra_equipment: Option<Vec<String>>,
    /// Evidence that it is expected to give, nats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_gain_nats: Option<f64>,
    /// Was it checked against the limits of joints and motors?
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limits_checked: Option<bool>,
    /// What to beware of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Experiment {
    /// A goal, what it tells apart, and how.
    pub fn new(goal: impl Into<String>, separates: Vec<Physics>, steps: Vec<String>) -> Self {
        Self {
            goal: goal.into(),
            separates,
            steps,
            trajectory: None,
            duration_s: None,
            extra_equipment: None,
            expected_gain_nats: None,
            limits_checked: None,
            warning: None,
            extra: Extra::default(),
        }
    }
}

names! {
    /// Kind of motion.
    TrajectoryKind {
        /// Stand still under load.
        Hold "hold",
        /// Back and forth at constant speed.
        Triangle "triangle",
        /// One sine.
        Sine "sine",
        /// Several sines.
        Multisine "multisine",
        /// Rising frequency.
        Chirp "chirp",
        /// Several amplitudes.
        AmplitudeLadder "amplitude_ladder",
        /// Several speeds.
        SpeedLadder "speed_ladder",
        /// The same at several postures.
        PostureSet "posture_set",
        /// To the hard stops.
        Homing "homing",
        /// Rest, warm up, repeat.
        RestWarmRepeat "rest_warm_repeat",
        /// Something else.
        Custom "custom",
    }
}

/// A motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// Its kind.
    pub kind: TrajectoryKind,
    /// Joints that move.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<String>>,
    /// Amplitude, in `amplitude_unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplitude: Option<f64>,
    /// Unit of the amplitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplitude_unit: Option<String>,
    /// Frequencies, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frequency_hz: Option<Vec<f64>>,
    /// Speeds, `amplitude_unit` per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speeds: Option<Vec<f64>>,
    /// Repeats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<u64>,
    /// File with the motion, relative to the folder of report.json.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Trajectory {
    /// A kind of motion.
    pub fn new(kind: TrajectoryKind) -> Self {
        Self {
            kind,
            joints: None,
            amplitude: None,
            amplitude_unit: None,
            frequency_hz: None,
            speeds: None,
            repeats: None,
            file: None,
            extra: Extra::default(),
        }
    }
}
