//! `load_dependent_friction`: friction in pulleys and sheaths, which grows with the load that they carry.

use super::parameters::{NOT_NEGATIVE, Parameter, ParameterError, Parameters};

/// `tau_f = (f_0 + mu_l |load|) s(qd)`, where `load` is the torque that moves and holds the arm: inertia, velocity terms and
/// gravity, without friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadDependentFriction {
    /// Level without load, N·m or N.
    pub f_0: f64,
    /// Friction per load.
    pub mu_l: f64,
}

impl LoadDependentFriction {
    /// Names and units. `mu_theta` (coefficient times wrap angle) gives `mu_l = exp(mu_theta) - 1`, the capstan law, where
    /// `mu_l` itself is not given.
    pub const PARAMETERS: [Parameter; 3] = [
        Parameter::optional("f_0", "N.m|N", 0.0, NOT_NEGATIVE),
        Parameter::optional("mu_l", "1", f64::NAN, (0.0, 0.95)),
        Parameter::optional("mu_theta", "1", f64::NAN, (0.0, 0.66)),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [f_0, mu_l, mu_theta] = parameters.numbers(&Self::PARAMETERS)?;
        let mu_l = match (mu_l.is_nan(), mu_theta.is_nan()) {
            (false, _) => mu_l,
            (true, false) => mu_theta.exp() - 1.0,
            (true, true) => return Err(ParameterError::Missing { name: "mu_l", unit: "1" }),
        };
        Ok(Self { f_0, mu_l })
    }

    /// The load that is left of `drive` (cable torque less all other friction) once this friction is taken off:
    /// solves `drive = load + mu_l |load| sign` exactly.
    #[inline]
    pub fn load(mu_l: f64, drive: f64, sign: f64) -> f64 {
        drive / (1.0 + mu_l * sign * drive.signum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_widens_with_the_load() {
        // Torque needed to move a load up and down: the difference is twice the friction.
        let needed = |load: f64, sign: f64| load + 0.2 * load.abs() * sign;
        for load in [1.0, 4.0, -4.0] {
            for sign in [1.0, -1.0, 0.3] {
                assert!((LoadDependentFriction::load(0.2, needed(load, sign), sign) - load).abs() < 1e-12);
            }
            assert!((needed(load, 1.0) - needed(load, -1.0) - 0.4 * load.abs()).abs() < 1e-12);
        }
    }

    #[test]
    fn the_wrap_angle_gives_the_capstan_law() {
        let friction = LoadDependentFriction::new(&Parameters::of(&[("mu_theta", 0.3)])).expect("valid");
        assert!((friction.mu_l - 0.349_858_807_576_003).abs() < 1e-12);
        assert!(LoadDependentFriction::new(&Parameters::of(&[("f_0", 1.0)])).is_err());
    }
}
