//! How far off the shipped robots are: `cargo run --release -p ravenpose-simulator --example worn`.
#![allow(missing_docs)]

use arm::Side;
use simulator::Robot;
use simulator::production::{Motion, Plan, Player};

fn main() {
    for (name, robot) in [("raven2-nominal", Robot::nominal()), ("raven2-worn", Robot::worn())] {
        let (duration_s, run_s, motion) = (20.0 * 60.0, 60.0, Motion::Mixed);
        let plan =
            Plan { robot, sides: vec![Side::Gold], duration_s, run_s, runs_per_session: 1, seed: 1, homing_seed: None, motion };
        let (mut squares, mut largest, mut count) = (0.0, 0.0_f64, 0_u64);
        let mut means = Vec::new();
        let mut within = 0.0;
        for run in plan.runs() {
            let mut player = Player::new(&plan, run).expect("robot");
            let arm = plan.robot.raven.arm(Side::Gold);
            let mut errors = Vec::new();
            while let Some((_, cycles)) = player.next_cycle() {
                let cycle = &cycles[0].1;
                errors.push(cycle.truth.tip.translation.vector - arm.kinematics.tip_position(&cycle.reported.joints));
            }
            let mean = errors.iter().sum::<nalgebra::Vector3<f64>>() / errors.len() as f64;
            within += errors.iter().map(|error| (error - mean).norm_squared()).sum::<f64>();
            means.push(mean.norm() * 1e3);
            squares += errors.iter().map(nalgebra::Vector3::norm_squared).sum::<f64>();
            largest = errors.iter().map(nalgebra::Vector3::norm).fold(largest, f64::max);
            count += errors.len() as u64;
        }
        means.sort_by(f64::total_cmp);
        println!(
            "{name}: tip off by {:.2} mm RMS, {:.2} mm at most; within a run (mean taken off) {:.2} mm RMS; mean of a run {:.2} to {:.2} mm",
            (squares / count as f64).sqrt() * 1e3,
            largest * 1e3,
            (within / count as f64).sqrt() * 1e3,
            means[0],
            means[means.len() - 1]
        );
    }
}
