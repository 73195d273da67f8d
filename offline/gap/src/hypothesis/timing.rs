//! A channel that comes late.

use super::dictionary::Dictionary;
use super::{Bound, Column, Family};
use crate::nominal::sign_series;
use crate::problem::Channel;

/// Least delay of a torque, late or early, s: it is given once a millisecond, and what is less than half of that is how two motions are looked at.
const LEAST_LATE_S: f64 = 5e-4;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    let problem = dictionary.problem;
    let bound = Bound::Between(-0.15, 0.4);
    if problem.cell(Channel::EndEffector, 0).is_some() {
        all.push(Family::fixed("measurement_delay", &[], "tip", Channel::EndEffector, &[bound], |d| vec![late_tip(d, |_, _| 1.0)]));
        all.push(
            Family::fixed(
                "measurement_delay",
                &[],
                "tip, drifting",
                Channel::EndEffector,
                &[bound, Bound::Between(-0.01, 0.01)],
                |d| vec![late_tip(d, |_, _| 1.0), late_tip(d, |r, i| d.problem.pairs[r].real.run.elapsed_s(i))],
            )
            .penalised(2.0),
        );
    }
    if problem.cell(Channel::Transmission, 0).is_some() {
        // The joint encoders come late: A⁻¹m - q(t - d) grows by d dq/dt, on all joints alike.
        all.push(Family::fixed("measurement_delay", &[], "joint encoders", Channel::Transmission, &[bound], |d| {
            let velocity = |j: usize| d.at_grid(|r, i, _| d.problem.pairs[r].real.velocity[j][i]);
            let velocities: Vec<Option<Vec<f64>>> = (0..d.joints()).map(|j| Some(velocity(j))).collect();
            vec![d.deflection(&velocities)]
        }));
    }
    if problem.cell(Channel::JointTorque, 0).is_some() {
        // Late is all of it. What only the sign of dry friction says is how that turns, slowly or after a moment's sticking.
        let family = Family::fixed("measurement_delay", &[], "torque", Channel::JointTorque, &[bound], |d| {
            vec![late_torque(d, |load, dry| load + dry)]
        });
        all.push(family.borne_out(LEAST_LATE_S, |d| vec![late_torque(d, |load, _| load), late_torque(d, |_, dry| dry)]));
    }
}

/// `y(t) = x(t - d)`: `-d dx/dt` of the tip, weighted.
fn late_tip(dictionary: &Dictionary, weight: impl Fn(usize, usize) -> f64) -> Column {
    let n = dictionary.joints();
    dictionary.tip(|r, i, row| {
        let velocity = &dictionary.problem.pairs[r].real.velocity;
        let along = |axis: usize| (0..n).map(|j| dictionary.tip_jacobian[row][axis * n + j] * velocity[j][i]).sum::<f64>();
        [0, 1, 2].map(|axis| -weight(r, i) * along(axis))
    })
}

/// `-d dτ/dt` of what the model asks of the motors, made up of their load and their dry friction.
fn late_torque(dictionary: &Dictionary, of: impl Fn(f64, f64) -> f64) -> Column {
    let problem = dictionary.problem;
    let mut column = Column::default();
    for j in 0..dictionary.joints() {
        let coulomb = problem.nominal.drives[j][2];
        let mut slope = Vec::with_capacity(dictionary.grid.len());
        for (r, pair) in problem.pairs.iter().enumerate() {
            let sign = sign_series(&pair.real, j);
            let model: Vec<f64> =
                problem.loads[r].iter().zip(&pair.real.rows).map(|(load, &i)| of(load.motor[j], coulomb * sign[i])).collect();
            let step = pair.real.step() as f64 * pair.real.run.dt_s;
            for k in 0..model.len() {
                let (low, high) = (k.saturating_sub(1), (k + 1).min(model.len() - 1));
                slope.push(-(model[high] - model[low]) / ((high - low).max(1) as f64 * step));
            }
        }
        column.push(problem.cell(Channel::JointTorque, j), &slope);
    }
    column
}
