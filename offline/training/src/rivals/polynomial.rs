//! Ridge regression on inputs and, if wanted, all their products (Peng 2024).

use super::{Rival, Standard, lag, posture, rows};
use crate::data::Trajectory;
use nalgebra::{DMatrix, DVector};
use ndarray::{Array2, linalg::general_mat_mul};

/// Share of the mean diagonal that keeps the normal equations solvable where inputs repeat each other.
const RIDGE: f64 = 1e-7;
/// Rows that enter the normal equations at a time.
const CHUNK_ROWS: usize = 2048;

/// A polynomial of first or second order.
pub struct Polynomial {
    columns: Vec<Vec<(usize, f64)>>,
    second: bool,
    standard: Standard,
    /// Terms x outputs.
    weights: DMatrix<f64>,
}

impl Polynomial {
    /// A sum of inputs.
    pub fn linear(inputs: Vec<usize>) -> Self {
        Self::new(inputs.into_iter().map(|input| vec![(input, 1.0)]).collect(), false)
    }

    /// With all products of two inputs.
    pub fn second_order(inputs: Vec<usize>) -> Self {
        Self::new(inputs.into_iter().map(|input| vec![(input, 1.0)]).collect(), true)
    }

    /// Products of posture, lag, torque and motor speed of a RAVEN-II.
    pub fn second_order_of_raven() -> Self {
        let field = |start: usize| [0, 1, 2, 4, 5, 6, 7].iter().map(move |slot| vec![(start + slot, 1.0)]);
        let columns = posture().into_iter().chain(lag()).chain(field(40)).chain(field(64)).collect();
        Self::new(columns, true)
    }

    fn new(columns: Vec<Vec<(usize, f64)>>, second: bool) -> Self {
        Self { columns, second, standard: Standard::default(), weights: DMatrix::zeros(0, 0) }
    }

    fn terms(&self, row: &[f32], x: &mut Vec<f64>, to: &mut Vec<f64>) {
        self.standard.of(row, x);
        to.clear();
        to.push(1.0);
        to.extend_from_slice(x);
        if self.second {
            for (i, a) in x.iter().enumerate() {
                to.extend(x[i..].iter().map(|b| a * b));
            }
        }
    }

    fn count(&self) -> usize {
        let n = self.standard.width();
        1 + n + if self.second { n * (n + 1) / 2 } else { 0 }
    }
}

impl Rival for Polynomial {
    fn fit(&mut self, train: &[Trajectory], outputs: usize) {
        self.standard = Standard::fit(self.columns.clone(), train);
        let count = self.count();
        let mut normal = Array2::<f64>::zeros((count, count));
        let mut right = Array2::<f64>::zeros((count, outputs));
        let (mut x, mut terms) = (Vec::new(), Vec::new());
        for one in train {
            let inputs: Vec<&[f32]> = rows(one).collect();
            let labels: Vec<&[f32]> = one.labels.chunks_exact(outputs.max(1)).collect();
            for (inputs, labels) in inputs.chunks(CHUNK_ROWS).zip(labels.chunks(CHUNK_ROWS)) {
                let mut a = Array2::zeros((inputs.len(), count));
                let mut b = Array2::zeros((inputs.len(), outputs));
                for (r, (input, label)) in inputs.iter().zip(labels).enumerate() {
                    self.terms(input, &mut x, &mut terms);
                    a.row_mut(r).iter_mut().zip(&terms).for_each(|(to, from)| *to = *from);
                    b.row_mut(r).iter_mut().zip(*label).for_each(|(to, from)| *to = f64::from(*from));
                }
                general_mat_mul(1.0, &a.t(), &a, 1.0, &mut normal);
                general_mat_mul(1.0, &a.t(), &b, 1.0, &mut right);
            }
        }
        let ridge = RIDGE * normal.diag().sum() / count as f64;
        let matrix = DMatrix::from_fn(count, count, |r, c| normal[[r, c]] + if r == c { ridge } else { 0.0 });
        let right = DMatrix::from_fn(count, outputs, |r, c| right[[r, c]]);
        self.weights = matrix.cholesky().map_or_else(|| DMatrix::zeros(count, outputs), |found| found.solve(&right));
    }

    fn estimate(&self, one: &Trajectory) -> Vec<f32> {
        let (mut x, mut terms) = (Vec::new(), Vec::new());
        rows(one)
            .flat_map(|row| {
                self.terms(row, &mut x, &mut terms);
                let estimate = self.weights.tr_mul(&DVector::from_column_slice(&terms));
                estimate.iter().map(|value| *value as f32).collect::<Vec<_>>()
            })
            .collect()
    }
}
