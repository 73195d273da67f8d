//! The control software's own numbers: `fk.csv`, `coupling.csv`, `gravity.csv`, `jacvel.csv`, and the sensing and torque
//! columns of `closedloop.csv`, within the tolerances of the vectors' README.
#![allow(missing_docs)]

mod common;

use arm::{Raven2, Side, Tool, published};
use common::{Worst, table, vectors};

#[test]
fn fk_matches_within_1e_12_and_one_micrometre() {
    let Some(table) = table(&vectors().join("fk.csv")) else { return };
    assert!(table.rows() >= 480, "{} rows", table.rows());
    let (mut position, mut rotation, mut integers) = (Worst::default(), Worst::default(), Worst::default());
    for row in 0..table.rows() {
        let side = Side::from_name(table.text(row, "arm")).expect("arm");
        let joints = table.joints(row, "jpos", "rad", "m");
        let tip = Raven2::nominal().arm(side).kinematics.tip(&joints);
        let um = published::position_um(&tip);
        for (i, axis) in ["x", "y", "z"].iter().enumerate() {
            position.see(tip.translation.vector[i] - table.number(row, &format!("{axis}_m")));
            integers.see(f64::from(um[i]) - table.number(row, &format!("pos_{axis}_um")));
        }
        for k in 0..9 {
            let name = format!("r{}{}", k / 3 + 1, k % 3 + 1);
            rotation.see(tip.rotation.matrix()[(k / 3, k % 3)] - table.number(row, &name));
        }
    }
    println!("fk: position {:e} m, rotation {:e}, integers {} um", position.0, rotation.0, integers.0);
    assert!(position.0 < 1e-12 && rotation.0 < 1e-12 && integers.0 <= 1.0);
}

#[test]
fn coupling_matches_both_ways_on_both_arms_and_tools() {
    let Some(table) = table(&vectors().join("coupling.csv")) else { return };
    assert!(table.rows() >= 1120, "{} rows", table.rows());
    let (mut forward, mut inverse, mut speeds) = (Worst::default(), Worst::default(), Worst::default());
    for row in 0..table.rows() {
        let side = Side::from_name(table.text(row, "arm")).expect("arm");
        let tool = Tool::from_name(table.text(row, "tool")).expect("tool");
        let transmission = Raven2::nominal().arm_with_tool(side, tool).transmission;
        let joints = table.joints(row, "jpos", "rad", "m");
        let motors = table.joints(row, "mpos", "rad", "rad");
        if table.text(row, "direction") == "fwd" {
            see_all(&mut forward, &transmission.joints(&motors), &joints);
            let expected = table.joints(row, "jvel", "rad_s", "m_s");
            let motor_speeds = table.joints(row, "mvel", "rad_s", "rad_s");
            see_all(&mut speeds, &transmission.published_speeds(&motor_speeds), &expected);
        } else {
            let motor_3 = table.number(row, "mpos_3_actual_rad");
            see_all(&mut inverse, &transmission.motors_at(&joints, motor_3), &motors);
        }
    }
    println!("coupling, relative to max(1, value): forward {:e}, inverse {:e}, speeds {:e}", forward.0, inverse.0, speeds.0);
    assert!(forward.0 < 2e-6 && inverse.0 < 2e-6 && speeds.0 < 2e-6);
}

fn see_all(worst: &mut Worst, found: &[f64; 7], expected: &[f64; 7]) {
    for (found, expected) in found.iter().zip(expected) {
        worst.see((found - expected) / expected.abs().max(1.0));
    }
}

#[test]
fn gravity_matches_within_1e_6() {
    let Some(table) = table(&vectors().join("gravity.csv")) else { return };
    assert!(table.rows() >= 240, "{} rows", table.rows());
    let mut worst = Worst::default();
    for row in 0..table.rows() {
        let side = Side::from_name(table.text(row, "arm")).expect("arm");
        let found = Raven2::nominal().arm(side).gravity.capstan_torque(&table.joints(row, "jpos", "rad", "m"));
        for (i, found) in found.iter().enumerate() {
            worst.see(found - table.number(row, &format!("tau_g_{}_nm", i + 1)));
        }
    }
    println!("gravity: {:e} N m", worst.0);
    assert!(worst.0 < 1e-6);
}

#[test]
fn jacvel_matches_within_1e_5() {
    let Some(table) = table(&vectors().join("jacvel.csv")) else { return };
    assert!(table.rows() >= 240, "{} rows", table.rows());
    let mut worst = Worst::default();
    for row in 0..table.rows() {
        let side = Side::from_name(table.text(row, "arm")).expect("arm");
        let joints = table.joints(row, "jpos", "rad", "m");
        let found = published::jac_vel(side, &joints, &table.joints(row, "jvel", "rad_s", "m_s"));
        for (k, found) in found.iter().enumerate() {
            worst.see(f64::from(*found) - table.number(row, &format!("jac_vel_{k}")));
        }
    }
    println!("jacvel: {:e}", worst.0);
    assert!(worst.0 < 1e-5);
}

#[test]
fn closed_loop_sensing_control_and_amplifier_match() {
    let Some(table) = table(&vectors().join("closedloop.csv")) else { return };
    let gold = Raven2::nominal().arm(Side::Gold);
    let (mut angle, mut speed, mut joint) = (Worst::default(), Worst::default(), Worst::default());
    let (mut torque, mut counts) = (Worst::default(), Worst::default());
    for row in 2..table.rows() {
        let motors = table.joints(row, "mpos", "rad", "rad");
        let speeds = table.joints(row, "mvel", "rad_s", "rad_s");
        let joints = table.joints(row, "jpos", "rad", "m");
        let command = gold.transmission.motors(&table.joints(row, "jpos_d", "rad", "m"));
        let truth = table.joints(row - 1, "truth_mpos", "rad", "rad");
        let truth_before = table.joints(row - 2, "truth_mpos", "rad", "rad");
        let gravity = gold.gravity.capstan_torque(&joints);
        let found = gold.amplifiers.proportional_derivative(&command, &motors, &speeds);
        let reported = gold.transmission.joints(&motors);
        for i in 0..3 {
            let count = gold.encoders.quantise(truth[i]);
            angle.see(count * gold.encoders.rad_per_count() - motors[i]);
            speed.see(gold.encoders.speed(count, gold.encoders.quantise(truth_before[i])) - speeds[i]);
            joint.see(reported[i] - joints[i]);
            let tau = table.number(row, &format!("tau_{}_nm", i + 1));
            torque.see(found[i] + gravity[i] - tau);
            counts.see(f64::from(gold.amplifiers.counts(i, tau)) - table.number(row, &format!("dac_{}", i + 1)));
        }
    }
    println!(
        "closedloop: mpos {:e} rad, mvel {:e} rad/s, jpos {:e}, tau {:e} N m, dac {} counts",
        angle.0, speed.0, joint.0, torque.0, counts.0
    );
    assert!(angle.0 < 1e-8 && speed.0 < 1e-6 && joint.0 < 1e-9 && torque.0 < 1e-8 && counts.0 <= 1.0);
}
