//! `stribeck_friction`: more friction at small speeds than at large ones.

use super::parameters::{NOT_NEGATIVE, POSITIVE, Parameter, ParameterError, Parameters};

/// `tau_f = (f_c + (f_s - f_c) exp(-|qd / v_s|^a)) s(qd)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StribeckFriction {
    /// Level at large speed, N·m or N.
    pub f_c: f64,
    /// Level at small speed, N·m or N.
    pub f_s: f64,
    /// Speed over which it falls, rad/s or m/s.
    pub v_s: f64,
    /// Shape of the fall.
    pub a: f64,
}

impl StribeckFriction {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 4] = [
        Parameter::needed("f_c", "N.m|N", NOT_NEGATIVE),
        Parameter::needed("f_s", "N.m|N", NOT_NEGATIVE),
        Parameter::needed("v_s", "rad/s|m/s", POSITIVE),
        Parameter::optional("a", "1", 2.0, (0.1, 10.0)),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [f_c, f_s, v_s, a] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { f_c, f_s, v_s, a })
    }

    /// Size of the friction at a speed, N·m or N.
    #[inline]
    pub fn level(&self, speed: f64) -> f64 {
        self.f_c + (self.f_s - self.f_c) * (-(speed / self.v_s).abs().powf(self.a)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_falls_with_speed_between_its_two_levels() {
        let friction = StribeckFriction { f_c: 1.0, f_s: 2.0, v_s: 0.01, a: 1.0 };
        assert_eq!(friction.level(0.0), 2.0);
        assert!((friction.level(1.0) - 1.0).abs() < 1e-12);
        assert!((friction.level(0.01) - (1.0 + (-1.0_f64).exp())).abs() < 1e-12);
        let levels: Vec<f64> = (0..50).map(|i| friction.level(f64::from(i) * 0.001)).collect();
        assert!(levels.windows(2).all(|pair| pair[1] < pair[0]), "a falling slope, which is what makes stick and slip");
    }
}
