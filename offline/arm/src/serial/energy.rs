//! Kinetic and potential energy, link by link: independent of the mass matrix, which is checked against it.

use nalgebra::{Matrix3, Vector3};

use super::{SerialArm, Workspace};

impl SerialArm {
    /// Kinetic energy, J.
    ///
    /// # Panics
    /// If a vector is not N long or the workspace is another arm's.
    pub fn kinetic_energy(&self, ws: &mut Workspace, q: &[f64], qd: &[f64]) -> f64 {
        self.check_sizes(ws, &[q.len(), qd.len()]);
        let (mut velocity, mut omega, mut energy) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for ((stage, &q), &rate) in self.stages.iter().zip(q).zip(qd) {
            let (rotation, position) = stage.place(q);
            velocity = rotation.tr_mul(&(velocity + omega.cross(&position)));
            omega = rotation.tr_mul(&omega);
            if stage.prismatic {
                velocity.z += rate;
            } else {
                omega.z += rate;
            }
            let turning = omega.dot(&(stage.inertia * omega)) / 2.0;
            energy += turning + velocity.dot(&omega.cross(&stage.moment)) + stage.mass * velocity.norm_squared() / 2.0;
        }
        energy
    }

    /// Potential energy in gravity, J; 0 if all mass were in the base's origin.
    ///
    /// # Panics
    /// If `q` is not N long or the workspace is another arm's.
    pub fn potential_energy(&self, ws: &mut Workspace, q: &[f64]) -> f64 {
        self.check_sizes(ws, &[q.len()]);
        let (mut rotation, mut position, mut moment) = (Matrix3::identity(), Vector3::zeros(), Vector3::zeros());
        for (stage, &q) in self.stages.iter().zip(q) {
            let (r, p) = stage.place(q);
            position += rotation * p;
            rotation *= r;
            moment += position * stage.mass + rotation * stage.moment;
        }
        -self.gravity_m_s2.dot(&moment)
    }
}
