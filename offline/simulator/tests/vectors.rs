//! The plant and the closed loop of the specification: `plant.csv` and `closedloop.csv`, within the tolerances of the vectors'
//! README.
#![allow(missing_docs)]

mod common;

use arm::Side;
use common::{ANGLE, POSITION, RATE, SPEED, TORQUE, table, vectors};
use simulator::plant::{Method, State};
use simulator::{Command, Robot, Simulation};

fn nominal() -> Simulation {
    let home = *arm::Raven2::nominal().arm(Side::Gold).limits.home();
    Simulation::new(&Robot::nominal(), Side::Gold, 0, &home).expect("nominal")
}

#[test]
fn stretch_force_and_accelerations_match() {
    let Some(table) = table(&vectors().join("plant.csv")) else { return };
    assert!(table.rows() >= 240, "{} rows", table.rows());
    let mut simulation = nominal();
    let mut worst = [0.0_f64; 4];
    for row in 0..table.rows() {
        let state = State {
            joints: table.vector(row, "jpos", POSITION),
            rates: table.vector(row, "jvel", RATE),
            motors: table.vector(row, "mpos", ANGLE),
            speeds: table.vector(row, "mvel", SPEED),
            ..State::ZERO
        };
        let torque = table.vector(row, "tau", TORQUE);
        let plant = simulation.plant();
        let (stretch, force) = (plant.cable_stretch_m(&state), plant.cable_forces_n(&state));
        let (joints, motors) = plant.accelerations(&state, &torque);
        let jacc = table.vector(row, "jacc", ["_rad_s2", "_rad_s2", "_m_s2"]);
        let macc = table.vector(row, "macc", ["_rad_s2"; 3]);
        for i in 0..3 {
            worst[0] = worst[0].max((stretch[i] - table.vector(row, "stretch", ["_m"; 3])[i]).abs());
            worst[1] = worst[1].max((force[i] - table.vector(row, "tension", ["_n"; 3])[i]).abs());
            worst[2] = worst[2].max((joints[i] - jacc[i]).abs());
            worst[3] = worst[3].max((motors[i] - macc[i]).abs());
        }
    }
    println!("plant: stretch {:e} m, force {:e} N, joints {:e}, motors {:e} rad/s2", worst[0], worst[1], worst[2], worst[3]);
    assert!(worst[0] < 1e-10 && worst[1] < 1e-4 && worst[2] < 1e-4 && worst[3] < 1e-3);
}

/// Runs the closed loop of the vectors; largest differences of positions (rad, m) and of amplifier commands (counts).
fn closed_loop(method: Method, step_s: f64) -> Option<(f64, i32)> {
    let table = table(&vectors().join("closedloop.csv"))?;
    let mut simulation = nominal();
    let home = *simulation.arm().limits.home();
    simulation.set_step(method, step_s);
    simulation.set_state(State {
        joints: table.vector(0, "truth_jpos", POSITION),
        motors: table.vector(0, "truth_mpos", ANGLE),
        ..State::ZERO
    });
    let (mut position, mut counts) = (0.0_f64, 0);
    for row in 0..table.rows() {
        let mut joints_d = home;
        joints_d[..3].copy_from_slice(&table.vector(row, "jpos_d", POSITION)[..3]);
        let cycle = simulation.tick(&Command::Joints(joints_d));
        let (joints, motors) = (table.vector(row, "truth_jpos", POSITION), table.vector(row, "truth_mpos", ANGLE));
        for i in 0..3 {
            position = position.max((cycle.truth.joints[i] - joints[i]).abs());
            position = position.max((cycle.truth.motors[i] - motors[i]).abs());
            let dac = table.number(row, &format!("dac_{}", i + 1)) as i32;
            counts = counts.max((cycle.reported.dac[i] - dac).abs());
        }
    }
    println!("closed loop, {method:?} {step_s} s: {position:e} rad or m, {counts} counts");
    Some((position, counts))
}

#[test]
fn the_closed_loop_matches_with_the_nominal_step() {
    let Some((position, counts)) = closed_loop(Method::Rk4, 0.25e-3) else { return };
    assert!(position < 1e-6 && counts <= 1);
}

#[test]
fn the_implicit_method_finds_the_same_loop() {
    // One encoder count of difference is possible where an angle lies at a count's edge: 1.6 mrad of the motor.
    let Some((position, counts)) = closed_loop(Method::Rosenbrock, 0.025e-3) else { return };
    assert!(position < 1e-5, "{position} {counts}");
}
