//! `measurement_delay`: a signal shows what was some time ago.

use super::parameters::{Parameter, ParameterError, Parameters};

/// `y(t) = x(t - d - clock_drift t)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasurementDelay {
    /// s.
    pub d: f64,
    /// s/s.
    pub clock_drift: f64,
}

/// The signal that is late.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// True tip position, as a camera gives it.
    EndEffector,
    /// True joint positions, as an encoder at the joint gives them.
    Transmission,
    /// Motor encoders: inside the control loop.
    Motor,
}

impl Channel {
    /// Names as files have them.
    pub const NAMES: [(&'static str, Self); 3] =
        [("end_effector", Self::EndEffector), ("transmission", Self::Transmission), ("motor", Self::Motor)];
}

impl MeasurementDelay {
    /// Names and units. A simulator cannot look ahead: delays only.
    pub const PARAMETERS: [Parameter; 2] =
        [Parameter::optional("d", "s", 0.0, (0.0, 1.0)), Parameter::optional("clock_drift", "s/s", 0.0, (0.0, 0.01))];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [d, clock_drift] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { d, clock_drift })
    }

    /// Age of the signal at a time since the start, s.
    #[inline]
    pub fn age_s(&self, time_s: f64) -> f64 {
        self.d + self.clock_drift * time_s
    }
}
