//! The columns of a recording that a RAVEN state is made from, taken out by name and checked once.

use arm::JOINTS;

use super::StatesError;
use crate::Recording;

/// A column per joint; none where the recording lacks it.
pub(super) type PerJoint<'a> = [Option<&'a [f64]>; JOINTS];

/// Time steps that differ by more than this factor from their mean are arrival times, not sample times.
const IRREGULAR_FACTOR: f64 = 1.5;

/// What the recording holds.
pub(super) struct Channels<'a> {
    pub(super) time_s: &'a [f64],
    /// Are positions taken from the motors (otherwise from the joints)?
    pub(super) from_motors: bool,
    pub(super) motors: PerJoint<'a>,
    pub(super) joints: PerJoint<'a>,
    pub(super) joints_d: PerJoint<'a>,
    pub(super) motor_speeds: PerJoint<'a>,
    /// At the shaft, before the gearbox.
    pub(super) torque: PerJoint<'a>,
    pub(super) dac: PerJoint<'a>,
    /// Mean time step where the steps are irregular.
    pub(super) mean_spacing_s: Option<f64>,
}

impl<'a> Channels<'a> {
    pub(super) fn new(recording: &'a Recording) -> Result<Self, StatesError> {
        let time_s = recording.time_s().ok_or_else(|| StatesError::NoTime { recording: recording.name.clone() })?;
        let motors = per_joint(recording, "mpos", |_| "rad");
        let joints = joint_positions(recording, "jpos")?;
        let joints_d = joint_positions(recording, "jpos_d")?;
        let from_motors = motors[..3].iter().all(Option::is_some);
        if !from_motors && let Some(missing) = joints[..3].iter().position(Option::is_none) {
            let missing = if motors.iter().any(Option::is_some) {
                let missing = motors.iter().position(Option::is_none).unwrap_or(0);
                format!("mpos_{}_rad", missing + 1)
            } else {
                format!("jpos_{}_{}", missing + 1, position_unit(missing))
            };
            return Err(StatesError::NoPositions { recording: recording.name.clone(), missing });
        }
        Ok(Self {
            time_s,
            from_motors,
            motors,
            joints,
            joints_d,
            motor_speeds: per_joint(recording, "mvel", |_| "rad_s"),
            torque: per_joint(recording, "tau", |_| "nm"),
            dac: per_joint(recording, "dac", |_| "counts"),
            mean_spacing_s: irregular_mean(time_s),
        })
    }

    /// Time that a speed at this row is taken over, s.
    pub(super) fn spacing_s(&self, row: usize) -> f64 {
        self.mean_spacing_s.unwrap_or_else(|| self.time_s[row] - self.time_s[row - 1])
    }
}

fn position_unit(joint: usize) -> &'static str {
    if joint == 2 { "m" } else { "rad" }
}

fn per_joint<'a>(recording: &'a Recording, quantity: &str, unit: fn(usize) -> &'static str) -> PerJoint<'a> {
    std::array::from_fn(|joint| recording.column(&format!("{quantity}_{}_{}", joint + 1, unit(joint))))
}

fn joint_positions<'a>(recording: &'a Recording, quantity: &str) -> Result<PerJoint<'a>, StatesError> {
    for joint in 0..JOINTS {
        let wrong = if joint == 2 { "rad" } else { "m" };
        let found = format!("{quantity}_{}_{wrong}", joint + 1);
        if recording.column(&found).is_some() {
            return Err(StatesError::JointKind { recording: recording.name.clone(), found });
        }
    }
    Ok(per_joint(recording, quantity, position_unit))
}

/// Mean time step, if the steps are far from it.
fn irregular_mean(time_s: &[f64]) -> Option<f64> {
    let (first, last) = (time_s.first()?, time_s.last()?);
    let mean = (last - first) / (time_s.len() - 1).max(1) as f64;
    let regular = time_s.windows(2).all(|pair| {
        let step = pair[1] - pair[0];
        step < mean * IRREGULAR_FACTOR && step > mean / IRREGULAR_FACTOR
    });
    (!regular).then_some(mean)
}
