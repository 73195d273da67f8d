//! `cable_hysteresis`: a cable whose force depends on the history of its deflection (Bouc-Wen).
//!
//! Cables have `z_m > 0` and `g` from 0.5 to 1. The equation also describes elements that harden: there the knee grows the
//! other way, `zd = Dd (1 + |z / z_m|^n (g + (1 - g) sgn(Dd z)))`, which a negative `z_m` stands for
//! ([`CableHysteresis::of_bouc_wen`]).

use super::parameters::{ANY, POSITIVE, Parameter, ParameterError, Parameters};

/// `tau_c = a k D + (1 - a) k z`; `zd = Dd (1 - |z / z_m|^n (g + (1 - g) sgn(Dd z)))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CableHysteresis {
    /// Share of the force that has no memory.
    pub a: f64,
    /// Stiffness at small deflections, N·m/rad or N/m.
    pub k: f64,
    /// Largest memory, rad or m. Negative: the element hardens with its memory instead of giving way (see the module).
    pub z_m: f64,
    /// Sharpness of the knee.
    pub n: f64,
    /// Shape: 1 bends in both directions alike, 0.5 unloads straight; cables lie between, other elements anywhere.
    pub g: f64,
}

impl CableHysteresis {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 5] = [
        Parameter::needed("a", "1", (0.0, 1.0)),
        Parameter::needed("k", "N.m/rad|N/m", POSITIVE),
        Parameter::needed("z_m", "rad|m", ANY),
        Parameter::optional("n", "1", 1.0, (1.0, 10.0)),
        Parameter::optional("g", "1", 0.5, ANY),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [a, k, z_m, n, g] = parameters.numbers(&Self::PARAMETERS)?;
        if z_m == 0.0 {
            let (found, expected) = ("0".to_owned(), "one number other than 0".to_owned());
            return Err(ParameterError::Range { name: "z_m", found, expected, unit: "rad|m" });
        }
        Ok(Self { a, k, z_m, n, g })
    }

    /// From the form in which the literature has it (Noël, Schoukens 2016): a spring `k y` beside
    /// `z' = alpha y' - beta (gamma |y'| |z|^(nu-1) z + delta y' |z|^nu)`, forces in N·m or N. Both are the same element:
    /// `a = k / (k + alpha)`, stiffness `k + alpha`, `g = delta / (gamma + delta)`, `n = nu`,
    /// `z_m = sgn(gamma + delta) (beta |gamma + delta| alpha^(nu-1))^(-1/nu)`.
    /// With `gamma + delta = 0` there is no such form.
    pub fn of_bouc_wen(k: f64, alpha: f64, beta: f64, gamma: f64, delta: f64, nu: f64) -> Self {
        let both = gamma + delta;
        let z_m = both.signum() * (beta * both.abs() * alpha.powf(nu - 1.0)).powf(-1.0 / nu);
        Self { a: k / (k + alpha), k: k + alpha, z_m, n: nu, g: delta / both }
    }

    /// Force of the cable at a deflection and memory, N·m or N.
    #[inline]
    pub fn force(&self, deflection: f64, memory: f64) -> f64 {
        self.k * (self.a * deflection + (1.0 - self.a) * memory)
    }

    /// Rate of the memory.
    #[inline]
    pub fn memory_rate(&self, deflection_rate: f64, memory: f64) -> f64 {
        let ratio = (memory / self.z_m).abs();
        let knee = if self.n == 1.0 { ratio } else { ratio.powf(self.n) };
        let knee = if self.z_m < 0.0 { -knee } else { knee };
        let loading = if deflection_rate * memory > 0.0 { 1.0 } else { 2.0 * self.g - 1.0 };
        deflection_rate * (1.0 - knee * loading)
    }

    /// Slope of the force along the present motion, N·m/rad or N/m.
    #[inline]
    pub fn slope(&self, deflection_rate: f64, memory: f64) -> f64 {
        let along = if deflection_rate == 0.0 { 1.0 } else { self.memory_rate(deflection_rate, memory) / deflection_rate };
        self.k * (self.a + (1.0 - self.a) * along.clamp(0.0, 20.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drives the deflection along a path in small steps and returns (deflection, force) of every step.
    fn drive(cable: &CableHysteresis, path: &[f64]) -> Vec<(f64, f64)> {
        let mut memory = 0.0;
        let mut trace = Vec::new();
        for pair in path.windows(2) {
            for step in 0..2000 {
                let rate = (pair[1] - pair[0]) / 2000.0;
                memory += cable.memory_rate(rate, memory);
                trace.push((pair[0] + rate * f64::from(step + 1), cable.force(pair[0] + rate * f64::from(step + 1), memory)));
            }
        }
        trace
    }

    fn area(loop_: &[(f64, f64)]) -> f64 {
        loop_.windows(2).map(|pair| (pair[1].0 - pair[0].0) * (pair[1].1 + pair[0].1) / 2.0).sum()
    }

    const CABLE: CableHysteresis = CableHysteresis { a: 0.4, k: 1000.0, z_m: 1e-3, n: 1.0, g: 0.6 };

    #[test]
    fn minor_loops_lie_inside_the_major_one_and_every_loop_takes_energy() {
        let trace = drive(&CABLE, &[0.0, 4e-3, -4e-3, 4e-3, -4e-3, 4e-3]);
        let major = area(&trace[6000..10000]);
        let trace = drive(&CABLE, &[0.0, 4e-3, -4e-3, 0.0, 1e-3, 0.0, 1e-3, 0.0]);
        let minor = area(&trace[10000..14000]);
        assert!(major > 0.0 && minor > 0.0 && minor < 0.3 * major, "major {major}, minor {minor}");
    }

    #[test]
    fn the_loop_does_not_depend_on_the_rate() {
        let slow = drive(&CABLE, &[0.0, 3e-3, -3e-3, 3e-3]);
        let mut memory = 0.0;
        let mut last = 0.0;
        for pair in [0.0, 3e-3, -3e-3, 3e-3].windows(2) {
            for step in 0..20_000 {
                let rate = (pair[1] - pair[0]) / 20_000.0;
                memory += CABLE.memory_rate(rate, memory);
                last = CABLE.force(pair[0] + rate * f64::from(step + 1), memory);
            }
        }
        assert!((slow.last().expect("steps").1 - last).abs() < 2e-3);
    }

    #[test]
    fn the_form_of_the_literature_is_the_same_element() {
        for (gamma, delta, nu) in [(0.8, -1.1, 1.0), (0.8, 0.4, 1.0), (0.7, -0.2, 1.6), (0.5, -0.9, 2.0)] {
            let (k, alpha, beta) = (5e4, 4e4, 1e3);
            let cable = CableHysteresis::of_bouc_wen(k, alpha, beta, gamma, delta, nu);
            let (mut memory, mut z, mut y) = (0.0_f64, 0.0_f64, 0.0);
            for step in 0..20_000 {
                let rate = 1e-7 * (f64::from(step) * 2e-3).cos();
                memory += cable.memory_rate(rate, memory);
                z += alpha * rate - beta * (gamma * rate.abs() * z.abs().powf(nu - 1.0) * z + delta * rate * z.abs().powf(nu));
                y += rate;
                let (ours, theirs) = (cable.force(y, memory), k * y + z);
                assert!((ours - theirs).abs() < 1e-6 * theirs.abs().max(1e-3), "{gamma} {delta} {nu}: {ours} {theirs}");
            }
        }
    }

    #[test]
    fn the_stiffness_drops_with_amplitude() {
        let secant = |amplitude: f64| drive(&CABLE, &[0.0, amplitude]).last().expect("steps").1 / amplitude;
        assert!((secant(1e-6) - CABLE.k).abs() < 1.0);
        assert!(secant(5e-3) < 0.6 * CABLE.k);
    }
}
