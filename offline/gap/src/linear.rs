//! Small dense least squares.

use nalgebra::{DMatrix, DVector};

/// Sum of the products of two series.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Coefficients of the columns whose sum comes closest to a series.
pub fn least_squares(columns: &[&[f64]], series: &[f64]) -> Vec<f64> {
    let mut gram = DMatrix::from_fn(columns.len(), columns.len(), |i, k| dot(columns[i], columns[k]));
    let mut at = DVector::from_fn(columns.len(), |i, _| dot(columns[i], series));
    solve(&mut gram, &mut at);
    at.as_slice().to_vec()
}

/// Solves a symmetric positive semidefinite system in place, columns scaled to one; directions without a signature get 0.
pub fn solve(gram: &mut DMatrix<f64>, right: &mut DVector<f64>) {
    let n = right.len();
    let scale: Vec<f64> = (0..n).map(|i| if gram[(i, i)] > 0.0 { gram[(i, i)].sqrt() } else { 1.0 }).collect();
    for i in 0..n {
        for j in 0..n {
            gram[(i, j)] /= scale[i] * scale[j];
        }
        right[i] /= scale[i];
        gram[(i, i)] = gram[(i, i)].max(1e-300) + 1e-12;
    }
    match gram.clone().cholesky() {
        Some(cholesky) => cholesky.solve_mut(right),
        None => right.fill(0.0),
    }
    for i in 0..n {
        right[i] /= scale[i];
    }
}
