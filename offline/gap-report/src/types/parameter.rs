//! Parameters of a physics.

use serde::{Deserialize, Serialize};

use super::Extra;
use crate::names::names;
use crate::{Motion, Physics, vocabulary};

/// A parameter with its interval. Joint side, also where the recording is motor side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name in the vocabulary.
    pub name: String,
    /// Value, in `unit`.
    pub value: f64,
    /// Unit of the vocabulary, such as `N.m`.
    pub unit: String,
    /// 95 % interval; holds the value.
    pub ci95: [f64; 2],
    /// How the interval was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ci_method: Option<CiMethod>,
    /// Do these data determine it?
    pub identifiable: Identifiable,
    /// Does it stand at a limit of the search?
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_bound: Option<bool>,
    /// Limits of the search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior_range: Option<[f64; 2]>,
    /// Value by output error where `value` is by equation error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output_error_value: Option<f64>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

names! {
    /// How an interval was found.
    CiMethod {
        /// Moving-block bootstrap.
        BlockBootstrap "block_bootstrap",
        /// Sandwich covariance with block scores.
        Sandwich "sandwich",
        /// Profile likelihood.
        Profile "profile",
        /// Posterior.
        Posterior "posterior",
    }
}

names! {
    /// Do the data determine a parameter?
    Identifiable {
        /// They do.
        Yes "yes",
        /// Roughly.
        Weak "weak",
        /// They do not.
        No "no",
    }
}

/// Key of the unit that a value has, where the vocabulary has none for it.
pub const TRUE_UNIT: &str = "x_unit";
/// Key of the direction of a shift, such as `-y`, in the frame before what is shifted.
pub const ALONG: &str = "x_along";

impl Parameter {
    /// A parameter in a unit. The interval is put in order and widened to hold the value: a bootstrap need not.
    pub fn new(name: impl Into<String>, value: f64, unit: impl Into<String>, ci95: [f64; 2]) -> Self {
        let [a, b] = ci95;
        Self {
            name: name.into(),
            value,
            unit: unit.into(),
            ci95: [a.min(b).min(value), a.max(b).max(value)],
            ci_method: None,
            identifiable: Identifiable::from_interval(value, ci95),
            at_bound: None,
            prior_range: None,
            output_error_value: None,
            extra: Extra::default(),
        }
    }

    /// A parameter of a physics, in the unit that the vocabulary gives it at a joint that moves like this; none if the
    /// vocabulary has no such parameter.
    pub fn of(physics: &Physics, name: &str, motion: Motion, value: f64, ci95: [f64; 2]) -> Option<Self> {
        let spec = vocabulary().of(physics)?.parameter(name)?;
        Some(Self { prior_range: Some(spec.raven_range), ..Self::new(name, value, spec.unit_for(motion), ci95) })
    }

    /// The unit that the value has. The vocabulary has one for each way in which a joint moves; that of a coupling is the moving joint's as well.
    pub fn true_unit(&self) -> &str {
        self.extra.get(TRUE_UNIT).and_then(|unit| unit.as_str()).unwrap_or(&self.unit)
    }

    /// Of a shift, in the frame before what is shifted: the direction in which it is positive, and that in which it goes.
    pub fn along(&self) -> Option<[String; 2]> {
        let along = self.extra.get(ALONG)?.as_str()?;
        let (negative, axis) = along.strip_prefix('-').map_or((false, along), |axis| (true, axis));
        let shown = |negative: bool| if negative { format!("\u{2212}{axis}") } else { axis.to_owned() };
        Some([shown(negative), shown(negative != (self.value < 0.0))])
    }

    /// Sets how the interval was found.
    #[must_use]
    pub fn method(mut self, method: CiMethod) -> Self {
        self.ci_method = Some(method);
        self
    }

    /// Sets how far the data determine it.
    #[must_use]
    pub fn identifiable(mut self, identifiable: Identifiable) -> Self {
        self.identifiable = identifiable;
        self
    }
}

impl Identifiable {
    /// `Weak` if the half width exceeds half of the value, else `Yes` (gap-design.md, section 7, rule 9). `No` needs to be
    /// known from the fit.
    pub fn from_interval(value: f64, [low, high]: [f64; 2]) -> Self {
        if 0.5 * (high - low).abs() > 0.5 * value.abs() { Self::Weak } else { Self::Yes }
    }
}
