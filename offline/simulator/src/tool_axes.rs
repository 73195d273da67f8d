//! Motors 4 to 7 and the joints that they drive through rigid cables (raven2-plant.md, section 7: all assumed).

use arm::transmission::Transmission;
use arm::{JOINTS, Joints, Motors};

use crate::physics::{JointCoupling, JointOffset};
use crate::plant::{Drive, Timed};

/// Tool motors.
const TOOL: usize = 4;
/// The first of them.
pub(crate) const FIRST: usize = JOINTS - TOOL;

/// The four axes of a tool.
#[derive(Debug, Clone)]
pub(crate) struct ToolAxes {
    pub(crate) drives: Vec<Drive>,
    pub(crate) offsets: Vec<(Timed<JointOffset>, usize)>,
    /// (driven, driver), joints from 0.
    pub(crate) couplings: Vec<(Timed<JointCoupling>, usize, usize)>,
    angles: [f64; TOOL],
    speeds: [f64; TOOL],
    /// Joint positions after play; none before the first look.
    joints: Option<[f64; TOOL]>,
    /// Memories of warmth, one list per drive.
    warmth: [Vec<f64>; TOOL],
}

impl ToolAxes {
    /// At rest at motor angles, rad.
    pub(crate) fn new(drives: Vec<Drive>, motors: &Motors) -> Self {
        let warmth = std::array::from_fn(|i| vec![0.0; drives[i].thermal.len()]);
        let angles = std::array::from_fn(|i| motors[FIRST + i]);
        Self { drives, offsets: Vec::new(), couplings: Vec::new(), angles, speeds: [0.0; TOOL], joints: None, warmth }
    }

    /// Puts the motors at rest at angles, rad.
    pub(crate) fn rest_at(&mut self, motors: &Motors) {
        self.angles = std::array::from_fn(|i| motors[FIRST + i]);
        self.speeds = [0.0; TOOL];
        self.joints = None;
    }

    /// Lets its motors turn at speeds, rad/s.
    pub(crate) fn turn_at(&mut self, speeds: &[f64]) {
        self.speeds.copy_from_slice(speeds);
    }

    /// Makes room for the memories of effects that were just added.
    pub(crate) fn grow_memories(&mut self) {
        for (warmth, drive) in self.warmth.iter_mut().zip(&self.drives) {
            warmth.resize(drive.thermal.len(), 0.0);
        }
    }

    /// Takes over how warm the same drives were.
    pub(crate) fn go_on_from(&mut self, last: &Self) {
        self.warmth.clone_from(&last.warmth);
    }

    /// Switches effects on and off.
    pub(crate) fn at(&mut self, time_s: f64) {
        self.drives.iter_mut().for_each(|drive| {
            drive.at(time_s);
            drive.offset = 0.0;
        });
        self.couplings.iter_mut().for_each(|(effect, ..)| {
            effect.at(time_s);
        });
        for (effect, joint) in &mut self.offsets {
            effect.at(time_s);
            if effect.on {
                self.drives[*joint - FIRST].offset += effect.effect.o;
            }
        }
    }

    /// Motor angles, rad.
    pub(crate) fn angles(&self) -> &[f64; TOOL] {
        &self.angles
    }

    /// Moves the motors on under commanded capstan torques, N·m; one implicit step of second order (see `plant::Method`).
    pub(crate) fn advance(&mut self, torque_nm: &[f64], duration_s: f64) {
        const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
        let h = duration_s;
        for i in 0..TOOL {
            let drive = &self.drives[i];
            let applied = drive.applied(torque_nm[i]);
            let warm = drive.warm_share(&self.warmth[i]);
            let inertia = drive.nominal.inertia;
            let acceleration = |angle: f64, speed: f64| {
                let (friction, slope) = friction(drive, speed, warm);
                ((applied - drive.ripple(angle) - friction) / inertia, slope / inertia)
            };
            let (a1, slope) = acceleration(self.angles[i], self.speeds[i]);
            let damped = 1.0 + GAMMA * h * slope;
            let k1 = a1 / damped;
            let k1_angle = self.speeds[i] + GAMMA * h * k1;
            let speed = self.speeds[i] + h * k1;
            let (a2, _) = acceleration(self.angles[i] + h * k1_angle, speed);
            let k2 = (a2 - 2.0 * k1) / damped;
            let k2_angle = speed - 2.0 * k1_angle + GAMMA * h * k2;
            self.angles[i] += h * (1.5 * k1_angle + 0.5 * k2_angle);
            self.speeds[i] += h * (1.5 * k1 + 0.5 * k2);
            for (warmth, (drift, _)) in self.warmth[i].iter_mut().zip(&drive.thermal).filter(|(_, (drift, _))| drift.on) {
                *warmth += h * drift.effect.rate(applied / drive.nominal.torque_ref_nm, *warmth);
            }
        }
    }

    /// True joint positions 4 to 7, given the motors of joints 1 to 3 and those joints.
    pub(crate) fn joints(&mut self, transmission: &Transmission, motors: &Motors, base_joints: &[f64; FIRST]) -> [f64; TOOL] {
        let believed = transmission.joints(motors);
        let mut found: Joints = [0.0; JOINTS];
        found[..FIRST].copy_from_slice(base_joints);
        for i in 0..TOOL {
            let (shift, _) = self.drives[i].shift(believed[FIRST + i]);
            found[FIRST + i] = believed[FIRST + i] + shift;
        }
        let straight = found;
        for (effect, driven, driver) in self.couplings.iter().filter(|(effect, ..)| effect.on) {
            found[*driven] -= effect.effect.c_ij * straight[*driver];
        }
        let mut joints = [0.0; TOOL];
        for i in 0..TOOL {
            let before = self.joints.map_or(found[FIRST + i], |joints| joints[i]);
            let mut position = found[FIRST + i];
            for backlash in crate::plant::on(&self.drives[i].backlash) {
                position = backlash.play(before, position);
            }
            joints[i] = position;
        }
        self.joints = Some(joints);
        joints
    }
}

/// Friction at the capstan of a tool motor, N·m, and its chord; friction of the joint is brought to the capstan.
fn friction(drive: &Drive, speed: f64, warm: f64) -> (f64, f64) {
    let to_capstan = drive.nominal.gear / drive.nominal.ratio;
    let (motor, motor_slope) = drive.motor_friction(speed, warm);
    let joint = drive.joint_friction(speed / drive.nominal.ratio, warm, &[]);
    (motor + to_capstan * joint.torque, motor_slope + to_capstan / drive.nominal.ratio * joint.slope)
}
