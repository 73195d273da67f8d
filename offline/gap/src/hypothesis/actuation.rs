//! Motors: torque scale, offset and ripple.

use super::dictionary::{Dictionary, size};
use super::{Bound, Candidate, Column, Family, product};
use crate::cell::Channel;
use crate::problem::Problem;

/// Speed below which a joint creeps, of its RMS speed.
const CREEPING: f64 = 0.01;
/// Most waves per motor turn.
const ORDERS: u32 = 64;
/// The physics whose wave goes with the motor's angle.
pub(crate) const RIPPLE: &str = "torque_ripple";
/// From so many waves per second on a cable gives way, and its link does not follow its motor as the nominal model has it,
const SHAKES_HZ: f64 = 4.0;
/// up to so many waves in a standard deviation of the window, behind which nothing is left of them.
const SMOOTHED: f64 = 0.3;

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
                    RIPPLE,
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

/// How many times its torque a motor gives by these coefficients; none of another physics, or of an offset alone.
pub(crate) fn torque_scale(family: &Family, theta: &[f64]) -> Option<f64> {
    (family.physics == "motor_torque_scale" && family.form != "offset").then(|| 1.0 / (1.0 + theta[0]))
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

/// At which rows of a cell does a ripple shake the cable of its drive?
pub(crate) fn shaken(problem: &Problem, cell: usize, ripple: &Candidate) -> Vec<bool> {
    let j = ripple.family.joints[0];
    let waves = ripple.shape_of("order").unwrap_or(0.0) * problem.robot.motor_from_joint[(j, j)].abs() / std::f64::consts::TAU;
    let shakes = |&(r, i): &(usize, usize)| {
        let motion = &problem.pairs[r].real;
        (SHAKES_HZ..SMOOTHED / motion.window.sigma_s()).contains(&(waves * motion.drive_velocity[j][i].abs()))
    };
    problem.cells[cell].rows.iter().map(shakes).collect()
}

/// All that the motor gives: load, rotor, nominal friction.
fn total(dictionary: &Dictionary, j: usize, sign: &[f64]) -> Column {
    let problem = dictionary.problem;
    let coulomb = problem.nominal.drives[j][2];
    let load = dictionary.drive_torque(j);
    dictionary.effort_of(j, load.iter().zip(sign).map(|(load, s)| load + coulomb * s).collect(), false)
}
