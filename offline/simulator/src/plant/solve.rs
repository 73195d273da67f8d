//! Small symmetric systems, without allocation.

use super::{JOINTS_MAX, Vector, inverse};

/// In place, lower triangle; false where a pivot is not positive.
pub(super) fn cholesky<const N: usize>(matrix: &mut [[f64; N]; N], n: usize) -> bool {
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            let rest = matrix[i][j] - dot;
            if i == j {
                if rest.is_nan() || rest <= 0.0 {
                    return false;
                }
                matrix[i][i] = rest.sqrt();
            } else {
                matrix[i][j] = rest / matrix[j][j];
            }
        }
    }
    true
}

/// Solves with the lower triangle of [`cholesky`].
pub(super) fn back_substitute<const N: usize>(lower: &[[f64; N]; N], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| lower[i][k] * b[k]).sum();
        b[i] = (b[i] - dot) / lower[i][i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| lower[k][i] * b[k]).sum();
        b[i] = (b[i] - dot) / lower[i][i];
    }
}

/// Solves with a mass matrix; where it is not positive definite (identified inertias may be impossible), by elimination.
pub(super) fn solve_mass(mass: &[f64], n: usize, b: &mut Vector) {
    let mut matrix = [[0.0; JOINTS_MAX]; JOINTS_MAX];
    for i in 0..n {
        matrix[i][..n].copy_from_slice(&mass[i * n..(i + 1) * n]);
    }
    let kept = matrix;
    if cholesky(&mut matrix, n) {
        back_substitute(&matrix, n, b);
    } else if let Some(inverse) = inverse(&kept, n) {
        let given = *b;
        for i in 0..n {
            b[i] = (0..n).map(|j| inverse[i][j] * given[j]).sum();
        }
    }
}
