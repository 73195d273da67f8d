//! `transmission_ratio`: a pulley or gear is not of the size that the controller believes.

use super::parameters::{Parameter, ParameterError, Parameters};

/// `q_true - home = (1 + e)(q - home)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransmissionRatio {
    /// Relative error.
    pub e: f64,
}

impl TransmissionRatio {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 1] = [Parameter::needed("e", "1", (-0.9, 10.0))];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [e] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { e })
    }

    /// What is added to a position whose distance from the homing position is `travel`, rad or m.
    #[inline]
    pub fn shift(&self, travel: f64) -> f64 {
        self.e * travel
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_grows_in_proportion_to_the_distance_from_homing() {
        let ratio = TransmissionRatio { e: 0.05 };
        assert_eq!(ratio.shift(0.0), 0.0);
        assert!((ratio.shift(0.8) - 2.0 * ratio.shift(0.4)).abs() < 1e-15);
    }
}
