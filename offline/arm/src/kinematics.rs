//! Joints to tip: modified (Craig) Denavit-Hartenberg chain of the control software (raven2-plant.md, section 2).

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use crate::plant::KinematicsTable;
use crate::{Joints, Side};

/// Frames of the chain, 1 to 6; frame 6 is the tip.
pub const FRAMES: usize = 6;

/// Insertion is the third frame's length; the controller counts it as joint 3.
const INSERTION_FRAME: usize = 2;

/// One row of the table: `T = Rx(alpha) Tx(a) Rz(theta) Tz(d)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Link {
    pub(crate) alpha_sin: f64,
    pub(crate) alpha_cos: f64,
    pub(crate) a_m: f64,
    pub(crate) theta_offset: f64,
    pub(crate) d_m: f64,
}

impl Link {
    pub(crate) fn transform(&self, theta: f64, d_m: f64) -> IsometryMatrix3<f64> {
        let (sin, cos) = theta.sin_cos();
        let (sa, ca) = (self.alpha_sin, self.alpha_cos);
        let rotation = Matrix3::new(cos, -sin, 0.0, sin * ca, cos * ca, -sa, sin * sa, cos * sa, ca);
        let translation = Translation3::new(self.a_m, -d_m * sa, d_m * ca);
        IsometryMatrix3::from_parts(translation, Rotation3::from_matrix_unchecked(rotation))
    }
}

/// Forward kinematics of one arm, in frame 0 of that arm: origin in the remote centre of motion, x up, z along the
/// shoulder axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Kinematics {
    links: [Link; FRAMES],
}

impl Kinematics {
    pub(crate) fn new(table: &KinematicsTable, side: Side) -> Self {
        let rows = table.side(side);
        let links = std::array::from_fn(|i| {
            let (alpha_sin, alpha_cos) = rows.alpha_deg[i].to_radians().sin_cos();
            Link {
                alpha_sin,
                alpha_cos,
                a_m: rows.a_m[i],
                theta_offset: rows.theta_offset_deg[i].to_radians(),
                d_m: rows.d_m[i].constant_m(),
            }
        });
        Self { links }
    }

    pub(crate) fn links(&self) -> &[Link; FRAMES] {
        &self.links
    }

    /// Pose of the tip: translation in m, rotation, in frame 0 of the arm.
    pub fn tip(&self, joints: &Joints) -> IsometryMatrix3<f64> {
        self.frames(joints)[FRAMES - 1]
    }

    /// Position of the tip in frame 0 of the arm, m.
    pub fn tip_position(&self, joints: &Joints) -> Vector3<f64> {
        self.tip(joints).translation.vector
    }

    /// Poses of the frames 1 to 6 in frame 0.
    pub fn frames(&self, joints: &Joints) -> [IsometryMatrix3<f64>; FRAMES] {
        let [j1, j2, insertion_m, j4, j5, _, _] = *joints;
        let variable = [j1, j2, 0.0, j4, j5, wrist_yaw(joints)];
        let mut pose = IsometryMatrix3::identity();
        std::array::from_fn(|i| {
            let link = &self.links[i];
            let d_m = if i == INSERTION_FRAME { insertion_m } else { link.d_m };
            pose *= link.transform(link.theta_offset + variable[i], d_m);
            pose
        })
    }
}

/// Yaw of the wrist, rad: half the difference of the two jaws (ravenstate.md, trap 7).
pub fn wrist_yaw(joints: &Joints) -> f64 {
    (joints[6] - joints[5]) / 2.0
}

/// Opening of the jaws, rad: their sum (ravenstate.md, trap 7).
pub fn jaw_opening(joints: &Joints) -> f64 {
    joints[5] + joints[6]
}
