//! `gravity_direction`: the base does not stand as the model believes.

use nalgebra::{Rotation3, Vector3};

use super::parameters::{ANY, Parameter, ParameterError, Parameters};

/// `g' = Exp([a, b, 0]) g`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GravityDirection {
    /// Rotation about x of the base frame, rad.
    pub a: f64,
    /// Rotation about y, rad.
    pub b: f64,
}

impl GravityDirection {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 2] = [Parameter::optional("a", "rad", 0.0, ANY), Parameter::optional("b", "rad", 0.0, ANY)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [a, b] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { a, b })
    }

    /// Gravity as it is, from gravity as believed, m/s².
    pub fn turned(&self, gravity_m_s2: Vector3<f64>) -> Vector3<f64> {
        Rotation3::new(Vector3::new(self.a, self.b, 0.0)) * gravity_m_s2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_keeps_its_size_and_turns_by_the_angle() {
        let tilted = GravityDirection { a: 0.0, b: 0.1 }.turned(Vector3::new(-9.81, 0.0, 0.0));
        assert!((tilted.norm() - 9.81).abs() < 1e-12);
        assert!((tilted.z - 9.81 * 0.1_f64.sin()).abs() < 1e-12, "{tilted}");
    }
}
