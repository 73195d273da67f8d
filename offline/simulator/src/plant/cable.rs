//! Cable laws: stretch to force.

/// The two sides of one cable loop, as one force between capstan and joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CableLaw {
    /// `gamma = ke (exp(s) - exp(-s)) + 2 be s'`, `s` in metres (raven2-plant.md, section 7): practically a linear spring, and
    /// never slack.
    Exponential {
        /// N.
        ke_n: f64,
        /// N·s/m.
        be_ns_m: f64,
    },
    /// A straight line.
    Linear {
        /// N/m.
        k_n_m: f64,
        /// N·s/m.
        d_ns_m: f64,
    },
    /// Two cables, each `F(x) = k l (exp(x / l) - 1)` where it is taut and 0 where it is slack, both stretched beforehand until
    /// they carry the pretension. The stiffness rises with the load; beyond the pretension one side hangs through and half
    /// the stiffness is gone.
    Pretensioned {
        /// Stiffness of one side at no tension, N/m.
        k_n_m: f64,
        /// Stretch over which it stiffens by e, m.
        length_m: f64,
        /// Stretch of either side at rest, m.
        prestretch_m: f64,
        /// Damping of a taut side, N·s/m.
        be_ns_m: f64,
    },
}

/// A cable loop at one stretch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CableForce {
    /// Elastic force between the sides, N.
    pub force_n: f64,
    /// Slope of the force, N/m.
    pub stiffness_n_m: f64,
    /// Damping, N·s/m.
    pub damping_ns_m: f64,
}

impl CableLaw {
    /// A pretensioned pair that carries `pretension_n` on either side at rest.
    pub fn pretensioned(k_n_m: f64, length_m: f64, pretension_n: f64, be_ns_m: f64) -> Self {
        let prestretch_m = length_m * (pretension_n / (k_n_m * length_m)).ln_1p();
        Self::Pretensioned { k_n_m, length_m, prestretch_m, be_ns_m }
    }

    /// Force, stiffness and damping at a stretch, m.
    #[inline]
    pub fn at(&self, stretch_m: f64) -> CableForce {
        match *self {
            Self::Exponential { ke_n, be_ns_m } => {
                // exp(s) - exp(-s) and its slope, to the last bit at the millimetres that occur, without two exponentials.
                let square = stretch_m * stretch_m;
                let (sinh, cosh) = if square < 1e-4 {
                    (stretch_m * (1.0 + square / 6.0 * (1.0 + square / 20.0)), 1.0 + square / 2.0 * (1.0 + square / 12.0))
                } else {
                    (stretch_m.sinh(), stretch_m.cosh())
                };
                CableForce { force_n: 2.0 * ke_n * sinh, stiffness_n_m: 2.0 * ke_n * cosh, damping_ns_m: 2.0 * be_ns_m }
            }
            Self::Linear { k_n_m, d_ns_m } => CableForce { force_n: k_n_m * stretch_m, stiffness_n_m: k_n_m, damping_ns_m: d_ns_m },
            Self::Pretensioned { k_n_m, length_m, prestretch_m, be_ns_m } => {
                let side = |stretch: f64| {
                    if stretch <= 0.0 {
                        return (0.0, 0.0, 0.0);
                    }
                    let rise = (stretch / length_m).exp();
                    // Damping takes hold over the first tenth of a millimetre: a cable that tightens does not knock.
                    (k_n_m * length_m * (rise - 1.0), k_n_m * rise, be_ns_m * (stretch / 1e-4).min(1.0))
                };
                let (pull, push) = (side(prestretch_m + stretch_m), side(prestretch_m - stretch_m));
                CableForce { force_n: pull.0 - push.0, stiffness_n_m: pull.1 + push.1, damping_ns_m: pull.2 + push.2 }
            }
        }
    }

    /// Tensions of the two sides at a stretch, N; none for a law that does not tell them apart.
    pub fn tensions_n(&self, stretch_m: f64) -> Option<[f64; 2]> {
        match *self {
            Self::Exponential { .. } | Self::Linear { .. } => None,
            Self::Pretensioned { k_n_m, length_m, prestretch_m, .. } => {
                let side = |stretch: f64| k_n_m * length_m * (stretch.max(0.0) / length_m).exp_m1();
                Some([side(prestretch_m + stretch_m), side(prestretch_m - stretch_m)])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nominal_law_is_the_exponential_of_the_specification() {
        let law = CableLaw::Exponential { ke_n: 720e3, be_ns_m: 4000.0 };
        for s in [0.0, 1e-6, 1e-3, -4e-3, 0.0099, 0.0101, 0.3, -0.3_f64] {
            let force = 720e3 * (s.exp() - (-s).exp());
            assert!((law.at(s).force_n - force).abs() <= 1e-9 * force.abs() + 1e-9, "{s}");
            let ahead = (law.at(s + 1e-7).force_n - law.at(s - 1e-7).force_n) / 2e-7;
            assert!((law.at(s).stiffness_n_m / ahead - 1.0).abs() < 1e-6, "{s}");
        }
    }

    #[test]
    fn at_rest_both_sides_carry_the_pretension_and_beyond_it_one_hangs_through() {
        let law = CableLaw::pretensioned(50e3, 2e-3, 20.0, 100.0);
        let [a, b] = law.tensions_n(0.0).expect("two sides");
        assert!((a - 20.0).abs() < 1e-9 && (b - 20.0).abs() < 1e-9);
        let [taut, slack] = law.tensions_n(1e-3).expect("two sides");
        assert!(slack == 0.0 && taut > 50.0);
        assert!((law.at(1e-3).force_n - taut).abs() < 1e-9);
        assert!(law.at(1e-3).damping_ns_m < 1.01 * law.at(0.0).damping_ns_m / 2.0 + 100.0);
    }

    #[test]
    fn the_force_stiffens_with_the_stretch_and_is_odd() {
        let law = CableLaw::pretensioned(50e3, 2e-3, 20.0, 100.0);
        assert!(law.at(2e-3).stiffness_n_m > 1.5 * law.at(0.5e-3).stiffness_n_m);
        assert_eq!(law.at(1e-3).force_n, -law.at(-1e-3).force_n);
    }
}
