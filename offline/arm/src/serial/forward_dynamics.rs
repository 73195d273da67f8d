//! Accelerations of given torques: mass matrix, its LDLᵀ factor, two substitutions.
//!
//! Counted by hand this is less work for three joints than the articulated-body algorithm, whose 6×6 inertias are dearer to
//! shift than M is to factor, and M comes along for implicit integration. For long arms the count turns round.

use super::{SerialArm, Workspace};

/// The mass matrix has no inverse: some motion moves no inertia at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("joint {}: nothing with inertia moves with it alone; give the links behind it mass or inertia", .joint + 1)]
pub struct SingularMassMatrix {
    /// Index of the first joint, from the tip, that adds no inertia of its own.
    pub joint: usize,
}

impl SerialArm {
    /// Accelerations under torques `tau`: solves `M·qdd = tau - C·qd - g`.
    ///
    /// # Errors
    /// [`SingularMassMatrix`] if M is not positive definite, or not a number.
    ///
    /// # Panics
    /// If a vector is not N long or the workspace is another arm's.
    pub fn forward_dynamics(
        &self,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd_out: &mut [f64],
    ) -> Result<(), SingularMassMatrix> {
        self.check_sizes(ws, &[tau.len(), qdd_out.len()]);
        // Both are taken out for the call and put back; nothing is allocated.
        let mut m = std::mem::take(&mut ws.matrix);
        let mut bias = std::mem::take(&mut ws.vector);
        self.mass_matrix_and_bias(ws, q, qd, &mut m, &mut bias);
        for ((out, tau), bias) in qdd_out.iter_mut().zip(tau).zip(&bias) {
            *out = tau - bias;
        }
        let solved = solve(&mut m, qdd_out);
        ws.matrix = m;
        ws.vector = bias;
        solved
    }
}

/// What elimination leaves of a diagonal entry below this share is its rounding: the joint adds no inertia of its own.
const ROUNDING: f64 = 1e-13;

/// Solves `m·x = rhs` in place for a symmetric positive definite `m`; from the last row upward, so that a chain's tip is
/// eliminated first (`m = LᵀDL`, Featherstone 2008, section 6.5).
fn solve(m: &mut [f64], rhs: &mut [f64]) -> Result<(), SingularMassMatrix> {
    let n = rhs.len();
    for k in (0..n).rev() {
        let pivot = m[k * n + k];
        if pivot.is_nan() || pivot <= 0.0 {
            return Err(SingularMassMatrix { joint: k });
        }
        for i in (0..k).rev() {
            let factor = m[k * n + i] / pivot;
            for j in 0..i {
                m[i * n + j] -= factor * m[k * n + j];
            }
            let diagonal = m[i * n + i];
            let left = diagonal - factor * m[k * n + i];
            // NaN goes to 0, too, and is refused as that.
            m[i * n + i] = if left > ROUNDING * diagonal { left } else { 0.0 };
            rhs[i] -= factor * rhs[k];
            m[k * n + i] = factor;
        }
        rhs[k] /= pivot;
    }
    for k in 0..n {
        for i in 0..k {
            rhs[k] -= m[k * n + i] * rhs[i];
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_positive_definite_system_is_solved_and_another_one_refused() {
        let m = [4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0];
        let x = [1.0, -2.0, 3.0];
        let mut rhs = [0, 1, 2].map(|i: usize| (0..3).map(|j| m[i * 3 + j] * x[j]).sum::<f64>());
        solve(&mut m.clone(), &mut rhs).expect("positive definite");
        assert!(rhs.iter().zip(x).all(|(found, x)| (found - x).abs() < 1e-14), "{rhs:?}");
        assert_eq!(solve(&mut [1.0, 0.0, 0.0, 0.0], &mut [1.0, 1.0]), Err(SingularMassMatrix { joint: 1 }));
        assert_eq!(solve(&mut [1.0, 2.0, 2.0, 1.0], &mut [1.0, 1.0]), Err(SingularMassMatrix { joint: 0 }));
        // A remainder of rounding is no inertia.
        let alike = [0.3 * (1.0 + 1e-15), 0.3, 0.3, 0.3];
        assert_eq!(solve(&mut alike.clone(), &mut [1.0, 1.0]), Err(SingularMassMatrix { joint: 0 }));
        assert_eq!(solve(&mut [f64::NAN], &mut [1.0]), Err(SingularMassMatrix { joint: 0 }));
    }
}
