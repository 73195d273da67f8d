//! `torque_ripple`: the motor loses torque unevenly over its turn.

use super::parameters::{ANY, POSITIVE, Parameter, ParameterError, Parameters};

/// `tau = amp sin(order theta_m + phase)` is lost, as friction is: so much more has to be commanded. `theta_m` is the angle of the motor's shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueRipple {
    /// Amplitude on the joint's side, N·m or N.
    pub amplitude: f64,
    /// Periods per turn of the motor.
    pub order: f64,
    /// rad.
    pub phase: f64,
}

impl TorqueRipple {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 3] = [
        Parameter::needed("amp", "N.m|N", ANY),
        Parameter::needed("order", "1/rev", POSITIVE),
        Parameter::optional("phase", "rad", 0.0, ANY),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [amplitude, order, phase] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { amplitude, order, phase })
    }

    /// What is lost of the torque at a motor angle, N·m or N on the joint's side.
    #[inline]
    pub fn torque(&self, motor_rad: f64) -> f64 {
        self.amplitude * (self.order * motor_rad + self.phase).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn it_repeats_as_often_per_turn_as_its_order_says() {
        let ripple = TorqueRipple { amplitude: 0.3, order: 6.0, phase: 0.2 };
        assert!((ripple.torque(1.0 + TAU / 6.0) - ripple.torque(1.0)).abs() < 1e-12);
        let mean: f64 = (0..600).map(|i| ripple.torque(TAU * f64::from(i) / 600.0)).sum::<f64>() / 600.0;
        assert!(mean.abs() < 1e-12);
    }
}
