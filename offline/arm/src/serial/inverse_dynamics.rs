//! Recursive Newton-Euler: torques of a motion.

use nalgebra::{Matrix3, Vector3};

use super::small::{cross, turn, turn_back};
use super::stage::Stage;
use super::workspace::State;
use super::{SerialArm, Workspace};

/// Force and torque that the surroundings put on the arm, in the base frame, the torque about the point of attack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force_n: Vector3<f64>,
    /// Torque, N·m.
    pub torque_nm: Vector3<f64>,
    /// Point of attack in the tip's frame, m.
    pub point_in_tool_m: Vector3<f64>,
}

impl SerialArm {
    /// Torques (prismatic: forces) that the joints need for accelerations `qdd`: `M·qdd + C·qd + g - Jᵀ·wrench`.
    ///
    /// # Panics
    /// If a vector is not N long or the workspace is another arm's.
    pub fn inverse_dynamics(
        &self,
        ws: &mut Workspace,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        wrench: Option<&Wrench>,
        tau: &mut [f64],
    ) {
        self.check_sizes(ws, &[q.len(), qd.len(), qdd.len(), tau.len()]);
        place(&self.stages, &mut ws.states, q);
        outward(&self.stages, &mut ws.states, -self.gravity_m_s2, |joint| (qd[joint], qdd[joint]));
        if let Some(wrench) = wrench {
            self.attack(&mut ws.states, wrench);
        }
        inward(&self.stages, &ws.states, tau);
    }

    /// Torques at rest acceleration: `C(q, qd)·qd + g(q)`.
    ///
    /// # Panics
    /// If a vector is not N long or the workspace is another arm's.
    pub fn bias(&self, ws: &mut Workspace, q: &[f64], qd: &[f64], out: &mut [f64]) {
        self.check_sizes(ws, &[q.len(), qd.len(), out.len()]);
        place(&self.stages, &mut ws.states, q);
        outward(&self.stages, &mut ws.states, -self.gravity_m_s2, |joint| (qd[joint], 0.0));
        inward(&self.stages, &ws.states, out);
    }

    /// Torques that hold the arm still against gravity: `g(q)`.
    ///
    /// # Panics
    /// If a vector is not N long or the workspace is another arm's.
    pub fn gravity(&self, ws: &mut Workspace, q: &[f64], out: &mut [f64]) {
        self.check_sizes(ws, &[q.len(), out.len()]);
        place(&self.stages, &mut ws.states, q);
        outward(&self.stages, &mut ws.states, -self.gravity_m_s2, |_| (0.0, 0.0));
        inward(&self.stages, &ws.states, out);
    }

    /// Velocity torques alone: `C(q, qd)·qd`.
    ///
    /// # Panics
    /// If a vector is not N long or the workspace is another arm's.
    pub fn coriolis_torque(&self, ws: &mut Workspace, q: &[f64], qd: &[f64], out: &mut [f64]) {
        self.check_sizes(ws, &[q.len(), qd.len(), out.len()]);
        place(&self.stages, &mut ws.states, q);
        outward(&self.stages, &mut ws.states, Vector3::zeros(), |joint| (qd[joint], 0.0));
        inward(&self.stages, &ws.states, out);
    }

    /// Takes an external wrench off the force that the last link needs.
    fn attack(&self, states: &mut [State], wrench: &Wrench) {
        let Some((last, stage)) = states.len().checked_sub(1).zip(self.stages.last()) else { return };
        let (mut force, mut torque) = (wrench.force_n, wrench.torque_nm);
        for state in states.iter() {
            force = turn_back(&state.rotation, &force);
            torque = turn_back(&state.rotation, &torque);
        }
        let tool = self.tool_pose();
        let lever = stage.alignment.inverse() * (tool.rotation * wrench.point_in_tool_m + tool.translation.vector);
        states[last].force -= force;
        states[last].torque -= torque + cross(&lever, &force);
    }
}

/// Rotations and origins at positions `q`.
#[inline]
pub(super) fn place(stages: &[Stage], states: &mut [State], q: &[f64]) {
    for ((stage, state), &q) in stages.iter().zip(states).zip(q) {
        (state.rotation, state.position) = stage.place(q);
    }
}

/// Base to tip: velocities, accelerations, and the force and torque that each link needs about its own origin. `motion`
/// gives rate and acceleration of a joint.
#[inline]
pub(super) fn outward(
    stages: &[Stage],
    states: &mut [State],
    base_acceleration: Vector3<f64>,
    motion: impl Fn(usize) -> (f64, f64),
) {
    let (mut omega, mut omega_dot, mut acceleration) = (Vector3::zeros(), Vector3::zeros(), base_acceleration);
    // Acceleration of a point fixed to the link: `whirl · point` beyond the origin's. The base stands.
    let mut whirl = Matrix3::zeros();
    for (joint, (stage, state)) in stages.iter().zip(states).enumerate() {
        let (rate, rate_dot) = motion(joint);
        if joint > 0 {
            acceleration += turn(&whirl, &state.position);
            omega = turn_back(&state.rotation, &omega);
            omega_dot = turn_back(&state.rotation, &omega_dot);
        }
        acceleration = turn_back(&state.rotation, &acceleration);
        // What the link before does, crossed with z: (x, y, z) × (0, 0, 1) = (y, -x, 0).
        if stage.prismatic {
            acceleration += Vector3::new(2.0 * rate * omega.y, -2.0 * rate * omega.x, rate_dot);
        } else {
            omega_dot += Vector3::new(rate * omega.y, -rate * omega.x, rate_dot);
            omega.z += rate;
        }
        let (h, inertia) = (&stage.moment, &stage.inertia);
        whirl = whirling(&omega, &omega_dot);
        state.force = acceleration * stage.mass + turn(&whirl, h);
        state.torque = turn(inertia, &omega_dot) + cross(&omega, &turn(inertia, &omega)) + cross(h, &acceleration);
        state.omega = omega;
        state.omega_dot = omega_dot;
        state.acceleration = acceleration;
    }
}

/// `ω̇× + ω×ω×`.
#[inline]
fn whirling(omega: &Vector3<f64>, omega_dot: &Vector3<f64>) -> Matrix3<f64> {
    let (w, d) = (omega, omega_dot);
    let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
    let (xy, xz, yz) = (w.x * w.y, w.x * w.z, w.y * w.z);
    Matrix3::new(-yy - zz, xy - d.z, xz + d.y, xy + d.z, -xx - zz, yz - d.x, xz - d.y, yz + d.x, -xx - yy)
}

/// Tip to base: sums up the forces and reads off what acts along or about each axis.
#[inline]
pub(super) fn inward(stages: &[Stage], states: &[State], tau: &mut [f64]) {
    let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
    for ((stage, state), tau) in stages.iter().zip(states).zip(tau).rev() {
        force += state.force;
        torque += state.torque;
        *tau = if stage.prismatic { force.z } else { torque.z };
        force = turn(&state.rotation, &force);
        torque = turn(&state.rotation, &torque) + cross(&state.position, &force);
    }
}
