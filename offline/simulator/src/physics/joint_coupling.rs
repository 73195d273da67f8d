//! `joint_coupling`: one joint's motion pulls another joint's cable more, or less, than the controller believes.

use super::parameters::{ANY, Parameter, ParameterError, Parameters};

/// `m_i = TR_i (q_i + (C_ij + c_ij) q_j)`, and the transposed share in torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointCoupling {
    /// What is added to the nominal coupling of the driven joint by the driving joint, rad/rad or m/rad.
    pub c_ij: f64,
}

impl JointCoupling {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 1] = [Parameter::needed("c_ij", "rad/rad|m/rad", ANY)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [c_ij] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { c_ij })
    }
}
