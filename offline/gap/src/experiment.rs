//! The short experiment that would tell an effect from its rivals (gap-design.md, section 7, rule 10 and its table of pairs).

use gap_report::{Experiment, Physics};

use crate::hypothesis::Candidate;
use crate::robot::Robot;
use crate::search::Scored;

/// What decides between two.
const SEPARATORS: [(&str, &str, &str, &[&str], f64); 13] = [
    (
        "payload",
        "link_inertia",
        "is it the tool or the link?",
        &["take the tool off and record 30 s", "hang a known 100 g weight at the tip and record 30 s"],
        60.0,
    ),
    (
        "payload",
        "external_contact",
        "does the force turn with the tool?",
        &["record 30 s at three postures far apart, nothing near the arm"],
        90.0,
    ),
    (
        "joint_offset",
        "transmission_ratio",
        "is the error the same everywhere?",
        &["home the joint to its hard stop", "move it alone from one limit to the other and back"],
        30.0,
    ),
    (
        "joint_offset",
        "joint_coupling",
        "does another joint move it?",
        &["move one joint at a time from limit to limit, the others still"],
        60.0,
    ),
    (
        "transmission_ratio",
        "joint_coupling",
        "which joint moves it?",
        &["move one joint at a time from limit to limit, the others still"],
        60.0,
    ),
    (
        "coulomb_friction",
        "load_dependent_friction",
        "does friction grow with load?",
        &["move at one speed at three postures of unlike load", "repeat with a known 100 g weight"],
        60.0,
    ),
    (
        "coulomb_friction",
        "viscous_friction",
        "does friction grow with speed?",
        &["triangle motion at two speeds, one five times the other"],
        30.0,
    ),
    (
        "coulomb_friction",
        "stribeck_friction",
        "is friction larger at creep?",
        &["triangle motion at five speeds, the slowest barely moving"],
        60.0,
    ),
    (
        "coulomb_friction",
        "thermal_drift",
        "does friction fade as it warms?",
        &["record the cold robot for 30 s", "work it for ten minutes", "repeat the same motion"],
        700.0,
    ),
    (
        "cable_hysteresis",
        "backlash",
        "are there loops within the loop?",
        &["slow triangle motion with three amplitudes, each half the one before"],
        60.0,
    ),
    (
        "cable_hysteresis",
        "cable_stretch",
        "does the loop stay open?",
        &["slow triangle motion with three amplitudes, each half the one before"],
        60.0,
    ),
    (
        "cable_creep",
        "thermal_drift",
        "does it recover without load?",
        &["hold under load for 60 s", "unload and hold for 60 s at the same temperature"],
        120.0,
    ),
    (
        "measurement_delay",
        "viscous_friction",
        "does it grow with frequency on every joint alike?",
        &["sines of 0.2, 0.5, 1 and 2 Hz on each joint in turn"],
        60.0,
    ),
];

/// The experiment for an effect and those that come close to it.
pub(crate) fn suggest(robot: &Robot, candidate: &Candidate, close: &[&Scored], rivals: Vec<Physics>) -> Experiment {
    let own = candidate.family.physics;
    let found = close.iter().find_map(|rival| {
        let other = rival.candidate.family.physics;
        SEPARATORS.iter().find(|(a, b, ..)| (*a, *b) == (own, other) || (*a, *b) == (other, own))
    });
    let joint = candidate
        .family
        .joints
        .first()
        .map_or_else(|| "every joint".to_owned(), |j| robot.joints[(*j).min(robot.joints.len() - 1)].clone());
    let (goal, steps, seconds) = match found {
        Some((_, _, goal, steps, seconds)) => (*goal, *steps, *seconds),
        None => (
            "which of them it is",
            &[
                "slow triangle motion of one joint at a time, at two speeds, one five times the other",
                "hold still for 10 s at each end",
            ][..],
            90.0,
        ),
    };
    let mut experiment = experiment_of(&format!("{goal} ({joint})"), rivals, steps);
    experiment.duration_s = Some(seconds);
    experiment
}

/// For signatures that need nothing else.
fn experiment_of(goal: &str, rivals: Vec<Physics>, steps: &[&str]) -> Experiment {
    Experiment::new(goal, rivals, steps.iter().map(|s| (*s).to_owned()).collect())
}
