//! One effect in words and numbers: the form that is sealed, and what the plant makes of it.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An effect: physics by its vocabulary name (or an `outside:` name), where, how large, when.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Name of the vocabulary, or `outside:NAME`.
    pub physics: String,
    /// Joint (or the joint that moves the link), counted from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<usize>,
    /// Parameters under the names of the vocabulary, joint side, SI.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// What the vocabulary has no name for, by the generator's own names, SI.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub details: BTreeMap<String, f64>,
    /// Delayed signal: `tip`, `joint`, `torque` or `motor`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<String>,
    /// Start and end in seconds of every run; without it the whole of all runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// Start and end in seconds, one for each run, of what is at other times in other runs; empty otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub intervals: Vec<[f64; 2]>,
}

/// The interval of what is not in a run at all.
pub const NEVER: [f64; 2] = [1e6, 1e6];
/// The interval of what is in all of a run.
pub const ALWAYS: [f64; 2] = [-1e6, 1e6];

/// Duration over which an effect comes or goes, s.
pub const RAMP: f64 = 0.04;

impl Effect {
    /// A whole-run effect at a joint (counted from 1).
    pub fn at(physics: &str, joint: Option<usize>, parameters: &[(&str, f64)]) -> Self {
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self { physics: physics.to_owned(), joint, parameters, ..Self::default() }
    }

    /// A parameter or detail by name; 0 where it is not given.
    pub fn value(&self, name: &str) -> f64 {
        self.parameters.get(name).or_else(|| self.details.get(name)).copied().unwrap_or(0.0)
    }

    /// As it is in one run, counted from 0.
    #[must_use]
    pub fn in_run(&self, run: usize) -> Self {
        Self { interval: self.intervals.get(run).copied().or(self.interval), intervals: Vec::new(), ..self.clone() }
    }

    /// The first run that it is in, counted from 0.
    pub fn first_run(&self) -> usize {
        self.intervals.iter().position(|interval| *interval != NEVER).unwrap_or(0)
    }

    /// Index of the joint, counted from 0.
    pub fn index(&self) -> usize {
        self.joint.unwrap_or(1).max(1) - 1
    }

    /// Share of the effect at time `t`: 0 outside its interval, 1 inside, a smooth step between.
    pub fn weight(&self, t: f64) -> f64 {
        let Some([on, off]) = self.interval else { return 1.0 };
        smooth((t - on) / RAMP) * (1.0 - smooth((t - off) / RAMP))
    }
}

/// 0 below 0, 1 above 1, with continuous acceleration between.
pub fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}
