//! `coulomb_friction`: a torque of constant size against the motion.

use super::parameters::{NOT_NEGATIVE, Parameter, ParameterError, Parameters};

/// `tau_f = f_c (s + asym s²)`, `s` the smoothed sign of the joint's speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoulombFriction {
    /// Mean of the levels forward and backward, N·m or N.
    pub f_c: f64,
    /// `(f+ - f-) / (f+ + f-)`.
    pub asymmetry: f64,
}

impl CoulombFriction {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 2] =
        [Parameter::needed("f_c", "N.m|N", NOT_NEGATIVE), Parameter::optional("f_c_asym", "1", 0.0, (-1.0, 1.0))];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [f_c, asymmetry] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { f_c, asymmetry })
    }

    /// Friction at a smoothed sign of the speed, N·m or N; it acts against the motion.
    #[inline]
    pub fn torque(&self, sign: f64) -> f64 {
        self.f_c * (sign + self.asymmetry * sign * sign)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::smooth_sign;

    #[test]
    fn the_level_is_the_same_at_every_speed_and_differs_by_direction_only() {
        let friction = CoulombFriction { f_c: 2.0, asymmetry: 0.25 };
        for speed in [0.1, 1.0, 30.0] {
            assert!((friction.torque(smooth_sign(speed, 0.001)) - 2.5).abs() < 1e-12);
            assert!((friction.torque(smooth_sign(-speed, 0.001)) + 1.5).abs() < 1e-12);
        }
        assert_eq!(friction.torque(smooth_sign(0.0, 0.001)), 0.0);
    }
}
