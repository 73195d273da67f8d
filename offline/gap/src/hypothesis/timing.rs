//! A channel that comes late.

use super::dictionary::Dictionary;
use super::{Bound, Candidate, Column};
use crate::nominal::sign_series;
use crate::problem::Channel;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    let problem = dictionary.problem;
    let n = dictionary.joints();
    let bound = Bound::Between(-0.1, 0.3);
    if problem.cell(Channel::EndEffector, 0).is_some() {
        // y(t) = x(t - d): -d dx/dt.
        let late = |weight: &dyn Fn(usize, usize) -> f64| {
            dictionary.tip(|r, i, row| {
                let velocity = &problem.pairs[r].real.velocity;
                [0, 1, 2].map(|axis| {
                    -weight(r, i) * (0..n).map(|j| dictionary.tip_jacobian[row][axis * n + j] * velocity[j][i]).sum::<f64>()
                })
            })
        };
        let named = |form| Candidate::new("measurement_delay", &[], form, Channel::EndEffector);
        all.push(named("constant").with(late(&|_, _| 1.0), bound));
        let drift = late(&|r, i| i as f64 * problem.pairs[r].real.run.dt_s);
        all.push(named("constant and drifting").with(late(&|_, _| 1.0), bound).with(drift, Bound::Between(-0.01, 0.01)));
    }
    if problem.cell(Channel::Transmission, 0).is_some() {
        // The joint encoders come late: A⁻¹m - q(t - d) grows by d dq/dt, on all joints alike.
        let velocities: Vec<Option<Vec<f64>>> =
            (0..n).map(|j| Some(dictionary.at_grid(|r, i, _| problem.pairs[r].real.velocity[j][i]))).collect();
        all.push(Candidate::new("measurement_delay", &[], "joint encoders", Channel::Transmission).with(dictionary.deflection(&velocities), bound));
    }
    if problem.cell(Channel::JointTorque, 0).is_some() {
        let mut column = Column::default();
        for j in 0..n {
            let coulomb = problem.nominal.drives[j][2];
            let mut slope = Vec::with_capacity(dictionary.grid.len());
            for (r, pair) in problem.pairs.iter().enumerate() {
                let sign = sign_series(&pair.real, j);
                let model: Vec<f64> =
                    problem.loads[r].iter().zip(&pair.real.rows).map(|(load, &i)| load.motor[j] + coulomb * sign[i]).collect();
                let step = pair.real.rows.get(1).map_or(1.0, |second| (second - pair.real.rows[0]) as f64) * pair.real.run.dt_s;
                for k in 0..model.len() {
                    let (low, high) = (k.saturating_sub(1), (k + 1).min(model.len() - 1));
                    slope.push(-(model[high] - model[low]) / ((high - low).max(1) as f64 * step));
                }
            }
            column.push(problem.cell(Channel::JointTorque, j), slope);
        }
        all.push(Candidate::new("measurement_delay", &[], "torque", Channel::JointTorque).with(column, bound));
    }
}
