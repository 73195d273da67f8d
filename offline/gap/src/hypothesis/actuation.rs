//! Motors: torque scale and ripple.

use super::dictionary::Dictionary;
use super::{Bound, Candidate};
use crate::problem::Channel;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    let problem = dictionary.problem;
    for j in 0..dictionary.joints() {
        let coulomb = problem.nominal.drives[j][2];
        let sign = super::friction::turning(dictionary, j, 0.0);
        let total: Vec<f64> = dictionary
            .at_grid(|r, _, k| problem.loads[r][k].motor[j])
            .iter()
            .zip(&sign)
            .map(|(load, s)| load + coulomb * s)
            .collect();
        let constant = vec![1.0; total.len()];
        let named = |form| Candidate::new("motor_torque_scale", &[j], form, Channel::JointTorque);
        let scale = || dictionary.effort_of(j, total.clone(), false);
        all.push(named("scale").with(scale(), Bound::Between(-0.9, 5.0)));
        all.push(named("scale and offset").with(scale(), Bound::Between(-0.9, 5.0)).with(dictionary.effort_of(j, constant.clone(), false), Bound::Free));
        all.push(named("offset").with(dictionary.effort_of(j, constant, false), Bound::Free));
    }
}
