//! Recordings of an arm that is not RAVEN-II, simulated again (`data/gap-examples`: another program's plant).
#![allow(missing_docs)]

mod common;

use std::path::PathBuf;

use common::data;
use common::urdf::gap_urdf;
use recordings::csv;
use simulator::RobotModel;
use simulator::model::{Connection, ControllerModel, ControllerNumbers};
use simulator::plant::{Given, Vector};
use simulator::resimulate::{ClosedLoop, Motion, OpenLoop, Run, Simulated, closed_loop, inverse, open_loop};

/// The arm of the examples with drives as least squares on `a/sim_1` gives them: gains from torque over error, rotors and friction
/// from torque over the joints' motion, stiffness from how far motors and joints stand apart under load. Rounded to two digits.
fn robot(urdf: &std::path::Path) -> RobotModel {
    let mut robot = RobotModel::load(&urdf.to_string_lossy()).expect("URDF");
    let drives = [(1600.0, 2.0, 0.0125, 3.1e-5, 0.05), (400.0, 0.5, 0.0105, 3.7e-5, 0.03), (4e4, 30.0, 0.0093, 3.7e-5, 0.12)];
    for (joint, (stiffness, damping, motor_coulomb, motor_viscous, joint_coulomb)) in drives.into_iter().enumerate() {
        let mut drive = robot.drives()[joint];
        (drive.connection, drive.stiffness, drive.damping) = (Connection::Cable, stiffness, damping);
        (drive.motor_coulomb_nm, drive.motor_viscous_nm_s) = (motor_coulomb, motor_viscous);
        (drive.rotor_inertia_kg_m2, drive.joint_coulomb) = (1.5e-5, joint_coulomb);
        robot.set_drive(joint, &drive).expect("drive");
    }
    let joint = |kp: f64, ki: f64, kd: f64| ControllerNumbers { kp, ki, kd, velocity_share: 1.0, gravity_share: 1.0 };
    let joints = vec![joint(0.2, 0.02, 4e-3), joint(0.165, 0.005, 3.2e-3), joint(0.1, 0.0, 2e-3)];
    robot.set_controller(Some(ControllerModel { period_s: 1e-3, delay_cycles: 0, joints })).expect("gains");
    robot
}

fn run(robot: &RobotModel, name: &str) -> Run {
    let path: PathBuf = data().join("gap-examples").join(name);
    Run::from_recording(&csv::read(&path).expect("recording"), robot).expect("run")
}

/// Three numbers with three digits.
fn shown(values: [f64; 3]) -> String {
    values.map(|value| format!("{value:.2e}")).join(" ")
}

fn rms(found: &[Vector], wanted: &[Vector]) -> [f64; 3] {
    let from = 500;
    let rows = (found.len() - from) as f64;
    std::array::from_fn(|joint| {
        let squares: f64 = found.iter().zip(wanted).skip(from).map(|(a, b)| (a[joint] - b[joint]).powi(2)).sum();
        (squares / rows).sqrt()
    })
}

fn spread(rows: &[Vector]) -> [f64; 3] {
    std::array::from_fn(|joint| {
        let mean = rows.iter().map(|row| row[joint]).sum::<f64>() / rows.len() as f64;
        (rows.iter().map(|row| (row[joint] - mean).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
    })
}

#[test]
fn commands_of_another_simulator_give_nearly_its_motion() {
    let Some(urdf) = gap_urdf() else { return };
    let robot = robot(&urdf);
    let recorded = run(&robot, "a/sim_1.csv.gz");
    let begun = std::time::Instant::now();
    let found = closed_loop(&robot, &recorded, ClosedLoop::default()).expect("closed loop");
    let speed = 12.0 / begun.elapsed().as_secs_f64();
    let (torque, motors) = (recorded.torque.as_ref().expect("tau"), recorded.motors.as_ref().expect("mpos"));
    let truth = recorded.true_joints.as_ref().expect("truth_jpos");
    println!("closed loop, {speed:.0} times real time; off by (RMS, in brackets the spread of the recorded signal)");
    println!("motors rad {} ({})", shown(rms(&found.motors, motors)), shown(spread(motors)));
    println!("joints rad, m {} ({})", shown(rms(&found.true_joints, truth)), shown(spread(truth)));
    println!("torque Nm {} ({})", shown(rms(&found.torque, torque)), shown(spread(torque)));
    let windows = open_loop(&robot, &recorded, OpenLoop::default()).expect("open loop");
    println!("open loop, 1 s windows: motors rad {}", shown(rms(&windows.motors, motors)));
    for given in [Given::Motors, Given::Joints] {
        let motion = Motion::of_run(&recorded, given, 15).expect("motion");
        let begun = std::time::Instant::now();
        let needed: Simulated = inverse(&robot, &motion).expect("inverse");
        let speed = 12.0 / begun.elapsed().as_secs_f64();
        println!(
            "inverse from {given:?}, {speed:.0} times real time: torque Nm {}, joints {}, motors {}",
            shown(rms(&needed.torque, torque)),
            shown(rms(&needed.true_joints, truth)),
            shown(rms(&needed.motors, motors))
        );
    }
}
