//! Verdicts: what is missing, where, how much, and how sure.

use serde::{Deserialize, Serialize};

use super::{
    Artifact, Channel, Confusable, Evidence, Experiment, Extra, Feature, Fit, Location, Parameter, Regime, Score, Subsystem,
};
use crate::Physics;
use crate::names::names;

names! {
    /// Standing of a verdict among those that compete for one effect.
    Role {
        /// The one that is told.
        Primary "primary",
        /// One that it could be instead.
        Alternative "alternative",
    }
}

/// One candidate for one effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Place in the list, from 1; see [`ranked`].
    pub rank: u64,
    /// Which of several simultaneous effects, from 1; candidates for the same effect share it.
    pub effect: u64,
    /// Told, or an alternative.
    pub role: Role,
    /// What it is.
    pub physics: Physics,
    /// Probability, 0 to 1; those of one effect add up to 1 at most.
    pub probability: f64,
    /// Probability of it or one of those that it cannot be told from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set_probability: Option<f64>,
    /// In words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub summary: Option<String>,
    /// Where it shows.
    pub location: Location,
    /// Its parameters, empty for `none` and `unmodelled`.
    pub parameters: Vec<Parameter>,
    /// What it improves on held-out runs.
    pub fit: Vec<Fit>,
    /// Its gain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score: Option<Score>,
    /// What speaks for it.
    pub evidence: Vec<Evidence>,
    /// What the data cannot exclude.
    pub confusable_with: Vec<Confusable>,
    /// What would decide; needed where a primary verdict can be confused.
    pub suggested_experiment: Option<Experiment>,
    /// The model with this effect alone.
    pub corrected_model: Option<Artifact>,
    /// Its pictures.
    pub plots: Vec<Artifact>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Verdict {
    fn new(effect: u64, role: Role, physics: Physics, probability: f64, location: Location) -> Self {
        Self {
            rank: effect,
            effect,
            role,
            physics,
            probability,
            set_probability: None,
            summary: None,
            location,
            parameters: Vec::new(),
            fit: Vec::new(),
            score: None,
            evidence: Vec::new(),
            confusable_with: Vec::new(),
            suggested_experiment: None,
            corrected_model: None,
            plots: Vec::new(),
            extra: Extra::default(),
        }
    }

    /// A named physics with all that the schema asks of a primary verdict. Its summary is its headline.
    pub fn primary(
        effect: u64,
        physics: Physics,
        probability: f64,
        location: Location,
        (parameters, fit, evidence): (Vec<Parameter>, Vec<Fit>, Vec<Evidence>),
        corrected_model: Artifact,
    ) -> Self {
        let bare = Self::new(effect, Role::Primary, physics, probability, location);
        let verdict = Self { parameters, fit, evidence, corrected_model: Some(corrected_model), ..bare };
        Self { summary: Some(crate::headline(&verdict)), ..verdict }
    }

    /// What an effect could be instead.
    pub fn alternative(
        effect: u64,
        physics: Physics,
        probability: f64,
        location: Location,
        parameters: Vec<Parameter>,
        fit: Vec<Fit>,
    ) -> Self {
        Self { parameters, fit, ..Self::new(effect, Role::Alternative, physics, probability, location) }
    }

    /// No mismatch.
    pub fn none(probability: f64, channel: Channel, evidence: Vec<Evidence>) -> Self {
        let regime = Regime::new(Feature::All, "no regime differs from noise");
        let location = Location::new(channel, [], Subsystem::Unknown, regime);
        Self { evidence, ..Self::new(1, Role::Primary, Physics::None, probability, location) }
    }

    /// A mismatch that nothing in the library explains, with at least one test that shows it.
    pub fn unmodelled(effect: u64, probability: f64, location: Location, shown_by: Evidence) -> Self {
        Self { evidence: vec![shown_by], ..Self::new(effect, Role::Primary, Physics::Unmodelled, probability, location) }
    }

    /// Adds physics that the data cannot exclude, and the experiment that would decide.
    #[must_use]
    pub fn confusable(mut self, with: Vec<Confusable>, set_probability: f64, decided_by: Experiment) -> Self {
        self.confusable_with = with;
        self.set_probability = Some(set_probability);
        self.suggested_experiment = Some(decided_by);
        self
    }

    /// Sets its score.
    #[must_use]
    pub fn score(mut self, score: Score) -> Self {
        self.score = Some(score);
        self
    }

    /// Is it the one that is told for its effect?
    pub fn is_primary(&self) -> bool {
        self.role == Role::Primary
    }
}

/// Verdicts in their order with their ranks: by effect, the primary one first, then by falling probability.
pub fn ranked(mut verdicts: Vec<Verdict>) -> Vec<Verdict> {
    verdicts.sort_by(|a, b| a.effect.cmp(&b.effect).then(a.role.cmp(&b.role)).then(b.probability.total_cmp(&a.probability)));
    for (rank, verdict) in (1..).zip(&mut verdicts) {
        verdict.rank = rank;
    }
    verdicts
}
