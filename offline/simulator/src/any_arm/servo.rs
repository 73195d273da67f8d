//! A controller of motors: proportional, integral, derivative, with the arm's weight fed forward.

use std::collections::VecDeque;

use arm::serial::{SerialArm, Workspace};

use super::middle;
use crate::model::{Connection, ControllerModel, ControllerNumbers, DriveModel, RobotModel};
use crate::plant::{JOINTS_MAX, Matrix, Vector, inverse};

/// Bandwidth of a controller of which nothing is known, rad/s: follows a hand, and leaves cables alone.
const BANDWIDTH_RAD_S: f64 = 50.0;
/// Its damping, share of the critical one.
const DAMPING: f64 = 0.8;

/// Gains for a robot that has none of its own **(assumed)**: 8 Hz on the inertia that each motor moves in the middle of its
/// range, weight fed forward, 1 kHz.
pub fn default_gains(model: &RobotModel) -> ControllerModel {
    let (arm, drives) = (model.arm(), model.drives());
    let n = model.joint_count();
    let mut mass = vec![0.0; n * n];
    arm.mass_matrix(&mut Workspace::new(&arm), &middle(&arm)[..n], &mut mass);
    let joints = drives.iter().enumerate().map(|(i, drive)| {
        let inertia = drive.rotor_inertia_kg_m2 + mass[i * n + i] / (drive.reduction * drive.reduction);
        ControllerNumbers {
            kp: inertia * BANDWIDTH_RAD_S * BANDWIDTH_RAD_S,
            ki: 0.0,
            kd: 2.0 * DAMPING * inertia * BANDWIDTH_RAD_S,
            velocity_share: 1.0,
            gravity_share: 1.0,
        }
    });
    ControllerModel { period_s: 1e-3, delay_cycles: 0, joints: joints.collect() }
}

/// What the controller measures and wants in one cycle: motors as encoders show them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measured {
    pub(crate) motors: Vector,
    pub(crate) speeds: Vector,
    pub(crate) joints: Vector,
}

/// The controller in motion.
#[derive(Debug, Clone)]
pub(crate) struct Servo {
    gains: ControllerModel,
    drives: Vec<DriveModel>,
    coupling_inverse: Matrix,
    arm: SerialArm,
    workspace: Workspace,
    /// Sum of error times period, rad·s.
    integral: Vector,
    wanted_before: Option<Vector>,
    /// Newest last.
    waiting: VecDeque<Measured>,
    counts_before: Option<Vector>,
}

impl Servo {
    pub(crate) fn new(model: &RobotModel, gains: ControllerModel) -> Self {
        let n = model.joint_count();
        let mut coupling = [[0.0; JOINTS_MAX]; JOINTS_MAX];
        for (row, given) in coupling.iter_mut().zip(model.coupling()) {
            row[..n].copy_from_slice(&given);
        }
        let arm = model.arm();
        Self {
            workspace: Workspace::new(&arm),
            arm,
            drives: model.drives(),
            coupling_inverse: inverse(&coupling, n).unwrap_or(coupling),
            integral: [0.0; JOINTS_MAX],
            wanted_before: None,
            waiting: VecDeque::new(),
            counts_before: None,
            gains,
        }
    }

    pub(crate) fn period_s(&self) -> f64 {
        self.gains.period_s
    }

    /// Speeds that the controller works with: true ones, or differences of encoder steps.
    pub(crate) fn speeds(&mut self, motors: &Vector, true_speeds: &Vector) -> Vector {
        let before = self.counts_before.replace(*motors);
        std::array::from_fn(|i| {
            let stepped = self.drives.get(i).is_some_and(|drive| drive.encoder_counts_per_rev.is_some());
            match before {
                _ if !stepped => true_speeds[i],
                Some(before) => (motors[i] - before[i]) / self.gains.period_s,
                None => 0.0,
            }
        })
    }

    /// Motor torques that are commanded, N·m at the shaft.
    pub(crate) fn tick(&mut self, now: Measured, wanted: &Vector) -> Vector {
        self.waiting.push_back(now);
        if self.waiting.len() > self.gains.delay_cycles as usize + 1 {
            self.waiting.pop_front();
        }
        let seen = self.waiting.front().copied().unwrap_or(now);
        let before = self.wanted_before.replace(*wanted).unwrap_or(*wanted);
        let weight = self.weight(&seen.joints);
        let period_s = self.gains.period_s;
        let mut out = [0.0; JOINTS_MAX];
        for (i, gains) in self.gains.joints.iter().enumerate() {
            let error = wanted[i] - seen.motors[i];
            self.integral[i] += error * period_s;
            let speed_d = gains.velocity_share * (wanted[i] - before[i]) / period_s;
            let torque = gains.kp * error
                + gains.ki * self.integral[i]
                + gains.kd * (speed_d - seen.speeds[i])
                + gains.gravity_share * weight[i];
            out[i] = limited(&self.drives[i], torque);
        }
        out
    }

    /// Fills the integral so that the next command is a torque, N·m: a recording begins in motion.
    pub(crate) fn begin_with(&mut self, now: Measured, wanted: &Vector, speed_d: &Vector, torque: &Vector) {
        let weight = self.weight(&now.joints);
        for (i, gains) in self.gains.joints.iter().enumerate().filter(|(_, gains)| gains.ki != 0.0) {
            let rest = gains.kp * (wanted[i] - now.motors[i])
                + gains.kd * (gains.velocity_share * speed_d[i] - now.speeds[i])
                + gains.gravity_share * weight[i];
            self.integral[i] = (torque[i] - rest) / gains.ki;
        }
        self.wanted_before = Some(std::array::from_fn(|i| wanted[i] - speed_d[i] * self.gains.period_s));
    }

    /// Motor torques that hold the nominal arm, N·m.
    fn weight(&mut self, joints: &Vector) -> Vector {
        let n = self.drives.len();
        let mut gravity = [0.0; JOINTS_MAX];
        if self.gains.joints.iter().all(|gains| gains.gravity_share == 0.0) {
            return gravity;
        }
        self.arm.gravity(&mut self.workspace, &joints[..n], &mut gravity[..n]);
        std::array::from_fn(|i| {
            let Some(drive) = self.drives.get(i) else { return 0.0 };
            (0..n).map(|k| self.coupling_inverse[k][i] * gravity[k]).sum::<f64>() / drive.reduction
        })
    }
}

/// What of a torque the amplifier can give: whole counts where counts are known, and no more than the limits.
fn limited(drive: &DriveModel, torque: f64) -> f64 {
    let largest = drive.torque_max_nm.unwrap_or(f64::INFINITY);
    let torque = torque.clamp(-largest, largest);
    let per_count = drive.torque_per_count_nm();
    if per_count == 0.0 || drive.connection == Connection::Force {
        return torque;
    }
    let most = drive.counts_max.unwrap_or(f64::INFINITY);
    (torque / per_count).trunc().clamp(-most, most) * per_count
}
