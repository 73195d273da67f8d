//! Gaussian process on posture and speed (Mahler 2014), with inducing points (subset of regressors, Quiñonero-Candela and
//! Rasmussen 2005): squared-exponential kernel on standardised inputs.

use super::{Rival, Standard, lag, posture, rows};
use crate::data::Trajectory;
use crate::random::Random;
use nalgebra::{Cholesky, DMatrix};
use ndarray::{Array2, linalg::general_mat_mul};

const INDUCING: usize = 600;
/// Rows that are learnt from at most, drawn at random.
const ROWS_MAX: usize = 60_000;
const CHUNK_ROWS: usize = 2000;
/// Candidate length scales, in standard deviations of the inputs times the root of their number.
const LENGTHS: [f64; 4] = [0.4, 0.7, 1.2, 2.0];
/// Variance of the truth's noise in units of the label's variance.
const NOISE: f64 = 0.02;
/// Share of the rows that choose the length scale.
const CHOOSING: f64 = 0.1;

/// A sparse Gaussian process.
pub struct Gaussian {
    columns: Vec<Vec<(usize, f64)>>,
    seed: u64,
    standard: Standard,
    inducing: Array2<f64>,
    length: f64,
    mean: Vec<f64>,
    weights: Array2<f64>,
}

impl Gaussian {
    /// On posture, lag and motor speed of a RAVEN-II.
    pub fn of_raven(seed: u64) -> Self {
        let speeds = [0, 1, 2, 4, 5, 6, 7].iter().map(|slot| vec![(64 + slot, 1.0)]);
        let columns = posture().into_iter().chain(lag()).chain(speeds).collect();
        let empty = Array2::zeros((0, 0));
        Self {
            columns,
            seed,
            standard: Standard::default(),
            inducing: empty.clone(),
            length: 1.0,
            mean: Vec::new(),
            weights: empty,
        }
    }

    /// Kernel between rows and inducing points.
    fn kernel(&self, x: &Array2<f64>, length: f64) -> Array2<f64> {
        let squares = |m: &Array2<f64>| m.rows().into_iter().map(|row| row.dot(&row)).collect::<Vec<f64>>();
        let (a, b) = (squares(x), squares(&self.inducing));
        let mut k = Array2::zeros((x.nrows(), self.inducing.nrows()));
        general_mat_mul(-2.0, x, &self.inducing.t(), 0.0, &mut k);
        let scale = -0.5 / (length * length * self.standard.width() as f64);
        for (mut row, a) in k.rows_mut().into_iter().zip(&a) {
            row.iter_mut().zip(&b).for_each(|(k, b)| *k = (scale * (*k + a + b).max(0.0)).exp());
        }
        k
    }

    fn solve(&self, x: &Array2<f64>, y: &Array2<f64>, length: f64) -> Option<Array2<f64>> {
        let m = self.inducing.nrows();
        let mut normal = self.kernel(&self.inducing, length) * NOISE;
        for i in 0..m {
            normal[[i, i]] += 1e-6 * x.nrows() as f64 / m as f64;
        }
        let mut right = Array2::zeros((m, y.ncols()));
        for start in (0..x.nrows()).step_by(CHUNK_ROWS) {
            let rows = ndarray::s![start..(start + CHUNK_ROWS).min(x.nrows()), ..];
            let k = self.kernel(&x.slice(rows).to_owned(), length);
            general_mat_mul(1.0, &k.t(), &k, 1.0, &mut normal);
            general_mat_mul(1.0, &k.t(), &y.slice(rows), 1.0, &mut right);
        }
        let found = Cholesky::new(DMatrix::from_fn(m, m, |r, c| normal[[r, c]]))?;
        let solved = found.solve(&DMatrix::from_fn(m, y.ncols(), |r, c| right[[r, c]]));
        Some(Array2::from_shape_fn((m, y.ncols()), |(r, c)| solved[(r, c)]))
    }
}

impl Rival for Gaussian {
    fn fit(&mut self, train: &[Trajectory], outputs: usize) {
        self.standard = Standard::fit(self.columns.clone(), train);
        let mut pairs: Vec<(&[f32], &[f32])> =
            train.iter().flat_map(|one| rows(one).zip(one.labels.chunks_exact(outputs.max(1)))).collect();
        Random::new(self.seed, 32).shuffle(&mut pairs);
        pairs.truncate(ROWS_MAX);
        let n = pairs.len().max(1) as f64;
        self.mean = (0..outputs).map(|axis| pairs.iter().map(|(_, y)| f64::from(y[axis])).sum::<f64>() / n).collect();
        let x = self.standard.of_all(pairs.iter().map(|(row, _)| *row));
        let y = Array2::from_shape_fn((pairs.len(), outputs), |(r, c)| f64::from(pairs[r].1[c]) - self.mean[c]);
        self.inducing = x.slice(ndarray::s![..INDUCING.min(x.nrows()), ..]).to_owned();
        let cut = (x.nrows() as f64 * CHOOSING) as usize;
        let (chosen_x, chosen_y) = (x.slice(ndarray::s![..cut, ..]).to_owned(), y.slice(ndarray::s![..cut, ..]));
        let (rest_x, rest_y) = (x.slice(ndarray::s![cut.., ..]).to_owned(), y.slice(ndarray::s![cut.., ..]).to_owned());
        let mut best = f64::INFINITY;
        for length in LENGTHS {
            let Some(weights) = self.solve(&rest_x, &rest_y, length) else { continue };
            let rest = self.kernel(&chosen_x, length).dot(&weights) - chosen_y;
            let squares = rest.iter().map(|rest| rest * rest).sum::<f64>();
            if squares < best {
                (best, self.length, self.weights) = (squares, length, weights);
            }
        }
    }

    fn estimate(&self, one: &Trajectory) -> Vec<f32> {
        let all: Vec<&[f32]> = rows(one).collect();
        let mut out = Vec::new();
        for rows in all.chunks(CHUNK_ROWS) {
            let y = self.kernel(&self.standard.of_all(rows.iter().copied()), self.length).dot(&self.weights);
            out.extend(
                y.rows()
                    .into_iter()
                    .flat_map(|row| row.iter().zip(&self.mean).map(|(y, mean)| (y + mean) as f32).collect::<Vec<_>>()),
            );
        }
        out
    }
}
