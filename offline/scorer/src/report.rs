//! What the tool answered: the parts of report.json that are scored.

use serde::Deserialize;

/// A parameter of a verdict.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Parameter {
    /// Name of the vocabulary.
    pub name: String,
    /// Joint side, SI.
    pub value: f64,
    /// Interval of 95 %.
    pub ci95: [f64; 2],
    /// `yes`, `weak` or `no`.
    pub identifiable: String,
}

/// A stretch of one run.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Interval {
    /// Run.
    pub run: String,
    /// s.
    pub start_s: f64,
    /// s.
    pub end_s: f64,
}

/// Where.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Location {
    /// Joint names.
    pub joint: Vec<String>,
    /// Empty means whole runs.
    pub time_intervals: Vec<Interval>,
}

/// How much better the corrected simulation fits.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Fit {
    /// Before the correction.
    pub before: f64,
    /// What noise alone leaves.
    pub noise_floor: Option<f64>,
    /// Share removed.
    pub removed_fraction: Option<f64>,
}

/// Another name that the data cannot exclude.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Confusable {
    /// Name.
    pub physics: String,
}

/// A verdict.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Verdict {
    /// 1 is first.
    pub rank: usize,
    /// Slot of simultaneous effects.
    pub effect: usize,
    /// `primary` or `alternative`.
    pub role: String,
    /// Name.
    pub physics: String,
    /// Stated.
    pub probability: f64,
    /// Where.
    pub location: Location,
    /// How large.
    pub parameters: Vec<Parameter>,
    /// How much better.
    pub fit: Vec<Fit>,
    /// The rest of the set.
    pub confusable_with: Vec<Confusable>,
}

impl Verdict {
    /// Names of the set, the headline first.
    pub fn set(&self) -> Vec<&str> {
        let mut set = vec![self.physics.as_str()];
        for other in &self.confusable_with {
            if !set.contains(&other.physics.as_str()) {
                set.push(&other.physics);
            }
        }
        set
    }

    /// Share removed where the mismatch stands highest above its floor.
    pub fn removed(&self) -> Option<f64> {
        let above = |fit: &&Fit| fit.before / fit.noise_floor.unwrap_or(f64::INFINITY).max(1e-12);
        let fits = self.fit.iter().filter(|fit| fit.removed_fraction.is_some());
        fits.max_by(|a, b| above(a).total_cmp(&above(b))).and_then(|fit| fit.removed_fraction)
    }
}

/// Mismatch or not.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Mismatch {
    /// Beyond noise.
    pub detected: bool,
}

/// Time taken.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Timing {
    /// s.
    pub total_s: f64,
}

/// A run, as the tool describes it.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Run {
    /// Name.
    pub id: String,
    /// s.
    pub duration_s: f64,
}

/// What went in.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Inputs {
    /// In the order given.
    pub runs: Vec<Run>,
}

/// A report.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Report {
    /// `no_mismatch`, `explained`, `partly_explained`, `unmodelled`, `insufficient_data`.
    pub status: String,
    /// What went in.
    pub inputs: Inputs,
    /// Beyond noise or not.
    pub mismatch: Mismatch,
    /// All verdicts.
    pub verdicts: Vec<Verdict>,
    /// Time taken.
    pub timing: Timing,
}

impl Report {
    /// Primary verdicts by rank.
    pub fn primaries(&self) -> Vec<&Verdict> {
        let mut primaries: Vec<_> = self.verdicts.iter().filter(|verdict| verdict.role == "primary").collect();
        primaries.sort_by_key(|verdict| verdict.rank);
        primaries
    }
}
