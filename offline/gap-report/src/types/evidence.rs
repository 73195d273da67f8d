//! What speaks for a verdict, and what else it might be.

use serde::{Deserialize, Serialize};

use super::Extra;
use crate::Physics;
use crate::names::names;

names! {
    /// How a statistic was judged.
    TestMethod {
        /// t test of slopes in blocks.
        BlockSlopeT "block_slope_t",
        /// Surrogates by circular shifts.
        CircularShift "circular_shift",
        /// Block bootstrap.
        BlockBootstrap "block_bootstrap",
        /// Gain on held-out data.
        HeldOutGain "held_out_gain",
        /// Change point.
        ChangePoint "change_point",
        /// Coherence.
        Coherence "coherence",
        /// Repeatability.
        Repeatability "repeatability",
        /// A check of the data before anything else.
        Gate "gate",
    }
}

names! {
    /// Which data a test saw.
    TestData {
        /// Those of the fit.
        Train "train",
        /// Those that were held out.
        HeldOut "held_out",
        /// Both.
        Both "both",
    }
}

/// One test that speaks for a verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// The test.
    pub test: String,
    /// What it shows.
    pub claim: String,
    /// Its statistic.
    pub statistic: f64,
    /// What the statistic is, such as `t` or `nats`.
    pub statistic_name: String,
    /// p value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// q value, after correction for many tests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q_value: Option<f64>,
    /// Size of the effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effect: Option<EffectSize>,
    /// Effective number of independent samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_effective: Option<f64>,
    /// How it was judged.
    pub method: TestMethod,
    /// On which data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<TestData>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// Size of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectSize {
    /// Value, in `unit`.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// 95 % interval; holds the value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ci95: Option<[f64; 2]>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Evidence {
    /// A test, its claim and its statistic.
    pub fn new(
        test: impl Into<String>,
        claim: impl Into<String>,
        (statistic, statistic_name): (f64, &str),
        method: TestMethod,
    ) -> Self {
        Self {
            test: test.into(),
            claim: claim.into(),
            statistic,
            statistic_name: statistic_name.to_owned(),
            p_value: None,
            q_value: None,
            effect: None,
            n_effective: None,
            method,
            data: None,
            extra: Extra::default(),
        }
    }
}

/// Physics that the data cannot exclude.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Confusable {
    /// Its name.
    pub physics: Physics,
    /// At which joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<Vec<String>>,
    /// Share of the effect's signature that it reproduces, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overlap: Option<f64>,
    /// Score of the verdict minus its score, nats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score_difference_nats: Option<f64>,
    /// Why the two look alike in these data.
    pub reason: String,
    /// What would tell them apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separated_by: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Confusable {
    /// Physics that looks alike, and why.
    pub fn new(physics: Physics, reason: impl Into<String>) -> Self {
        Self {
            physics,
            joint: None,
            overlap: None,
            score_difference_nats: None,
            reason: reason.into(),
            separated_by: None,
            extra: Extra::default(),
        }
    }
}
