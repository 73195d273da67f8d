//! Speed and accuracy on an arm from a URDF: `cargo run --release -p ravenpose-simulator --example speed_any_arm -- ROBOT`.
#![allow(missing_docs)]

use simulator::RobotModel;
use simulator::any_arm::{ArmSimulation, trajectory};
use simulator::model::Connection;
use simulator::plant::{Given, Method};
use simulator::resimulate::{Motion, Run, inverse};
use std::time::Instant;

const SECONDS: f64 = 20.0;

fn main() {
    let path = std::env::args().nth(1).expect("usage: speed_any_arm ROBOT.toml|ROBOT.urdf");
    let mut robot = RobotModel::load(&path).expect("robot");
    for joint in 0..robot.joint_count() {
        let mut drive = robot.drives()[joint];
        if drive.connection == Connection::Rigid {
            (drive.connection, drive.rotor_inertia_kg_m2) = (Connection::Cable, 1.5e-5);
            (drive.stiffness, drive.damping) = ([1600.0, 400.0, 4e4][joint % 3], [2.0, 0.5, 30.0][joint % 3]);
            (drive.motor_coulomb_nm, drive.joint_coulomb) = (0.01, [0.5, 0.5, 1.0][joint % 3]);
            robot.set_drive(joint, &drive).expect("drive");
        }
    }
    let motion = trajectory(&robot, 1, SECONDS);
    let run = |method: Option<(Method, f64)>| {
        let mut simulation = ArmSimulation::new(&robot, None, 1, motion.start()).expect("simulation");
        if let Some((method, step_s)) = method {
            simulation.plant().set_step(method, step_s);
        }
        let begun = Instant::now();
        let cycles: Vec<_> = (0..(SECONDS * 1e3) as u64).map(|k| simulation.tick(&motion.at(k as f64 * 1e-3))).collect();
        (cycles, SECONDS / begun.elapsed().as_secs_f64())
    };
    let (reference, _) = run(Some((Method::Rk4, 0.025e-3)));
    let (cycles, speed) = run(None);
    println!("as chosen: {speed:.0} times real time");
    for method in [Method::Rk4, Method::Rosenbrock] {
        for step_s in [1e-3, 0.5e-3, 0.25e-3] {
            let (found, speed) = run(Some((method, step_s)));
            let off = |part: fn(&simulator::any_arm::ArmCycle) -> [f64; 3]| {
                let pairs = found.iter().zip(&reference).flat_map(|(a, b)| part(a).into_iter().zip(part(b)));
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let (tip, torque) = (off(|cycle| cycle.true_tip), off(|cycle| [cycle.torque[0], cycle.torque[1], cycle.torque[2]]));
            println!(
                "{method:?}, step {:.3} ms: {speed:.0} times real time, tip off by {:.2} um, torque by {torque:.1e} Nm at most",
                step_s * 1e3,
                tip * 1e6
            );
        }
    }
    let recorded = Run {
        time_s: (0..cycles.len()).map(|k| k as f64 * 1e-3).collect(),
        motors: Some(cycles.iter().map(|cycle| cycle.motors).collect()),
        ..Run::default()
    };
    let motion = Motion::of_run(&recorded, Given::Motors, 5).expect("motion");
    let begun = Instant::now();
    let needed = inverse(&robot, &motion).expect("inverse");
    println!("inverse: {:.0} times real time, {} rows", SECONDS / begun.elapsed().as_secs_f64(), needed.len());
}
