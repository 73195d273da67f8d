//! `cable_creep`: a cable under load grows longer with time, and recovers when the load goes.

use super::parameters::{LASTING_S, NOT_NEGATIVE, Parameter, ParameterError, Parameters};

/// `Dd_k = (J_k tau_load - D_k) / T_k`: one Kelvin-Voigt element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CableCreep {
    /// Compliance that appears with time, rad/(N·m) or m/N.
    pub compliance: f64,
    /// Time over which it does, s.
    pub time_s: f64,
}

impl CableCreep {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 2] =
        [Parameter::needed("J_k", "rad/(N.m)|m/N", NOT_NEGATIVE), Parameter::needed("T_k", "s", LASTING_S)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [compliance, time_s] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { compliance, time_s })
    }

    /// Rate of the crept deflection under a load, rad/s or m/s.
    #[inline]
    pub fn rate(&self, load: f64, crept: f64) -> f64 {
        (self.compliance * load - crept) / self.time_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_grows_under_load_and_recovers_without() {
        let creep = CableCreep { compliance: 1e-3, time_s: 10.0 };
        let mut crept = 0.0;
        let mut run = |load: f64, seconds: u32| {
            for _ in 0..seconds * 100 {
                crept += creep.rate(load, crept) * 0.01;
            }
            crept
        };
        let after_one_time = run(5.0, 10);
        assert!((after_one_time / 5e-3 - (1.0 - (-1.0_f64).exp())).abs() < 2e-3);
        assert!((run(5.0, 100) - 5e-3).abs() < 1e-6);
        assert!(run(0.0, 100) < 1e-6);
    }
}
