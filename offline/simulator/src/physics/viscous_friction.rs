//! `viscous_friction`: a torque proportional to the speed.

use super::parameters::{NOT_NEGATIVE, Parameter, ParameterError, Parameters};

/// `tau_f = b qd`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViscousFriction {
    /// N·m·s/rad or N·s/m.
    pub b: f64,
}

impl ViscousFriction {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 1] = [Parameter::needed("b", "N.m.s/rad|N.s/m", NOT_NEGATIVE)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [b] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { b })
    }

    /// Friction at a speed; it acts against the motion.
    #[inline]
    pub fn torque(&self, speed: f64) -> f64 {
        self.b * speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_is_a_line_through_the_origin() {
        let friction = ViscousFriction { b: 3.0 };
        assert_eq!(friction.torque(0.0), 0.0);
        assert_eq!(friction.torque(2.0), 6.0);
        assert_eq!(friction.torque(-2.0), -friction.torque(2.0));
    }
}
