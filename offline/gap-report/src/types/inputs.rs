//! What was compared: tool, robot, simulator, runs.

use serde::{Deserialize, Serialize};

use super::{Extra, Interval};
use crate::names::names;

/// The program that wrote the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tool {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// Revision of its source.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revision: Option<String>,
    /// Version of the vocabulary, see [`crate::Vocabulary`].
    pub vocabulary_version: String,
    /// SHA-256 of everything that was configured, 64 lower-case hexadecimal digits.
    pub config_sha256: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Tool {
    /// This release of ravenpose.
    pub fn ravenpose(config_sha256: impl Into<String>, seed: u64) -> Self {
        Self {
            name: "ravenpose".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            revision: None,
            vocabulary_version: crate::vocabulary().version.clone(),
            config_sha256: config_sha256.into(),
            seed,
            extra: Extra::default(),
        }
    }
}

/// What was compared with what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// The robot.
    pub robot: Robot,
    /// The simulator.
    pub simulator: Simulator,
    /// Its recordings, at least one.
    pub runs: Vec<Run>,
    /// Channels that could be compared, each once, at least one.
    pub channels: Vec<Channel>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// The robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// SHA-256 of its URDF.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf_sha256: Option<String>,
    /// Names of its joints from the base to the tool, at least one.
    pub joints: Vec<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// The simulator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Simulator {
    /// Its name.
    pub name: String,
    /// Its version.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
    /// How far it could be used.
    pub access: Access,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

names! {
    /// How far a simulator could be used.
    Access {
        /// Our own.
        Builtin "builtin",
        /// Takes an extra force at every step.
        StepCallback "step_callback",
        /// Takes a series of extra forces.
        BatchExtraForce "batch_extra_force",
        /// Can be run, takes no extra force.
        BatchNoExtraForce "batch_no_extra_force",
        /// Only what it once wrote is there.
        RecordedOutput "recorded_output",
    }
}

names! {
    /// Where recording and simulation are compared.
    Channel {
        /// Torques or forces of the joints, joint side.
        JointTorque "joint_torque",
        /// Motor position against joint position.
        Transmission "transmission",
        /// Position of the tool.
        EndEffector "end_effector",
        /// Lags between signals.
        Timing "timing",
        /// What the whole loop does under equal commands.
        ClosedLoopOutput "closed_loop_output",
        /// Logged commands against replayed ones.
        Command "command",
    }
}

/// One recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name within the report.
    pub id: String,
    /// What it was used for.
    pub role: RunRole,
    /// Of a split run, the stretch that was held out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out_interval: Option<Interval>,
    /// SHA-256 of the simulator's output for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sim_sha256: Option<String>,
    /// Where it came from.
    pub kind: RunKind,
    /// Duration, s.
    pub duration_s: f64,
    /// Samples per second, Hz.
    pub rate_hz: f64,
    /// Samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<u64>,
    /// Samples that remained after masking.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples_used: Option<u64>,
    /// SHA-256 of the recording.
    pub sha256: String,
    /// Its file, relative to the folder of report.json.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Which tool the robot held.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_id: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

names! {
    /// What a run was used for.
    RunRole {
        /// Fitting and selection.
        Train "train",
        /// Judging only.
        HeldOut "held_out",
        /// Both, apart in time: see `held_out_interval`.
        Split "split",
        /// Known to be without effects.
        Null "null",
        /// Calibration.
        Calibration "calibration",
    }
}

names! {
    /// Where a run came from.
    RunKind {
        /// A robot.
        Real "real",
        /// A simulator.
        Simulated "simulated",
        /// Nobody says.
        Unknown "unknown",
    }
}

impl Run {
    /// A run that is fitted on or held out whole.
    pub fn new(id: impl Into<String>, role: RunRole, duration_s: f64, rate_hz: f64, sha256: impl Into<String>) -> Self {
        Self {
            id: id.into(),
            role,
            held_out_interval: None,
            sim_sha256: None,
            kind: RunKind::Unknown,
            duration_s,
            rate_hz,
            samples: None,
            samples_used: None,
            sha256: sha256.into(),
            file: None,
            tool_id: None,
            extra: Extra::default(),
        }
    }

    /// A single run of which the stretch from `start_s` to `end_s` is held out.
    pub fn split(id: &str, (start_s, end_s): (f64, f64), duration_s: f64, rate_hz: f64, sha256: impl Into<String>) -> Self {
        let held_out_interval = Some(Interval::new(id, start_s, end_s));
        Self { held_out_interval, ..Self::new(id, RunRole::Split, duration_s, rate_hz, sha256) }
    }

    /// May fits be judged on it?
    pub fn is_held_out(&self) -> bool {
        matches!(self.role, RunRole::HeldOut | RunRole::Split)
    }
}
