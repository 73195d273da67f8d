//! Speed and accuracy of the simulator: `cargo run --release -p ravenpose-simulator --example speed`.
#![allow(missing_docs)]

use arm::Side;
use simulator::plant::Method;
use simulator::trajectory::{WORKSPACE, teleoperation};
use simulator::{Command, Robot, Simulation};
use std::time::Instant;

fn main() {
    let seconds = 30.0;
    for (name, robot) in [("raven2-nominal", Robot::nominal()), ("raven2-worn", Robot::worn())] {
        let home = *robot.raven.arm(Side::Gold).limits.home();
        let trajectory = teleoperation(1, home, &WORKSPACE, seconds);
        let run = |method, step_s: f64| {
            let mut simulation = Simulation::new(&robot, Side::Gold, 1, &home).expect("robot");
            simulation.set_step(method, step_s);
            let begun = Instant::now();
            let tips: Vec<_> = (0..(seconds * 1e3) as u64)
                .map(|k| simulation.tick(&Command::Joints(trajectory.at(k as f64 * 1e-3))).truth.tip.translation.vector)
                .collect();
            (tips, seconds / begun.elapsed().as_secs_f64())
        };
        for method in [Method::Rk4, Method::Rosenbrock] {
            let (reference, _) = run(method, 0.025e-3);
            for step_s in [1e-3, 0.5e-3, 0.25e-3] {
                let (tips, speed) = run(method, step_s);
                let off = tips.iter().zip(&reference).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                println!(
                    "{name}, {method:?}, step {:.3} ms: {speed:.0} times real time, tip off by {:.2} um at most",
                    step_s * 1e3,
                    off * 1e6
                );
            }
        }
    }
}
