//! What was assumed for states and what stands out in them, in sentences for people.

use arm::{Arm, JOINTS, Side};

use super::Arms;
use super::channels::{Channels, PerJoint};
use crate::Recording;
use crate::sample::ArmSample;

/// Sentences about what the recording does not say.
pub(super) fn assumptions(recording: &Recording, channels: &Channels, recorded: Side, arms: Arms) -> Vec<String> {
    let mut notes = Vec::new();
    about_robot(recording, recorded, arms, &mut notes);
    about_positions(channels, &mut notes);
    about_commands(channels, &mut notes);
    about_speeds(channels, &mut notes);
    about_torque(channels, &mut notes);
    notes.push(
        "Encoder counts: from the motor angles with made-up constant offsets; runlevel 3, board numbers 49 (gold) and 22 (green)."
            .to_owned(),
    );
    notes
}

fn about_robot(recording: &Recording, recorded: Side, arms: Arms, notes: &mut Vec<String>) {
    if let Some(robot) = recording.metadata.get("robot")
        && !matches!(robot.to_ascii_lowercase().as_str(), "raven" | "raven2" | "raven-ii" | "raven-2" | "raven2-nominal")
    {
        notes.push(format!("Robot: the metadata say `{}`; the nominal RAVEN-II was used all the same.", robot.escape_debug()));
    }
    if !recording.metadata.contains_key("arm") {
        notes.push("Arm: the recording does not name its arm; it was taken for the gold (left) one.".to_owned());
    }
    for side in arms.sides().iter().filter(|side| **side != recorded) {
        notes.push(format!(
            "Arm: the {} arm shows the joints of the recorded {} arm, with its own signs and mirrored tip.",
            side.name(),
            recorded.name()
        ));
    }
}

fn about_positions(channels: &Channels, notes: &mut Vec<String>) {
    if channels.from_motors {
        notes.push("Joints and tip: computed from the motor angles by cable coupling and forward kinematics.".to_owned());
        let missing = missing(&channels.motors);
        if !missing.is_empty() {
            notes.push(format!("Joints {missing}: not recorded, taken as 0; their motors follow motor 3 through the cables."));
        }
        if channels.joints.iter().any(Option::is_some) {
            notes.push("Recorded jpos columns were not used: the published joints are those of the motors.".to_owned());
        }
    } else {
        notes.push("Motors: computed from the joints by the inverse cable coupling; tip by forward kinematics.".to_owned());
        let missing = missing(&channels.joints);
        if !missing.is_empty() {
            notes.push(format!("Joints {missing}: not recorded, taken as 0."));
        }
    }
}

fn about_commands(channels: &Channels, notes: &mut Vec<String>) {
    let missing = missing(&channels.joints_d);
    if !missing.is_empty() {
        notes.push(format!("Commands of joints {missing}: not recorded, taken as equal to what was reported."));
    }
}

fn about_speeds(channels: &Channels, notes: &mut Vec<String>) {
    if channels.motor_speeds[..3].iter().all(Option::is_some) {
        return;
    }
    notes.push(match channels.mean_spacing_s {
        Some(mean) => format!(
            "Motor speeds: differences of the motor angles over the mean step of {:.3} ms, since the time steps are irregular.",
            mean * 1e3
        ),
        None => "Motor speeds: differences of the motor angles over the time steps.".to_owned(),
    });
}

fn about_torque(channels: &Channels, notes: &mut Vec<String>) {
    let some = |column: &PerJoint, i: usize| column[i].is_some();
    let none: Vec<usize> = (0..JOINTS).filter(|i| !some(&channels.torque, *i) && !some(&channels.dac, *i)).collect();
    if (0..JOINTS).any(|i| !some(&channels.torque, i) && some(&channels.dac, i)) {
        notes.push("Torque: computed back from the amplifier counts.".to_owned());
    }
    if (0..JOINTS).any(|i| some(&channels.torque, i) && !some(&channels.dac, i)) {
        notes.push("Amplifier counts: computed from the torque.".to_owned());
    }
    if !none.is_empty() {
        notes.push(format!("Torque and amplifier counts of motors {}: not recorded, 0.", list(&none)));
    }
}

/// Sentences about what came out.
pub(super) fn findings(recording: &Recording, arm: &Arm, samples: &[ArmSample]) -> Vec<String> {
    let mut notes = beyond_limits(arm, samples);
    notes.extend(against_recorded_tip(recording, arm, samples));
    notes
}

fn beyond_limits(arm: &Arm, samples: &[ArmSample]) -> Vec<String> {
    (0..JOINTS)
        .filter_map(|joint| {
            let count = samples.iter().filter(|sample| !arm.limits.allows(joint, sample.joints[joint])).count();
            let values = samples.iter().map(|sample| sample.joints[joint]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
            let (scale, unit) = if joint == 2 { (1e3, "mm") } else { (180.0 / std::f64::consts::PI, "deg") };
            (count > 0).then(|| {
                format!(
                    "Joint {}: outside its command limits {:.1}..{:.1} {unit} in {count} of {} rows (it spans {:.1}..{:.1} {unit}).",
                    joint + 1,
                    arm.limits.min()[joint] * scale,
                    arm.limits.max()[joint] * scale,
                    samples.len(),
                    low * scale,
                    high * scale
                )
            })
        })
        .collect()
}

/// How far the computed tip lies from the one in the recording, where it has one.
fn against_recorded_tip(recording: &Recording, arm: &Arm, samples: &[ArmSample]) -> Option<String> {
    let tip = [recording.column("x_m")?, recording.column("y_m")?, recording.column("z_m")?];
    let mut distance_um: Vec<f64> = samples
        .iter()
        .enumerate()
        .map(|(row, sample)| {
            let found = arm.kinematics.tip_position(&sample.joints);
            (0..3).map(|axis| (found[axis] - tip[axis][row]).powi(2)).sum::<f64>().sqrt() * 1e6
        })
        .collect();
    distance_um.sort_by(f64::total_cmp);
    let largest = distance_um.last()?;
    Some(format!(
        "Tip: the computed position lies {:.1} um (median), {:.1} um (largest) from the recorded one.",
        distance_um[distance_um.len() / 2],
        largest
    ))
}

fn missing(columns: &PerJoint) -> String {
    list(&(0..JOINTS).filter(|joint| columns[*joint].is_none()).collect::<Vec<_>>())
}

/// Joint numbers, counted from 1, with commas.
fn list(joints: &[usize]) -> String {
    joints.iter().map(|joint| (joint + 1).to_string()).collect::<Vec<_>>().join(", ")
}
