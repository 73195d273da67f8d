//! `cable_stretch`: a compliance in series with the cable that the simulator knows.

use super::parameters::{NOT_NEGATIVE, POSITIVE, Parameter, ParameterError, Parameters};

/// `1/k_total = 1/k_known + 1/k`, with damping and optional stiffening of the missing spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CableStretch {
    /// Stiffness of the missing spring, joint side, N·m/rad or N/m.
    pub k: f64,
    /// Damping of the missing spring, N·m·s/rad or N·s/m.
    pub d: f64,
    /// Stiffening per metre of cable stretch, 1/m: the stiffness is `k cosh(stiffening stretch)`.
    pub stiffening: f64,
}

impl CableStretch {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 3] = [
        Parameter::needed("k", "N.m/rad|N/m", POSITIVE),
        Parameter::optional("d", "N.m.s/rad|N.s/m", 0.0, NOT_NEGATIVE),
        Parameter::optional("stiffening", "1/m", 0.0, NOT_NEGATIVE),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [k, d, stiffening] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { k, d, stiffening })
    }

    /// Share of the whole deflection that falls on the known cable of stiffness `known`; `stretch_m` is that of the cable.
    #[inline]
    pub fn share(&self, known: f64, stretch_m: f64) -> f64 {
        let k = if self.stiffening == 0.0 { self.k } else { self.k * (self.stiffening * stretch_m).cosh() };
        k / (known + k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deflection_follows_the_load_in_phase_and_adds_the_compliances() {
        let stretch = CableStretch { k: 300.0, d: 0.0, stiffening: 0.0 };
        let known = 600.0;
        for load in [-2.0, 0.5, 2.0] {
            let deflection = load * (1.0 / known + 1.0 / 300.0);
            assert!((known * stretch.share(known, 0.0) * deflection - load).abs() < 1e-12);
        }
    }

    #[test]
    fn a_stiffening_spring_takes_less_of_a_large_stretch() {
        let stretch = CableStretch { k: 300.0, d: 0.0, stiffening: 400.0 };
        assert!(stretch.share(600.0, 0.005) > stretch.share(600.0, 0.0));
        assert_eq!(stretch.share(600.0, 0.005), stretch.share(600.0, -0.005));
    }
}
