//! The report as a whole.

use serde::{Deserialize, Serialize};

use super::{Artifact, Channel, Extra, Fit, Inputs, Tool, Verdict};
use crate::names::names;

/// Version of the schema that these types are.
pub const SCHEMA_VERSION: &str = "1.0.0";

/// Result of comparing one simulator with one set of recordings; report.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`SCHEMA_VERSION`].
    pub schema_version: String,
    /// Name of this report.
    pub report_id: String,
    /// When it was written, RFC 3339; see [`crate::timestamp`].
    pub created: String,
    /// The program.
    pub tool: Tool,
    /// What was compared.
    pub inputs: Inputs,
    /// Checks of the data.
    pub data_quality: Vec<DataQuality>,
    /// The answer in one word.
    pub status: Status,
    /// Two or three sentences that a robot user understands.
    pub summary: String,
    /// Is there a mismatch?
    pub mismatch: Mismatch,
    /// What is missing, by rank; empty only with `insufficient_data`.
    pub verdicts: Vec<Verdict>,
    /// The model with all accepted effects; needed for `explained`.
    #[serde(default)]
    pub corrected_model: Option<Artifact>,
    /// What is left over.
    pub remaining: Remaining,
    /// How thresholds and probabilities were found.
    pub calibration: Calibration,
    /// How long it took.
    pub timing: Timing,
    /// Pictures beside the report.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plots: Vec<Artifact>,
    /// In blind trials, which case it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sealed_case: Option<SealedCase>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Report {
    /// Effects that are told: the primary verdicts, by rank.
    pub fn told(&self) -> impl Iterator<Item = &Verdict> {
        self.verdicts.iter().filter(|verdict| verdict.is_primary())
    }

    /// Checks of the data that came out at a level.
    pub fn quality(&self, level: Level) -> impl Iterator<Item = &DataQuality> {
        self.data_quality.iter().filter(move |check| check.level == level)
    }

    /// Ids of the runs that fits are judged on.
    pub fn held_out(&self) -> impl Iterator<Item = &str> {
        self.inputs.runs.iter().filter(|run| run.is_held_out()).map(|run| run.id.as_str())
    }
}

names! {
    /// The answer in one word.
    Status {
        /// Nothing beyond noise.
        NoMismatch "no_mismatch",
        /// Named physics explains the mismatch.
        Explained "explained",
        /// Named physics explains part of it.
        PartlyExplained "partly_explained",
        /// Nothing in the library explains it.
        Unmodelled "unmodelled",
        /// The data do not allow an answer.
        InsufficientData "insufficient_data",
    }
}

names! {
    /// How a check of the data came out.
    Level {
        /// In order.
        Ok "ok",
        /// To be kept in mind.
        Warn "warn",
        /// To be put right first.
        Fail "fail",
    }
}

/// A check of the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataQuality {
    /// The check.
    pub check: String,
    /// How it came out.
    pub level: Level,
    /// What was found.
    pub message: String,
    /// In which run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<String>,
    /// Its figure, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Unit of the figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl DataQuality {
    /// A check and what it found.
    pub fn new(check: impl Into<String>, level: Level, message: impl Into<String>) -> Self {
        let (check, message) = (check.into(), message.into());
        Self { check, level, message, run: None, value: None, unit: None, extra: Extra::default() }
    }

    /// Sets the run that it is about.
    #[must_use]
    pub fn run(mut self, run: impl Into<String>) -> Self {
        self.run = Some(run.into());
        self
    }

    /// Sets its figure.
    #[must_use]
    pub fn value(mut self, value: f64, unit: impl Into<String>) -> Self {
        (self.value, self.unit) = (Some(value), Some(unit.into()));
        self
    }
}

/// Is there a mismatch beyond noise?
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mismatch {
    /// Is there?
    pub detected: bool,
    /// Probability of such data without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// Residuals per channel and joint.
    pub excess_rms: Vec<ExcessRms>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// Key of an excess's `extra`: RMS of what the nominal model misses of the simulation's own channel, in the same unit.
pub const MODEL_ERROR: &str = "x_model_error";

/// What a residual has beyond noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExcessRms {
    /// The channel.
    pub channel: Channel,
    /// The joint, if the channel has joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Root mean square, in `unit`.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// What noise alone would give.
    pub noise_floor: f64,
    /// Effective number of independent samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_effective: Option<f64>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl ExcessRms {
    /// What the nominal model is known to get wrong there, where it is beyond noise but no more than that.
    pub fn model_error(&self) -> Option<f64> {
        let own = self.extra.get(MODEL_ERROR)?.as_f64()?;
        (self.noise_floor < self.value && self.value < own).then_some(own)
    }
}

/// What is left when all accepted effects are in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Remaining {
    /// Held-out gain of everything in the library together, nats.
    pub library_gain_nats: f64,
    /// Held-out gain of the flexible predictor, nats.
    pub flexible_gain_nats: f64,
    /// Share of what can be explained that is, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explained_share: Option<f64>,
    /// What the rest depends on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depends_on: Option<Vec<String>>,
    /// Figures of all accepted effects together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<Vec<Fit>>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// How thresholds and probabilities were found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Runs without effect that they were tried on.
    pub null_runs: u64,
    /// Gain that is asked for, nats.
    pub threshold_nats: f64,
    /// False alarms per case at most, with 95 % confidence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub false_alarm_upper95: Option<f64>,
    /// Temperature that makes the probabilities right on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probability_temperature: Option<f64>,
    /// Where these numbers are from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// How long it took, s.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Reading, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_s: Option<f64>,
    /// Screening, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub screen_s: Option<f64>,
    /// Fitting, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit_s: Option<f64>,
    /// Simulating, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub simulate_s: Option<f64>,
    /// Everything, s.
    pub total_s: f64,
    /// Threads.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<u64>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// Which case of a blind trial; never its truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SealedCase {
    /// The case.
    pub case_id: String,
    /// SHA-256 of its sealed truth.
    pub truth_commitment: String,
    /// SHA-256 of the manifest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub manifest_sha256: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}
