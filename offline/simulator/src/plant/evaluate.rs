//! Forces at one state.

use super::{Between, JOINTS_MAX, MEMORIES_MAX, Passive, Plant, State, Vector, on};
use crate::physics::LoadDependentFriction;

/// Everything that a time step needs to know about one state.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluation {
    /// What accelerates the links: `M q'' = drive - bias`.
    pub(super) drive: Vector,
    /// Velocity terms and gravity.
    pub(super) bias: Vector,
    /// Mass matrix, row-major, joints by joints.
    pub(super) mass: [f64; JOINTS_MAX * JOINTS_MAX],
    /// What accelerates the motors, N·m at the capstan.
    pub(super) motor: Vector,
    /// Slope of the cable torque over the deflection.
    pub(super) stiffness: Vector,
    /// Slope of the cable torque over the rate of the deflection.
    pub(super) damping: Vector,
    /// Chord of the joint friction.
    pub(super) joint_slope: Vector,
    /// Chord of the motor friction, N·m at the capstan per rad/s.
    pub(super) motor_slope: Vector,
    /// Friction of rigid motors over the rate of the joints.
    pub(super) rigid_slope: Vector,
    /// Rates of the memories.
    pub(super) memory_rates: [f64; MEMORIES_MAX],
}

impl Evaluation {
    pub(super) const ZERO: Self = Self {
        drive: [0.0; JOINTS_MAX],
        bias: [0.0; JOINTS_MAX],
        mass: [0.0; JOINTS_MAX * JOINTS_MAX],
        motor: [0.0; JOINTS_MAX],
        stiffness: [0.0; JOINTS_MAX],
        damping: [0.0; JOINTS_MAX],
        joint_slope: [0.0; JOINTS_MAX],
        motor_slope: [0.0; JOINTS_MAX],
        rigid_slope: [0.0; JOINTS_MAX],
        memory_rates: [0.0; MEMORIES_MAX],
    };
}

/// Where motors and joints stand against each other.
pub(super) struct Deflection {
    pub(super) position: Vector,
    pub(super) rate: Vector,
    /// Slope of the shift, by joint.
    pub(super) slope: Vector,
}

impl Plant {
    pub(super) fn deflections(&self, state: &State) -> Deflection {
        let n = self.joints;
        let mut seen = [0.0; JOINTS_MAX];
        let mut seen_rate = [0.0; JOINTS_MAX];
        for i in 0..n {
            let ratio = self.drives[i].nominal.ratio;
            seen[i] = state.motors[i] / ratio;
            seen_rate[i] = state.speeds[i] / ratio;
        }
        if self.rigid {
            self.see_rigid(state, &mut seen, &mut seen_rate);
        }
        let mut slope = [0.0; JOINTS_MAX];
        if self.shifted {
            slope = self.shift(&mut seen, &mut seen_rate);
        }
        if self.rigid {
            self.ground(&mut seen, &mut seen_rate);
        }
        let mut found = Deflection { position: seen, rate: seen_rate, slope };
        for i in 0..n {
            for j in 0..n {
                found.position[i] -= self.path[i][j] * state.joints[j];
                found.rate[i] -= self.path[i][j] * state.rates[j];
            }
        }
        found
    }

    /// Adds to motor-side positions and rates what the controller does not know: offsets, wrong ratios, eccentric pulleys.
    pub(super) fn shift(&self, seen: &mut Vector, seen_rate: &mut Vector) -> Vector {
        let n = self.joints;
        let mut slope = [0.0; JOINTS_MAX];
        let mut shift = [0.0; JOINTS_MAX];
        let mut shift_rate = [0.0; JOINTS_MAX];
        for j in 0..n {
            let believed: f64 = (0..n).map(|k| self.coupling_inverse[j][k] * seen[k]).sum();
            let believed_rate: f64 = (0..n).map(|k| self.coupling_inverse[j][k] * seen_rate[k]).sum();
            (shift[j], slope[j]) = self.drives[j].shift(believed);
            shift_rate[j] = slope[j] * believed_rate;
        }
        for i in 0..n {
            for j in 0..n {
                seen[i] += self.coupling_nominal[i][j] * shift[j];
                seen_rate[i] += self.coupling_nominal[i][j] * shift_rate[j];
            }
        }
        slope
    }

    /// Torque with which the cables pull back, in joint units on the motor's side: `(dx/dm)^T T` without the ratio.
    pub(super) fn reaction(&self, torque: &Vector, slope: &Vector) -> Vector {
        if !self.shifted {
            return *torque;
        }
        let n = self.joints;
        let mut by_joint = [0.0; JOINTS_MAX];
        for j in 0..n {
            by_joint[j] = slope[j] * (0..n).map(|i| self.coupling_nominal[i][j] * torque[i]).sum::<f64>();
        }
        let mut out = *torque;
        for k in 0..n {
            out[k] += (0..n).map(|j| self.coupling_inverse[j][k] * by_joint[j]).sum::<f64>();
        }
        out
    }

    /// Forces at a state, under capstan torques.
    pub(super) fn evaluate(&mut self, state: &State, applied_nm: &Vector, out: &mut Evaluation) {
        let n = self.joints;
        let found = self.deflections(state);
        let mut torque = [0.0; JOINTS_MAX];
        for i in 0..n {
            let drive = &self.drives[i];
            let cable = drive.elastic(found.position[i], found.rate[i], &state.memories);
            torque[i] = cable.torque;
            out.stiffness[i] = cable.stiffness;
            out.damping[i] = cable.damping;
            drive.memories(cable.torque, found.rate[i], applied_nm[i], &state.memories, &mut out.memory_rates);
        }
        let reaction = self.reaction(&self.of_cables(&torque), &found.slope);
        let mut external = self.external(state);
        if self.rigid {
            self.push_rigid(state, applied_nm, &mut external, &mut out.rigid_slope);
        }
        for i in 0..n {
            let drive = &self.drives[i];
            let warm = if drive.thermal.is_empty() { 1.0 } else { drive.warm_share(&state.memories) };
            let nominal = &drive.nominal;
            if nominal.between == Between::Rigid {
                (out.motor[i], out.motor_slope[i]) = (0.0, 0.0);
            } else {
                let (motor_friction, motor_slope) = drive.motor_friction(state.speeds[i], warm);
                out.motor[i] =
                    applied_nm[i] - motor_friction - drive.drag(&state.memories) - nominal.gear / nominal.ratio * reaction[i];
                drive.drag_rates(state.speeds[i], &state.memories, &mut out.memory_rates);
                if !drive.ripple.is_empty() {
                    out.motor[i] -= drive.ripple(state.motors[i]);
                }
                out.motor_slope[i] = motor_slope;
            }
            if let Some(stiction) = drive.stiction {
                out.memory_rates[stiction.slot] = stiction.rate(state.rates[i], state.memories[stiction.slot], self.step_s);
            }
            let friction = drive.joint_friction(state.rates[i], warm, &state.memories);
            let pulled: f64 = (0..n).map(|k| self.path[k][i] * torque[k]).sum::<f64>() + external[i] - friction.torque;
            out.joint_slope[i] = friction.slope + out.rigid_slope[i];
            out.drive[i] = if friction.per_load == 0.0 {
                pulled
            } else {
                out.joint_slope[i] += friction.per_load * pulled.abs() * friction.sign_slope;
                LoadDependentFriction::load(friction.per_load, pulled, friction.sign)
            };
        }
        let (mass, bias) = (&mut out.mass[..n * n], &mut out.bias[..n]);
        self.body.mass_matrix_and_bias(&mut self.workspace, &state.joints[..n], &state.rates[..n], mass, bias);
        if self.rigid {
            self.add_armatures(&mut out.mass);
        }
    }

    /// Joint torques of what the tip touches and of springs to the ground.
    pub(super) fn external(&mut self, state: &State) -> Vector {
        let mut out = [0.0; JOINTS_MAX];
        for (i, drive) in self.drives.iter().enumerate() {
            let passive = &drive.nominal.passive;
            if *passive != Passive::NONE {
                out[i] = passive.stiffness * (passive.rest - state.joints[i]) - passive.damping * state.rates[i];
            }
        }
        if self.contacts.iter().all(|contact| !contact.on) {
            return out;
        }
        let n = self.joints;
        let joints = &state.joints[..n];
        let tip = self.body.tip(&mut self.workspace, joints).translation.vector;
        let mut jacobian = [0.0; 6 * JOINTS_MAX];
        self.body.jacobian(&mut self.workspace, joints, &nalgebra::Vector3::zeros(), &mut jacobian[..6 * n]);
        for contact in on(&self.contacts) {
            let force = contact.force(tip);
            for (joint, torque) in out.iter_mut().enumerate().take(n) {
                *torque += (0..3).map(|axis| jacobian[axis * n + joint] * force[axis]).sum::<f64>();
            }
        }
        out
    }

    /// Cable force of every drive, N (N also for turning joints: at the radius of the joint's pulley), at a state.
    pub fn cable_forces_n(&self, state: &State) -> Vector {
        let found = self.deflections(state);
        let mut forces = [0.0; JOINTS_MAX];
        for (i, drive) in self.drives.iter().enumerate() {
            let cable = drive.elastic(found.position[i], found.rate[i], &state.memories);
            forces[i] = cable.torque / drive.nominal.radius_m;
        }
        forces
    }

    /// Cable stretch, m, and elastic-plus-damping force, N, as `vectors/plant.csv` has them.
    pub fn cable_stretch_m(&self, state: &State) -> Vector {
        let found = self.deflections(state);
        std::array::from_fn(|i| if i < self.joints { found.position[i] * self.drives[i].nominal.radius_m } else { 0.0 })
    }

    /// Accelerations of joints and motors at a state under capstan torques, N·m.
    pub fn accelerations(&mut self, state: &State, torque_nm: &Vector) -> (Vector, Vector) {
        let mut evaluation = Evaluation::ZERO;
        let applied = self.applied(torque_nm);
        self.evaluate(state, &applied, &mut evaluation);
        self.accelerations_of(&evaluation)
    }

    pub(super) fn accelerations_of(&self, evaluation: &Evaluation) -> (Vector, Vector) {
        let n = self.joints;
        let mut joints = [0.0; JOINTS_MAX];
        for i in 0..n {
            joints[i] = evaluation.drive[i] - evaluation.bias[i];
        }
        super::solve::solve_mass(&evaluation.mass, n, &mut joints);
        let mut motors = [0.0; JOINTS_MAX];
        for i in 0..n {
            motors[i] = evaluation.motor[i] / self.drives[i].nominal.inertia;
        }
        (joints, motors)
    }

    /// Capstan torques that act for commanded ones.
    pub(super) fn applied(&self, torque_nm: &Vector) -> Vector {
        std::array::from_fn(|i| self.drives.get(i).map_or(0.0, |drive| drive.applied(torque_nm[i])))
    }
}
