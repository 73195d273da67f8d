//! One run of plant and controller, sampled as a recording is.

use crate::acting::Act;
use crate::arm::Arm;
use crate::controller::{Loop, RATE};
use crate::effect::Effect;
use crate::lagrange::Chain;
use crate::plant::{Plant, STEP};
use crate::trajectory::{LEAD, Trajectory};

/// One signal set per sample, `[sample][joint]`; samples begin `LEAD` before the recording.
#[derive(Clone, Debug, Default)]
pub struct Signals {
    /// Motor position as the encoder shows it, rad before the gearbox.
    pub motor: Vec<Vec<f64>>,
    /// Motor velocity as the controller estimates it, rad/s.
    pub motor_speed: Vec<Vec<f64>>,
    /// Commanded motor torque, N m.
    pub torque: Vec<Vec<f64>>,
    /// Commanded joint position, rad or m.
    pub command: Vec<Vec<f64>>,
    /// True joint position, rad or m.
    pub joint: Vec<Vec<f64>>,
    /// True tip in the base frame, m.
    pub tip: Vec<[f64; 3]>,
    /// Tip as the controller computes it from its motors, m.
    pub reported_tip: Vec<[f64; 3]>,
    /// Torque or force in the cables, joint side; never recorded.
    pub load: Vec<Vec<f64>>,
}

impl Signals {
    /// Samples before time zero.
    pub fn lead() -> usize {
        (LEAD * RATE).round() as usize
    }

    /// Number of samples from time zero on.
    pub fn count(&self) -> usize {
        self.tip.len() - Self::lead()
    }
}

/// The arm that moves, the model its controller has of it, and how it reads its motors.
pub struct Robot<'a> {
    /// As it is.
    pub truth: &'a Arm,
    /// As the laboratory describes it.
    pub model: &'a Arm,
    /// Encoders show whole counts.
    pub stepped: bool,
}

/// Plays a trajectory.
pub fn play(robot: &Robot, effects: &[Effect], trajectory: &Trajectory) -> Signals {
    match robot.truth.size() {
        2 => play_sized::<2>(robot, effects, trajectory),
        3 => play_sized::<3>(robot, effects, trajectory),
        4 => play_sized::<4>(robot, effects, trajectory),
        6 => play_sized::<6>(robot, effects, trajectory),
        other => unreachable!("arms have 2 to 4 joints or 6, not {other}"),
    }
}

fn play_sized<const N: usize>(robot: &Robot, effects: &[Effect], trajectory: &Trajectory) -> Signals {
    let arm = robot.truth;
    let model = Chain::<N>::new(robot.model);
    let command = |k: usize| -> [f64; N] { std::array::from_fn(|j| trajectory.positions[k][j]) };
    let (first, second) = (command(0), command(1));
    let speed: [f64; N] = std::array::from_fn(|j| (second[j] - first[j]) * RATE);
    let mut plant = Plant::new(arm, effects, first, speed);
    let mut loops: [Loop; N] = std::array::from_fn(|j| Loop::new(&arm.drives[j], robot.stepped, speed[j] * arm.drives[j].ratio));
    let steps = (1.0 / (RATE * STEP)).round() as usize;
    let samples = trajectory.positions.len();
    let mut out = Signals::default();
    for k in 0..samples {
        let t = k as f64 / RATE - LEAD;
        let wanted = command(k);
        for acting in plant.acting() {
            match acting.act {
                Act::Gains(kp, kd) => {
                    let w = acting.weight;
                    loops[acting.joint].gains = (1.0 + w * (kp - 1.0), 1.0 + w * (kd - 1.0));
                }
                Act::Missed { counts, times } => {
                    loops[acting.joint].lose(counts * times.iter().filter(|&&time| time > 0.0 && t >= time).count() as f64);
                }
                _ => {}
            }
        }
        let hold = model.posture(&wanted, &[0.0; N]).gravity;
        let torque: [f64; N] = std::array::from_fn(|j| {
            let ratio = arm.drives[j].ratio;
            loops[j].step(plant.motor[j] * ratio, wanted[j] * ratio, hold[j] / ratio)
        });
        let tip = plant.tip();
        let reported = model.tip(&std::array::from_fn(|j| loops[j].position / arm.drives[j].ratio));
        out.motor.push(loops.iter().map(|l| l.position).collect());
        out.motor_speed.push(loops.iter().map(|l| l.velocity).collect());
        out.torque.push(torque.to_vec());
        out.command.push(wanted.to_vec());
        out.joint.push(plant.joint.to_vec());
        out.tip.push([tip.x, tip.y, tip.z]);
        out.reported_tip.push([reported.x, reported.y, reported.z]);
        out.load.push(plant.load.to_vec());
        for step in 0..steps {
            plant.set_time(t + step as f64 * STEP);
            plant.step(&torque);
        }
    }
    out
}
