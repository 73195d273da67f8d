//! `motor_torque_scale`: an amplifier or torque constant is not what the controller believes.

use super::parameters::{ANY, Parameter, ParameterError, Parameters};

/// `tau_true = kappa K_t (DAC - d_0) / K_DAC`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorTorqueScale {
    /// True torque per believed torque.
    pub kappa: f64,
    /// Command at which there is no torque, counts.
    pub d_0: f64,
}

impl MotorTorqueScale {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 2] =
        [Parameter::optional("kappa", "1", 1.0, ANY), Parameter::optional("d_0", "DAC", 0.0, ANY)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [kappa, d_0] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { kappa, d_0 })
    }

    /// Torque that acts, given what the command stands for and the torque of one count.
    #[inline]
    pub fn torque(&self, believed: f64, per_count: f64) -> f64 {
        self.kappa * (believed - self.d_0 * per_count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_proportional_to_the_torque_but_for_a_constant() {
        let amplifier = MotorTorqueScale { kappa: 0.9, d_0: 100.0 };
        let per_count = -2.7e-4;
        assert_eq!(amplifier.torque(100.0 * per_count, per_count), 0.0);
        let slope = amplifier.torque(1.0, per_count) - amplifier.torque(0.0, per_count);
        assert!((slope - 0.9).abs() < 1e-12);
    }
}
