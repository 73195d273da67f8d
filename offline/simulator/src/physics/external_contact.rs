//! `external_contact`: the tip touches something.

use nalgebra::Vector3;

use super::parameters::{ANY, POSITIVE, Parameter, ParameterError, Parameters};

/// `f = k max(0, n · x - x_0)^p`, at most `f_max`, pushing the tip back along `-n`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExternalContact {
    /// Stiffness, N/m (N/m^p).
    pub k: f64,
    /// Largest force, N.
    pub f_max: f64,
    /// Where the surface is along `n`, m, frame 0.
    pub x_0: f64,
    /// Exponent.
    pub p: f64,
    /// Unit vector into the obstacle, frame 0.
    pub n: Vector3<f64>,
}

impl ExternalContact {
    /// Names and units.
    pub const PARAMETERS: [Parameter; 4] = [
        Parameter::needed("k", "N/m", POSITIVE),
        Parameter::optional("f_max", "N", f64::INFINITY, POSITIVE),
        Parameter::needed("x_0", "m", ANY),
        Parameter::optional("p", "1", 1.0, (0.5, 3.0)),
    ];

    /// The direction into the obstacle, a vector of three.
    pub const VECTORS: [Parameter; 1] = [Parameter::needed("n", "1", ANY)];

    /// From parameters by name.
    ///
    /// # Errors
    /// [`ParameterError`] for unknown, missing and impossible values.
    pub fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        parameters.only(&Self::PARAMETERS, &Self::VECTORS)?;
        let [k, f_max, x_0, p] = &Self::PARAMETERS;
        let n = Vector3::from(parameters.vector::<3>(&Self::VECTORS[0])?);
        // A unit vector stays as it is, so that a saved file reads as itself.
        let unit = if (n.norm_squared() - 1.0).abs() < 4.0 * f64::EPSILON { Some(n) } else { n.try_normalize(1e-9) };
        let n = unit.ok_or(ParameterError::Range {
            name: "n",
            found: "zero".to_owned(),
            expected: "a direction".to_owned(),
            unit: "1",
        })?;
        Ok(Self {
            k: parameters.number(k)?,
            f_max: parameters.number(f_max)?,
            x_0: parameters.number(x_0)?,
            p: parameters.number(p)?,
            n,
        })
    }

    /// Force on the tip at a place, N, frame 0.
    #[inline]
    pub fn force(&self, tip_m: Vector3<f64>) -> Vector3<f64> {
        let depth = self.n.dot(&tip_m) - self.x_0;
        if depth <= 0.0 {
            return Vector3::zeros();
        }
        let size = self.k * if self.p == 1.0 { depth } else { depth.powf(self.p) };
        self.n * -size.min(self.f_max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_pushes_one_way_only_and_not_beyond_its_largest_force() {
        let contact = ExternalContact { k: 1000.0, f_max: 2.0, x_0: 0.1, p: 1.0, n: Vector3::x() };
        assert_eq!(contact.force(Vector3::new(0.09, 5.0, 5.0)), Vector3::zeros());
        assert!((contact.force(Vector3::new(0.101, 0.0, 0.0)) - Vector3::new(-1.0, 0.0, 0.0)).norm() < 1e-9);
        assert!((contact.force(Vector3::new(0.2, 0.0, 0.0)).x + 2.0).abs() < 1e-12);
    }
}
