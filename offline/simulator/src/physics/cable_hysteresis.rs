//! `cable_hysteresis`: a cable whose force depends on the history of its deflection (Bouc-Wen).

use super::parameters::{POSITIVE, Parameter, ParameterError, Parameters};

/// `tau_c = a k D + (1 - a) k z`; `zd = Dd (1 - |z / z_m|^n (g + (1 - g) sgn(Dd z)))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CableHysteresis {
    /// Share of the force that has no memory.
    pub a: f64,
    /// Stiffness at small deflections, N·m/rad or N/m.
    pub k: f64,
    /// Largest memory, rad or m.
    pub z_m: f64,
    /// Sharpness of the knee.
    pub n: f64,
    /// Shape: 1 bends in both directions alike, 0.5 unloads straight.
    pub g: f64,
}

impl CableHysteresis {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 5] = [
        Parameter::needed("a", "1", (0.0, 1.0)),
        Parameter::needed("k", "N.m/rad|N/m", POSITIVE),
        Parameter::needed("z_m", "rad|m", POSITIVE),
        Parameter::optional("n", "1", 1.0, (1.0, 10.0)),
        Parameter::optional("g", "1", 0.5, (0.5, 1.0)),
    ];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [a, k, z_m, n, g] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { a, k, z_m, n, g })
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
        let loading = if deflection_rate * memory > 0.0 { 1.0 } else { 2.0 * self.g - 1.0 };
        deflection_rate * (1.0 - knee * loading)
    }

    /// Slope of the force along the present motion, N·m/rad or N/m.
    #[inline]
    pub fn slope(&self, deflection_rate: f64, memory: f64) -> f64 {
        let along = if deflection_rate == 0.0 { 1.0 } else { self.memory_rate(deflection_rate, memory) / deflection_rate };
        self.k * (self.a + (1.0 - self.a) * along.clamp(0.0, 2.0))
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
    fn the_stiffness_drops_with_amplitude() {
        let secant = |amplitude: f64| drive(&CABLE, &[0.0, amplitude]).last().expect("steps").1 / amplitude;
        assert!((secant(1e-6) - CABLE.k).abs() < 1.0);
        assert!(secant(5e-3) < 0.6 * CABLE.k);
    }
}
