//! Motors: torque scale and offset.

use super::dictionary::Dictionary;
use super::{Bound, Column, Family};
use crate::problem::Channel;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    const TORQUE: Channel = Channel::JointTorque;
    if !dictionary.problem.has(TORQUE) {
        return;
    }
    for j in 0..dictionary.joints() {
        let offset = move |d: &Dictionary| d.effort_of(j, vec![1.0; d.grid.len()], false);
        let bound = Bound::Between(-0.95, 5.0);
        all.push(Family::fixed("motor_torque_scale", &[j], "scale", TORQUE, &[bound], move |d| vec![total(d, j)]));
        all.push(
            Family::fixed("motor_torque_scale", &[j], "scale and offset", TORQUE, &[bound, Bound::Free], move |d| vec![total(d, j), offset(d)])
                .penalised(1.5),
        );
        all.push(Family::fixed("motor_torque_scale", &[j], "offset", TORQUE, &[Bound::Free], move |d| vec![offset(d)]).penalised(1.0));
    }
}

/// All that the motor gives: load, rotor, nominal friction.
fn total(dictionary: &Dictionary, j: usize) -> Column {
    let problem = dictionary.problem;
    let coulomb = problem.nominal.drives[j][2];
    let sign = super::friction::turning(dictionary, j, 0.0);
    let load = dictionary.at_grid(|r, _, k| problem.loads[r][k].motor[j]);
    dictionary.effort_of(j, load.iter().zip(&sign).map(|(load, s)| load + coulomb * s).collect(), false)
}
