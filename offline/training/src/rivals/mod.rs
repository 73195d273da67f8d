//! What others do, fitted on the same training trajectories: each gives the error of a row as the model does.

mod forest;
mod gaussian;
mod kalman;
mod polynomial;
mod recurrent;
mod rigid;

use crate::data::Trajectory;
use crate::prepare;
use arm::Side;
use ndarray::Array2;
use ravenpose::correction::Quantity;

pub use forest::Forest;
pub use gaussian::Gaussian;
pub use kalman::Kalman;
pub use polynomial::Polynomial;
pub use recurrent::Recurrent;
pub use rigid::RigidForest;

/// Something that learns the error from trajectories.
pub trait Rival {
    /// Learns; `outputs` labels per row.
    fn fit(&mut self, train: &[Trajectory], outputs: usize);
    /// Estimates for every row of a trajectory, row-major.
    fn estimate(&self, one: &Trajectory) -> Vec<f32>;
}

/// Features of `raven118-v1` that describe the posture: `jpos` of the seven joints.
pub(crate) const POSTURE: [usize; 7] = [56, 57, 58, 60, 61, 62, 63];

/// The rivals that a data set of an arm of a RAVEN-II, or of a table, allows, with a name and where they come from. Two know positions only.
pub fn all(arm: Option<(Side, Quantity)>, inputs: usize, seed: u64) -> Vec<(&'static str, &'static str, Box<dyn Rival>)> {
    let every: Vec<usize> = (0..inputs).collect();
    let mut rivals: Vec<(&'static str, &'static str, Box<dyn Rival>)> = Vec::new();
    if let Some((side, target)) = arm {
        rivals.push(("static map of posture", "random forest on the seven joints", Box::new(Forest::new(&POSTURE, seed))));
        rivals.push(("linear regression", "Peng 2024: all features", Box::new(Polynomial::linear(every))));
        rivals.push((
            "2nd-order polynomial",
            "Peng 2024: posture, torque, lag, speed",
            Box::new(Polynomial::second_order_of_raven()),
        ));
        if target == Quantity::Position {
            rivals.push(("rigid + random forest", "Seita 2018: two phases", Box::new(RigidForest::new(seed))));
        }
        rivals.push((
            "Gaussian process",
            "Mahler 2014: posture and speed, 600 inducing points",
            Box::new(Gaussian::of_raven(seed)),
        ));
        if target == Quantity::Position {
            rivals.push((
                "dual unscented Kalman filter",
                "Haghighipanah 2015: elastic cables, at the truth's rate",
                Box::new(Kalman::of_raven(side)),
            ));
        }
        rivals.push((
            "gated recurrent unit",
            "Cho 2014: reads what the default network sees of each state, without its memory, row by row",
            Box::new(Recurrent::new(prepare::physical(), seed)),
        ));
    } else {
        rivals.push(("linear regression", "all inputs", Box::new(Polynomial::linear(every.clone()))));
        if inputs <= 40 {
            rivals.push(("2nd-order polynomial", "all inputs", Box::new(Polynomial::second_order(every.clone()))));
        }
        rivals.push(("random forest", "all inputs", Box::new(Forest::new(&every, seed))));
        let alone = every.iter().map(|input| vec![(*input, 1.0)]).collect();
        rivals.push(("gated recurrent unit", "all inputs, row by row", Box::new(Recurrent::new(alone, seed))));
    }
    rivals
}

/// Chosen inputs of rows, standardised with the statistics of the training rows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Standard {
    columns: Vec<Vec<(usize, f64)>>,
    mean: Vec<f64>,
    sd: Vec<f64>,
}

impl Standard {
    pub(crate) fn fit(columns: Vec<Vec<(usize, f64)>>, train: &[Trajectory]) -> Self {
        let mut found = Self { mean: vec![0.0; columns.len()], sd: vec![1.0; columns.len()], columns };
        let mut sums = vec![(0.0, 0.0); found.columns.len()];
        let mut n = 0.0_f64;
        // Two passes: the mean first, so that small spreads of large numbers survive.
        for one in train {
            for row in rows(one) {
                n += 1.0;
                sums.iter_mut().zip(&found.columns).for_each(|(sum, terms)| sum.0 += value(row, terms));
            }
        }
        let n = n.max(1.0);
        found.mean = sums.iter().map(|sum| sum.0 / n).collect();
        for one in train {
            for row in rows(one) {
                for ((sum, terms), mean) in sums.iter_mut().zip(&found.columns).zip(&found.mean) {
                    sum.1 += (value(row, terms) - mean).powi(2);
                }
            }
        }
        found.sd = sums.iter().map(|sum| (sum.1 / n).sqrt()).collect();
        found
    }

    pub(crate) fn width(&self) -> usize {
        self.columns.len()
    }

    /// Rows of inputs as a matrix.
    pub(crate) fn of_all<'a>(&self, rows: impl Iterator<Item = &'a [f32]>) -> Array2<f64> {
        let (mut x, mut all) = (Vec::new(), Vec::new());
        for row in rows {
            self.of(row, &mut x);
            all.extend_from_slice(&x);
        }
        Array2::from_shape_vec((all.len() / self.width().max(1), self.width()), all).unwrap_or_default()
    }

    pub(crate) fn of(&self, row: &[f32], to: &mut Vec<f64>) {
        to.clear();
        for ((terms, mean), sd) in self.columns.iter().zip(&self.mean).zip(&self.sd) {
            to.push(if *sd > 1e-6 * mean.abs() && *sd > 0.0 { (value(row, terms) - mean) / sd } else { 0.0 });
        }
    }
}

fn value(row: &[f32], terms: &[(usize, f64)]) -> f64 {
    terms.iter().map(|(input, factor)| factor * f64::from(row[*input])).sum()
}

/// The rows of inputs of a trajectory.
pub(crate) fn rows(one: &Trajectory) -> std::slice::ChunksExact<'_, f32> {
    one.inputs.chunks_exact((one.inputs.len() / one.rows().max(1)).max(1))
}

/// Posture alone, each joint a column.
pub(crate) fn posture() -> Vec<Vec<(usize, f64)>> {
    POSTURE.iter().map(|feature| vec![(*feature, 1.0)]).collect()
}

/// Commanded minus measured motor angle of each joint: the nearest to a speed that one state has beside `mvel`.
pub(crate) fn lag() -> Vec<Vec<(usize, f64)>> {
    [0, 1, 2, 4, 5, 6, 7].iter().map(|slot| vec![(80 + slot, 1.0), (48 + slot, -1.0)]).collect()
}
