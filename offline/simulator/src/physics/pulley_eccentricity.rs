//! `pulley_eccentricity`: a pulley does not turn about its centre.

use std::f64::consts::TAU;

use super::parameters::{ANY, POSITIVE, Parameter, ParameterError, Parameters};

/// `dq = e_over_r sin(2 pi q / period + phi)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulleyEccentricity {
    /// Amplitude, rad or m.
    pub e_over_r: f64,
    /// rad.
    pub phi: f64,
    /// Travel of the joint per turn of the pulley, rad or m.
    pub period: f64,
}

impl PulleyEccentricity {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 3] = [
        Parameter::needed("e_over_r", "rad|m", ANY),
        Parameter::optional("phi", "rad", 0.0, ANY),
        Parameter::needed("period", "rad|m", POSITIVE),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [e_over_r, phi, period] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { e_over_r, phi, period })
    }

    /// What is added to a position, and the slope of that.
    #[inline]
    pub fn shift(&self, position: f64) -> (f64, f64) {
        let (sin, cos) = (TAU * position / self.period + self.phi).sin_cos();
        (self.e_over_r * sin, self.e_over_r * cos * TAU / self.period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_repeats_with_each_turn_and_its_slope_is_its_derivative() {
        let pulley = PulleyEccentricity { e_over_r: 2e-3, phi: 0.4, period: 0.565 };
        let (here, slope) = pulley.shift(0.3);
        assert!((pulley.shift(0.3 + 0.565).0 - here).abs() < 1e-15);
        let (ahead, _) = pulley.shift(0.3 + 1e-6);
        assert!(((ahead - here) / 1e-6 - slope).abs() < 1e-6);
    }
}
