//! `backlash`: play between motor and joint. The joint rests on one flank and crosses when its load changes sign.

use super::parameters::{NOT_NEGATIVE, Parameter, ParameterError, Parameters};

/// `q = play(A^-1 m; b)`: a dead band of full width `b` in the deflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backlash {
    /// Full width, rad or m.
    pub b: f64,
}

impl Backlash {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 1] = [Parameter::needed("b", "rad|m", NOT_NEGATIVE)];

    /// Depth of the flank over which the damping takes hold, as a share of the width: contact starts softly.
    const SOFT_SHARE: f64 = 0.02;

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let [b] = parameters.numbers(&Self::PARAMETERS)?;
        Ok(Self { b })
    }

    /// Deflection that the spring feels: what of `deflection` lies beyond the dead band.
    #[inline]
    pub fn elastic(&self, deflection: f64) -> f64 {
        let half = self.b / 2.0;
        deflection - deflection.clamp(-half, half)
    }

    /// How firmly the flanks touch, 0 in the dead band, 1 when pressed: share of the damping that acts.
    #[inline]
    pub fn contact(&self, elastic: f64) -> f64 {
        (elastic.abs() / (Self::SOFT_SHARE * self.b).max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// The play operator: where an unloaded joint is, given where it was and where the motor would put it.
    #[inline]
    pub fn play(&self, joint: f64, motor: f64) -> f64 {
        let half = self.b / 2.0;
        joint.clamp(motor - half, motor + half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_is_flat_topped_and_its_width_does_not_grow_with_amplitude() {
        let backlash = Backlash { b: 0.2 };
        for amplitude in [0.5, 2.0] {
            let mut joint = 0.0;
            let mut widths = Vec::new();
            let mut flat = 0;
            let (mut up, mut down) = (Vec::new(), Vec::new());
            for step in 0..4000 {
                let motor = amplitude * (f64::from(step) * 0.01).sin();
                let next = backlash.play(joint, motor);
                flat += u32::from(next == joint);
                joint = next;
                if step > 1000 && motor.abs() < 0.01 * amplitude {
                    if (f64::from(step) * 0.01).cos() > 0.0 { up.push(motor - joint) } else { down.push(motor - joint) }
                }
            }
            widths.push(up.iter().sum::<f64>() / up.len() as f64 - down.iter().sum::<f64>() / down.len() as f64);
            assert!((widths[0] - 0.2).abs() < 1e-9, "{widths:?}");
            assert!(flat > 100, "the joint stands while the motor crosses the dead band");
        }
    }

    #[test]
    fn inside_the_dead_band_nothing_pushes() {
        let backlash = Backlash { b: 0.2 };
        assert_eq!(backlash.elastic(0.09), 0.0);
        assert_eq!(backlash.contact(0.0), 0.0);
        assert!((backlash.elastic(-0.15) + 0.05).abs() < 1e-15);
        assert_eq!(backlash.contact(0.05), 1.0);
    }
}
