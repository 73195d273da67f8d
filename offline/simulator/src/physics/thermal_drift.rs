//! `thermal_drift`: friction fades (or grows) as motor, grease and cable warm up, and returns at rest.

use super::parameters::{LASTING_S, Parameter, ParameterError, Parameters};

/// `f_c(t) = f_c0 (1 - kappa_T h)`; the warmth `h` follows `hd = (u - h) / T`, `u` the square of the torque over its reference.
/// Under the reference torque `h = 1 - exp(-t / T)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalDrift {
    /// Share of the Coulomb friction that is gone when warm.
    pub kappa_t: f64,
    /// s.
    pub time_s: f64,
}

impl ThermalDrift {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 2] = [Parameter::needed("kappa_T", "1", (-5.0, 1.0)), Parameter::needed("T", "s", LASTING_S)];

    /// No motor gets warmer than under twice its reference torque.
    const HEATING_MAX: f64 = 4.0;

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [kappa_t, time_s] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { kappa_t, time_s })
    }

    /// Rate of the warmth under a torque, in units of its reference.
    #[inline]
    pub fn rate(&self, relative_torque: f64, warmth: f64) -> f64 {
        ((relative_torque * relative_torque).min(Self::HEATING_MAX) - warmth) / self.time_s
    }

    /// What of the Coulomb friction is left.
    #[inline]
    pub fn share(&self, warmth: f64) -> f64 {
        (1.0 - self.kappa_t * warmth).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_fades_under_torque_and_returns_at_rest() {
        let drift = ThermalDrift { kappa_t: 0.4, time_s: 100.0 };
        let mut warmth = 0.0;
        for _ in 0..1000 {
            warmth += drift.rate(1.0, warmth) * 0.1;
        }
        assert!((drift.share(warmth) - (1.0 - 0.4 * (1.0 - (-1.0_f64).exp()))).abs() < 1e-3);
        for _ in 0..10_000 {
            warmth += drift.rate(0.0, warmth) * 0.1;
        }
        assert!((drift.share(warmth) - 1.0).abs() < 1e-3);
    }
}
