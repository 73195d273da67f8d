//! `joint_offset`: homing found the wrong zero; constant until the next homing (or, from a time on: a cable slipped).

use super::parameters::{ANY, Parameter, ParameterError, Parameters};

/// `q_true = q + o`, `q` as the controller reports it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointOffset {
    /// rad or m.
    pub o: f64,
}

impl JointOffset {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 1] = [Parameter::needed("o", "rad|m", ANY)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [o] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { o })
    }
}
