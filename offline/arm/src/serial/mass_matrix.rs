//! Composite rigid bodies: the mass matrix; and the call of a simulator's inner loop, mass matrix and bias together.

use nalgebra::{Matrix3, Vector3};

use super::inverse_dynamics::{inward, outward, place};
use super::small::{cross, turn, turn_tensor};
use super::stage::Stage;
use super::workspace::State;
use super::{SerialArm, Workspace};

impl SerialArm {
    /// Mass matrix M(q), N×N row-major, symmetric; kg·m², kg·m or kg by the joints' kinds.
    ///
    /// # Panics
    /// If `q` is not N or `m_out` not N·N long, or the workspace is another arm's.
    pub fn mass_matrix(&self, ws: &mut Workspace, q: &[f64], m_out: &mut [f64]) {
        self.check_sizes(ws, &[q.len()]);
        place(&self.stages, &mut ws.states, q);
        composite(&self.stages, &ws.states, m_out);
    }

    /// [`Self::mass_matrix`] and [`Self::bias`] for the price of one set of sines and cosines.
    ///
    /// # Panics
    /// If a vector is not N or `m_out` not N·N long, or the workspace is another arm's.
    pub fn mass_matrix_and_bias(&self, ws: &mut Workspace, q: &[f64], qd: &[f64], m_out: &mut [f64], bias_out: &mut [f64]) {
        self.check_sizes(ws, &[q.len(), qd.len(), bias_out.len()]);
        place(&self.stages, &mut ws.states, q);
        outward(&self.stages, &mut ws.states, -self.gravity_m_s2, |joint| (qd[joint], 0.0));
        inward(&self.stages, &ws.states, bias_out);
        composite(&self.stages, &ws.states, m_out);
    }
}

/// A body and all behind it as one rigid body, in the body's frame.
struct Composite {
    mass: f64,
    moment: Vector3<f64>,
    inertia: Matrix3<f64>,
}

/// Mass matrix of placed states.
#[inline]
pub(super) fn composite(stages: &[Stage], states: &[State], m_out: &mut [f64]) {
    let n = stages.len();
    assert!(m_out.len() == n * n && states.len() == n, "N N numbers of the mass matrix");
    let mut body = Composite { mass: 0.0, moment: Vector3::zeros(), inertia: Matrix3::zeros() };
    for i in (0..n).rev() {
        body.add(&stages[i]);
        let (mut force, mut torque) = body.unit_acceleration(stages[i].prismatic);
        m_out[i * n + i] = if stages[i].prismatic { force.z } else { torque.z };
        for j in (0..i).rev() {
            let moved = &states[j + 1];
            force = turn(&moved.rotation, &force);
            torque = turn(&moved.rotation, &torque) + cross(&moved.position, &force);
            let entry = if stages[j].prismatic { force.z } else { torque.z };
            m_out[i * n + j] = entry;
            m_out[j * n + i] = entry;
        }
        if i > 0 {
            body.shift(&states[i]);
        }
    }
}

impl Composite {
    #[inline]
    fn add(&mut self, stage: &Stage) {
        self.mass += stage.mass;
        self.moment += stage.moment;
        self.inertia += stage.inertia;
    }

    /// Force and torque about the origin for a unit acceleration of the joint with all behind it frozen.
    #[inline]
    fn unit_acceleration(&self, prismatic: bool) -> (Vector3<f64>, Vector3<f64>) {
        let h = &self.moment;
        if prismatic {
            (Vector3::new(0.0, 0.0, self.mass), Vector3::new(h.y, -h.x, 0.0))
        } else {
            (Vector3::new(-h.y, h.x, 0.0), Vector3::new(self.inertia.m13, self.inertia.m23, self.inertia.m33))
        }
    }

    /// Sees itself from the frame before.
    #[inline]
    fn shift(&mut self, state: &State) {
        let p = &state.position;
        let h = turn(&state.rotation, &self.moment);
        let mut inertia = turn_tensor(&state.rotation, &self.inertia);
        // ∫(|x|² - xxᵀ) with x = p + r·y; k = h + m·p/2 makes the shift k·pᵀ + p·kᵀ.
        let k = h + p * (self.mass / 2.0);
        let (xx, yy, zz) = (2.0 * k.x * p.x, 2.0 * k.y * p.y, 2.0 * k.z * p.z);
        let (xy, xz, yz) = (k.x * p.y + k.y * p.x, k.x * p.z + k.z * p.x, k.y * p.z + k.z * p.y);
        inertia.m11 += yy + zz;
        inertia.m22 += xx + zz;
        inertia.m33 += xx + yy;
        inertia.m12 -= xy;
        inertia.m21 -= xy;
        inertia.m13 -= xz;
        inertia.m31 -= xz;
        inertia.m23 -= yz;
        inertia.m32 -= yz;
        self.inertia = inertia;
        self.moment = h + p * self.mass;
    }
}
