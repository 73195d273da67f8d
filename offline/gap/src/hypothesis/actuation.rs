//! Motors: torque scale, offset and ripple.

use super::dictionary::{Dictionary, size};
use super::{Bound, Column, Family, product};
use crate::cell::Channel;

/// Speed below which a joint creeps, of its RMS speed.
const CREEPING: f64 = 0.01;
/// Most waves per motor turn.
const ORDERS: u32 = 64;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    const TORQUE: Channel = Channel::JointTorque;
    if !dictionary.problem.has(TORQUE) {
        return;
    }
    for j in 0..dictionary.joints() {
        let offset = move |d: &Dictionary| d.effort_of(j, vec![1.0; d.grid.len()], false);
        let bound = Bound::Between(-0.95, 5.0);
        all.push(Family::fixed("motor_torque_scale", &[j], "scale", TORQUE, &[bound], move |d| {
            vec![total(d, j, &super::friction::steep(d, j))]
        }));
        // The friction in it turns as that of the robot does.
        let usual = size(&dictionary.at_grid(|r, i, _| dictionary.problem.pairs[r].real.drive_velocity[j][i])).max(1e-9);
        let speeds = product(&[&super::friction::SIGN_SPEED.map(|share| share * usual)]);
        let rounded = move |d: &Dictionary, s: &[f64]| vec![total(d, j, &super::friction::turning(d, j, s[0]))];
        let family =
            Family::shaped("motor_torque_scale", &[j], "scale, rounded", TORQUE, &[bound], &[("v_eps", true)], speeds, rounded);
        all.push(family.penalised(0.5));
        all.push(
            Family::fixed("motor_torque_scale", &[j], "scale and offset", TORQUE, &[bound, Bound::Free], move |d| {
                vec![total(d, j, &super::friction::steep(d, j)), offset(d)]
            })
            .penalised(1.5),
        );
        all.push(
            Family::fixed("motor_torque_scale", &[j], "offset", TORQUE, &[Bound::Free], move |d| vec![offset(d)]).penalised(1.0),
        );
        if dictionary.problem.pairs.iter().all(|pair| pair.real.run.motor.is_some()) {
            let orders: Vec<f64> = (1..=ORDERS).map(f64::from).collect();
            all.push(
                Family::shaped(
                    "torque_ripple",
                    &[j],
                    "motor turns",
                    TORQUE,
                    &[Bound::Free, Bound::Free],
                    &[("order", false)],
                    product(&[&orders]),
                    move |d, s| {
                        [0.0, std::f64::consts::FRAC_PI_2].map(|phase| d.effort_of(j, ripple(d, j, s[0], phase), false)).to_vec()
                    },
                )
                .penalised(15.0),
            );
        }
    }
}

/// A wave so many times per turn of the motor, smoothed as the torque is: what turns fast is gone from both. Where the joint
/// creeps or holds nothing is claimed: a standing wave is a constant, and many constants explain anything. Nor in a run without its motors.
fn ripple(dictionary: &Dictionary, j: usize, order: f64, phase: f64) -> Vec<f64> {
    dictionary.smoothed(|r| {
        let motion = &dictionary.problem.pairs[r].real;
        let usual = crate::series::rms(motion.quick_velocity[j].iter().copied());
        let moving = |v: &f64| f64::from(u8::from(v.abs() > CREEPING * usual));
        let wave = |motor: &Vec<Vec<f64>>| {
            motor[j].iter().zip(&motion.quick_velocity[j]).map(|(angle, v)| (order * angle + phase).sin() * moving(v)).collect()
        };
        motion.run.motor.as_ref().map_or_else(|| vec![0.0; motion.run.len()], wave)
    })
}

/// All that the motor gives: load, rotor, nominal friction.
fn total(dictionary: &Dictionary, j: usize, sign: &[f64]) -> Column {
    let problem = dictionary.problem;
    let coulomb = problem.nominal.drives[j][2];
    let load = dictionary.drive_torque(j);
    dictionary.effort_of(j, load.iter().zip(sign).map(|(load, s)| load + coulomb * s).collect(), false)
}
