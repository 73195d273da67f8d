//! Inertial regressor: inverse dynamics is linear in ten parameters per link.

use nalgebra::{SMatrix, Vector3};

use super::inverse_dynamics::{outward, place};
use super::{PARAMETERS, SerialArm, Workspace};

/// One column per parameter.
type Columns = SMatrix<f64, 3, PARAMETERS>;

impl SerialArm {
    /// Regressor Y(q, qd, qdd), N×10N row-major: `Y · parameters` is the inverse dynamics without a wrench, parameters as
    /// [`Self::parameters`] has them. Gravity is in it; the arm's own inertia is not.
    ///
    /// # Panics
    /// If a vector is not N or `y_out` not N·10·N long, or the workspace is another arm's.
    pub fn regressor(&self, ws: &mut Workspace, q: &[f64], qd: &[f64], qdd: &[f64], y_out: &mut [f64]) {
        self.check_sizes(ws, &[q.len(), qd.len(), qdd.len()]);
        let n = self.stages.len();
        let width = PARAMETERS * n;
        assert_eq!(y_out.len(), n * width, "N 10 N numbers of the regressor");
        place(&self.stages, &mut ws.states, q);
        outward(&self.stages, &mut ws.states, -self.gravity_m_s2, |joint| (qd[joint], qdd[joint]));
        y_out.fill(0.0);
        for link in 0..n {
            // Parameters belong to the link's own frame, the recursion to the stage's.
            let (state, turn) = (&ws.states[link], self.stages[link].alignment.matrix());
            let (force, torque) = link_columns(&(turn * state.omega), &(turn * state.omega_dot), &(turn * state.acceleration));
            let (mut force, mut torque) = (turn.transpose() * force, turn.transpose() * torque);
            for joint in (0..=link).rev() {
                let felt = if self.stages[joint].prismatic { force.row(2) } else { torque.row(2) };
                let start = joint * width + link * PARAMETERS;
                for (out, value) in y_out[start..start + PARAMETERS].iter_mut().zip(felt.iter()) {
                    *out = *value;
                }
                let state = &ws.states[joint];
                force = state.rotation * force;
                torque = state.rotation * torque + state.position.cross_matrix() * force;
            }
        }
    }
}

/// Force and torque about the link's origin per parameter, for its angular velocity, angular acceleration and the
/// acceleration of its origin with gravity taken off.
fn link_columns(omega: &Vector3<f64>, omega_dot: &Vector3<f64>, acceleration: &Vector3<f64>) -> (Columns, Columns) {
    let (mut force, mut torque) = (Columns::zeros(), Columns::zeros());
    let spin = omega.cross_matrix();
    force.set_column(0, acceleration);
    force.fixed_view_mut::<3, 3>(0, 1).copy_from(&(omega_dot.cross_matrix() + spin * spin));
    torque.fixed_view_mut::<3, 3>(0, 1).copy_from(&-acceleration.cross_matrix());
    torque.fixed_view_mut::<3, 6>(0, 4).copy_from(&(on_tensor(omega_dot) + spin * on_tensor(omega)));
    (force, torque)
}

/// The matrix that gives `I·v` from `[Ixx, Ixy, Iyy, Ixz, Iyz, Izz]`.
fn on_tensor(v: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let (x, y, z) = (v.x, v.y, v.z);
    SMatrix::<f64, 3, 6>::from_row_slice(&[x, y, 0.0, z, 0.0, 0.0, 0.0, x, y, 0.0, z, 0.0, 0.0, 0.0, 0.0, x, y, z])
}
