//! How cells and claims are told: their names, quantities and units, and where a claim shows most.

use gap_report::Channel as Told;

use crate::cell::{Cell, Channel};
use crate::hypothesis::Candidate;
use crate::robot::Robot;

/// The schema's name of a channel.
pub(crate) fn told(channel: Channel) -> Told {
    match channel {
        Channel::JointTorque => Told::JointTorque,
        Channel::Transmission => Told::Transmission,
        Channel::EndEffector => Told::EndEffector,
    }
}

/// Joint or axis of a cell, by name.
pub(crate) fn cell_name(robot: &Robot, cell: &Cell) -> String {
    match cell.channel {
        Channel::EndEffector => ["x", "y", "z"][cell.index].to_owned(),
        _ => robot.joints[cell.index].clone(),
    }
}

/// Unit of a cell.
pub(crate) fn cell_unit(robot: &Robot, cell: &Cell) -> &'static str {
    match cell.channel {
        Channel::JointTorque => robot.effort_unit(cell.index),
        Channel::Transmission => robot.position_unit(cell.index),
        Channel::EndEffector => "m",
    }
}

/// What a cell shows, in words.
pub(crate) fn cell_quantity(robot: &Robot, cell: &Cell) -> String {
    let name = cell_name(robot, cell);
    match cell.channel {
        Channel::JointTorque => format!("torque of {name}"),
        Channel::Transmission => format!("motor minus joint position of {name}"),
        Channel::EndEffector => format!("tip position along {name}"),
    }
}

/// The cell in which an effect stands highest above the noise.
pub(crate) fn main_cell(floors: &[f64], candidate: &Candidate, theta: &[f64]) -> usize {
    (0..floors.len())
        .max_by(|a, b| {
            let height = |c: usize| candidate.rms(c, theta) / floors[c].max(1e-300);
            height(*a).total_cmp(&height(*b))
        })
        .unwrap_or(0)
}

/// Names of the joints that an effect is told at.
pub(crate) fn joints(robot: &Robot, candidate: &Candidate) -> Vec<String> {
    candidate.family.joints.iter().map(|j| robot.joints[(*j).min(robot.joints.len() - 1)].clone()).collect()
}
