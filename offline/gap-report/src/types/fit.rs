//! How well a corrected simulation fits what it was not fitted on.

use serde::{Deserialize, Serialize};

use super::Extra;
use crate::names::names;

names! {
    /// Figure of a fit.
    Metric {
        /// Root mean square.
        Rms "rms",
        /// Mean absolute error.
        Mae "mae",
        /// Greatest absolute error.
        Max "max",
        /// Root mean square relative to the signal's.
        Nrms "nrms",
        /// Coefficient of determination.
        R2 "r2",
        /// Log likelihood per sample, nats.
        LogLikelihoodPerSample "log_likelihood_per_sample",
    }
}

names! {
    /// What is compared.
    Space {
        /// The equation of motion on recorded motion.
        EquationError "equation_error",
        /// The simulation run again with the controller in the loop.
        ClosedLoop "closed_loop",
        /// The recorded simulator output, corrected to first order.
        RecordedOutput "recorded_output",
    }
}

names! {
    /// How a noise floor was found.
    FloorMethod {
        /// Equal commands, repeated.
        Repeats "repeats",
        /// Innovations of the noise model.
        Innovations "innovations",
        /// Steps of the sensor.
        Quantisation "quantisation",
        /// Nobody says.
        Unknown "unknown",
    }
}

/// A figure before and after the correction, on runs that took no part in the fitting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The figure.
    pub metric: Metric,
    /// What is compared, such as `torque J3`.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// How it is compared.
    pub space: Space,
    /// Before the correction, in `unit`.
    pub before: f64,
    /// After it.
    pub after: f64,
    /// What noise alone would leave; null if unknown.
    pub noise_floor: Option<f64>,
    /// How the floor was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor_method: Option<FloorMethod>,
    /// [`removed_fraction`], for `rms`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub removed_fraction: Option<f64>,
    /// Its 95 % interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub removed_fraction_ci95: Option<[f64; 2]>,
    /// Ids of held-out or split runs, each once, at least one.
    pub on: Vec<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

/// Key of a fit's `extra`: nothing of the cause is in the runs on which it was judged.
pub const ABSENT: &str = "x_absent";

impl Fit {
    /// An RMS in `unit` before and after on held-out runs, with the share of removable error that is gone.
    pub fn rms(
        quantity: impl Into<String>,
        unit: impl Into<String>,
        space: Space,
        (before, after): (f64, f64),
        floor: Option<(f64, FloorMethod)>,
        on: Vec<String>,
    ) -> Self {
        Self {
            metric: Metric::Rms,
            quantity: quantity.into(),
            unit: unit.into(),
            space,
            before,
            after,
            noise_floor: floor.map(|floor| floor.0),
            noise_floor_method: floor.map(|floor| floor.1),
            removed_fraction: floor.and_then(|(floor, _)| removed_fraction(before, after, floor)),
            removed_fraction_ci95: None,
            on,
            extra: Extra::default(),
        }
    }
}

/// Share of the error above the noise floor that a correction removed, `1 - (after^2 - floor^2) / (before^2 - floor^2)`; none
/// if there was nothing above the floor. Below 0: it made things worse; above 1: what is left is below the floor.
pub fn removed_fraction(before: f64, after: f64, floor: f64) -> Option<f64> {
    let removable = before * before - floor * floor;
    let fraction = 1.0 - (after * after - floor * floor) / removable;
    (removable > 0.0 && fraction.is_finite()).then_some(fraction)
}

/// Gain over the model without the effect, cross-validated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Held-out gain in log likelihood, nats.
    pub gain_nats: f64,
    /// Its standard error, nats.
    pub gain_se: f64,
    /// Folds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folds: Option<u64>,
    /// Gain that is asked for, nats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold_nats: Option<f64>,
    /// Parameters of the effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_parameters: Option<u64>,
    /// Bayesian information criterion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bic: Option<f64>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Score {
    /// A gain with its standard error, nats.
    pub fn new(gain_nats: f64, gain_se: f64) -> Self {
        Self { gain_nats, gain_se, folds: None, threshold_nats: None, n_parameters: None, bic: None, extra: Extra::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn removed_fractions_of_the_specification() {
        let near = |a: Option<f64>, b: f64| a.is_some_and(|a| (a - b).abs() < 5e-4);
        assert!(near(removed_fraction(13.4, 3.1, 2.7), 0.987));
        assert!(near(removed_fraction(1.62, 0.97, 0.74), 0.811));
        assert_eq!(removed_fraction(1.0, 1.0, 0.0), Some(0.0));
        assert_eq!(removed_fraction(1.0, 0.5, 1.0), None);
        assert_eq!(removed_fraction(1.0, f64::NAN, 0.5), None);
    }
}
