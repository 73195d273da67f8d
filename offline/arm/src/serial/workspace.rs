//! Memory of the algorithms: sized once for an arm, written on every call.

use nalgebra::{IsometryMatrix3, Matrix3, Matrix6, Vector3, Vector6};

use super::SerialArm;

/// Scratch memory for one arm and one thread. Any arm with the same number of joints may use it; it carries nothing
/// from one call to the next but the frames of [`SerialArm::forward_kinematics`].
#[derive(Debug, Clone)]
pub struct Workspace {
    pub(super) states: Vec<State>,
    pub(super) spatial: Vec<Spatial>,
    /// Poses of the links in the base frame.
    pub(super) frames: Vec<IsometryMatrix3<f64>>,
    /// N·N.
    pub(super) matrix: Vec<f64>,
    /// N.
    pub(super) vector: Vec<f64>,
}

/// One body while the recursions run, in its stage's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    pub(super) rotation: Matrix3<f64>,
    pub(super) position: Vector3<f64>,
    pub(super) omega: Vector3<f64>,
    pub(super) omega_dot: Vector3<f64>,
    /// Acceleration of the origin, gravity included as an upward acceleration of the base.
    pub(super) acceleration: Vector3<f64>,
    pub(super) force: Vector3<f64>,
    pub(super) torque: Vector3<f64>,
}

/// One body for the Coriolis matrix, in base coordinates about the base's origin, angular part first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spatial {
    pub(super) axis: Vector6<f64>,
    pub(super) axis_dot: Vector6<f64>,
    pub(super) inertia: Matrix6<f64>,
    pub(super) quadratic: Matrix6<f64>,
}

impl State {
    const fn zero() -> Self {
        let (m, v) = (Matrix3::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; 3])), Vector3::new(0.0, 0.0, 0.0));
        Self { rotation: m, position: v, omega: v, omega_dot: v, acceleration: v, force: v, torque: v }
    }
}

impl Workspace {
    /// Memory for arms with as many joints as this one.
    pub fn new(arm: &SerialArm) -> Self {
        let n = arm.joint_count();
        let spatial =
            Spatial { axis: Vector6::zeros(), axis_dot: Vector6::zeros(), inertia: Matrix6::zeros(), quadratic: Matrix6::zeros() };
        Self {
            states: vec![State::zero(); n],
            spatial: vec![spatial; n],
            frames: vec![IsometryMatrix3::identity(); n],
            matrix: vec![0.0; n * n],
            vector: vec![0.0; n],
        }
    }

    /// Poses of the links in the base frame, as the last [`SerialArm::forward_kinematics`] left them.
    pub fn frames(&self) -> &[IsometryMatrix3<f64>] {
        &self.frames
    }
}
