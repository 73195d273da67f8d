//! Levenberg-Marquardt on dense problems of a few hundred unknowns, with differences as derivatives.
//!
//! The `levenberg-marquardt` crate is on an older nalgebra and gives no covariance; the method is the same (Marquardt's scaling by
//! the diagonal, Nielsen's update of the damping).

use nalgebra::{DMatrix, DVector};

/// Where a minimisation ended.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// Parameters.
    pub parameters: DVector<f64>,
    /// Weighted residuals there.
    pub residuals: DVector<f64>,
    /// Derivatives of the residuals there, one column per parameter.
    pub jacobian: DMatrix<f64>,
    /// The last step was negligible.
    pub converged: bool,
}

impl Minimum {
    /// Sum of squares.
    pub fn cost(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// Covariance of the parameters when the residuals have unit variance; `None` if they are not determined.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let normal = self.jacobian.tr_mul(&self.jacobian);
        // Scaled to a unit diagonal first: radians and metres differ by orders of magnitude.
        let scale = normal.diagonal().map(|value| if value > 0.0 { 1.0 / value.sqrt() } else { 0.0 });
        if scale.iter().any(|value| *value == 0.0 || !value.is_finite()) {
            return None;
        }
        let scaling = DMatrix::from_diagonal(&scale);
        let inverse = (&scaling * normal * &scaling).cholesky()?.inverse();
        Some(&scaling * inverse * &scaling)
    }
}

/// Minimises the sum of squares of `residuals`, which answers `None` where it is not defined (such steps are refused).
/// `steps` are the half widths of the differences. `None` if it is not defined at the start.
pub fn minimise(
    start: DVector<f64>,
    steps: &DVector<f64>,
    iterations: usize,
    residuals: impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
) -> Option<Minimum> {
    let mut at = start;
    let mut here = residuals(&at).filter(|r| r.iter().all(|value| value.is_finite()))?;
    let mut jacobian = differences(&at, &here, steps, &residuals);
    let (mut damping, mut growth) = (1e-4, 2.0);
    let mut converged = false;
    for _ in 0..iterations {
        let mut normal = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&here);
        let diagonal = normal.diagonal();
        let floor = diagonal.max().max(1e-300) * 1e-15;
        for k in 0..at.len() {
            normal[(k, k)] += damping * diagonal[k].max(floor);
        }
        let Some(step) = normal.cholesky().map(|factor| factor.solve(&-&gradient)) else {
            damping *= 10.0;
            if damping > 1e12 {
                break;
            }
            continue;
        };
        let next = &at + &step;
        let there = residuals(&next).filter(|r| r.iter().all(|value| value.is_finite()));
        let (before, after) = (here.norm_squared(), there.as_ref().map_or(f64::INFINITY, DVector::norm_squared));
        let small = step.iter().zip(steps.iter()).all(|(change, unit)| change.abs() < unit * 1e-2);
        if let Some(there) = there.filter(|_| after <= before) {
            let expected = -(gradient.dot(&step) + 0.5 * (&jacobian * &step).norm_squared()) * 2.0;
            let gain = if expected > 0.0 { (before - after) / expected } else { 1.0 };
            at = next;
            here = there;
            jacobian = differences(&at, &here, steps, &residuals);
            damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-12);
            growth = 2.0;
            if small || before - after <= 1e-14 * before {
                converged = true;
                break;
            }
        } else {
            if small || damping > 1e12 {
                converged = small;
                break;
            }
            damping *= growth;
            growth *= 2.0;
        }
    }
    Some(Minimum { parameters: at, residuals: here, jacobian, converged })
}

fn differences(
    at: &DVector<f64>,
    here: &DVector<f64>,
    steps: &DVector<f64>,
    residuals: &impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(here.len(), at.len());
    let mut moved = at.clone();
    for k in 0..at.len() {
        moved[k] = at[k] + steps[k];
        let above = residuals(&moved);
        moved[k] = at[k] - steps[k];
        let below = residuals(&moved);
        moved[k] = at[k];
        let column = match (above, below) {
            (Some(a), Some(b)) => (a - b) / (2.0 * steps[k]),
            (Some(a), None) => (a - here) / steps[k],
            (None, Some(b)) => (here - b) / steps[k],
            (None, None) => continue,
        };
        jacobian.set_column(k, &column);
    }
    jacobian
}
