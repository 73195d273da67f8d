//! Poses of links and tip, and the geometric Jacobian.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use super::{SerialArm, Workspace};

impl SerialArm {
    /// Poses of all links in the base frame at positions `q`; they stay in the workspace until the next call.
    ///
    /// # Panics
    /// If `q` is not N long or the workspace is another arm's.
    pub fn forward_kinematics<'w>(&self, ws: &'w mut Workspace, q: &[f64]) -> &'w [IsometryMatrix3<f64>] {
        self.check_sizes(ws, &[q.len()]);
        let (mut rotation, mut position) = (Matrix3::identity(), Vector3::zeros());
        for ((stage, &q), frame) in self.stages.iter().zip(q).zip(&mut ws.frames) {
            let (r, p) = stage.place(q);
            position += rotation * p;
            rotation *= r;
            let link = rotation * stage.alignment.matrix().transpose();
            *frame = IsometryMatrix3::from_parts(Translation3::from(position), Rotation3::from_matrix_unchecked(link));
        }
        &ws.frames
    }

    /// Pose of the tip in the base frame.
    ///
    /// # Panics
    /// If `q` is not N long or the workspace is another arm's.
    pub fn tip(&self, ws: &mut Workspace, q: &[f64]) -> IsometryMatrix3<f64> {
        self.forward_kinematics(ws, q)[self.joint_count() - 1] * self.tool_pose()
    }

    /// Geometric Jacobian, 6×N row-major, of a point of the last link given in the tip's frame, m: `out · qd` is the
    /// point's velocity (three rows, m/s) and the last link's angular velocity (three rows, rad/s) in the base frame.
    ///
    /// # Panics
    /// If `q` is not N or `out` not 6·N long, or the workspace is another arm's.
    pub fn jacobian(&self, ws: &mut Workspace, q: &[f64], point_in_tool_m: &Vector3<f64>, out: &mut [f64]) {
        let n = self.joint_count();
        assert_eq!(out.len(), 6 * n, "6 N numbers of the Jacobian");
        let tip = self.tip(ws, q);
        let point = tip.rotation * point_in_tool_m + tip.translation.vector;
        for (joint, (stage, frame)) in self.stages.iter().zip(&ws.frames).enumerate() {
            let axis = frame.rotation * stage.alignment.matrix().column(2);
            let (linear, angular) =
                if stage.prismatic { (axis, Vector3::zeros()) } else { (axis.cross(&(point - frame.translation.vector)), axis) };
            for row in 0..3 {
                out[row * n + joint] = linear[row];
                out[(row + 3) * n + joint] = angular[row];
            }
        }
    }

    /// Are the workspace and every vector as long as the arm has joints?
    #[inline]
    pub(super) fn check_sizes(&self, ws: &Workspace, lengths: &[usize]) {
        let n = self.stages.len();
        assert!(ws.states.len() == n, "the workspace belongs to an arm with {} joints, this one has {n}", ws.states.len());
        assert!(lengths.iter().all(|&length| length == n), "vectors of {lengths:?} numbers for {n} joints");
    }
}
