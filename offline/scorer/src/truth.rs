//! What was sealed.

use serde::Deserialize;
use std::collections::BTreeMap;

/// An effect of a sealed truth. Only what is scored is read.
#[derive(Clone, Debug, Deserialize)]
pub struct Effect {
    /// Name of the vocabulary, or `outside:NAME`.
    pub physics: String,
    /// Joint counted from 1.
    #[serde(default)]
    pub joint: Option<usize>,
    /// Its name in the URDF.
    #[serde(default)]
    pub joint_name: Option<String>,
    /// Parameters of the vocabulary, joint side, SI.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// What is no parameter of the vocabulary: of a coupling the joint that moves, `from`, counted from 1.
    #[serde(default)]
    pub details: BTreeMap<String, f64>,
    /// Start and end, s; without it the whole run.
    #[serde(default)]
    pub interval: Option<[f64; 2]>,
    /// The same of each run, where they differ; empty otherwise.
    #[serde(default)]
    pub intervals: Vec<[f64; 2]>,
    /// Severity that was asked for.
    #[serde(default)]
    pub severity_wanted: Option<f64>,
    /// Severity that was reached.
    #[serde(default)]
    pub severity: f64,
}

/// A sealed truth.
#[derive(Clone, Debug, Deserialize)]
pub struct Truth {
    /// Identifier.
    pub case: String,
    /// Block of the matrix.
    pub block: String,
    /// Empty for a null case.
    pub effects: Vec<Effect>,
    /// Noise scale.
    #[serde(default)]
    pub noise: f64,
    /// Kind of arm.
    #[serde(default)]
    pub robot: String,
    /// Law of dry friction in the plant.
    #[serde(default)]
    pub dry_law: String,
    /// Joint names from the base outward.
    #[serde(default)]
    pub joints: Vec<String>,
    /// SHA-256 of the files of the case.
    #[serde(default)]
    pub files: BTreeMap<String, String>,
}

/// Severities of the design.
const LEVELS: [f64; 5] = [0.3, 1.0, 3.0, 10.0, 30.0];

impl Effect {
    /// True if no name of the vocabulary covers it.
    pub fn is_outside(&self) -> bool {
        self.physics.starts_with("outside:")
    }
}

impl Truth {
    /// Name of the joint that moves the one of a coupling.
    pub fn mover(&self, effect: &Effect) -> Option<&String> {
        let from = effect.details.get("from").filter(|_| effect.physics == "joint_coupling")?;
        self.joints.get((*from as usize).checked_sub(1)?)
    }

    /// Severity that the case is counted under: the one asked for, or, where a real robot could not have reached it, the level
    /// next to the one reached. 0 for a null case.
    pub fn level(&self) -> f64 {
        let Some(effect) = self.effects.iter().min_by(|a, b| a.severity.total_cmp(&b.severity)) else { return 0.0 };
        let wanted = effect.severity_wanted.unwrap_or(effect.severity);
        if (0.75..1.35).contains(&(effect.severity / wanted)) && LEVELS.contains(&wanted) {
            return wanted;
        }
        let far = |level: f64| (level / effect.severity.max(1e-6)).ln().abs();
        LEVELS.into_iter().min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(0.0)
    }

    /// Name in the rows of the confusion matrix, for cases of at most one effect.
    pub fn row(&self) -> &str {
        match self.effects.first() {
            None => "none",
            Some(effect) if effect.is_outside() => "unmodelled",
            Some(effect) => &effect.physics,
        }
    }
}
