//! The sentence in large type.

use super::joints::capital;
use super::sentence::sentence;
use crate::{DataQuality, Level, Physics, Report, Status, Verdict};

/// From this probability on a verdict is told without `most likely`.
const SURE: f64 = 0.9;
/// Up to it, only as a possibility.
const LIKELY: f64 = 0.5;

/// One sentence on one verdict: what the robot has and the simulation lacks, where, how much with its 95 % interval in brackets,
/// and how sure.
pub fn headline(verdict: &Verdict) -> String {
    plain_spaces(&unbroken(verdict))
}

/// Plain spaces only, and nothing that a terminal would take for a command.
pub(crate) fn plain_spaces(text: &str) -> String {
    let plain = |c: char| match c {
        '\u{a0}' | '\u{202f}' => ' ',
        c if c.is_control() && c != '\n' => '\u{fffd}',
        c => c,
    };
    text.chars().map(plain).collect()
}

/// [`headline`] with spaces that do not break between a number and its unit.
fn unbroken(verdict: &Verdict) -> String {
    let said = sentence(verdict);
    let hedge = match verdict.probability {
        _ if matches!(verdict.physics, Physics::None | Physics::Unmodelled) => "",
        p if p >= SURE => "",
        p if p > LIKELY => "most likely ",
        _ => "possibly ",
    };
    format!("{}.", capital(&format!("{hedge}{said}")))
}

/// One sentence on a check of the data, with its run. What a failure means stands first.
pub fn quality_headline(check: &DataQuality) -> String {
    let known = LEADS.iter().find(|(name, _)| check.check == *name || check.check.starts_with(&format!("{name} ")));
    let known = known.filter(|_| check.level == Level::Fail);
    // The same check may fail on either side.
    let other = (check.check == "input_sign" && check.message.contains("simulation"))
        .then_some(&("", "The simulation's input has the wrong sign"));
    let known = other.or(known);
    let lead = known.map_or_else(|| capital(&check.check.replace('_', " ")), |(_, lead)| (*lead).to_owned());
    let run = check.run.as_ref().map_or_else(String::new, |run| format!(" ({run})"));
    let end = if check.message.ends_with(['.', '!', '?']) { "" } else { "." };
    format!("{lead}{run}: {}{end}", check.message)
}

/// Names of checks and what their failure means.
const LEADS: [(&str, &str); 17] = [
    ("input_sign", "The recorded torque has the wrong sign"),
    ("torque sign convention", "The recorded torque has the wrong sign"),
    ("sign_convention", "Recording and simulation have opposite signs"),
    ("same_motion", "The simulation is not of this recording"),
    ("input_scale", "A recorded quantity has the wrong unit or scale"),
    ("command_replay", "The logged motor commands are not what the controller would give"),
    ("time_order", "The recorded times are out of order"),
    ("time_overlap", "Recording and simulation do not overlap in time"),
    ("sampling", "The recording is sampled too coarsely or unevenly"),
    ("duplicates", "Samples repeat"),
    ("gaps", "The recording has gaps"),
    ("saturation", "The motors were at their limits"),
    ("quantisation", "The sensors are too coarse for this"),
    ("excitation", "The robot moved too little or too uniformly"),
    ("nominal_model", "The simulator cannot be reproduced well enough to compare"),
    ("closed_loop_bias", "Two ways of fitting disagree"),
    ("too_short", "The recording is too short"),
];

/// The sentences that a report opens with, at least one: the answer, one sentence per effect.
pub fn headlines(report: &Report) -> Vec<String> {
    headlines_unbroken(report).iter().map(|sentence| plain_spaces(sentence)).collect()
}

/// [`headlines`] with spaces that do not break between a number and its unit.
pub(crate) fn headlines_unbroken(report: &Report) -> Vec<String> {
    let told: Vec<String> = report
        .told()
        .enumerate()
        .map(|(i, verdict)| match verdict.physics {
            Physics::Unmodelled if i > 0 => format!("Beyond that, {}.", sentence(verdict)),
            _ => unbroken(verdict),
        })
        .collect();
    match report.status {
        Status::InsufficientData => {
            let why = report.quality(Level::Fail).chain(report.quality(Level::Warn)).next();
            let why = why.map_or_else(|| report.summary.clone(), quality_headline);
            let first = "These recordings do not allow a verdict.".to_owned();
            [first, why].into_iter().chain(told).collect()
        }
        _ if told.is_empty() => vec![report.summary.clone()],
        _ => told,
    }
}
