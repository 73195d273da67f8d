//! `payload`: a point mass on the last link, perhaps picked up on the way.

use super::parameters::{ANY, NOT_NEGATIVE, Parameter, ParameterError, Parameters};

/// A mass `m_p` at `c` in the frame of the last link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Payload {
    /// kg.
    pub mass_kg: f64,
    /// Place in the frame of the last link, m.
    pub centre_m: [f64; 3],
}

impl Payload {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 4] = [
        Parameter::needed("m_p", "kg", NOT_NEGATIVE),
        Parameter::optional("c_x", "m", 0.0, ANY),
        Parameter::optional("c_y", "m", 0.0, ANY),
        Parameter::optional("c_z", "m", 0.0, ANY),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [mass_kg, x, y, z] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { mass_kg, centre_m: [x, y, z] })
    }
}
