//! What is known only roughly and is nobody's finding: numbers of a built-in model within a lab's belief, constants of a
//! run. Each cell has columns of them, scaled to what is believed; residuals and hypotheses are compared beside them.
//!
//! With `y = N ν + X θ + e`, ν of variance 1 and e of variance s², the rows' inverse covariance is `S = I - U D²/(D²+1) Uᵀ`
//! (over s²), where `N / s = U D Vᵀ`. Its root, applied to residual and columns alike, makes rows that count singly again.

use nalgebra::{DMatrix, DVector};

use crate::linear::dot;
use crate::series::rms;

/// Columns of one cell, each for one standard deviation of what is believed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Nuisance {
    /// Values at the cell's rows.
    pub columns: Vec<Vec<f64>>,
    /// Is a column a constant of one run, which says nothing of others?
    pub of_run: Vec<bool>,
}

/// Root of the rows' inverse covariance.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Projection {
    /// Orthonormal series.
    basis: Vec<Vec<f64>>,
    /// How much of each is taken away.
    taken: Vec<f64>,
}

impl Projection {
    /// From columns (of variance 1) and the size of the noise.
    pub fn new(columns: &[Vec<f64>], noise: f64) -> Self {
        let k = columns.len();
        if k == 0 || noise <= 0.0 {
            return Self::default();
        }
        let eigen = gram(columns).symmetric_eigen();
        let top = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
        let mut out = Self::default();
        for (i, value) in eigen.eigenvalues.iter().enumerate().filter(|(_, value)| **value > 1e-12 * top) {
            let mut series = vec![0.0; columns[0].len()];
            for (column, weight) in columns.iter().zip(eigen.eigenvectors.column(i).iter()) {
                series.iter_mut().zip(column).for_each(|(s, x)| *s += weight / value.sqrt() * x);
            }
            out.basis.push(series);
            out.taken.push(1.0 - (1.0 + value / (noise * noise)).sqrt().recip());
        }
        out
    }

    /// Applies it.
    pub fn apply(&self, series: &mut [f64]) {
        let along: Vec<f64> = self.basis.iter().map(|u| dot(u, series)).collect();
        for ((u, along), taken) in self.basis.iter().zip(along).zip(&self.taken) {
            series.iter_mut().zip(u).for_each(|(y, u)| *y -= taken * along * u);
        }
    }
}

impl Nuisance {
    /// Likeliest ν for a residual.
    pub fn estimate(&self, residual: &[f64]) -> Vec<f64> {
        let k = self.columns.len();
        let mut gram = gram(&self.columns);
        let mut right = DVector::from_fn(k, |i, _| dot(&self.columns[i], residual));
        // Twice: the noise is what is left.
        let mut noise = rms(residual.iter().copied());
        let whole = (gram.clone(), right.clone());
        for _ in 0..2 {
            (gram, right) = whole.clone();
            // Rows stand close: ten count as one.
            (0..k).for_each(|i| gram[(i, i)] += 10.0 * noise * noise);
            crate::linear::solve(&mut gram, &mut right);
            let told = self.predict(right.as_slice());
            noise = rms(residual.iter().zip(told).map(|(y, p)| y - p));
        }
        right.as_slice().to_vec()
    }

    /// What they add to the cell.
    pub fn predict(&self, nu: &[f64]) -> Vec<f64> {
        let rows = self.columns.first().map_or(0, Vec::len);
        let mut sum = vec![0.0; rows];
        for (column, nu) in self.columns.iter().zip(nu) {
            sum.iter_mut().zip(column).for_each(|(s, x)| *s += nu * x);
        }
        sum
    }

    /// A residual without them.
    #[must_use]
    pub fn without(&self, residual: &[f64]) -> Vec<f64> {
        if self.columns.is_empty() {
            return residual.to_vec();
        }
        residual.iter().zip(self.predict(&self.estimate(residual))).map(|(y, p)| y - p).collect()
    }

    pub(crate) fn push(&mut self, column: Vec<f64>, of_run: bool) {
        if column.iter().any(|x| *x != 0.0) {
            self.columns.push(column);
            self.of_run.push(of_run);
        }
    }
}

fn gram(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let k = columns.len();
    let mut gram = DMatrix::zeros(k, k);
    for a in 0..k {
        for b in 0..=a {
            gram[(a, b)] = dot(&columns[a], &columns[b]);
            gram[(b, a)] = gram[(a, b)];
        }
    }
    gram
}
