//! `link_inertia`: a link is heavier, lighter or otherwise distributed than the model believes.

use super::parameters::{ANY, Parameter, ParameterError, Parameters};

/// What is added to the ten inertial parameters of one link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia {
    /// `[m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz]` in kg, kg·m, kg·m²; moments about the origin of the link's frame.
    pub change: [f64; 10],
}

impl LinkInertia {
    /// Names and units; `dpi_B` is a vector of ten.
    pub const PARAMETERS: [Parameter; 1] = [Parameter::needed("dpi_B", "kg|kg.m|kg.m2", ANY)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        parameters.only(&Self::PARAMETERS, &[])?;
        Ok(Self { change: parameters.vector(&Self::PARAMETERS[0])? })
    }
}
