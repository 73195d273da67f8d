//! What is asked for, and what is sealed.

use crate::effect::Effect;
use crate::logger::Logging;
use crate::severity::Channel;
use crate::trajectory::Excitation;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An effect that is asked for.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wanted {
    /// Name of the vocabulary, or `outside:NAME`.
    pub physics: String,
    /// Joint counted from 1; drawn where the physics can show if absent.
    pub joint: Option<usize>,
    /// Wanted severity; ignored where parameters are given.
    pub severity: Option<f64>,
    /// Exact parameters instead of drawn ones.
    pub parameters: BTreeMap<String, f64>,
    /// Further exact values by the generator's own names.
    pub details: BTreeMap<String, f64>,
    /// Delayed signal.
    pub signal: Option<String>,
    /// Exact interval, s.
    pub interval: Option<[f64; 2]>,
    /// The effect comes or goes inside the runs, at drawn times.
    pub onset: bool,
    /// Exact intervals, s, one for each run.
    pub intervals: Vec<[f64; 2]>,
    /// The effect comes and goes in each run at a drawn time of its own, or is in some of the runs only.
    pub by_run: bool,
}

/// Arm of a case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The arm of data/gap-examples.
    #[default]
    Raven,
    /// Any other of two to four joints, drawn at random.
    Variant,
    /// One of six joints, drawn at random.
    Six,
    /// Two links that turn about parallel level axes, drawn at random.
    Planar,
    /// Three slides at right angles, the last upright, drawn at random.
    Gantry,
}

/// A case that is asked for.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Order {
    /// Everything random follows from it and `label`.
    pub seed: u64,
    /// Tells cases of one seed apart.
    pub label: String,
    /// Block of the matrix.
    pub block: String,
    /// None for a null case.
    pub effects: Vec<Wanted>,
    /// Noise of the examples times this.
    pub noise: f64,
    /// What the operator does.
    pub excitation: Excitation,
    /// Which arm.
    pub robot: Kind,
    /// Duration of a run, s.
    pub seconds: f64,
    /// Number of runs.
    pub runs: usize,
    /// How they are logged.
    pub logging: Logging,
}

impl Default for Order {
    fn default() -> Self {
        Self {
            seed: 0,
            label: String::new(),
            block: "single".into(),
            effects: Vec::new(),
            noise: 1.0,
            excitation: Excitation::Teleoperation,
            robot: Kind::Raven,
            seconds: 12.0,
            runs: 2,
            logging: Logging::Faithful,
        }
    }
}

/// A sealed effect.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sealed {
    /// What it is.
    #[serde(flatten)]
    pub effect: Effect,
    /// Name of the joint in the URDF.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_name: Option<String>,
    /// Joint at which its severity was measured, for channels that have joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shown_at: Option<String>,
    /// Unit of every parameter.
    pub units: BTreeMap<String, String>,
    /// Channel in which its severity was measured.
    pub channel: Channel,
    /// Severity that was asked for.
    pub severity_wanted: Option<f64>,
    /// Severity that was reached, with the first run's commands and the interval of the first run that it is in.
    pub severity: f64,
}

/// A sealed truth.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Truth {
    /// Form of this file.
    pub schema: String,
    /// Identifier of the case.
    pub case: String,
    /// Block of the matrix.
    pub block: String,
    /// Empty for a null case.
    pub effects: Vec<Sealed>,
    /// Severity that was asked for; 0 for a null case.
    pub severity: f64,
    /// Noise of the examples times this.
    pub noise: f64,
    /// Seed of the set.
    pub seed: u64,
    /// Kind of commands.
    pub excitation: Excitation,
    /// Kind of arm.
    pub robot: Kind,
    /// How it was logged, where that is not as it was read.
    #[serde(default, skip_serializing_if = "Logging::is_faithful")]
    pub logging: Logging,
    /// Joint names, from the base outward.
    pub joints: Vec<String>,
    /// `smooth` or `bristle`.
    pub dry_law: String,
    /// SHA-256 of every file of the case.
    pub files: BTreeMap<String, String>,
    /// Keeps the hash from being guessed.
    pub salt: String,
}
