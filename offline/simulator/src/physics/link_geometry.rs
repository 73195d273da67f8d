//! `link_geometry`: a link has another angle or length than the kinematics believe.

use super::parameters::{ANY, Parameter, ParameterError, Parameters};

/// Change of one row of the Denavit-Hartenberg table: its twist, and its length (`a` where the row has one, else `d`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkGeometry {
    /// Twist, rad.
    pub d_alpha: f64,
    /// Length, m.
    pub d_length: f64,
}

impl LinkGeometry {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 2] =
        [Parameter::optional("d_alpha", "rad", 0.0, ANY), Parameter::optional("d_length", "m", 0.0, ANY)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [d_alpha, d_length] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { d_alpha, d_length })
    }
}
