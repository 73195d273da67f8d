//! `frame_misalignment`: the tracker's frame is not where its registration says.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::parameters::{ANY, Parameter, ParameterError, Parameters};

/// `p_meas = Exp(w) p + t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameMisalignment {
    /// Rotation vector, rad.
    pub w: [f64; 3],
    /// Translation, m.
    pub t: [f64; 3],
}

impl FrameMisalignment {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 6] = [
        Parameter::optional("w_x", "rad", 0.0, ANY),
        Parameter::optional("w_y", "rad", 0.0, ANY),
        Parameter::optional("w_z", "rad", 0.0, ANY),
        Parameter::optional("t_x", "m", 0.0, ANY),
        Parameter::optional("t_y", "m", 0.0, ANY),
        Parameter::optional("t_z", "m", 0.0, ANY),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [w_x, w_y, w_z, t_x, t_y, t_z] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { w: [w_x, w_y, w_z], t: [t_x, t_y, t_z] })
    }

    /// The transform from true to measured.
    pub fn transform(&self) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(self.w));
        Isometry3::from_parts(Translation3::from(Vector3::from(self.t)), rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn it_is_one_rigid_transform_so_distances_stay() {
        let transform = FrameMisalignment { w: [0.1, -0.05, 0.02], t: [0.01, 0.0, -0.02] }.transform();
        let (a, b) = (Point3::new(0.1, 0.2, 0.3), Point3::new(-0.1, 0.0, 0.05));
        let (a_measured, b_measured) = (transform * a, transform * b);
        assert!(((a_measured - b_measured).norm() - (a - b).norm()).abs() < 1e-15);
        assert!((a_measured - a).norm() > 0.01);
    }
}
