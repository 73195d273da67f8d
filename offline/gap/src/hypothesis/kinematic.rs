//! Where the measured tip is against the joints: geometry and the frame of the measurement.

use arm::serial::{Body, SerialArm, Tool, Workspace};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::dictionary::Dictionary;
use super::{Bound, Candidate, Column};
use crate::problem::Channel;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Candidate>) {
    if dictionary.tip_rows.is_empty() {
        return;
    }
    let problem = dictionary.problem;
    let arm = &problem.robot.arm;
    let here = tips(dictionary, arm);
    for link in 0..dictionary.joints() {
        const TURN: f64 = 1e-4;
        let turned = with_placement(arm, link, |placement| placement * Rotation3::from_scaled_axis(Vector3::x() * TURN));
        let before = with_placement(arm, link, |placement| Rotation3::from_scaled_axis(Vector3::x() * TURN) * placement);
        for (form, arm) in [("twist before the joint", before), ("twist of the link's own frame", turned)] {
            let column = derivative(dictionary, &here, &arm, TURN);
            all.push(Candidate::new("link_geometry", &[link], form, Channel::EndEffector).with(column, Bound::Between(-0.2, 0.2)));
        }
        for (k, axis) in [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().enumerate() {
            const STEP: f64 = 1e-5;
            let moved = with_placement(arm, link, |placement| Translation3::from(axis * STEP) * placement);
            let column = derivative(dictionary, &here, &moved, STEP);
            let form = ["moved along x", "moved along y", "moved along z"][k];
            all.push(Candidate::new("link_geometry", &[link], form, Channel::EndEffector).with(column, Bound::Between(-0.1, 0.1)));
        }
    }
    push_length(dictionary, &here, all);
    let mut frame = Candidate::new("frame_misalignment", &[], "turned and moved", Channel::EndEffector);
    let mut moved = Candidate::new("frame_misalignment", &[], "moved", Channel::EndEffector);
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        frame = frame.with(dictionary.tip(|_, _, row| axis.cross(&here[row]).into()), Bound::Between(-0.6, 0.6));
    }
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        frame = frame.with(dictionary.tip(|_, _, _| axis.into()), Bound::Free);
        moved = moved.with(dictionary.tip(|_, _, _| axis.into()), Bound::Free);
    }
    all.push(frame);
    all.push(moved);
}

/// Length of the tool: along its offset from the last link.
fn push_length(dictionary: &Dictionary, here: &[Vector3<f64>], all: &mut Vec<Candidate>) {
    const STEP: f64 = 1e-5;
    let arm = &dictionary.problem.robot.arm;
    let pose = arm.tool_pose();
    let offset = pose.translation.vector;
    let axis = if offset.norm() > 1e-6 { offset.normalize() } else { pose.rotation * Vector3::z() };
    let longer = with_tool(arm, Translation3::from(axis * STEP) * pose);
    let column = derivative(dictionary, here, &longer, STEP);
    let last = dictionary.joints() - 1;
    all.push(Candidate::new("link_geometry", &[last], "length", Channel::EndEffector).with(column, Bound::Between(-0.1, 0.1)));
}

fn tips(dictionary: &Dictionary, arm: &SerialArm) -> Vec<Vector3<f64>> {
    let mut ws = Workspace::new(arm);
    let problem = dictionary.problem;
    let at = |&(r, i): &(usize, usize)| problem.joints(&problem.pairs[r].real, i);
    dictionary.tip_rows.iter().map(|row| arm.tip(&mut ws, &at(row)).translation.vector).collect()
}

fn derivative(dictionary: &Dictionary, here: &[Vector3<f64>], arm: &SerialArm, step: f64) -> Column {
    let there = tips(dictionary, arm);
    dictionary.tip(|_, _, row| ((there[row] - here[row]) / step).into())
}

fn with_placement(arm: &SerialArm, link: usize, change: impl Fn(IsometryMatrix3<f64>) -> IsometryMatrix3<f64>) -> SerialArm {
    let mut bodies: Vec<Body> = arm.bodies().to_vec();
    bodies[link].placement = change(bodies[link].placement);
    rebuilt(arm, bodies, arm.tool_pose())
}

fn with_tool(arm: &SerialArm, pose: IsometryMatrix3<f64>) -> SerialArm {
    rebuilt(arm, arm.bodies().to_vec(), pose)
}

fn rebuilt(arm: &SerialArm, bodies: Vec<Body>, tool: IsometryMatrix3<f64>) -> SerialArm {
    let tools = vec![Tool { name: "tip".to_owned(), pose: tool }];
    SerialArm::new(arm.name(), bodies, arm.gravity_vector(), tools).expect("a small change of an arm that exists")
}
