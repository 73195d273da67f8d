//! Where the measured tip is against the joints: geometry and the frame of the measurement.

use arm::serial::{Body, SerialArm, Tool, Workspace};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::dictionary::Dictionary;
use super::{Bound, Column, Family};
use crate::cell::Channel;

const TIP: Channel = Channel::EndEffector;
/// Forms of a link that is turned, or moved, by itself or with the torque that its weight then asks for.
pub(crate) const TWISTED: [&str; 2] = ["twist before the joint", "twist before the joint, torque too"];
const MOVED: [[&str; 2]; 3] = [
    ["moved along x", "moved along x, torque too"],
    ["moved along y", "moved along y, torque too"],
    ["moved along z", "moved along z, torque too"],
];
/// The form of a tool that is turned about the last link's x.
pub(crate) const TOOL_TWIST: &str = "twist of the tool";
/// The form of a tool that is longer.
pub(crate) const TOOL_LENGTH: &str = "length";
/// Turn from which derivatives are taken, rad.
const TURN: f64 = 1e-4;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    if dictionary.tip_rows.is_empty() {
        return;
    }
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let small = Bound::Between(-0.2, 0.2);
    // A link that is otherwise than believed carries its weight elsewhere; a kinematic model that is wrong for the camera alone does not.
    let told: &[bool] = if dictionary.problem.has(Channel::JointTorque) { &[false, true] } else { &[false] };
    for link in 0..dictionary.joints() {
        for &carries in told {
            // The base may stand anywhere.
            let moves = link > 0 || !carries;
            let form = TWISTED[usize::from(carries)];
            all.push(Family::fixed("link_geometry", &[link], form, TIP, &[small], move |d| {
                let turn = Rotation3::from_scaled_axis(Vector3::x() * TURN);
                vec![changed(d, &with_placement(&d.problem.robot.arm, link, |placement| turn * placement), TURN, carries)]
            }));
            for (axis, forms) in axes.into_iter().zip(MOVED).filter(|_| moves) {
                all.push(
                    Family::fixed("link_geometry", &[link], forms[usize::from(carries)], TIP, &[small], move |d| {
                        const STEP: f64 = 1e-5;
                        let step = Translation3::from(axis * STEP);
                        vec![changed(d, &with_placement(&d.problem.robot.arm, link, |placement| step * placement), STEP, carries)]
                    })
                    .penalised(2.0),
                );
            }
        }
    }
    let last = dictionary.joints() - 1;
    all.push(Family::fixed("link_geometry", &[last], TOOL_LENGTH, TIP, &[small], longer));
    all.push(Family::fixed("link_geometry", &[last], TOOL_TWIST, TIP, &[small], twisted));
    // Always both: what a frame that is only moved or only turned would say of the other is that it is known to be nothing.
    let turned = Bound::Between(-0.9, 0.9);
    let moves = move |d: &Dictionary| axes.map(|axis| d.tip(|_, _, _| axis.into()));
    let free = Bound::Free;
    let turns = ["w_x", "w_y", "w_z"];
    all.push(
        Family::secant(
            "frame_misalignment",
            &[],
            "turned and moved",
            TIP,
            &[turned, turned, turned, free, free, free],
            &turns,
            move |d, s| {
                let mut columns = turning(d, s);
                columns.extend(moves(d));
                columns
            },
        )
        .penalised(1.0),
    );
}

/// `Exp(w) p - p`, one secant for each number of w.
fn turning(dictionary: &Dictionary, w: &[f64]) -> Vec<Column> {
    let here = tips(dictionary, &dictionary.problem.robot.arm);
    let w: Vec<f64> = w.iter().map(|x| if x.abs() < 1e-5 { 1e-5 } else { *x }).collect();
    let after = |k: usize| Rotation3::from_scaled_axis(Vector3::from_fn(|i, _| if i < k { w[i] } else { 0.0 }));
    (0..3).map(|k| dictionary.tip(|_, _, row| ((after(k + 1) * here[row] - after(k) * here[row]) / w[k]).into())).collect()
}

/// Length of the tool: along its offset from the last link.
fn longer(dictionary: &Dictionary) -> Vec<Column> {
    const STEP: f64 = 1e-5;
    let arm = &dictionary.problem.robot.arm;
    let step = Translation3::from(tool_axis(arm) * STEP);
    vec![derivative(dictionary, &rebuilt(arm, arm.bodies().to_vec(), step * arm.tool_pose()), STEP)]
}

/// The tool turned about x of the last link.
fn twisted(dictionary: &Dictionary) -> Vec<Column> {
    let arm = &dictionary.problem.robot.arm;
    let turn = Rotation3::from_scaled_axis(Vector3::x() * TURN);
    vec![derivative(dictionary, &rebuilt(arm, arm.bodies().to_vec(), turn * arm.tool_pose()), TURN)]
}

/// A link that is moved along an axis of the frame before it.
pub(crate) struct Shift {
    /// Of the coefficient: the parameter is positive along `along`.
    pub sign: f64,
    /// The way that is positive; none where the link is longer by it.
    pub along: Option<&'static str>,
    /// What the link is longer by, over the coefficient, if it is along the way to the link, or along its joint where that has its
    /// origin in the frame before.
    pub longer: Option<f64>,
}

/// What the form of a link that is moved means in this arm; none for other forms.
pub(crate) fn shift(arm: &SerialArm, family: &Family) -> Option<Shift> {
    if family.physics != "link_geometry" {
        return None;
    }
    let (axis, names) = match family.side().strip_prefix("moved along ")? {
        "x" => (Vector3::x(), ["x", "-x"]),
        "y" => (Vector3::y(), ["y", "-y"]),
        _ => (Vector3::z(), ["z", "-z"]),
    };
    let body = arm.bodies().get(*family.joints.first()?)?;
    let way = body.placement.translation.vector.try_normalize(1e-9);
    let share = way.unwrap_or_else(|| body.placement.rotation * body.joint.axis.normalize()).dot(&axis);
    let longer = (share.abs() > 0.99).then(|| share.signum());
    // Along the axis of its joint, as an offset of Denavit and Hartenberg is told.
    let sign = longer.filter(|_| way.is_none()).unwrap_or(1.0);
    let said = way.is_some() && longer == Some(1.0);
    Some(Shift { sign, along: (!said).then_some(names[usize::from(sign < 0.0)]), longer })
}

/// Direction in which the tool is long, in the last link.
pub(crate) fn tool_axis(arm: &SerialArm) -> Vector3<f64> {
    let pose = arm.tool_pose();
    let offset = pose.translation.vector;
    if offset.norm() > 1e-6 { offset.normalize() } else { pose.rotation * Vector3::z() }
}

fn tips(dictionary: &Dictionary, arm: &SerialArm) -> Vec<Vector3<f64>> {
    let mut ws = Workspace::new(arm);
    let problem = dictionary.problem;
    let at = |&(r, i): &(usize, usize)| problem.joints(&problem.pairs[r].real, i);
    dictionary.tip_rows.iter().map(|row| arm.tip(&mut ws, &at(row)).translation.vector).collect()
}

fn derivative(dictionary: &Dictionary, arm: &SerialArm, step: f64) -> Column {
    let (here, there) = (tips(dictionary, &dictionary.problem.robot.arm), tips(dictionary, arm));
    dictionary.tip(|_, _, row| ((there[row] - here[row]) / step).into())
}

/// The same, and what the joints need more than they are believed to.
fn changed(dictionary: &Dictionary, arm: &SerialArm, step: f64, carries: bool) -> Column {
    let moved = derivative(dictionary, arm, step);
    if !carries {
        return moved;
    }
    let mut torque = dictionary.difference(&dictionary.loads_of(arm), dictionary.believed(), step, true);
    // What the cables give way by moves the tip by far less.
    torque.parts.retain(|(cell, _)| dictionary.problem.cells[*cell].channel != TIP);
    moved.and(torque)
}

fn with_placement(arm: &SerialArm, link: usize, change: impl Fn(IsometryMatrix3<f64>) -> IsometryMatrix3<f64>) -> SerialArm {
    let mut bodies: Vec<Body> = arm.bodies().to_vec();
    bodies[link].placement = change(bodies[link].placement);
    rebuilt(arm, bodies, arm.tool_pose())
}

fn rebuilt(arm: &SerialArm, bodies: Vec<Body>, tool: IsometryMatrix3<f64>) -> SerialArm {
    let tools = vec![Tool { name: "tip".to_owned(), pose: tool }];
    SerialArm::new(arm.name(), bodies, arm.gravity_vector(), tools).expect("a small change of an arm that exists")
}
