//! A recording turned into full RAVEN states, one per row, in the units as published.
//!
//! Motors recorded: joints by the cable coupling, tip by the kinematics. Joints recorded: motors by the inverse coupling.
//! What the recording lacks is assumed and said in [`States::notes`].

mod channels;
mod notes;

use arm::{Arm, JOINTS, Joints, Side};
use ravenpose_wire::RavenState;

use crate::Recording;
use crate::sample::{self, ArmSample, Cycle, ENCODER_OFFSETS};
use channels::Channels;

/// Which arms the states show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Arms {
    /// The left arm only.
    #[default]
    Gold,
    /// The right arm only.
    Green,
    /// Both.
    Both,
}

impl Arms {
    /// The sides, in message order.
    pub fn sides(self) -> &'static [Side] {
        match self {
            Self::Gold => &[Side::Gold],
            Self::Green => &[Side::Green],
            Self::Both => &Side::ALL,
        }
    }
}

/// States and what was assumed for them.
#[derive(Debug, Clone, PartialEq)]
pub struct States {
    /// One per row; sequence counts from 1, `source_time_ns` from 0.
    pub states: Vec<RavenState>,
    /// Sentences for people: what was assumed, what lies outside the robot's limits.
    pub notes: Vec<String>,
}

/// Why a recording cannot become RAVEN states: one line with the recording, what is wrong and the remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StatesError {
    /// A table, not a run.
    #[error("{recording}: has no time; put a column t_s first, or use a run instead of a table")]
    NoTime {
        /// The recording.
        recording: String,
    },
    /// Neither all of motors 1 to 3 nor all of joints 1 to 3.
    #[error(
        "{recording}: has no column {missing}; RAVEN states need mpos_1..3 (rad or deg), or jpos_1, jpos_2 (rad or deg) and jpos_3 (m)"
    )]
    NoPositions {
        /// The recording.
        recording: String,
        /// The first column that is missing.
        missing: String,
    },
    /// A joint in the unit of the other kind of joint.
    #[error("{recording}: column {found} has the wrong kind of unit for RAVEN-II; joint 3 slides (m), all others turn (rad, deg)")]
    JointKind {
        /// The recording.
        recording: String,
        /// The column.
        found: String,
    },
    /// Metadata name no arm.
    #[error("{recording}: metadata `arm = {found}` names no arm; write gold (left) or green (right)")]
    UnknownArm {
        /// The recording.
        recording: String,
        /// The value of `arm`.
        found: String,
    },
}

/// Turns a recording of one RAVEN arm into states. The recorded arm is that of the metadata (`# arm = green`), otherwise
/// gold; asked for the other arm, the same joints are shown there.
///
/// # Errors
/// [`StatesError`] where the recording has no time, no positions, or positions of another kind of robot.
pub fn from_recording(recording: &Recording, arms: Arms) -> Result<States, StatesError> {
    let recorded = sample::nominal(recorded_side(recording)?);
    let shown: Vec<Arm> = arms.sides().iter().map(|side| sample::nominal(*side)).collect();
    let channels = Channels::new(recording)?;
    let mut notes = notes::assumptions(recording, &channels, recorded.side, arms);
    let samples = samples(&channels, &recorded);
    // Where the table says when it began, its times count from there; stamps do not go below 0.
    let began_ns = recording.metadata.get("start_unix_ns").and_then(|text| text.parse::<i64>().ok()).unwrap_or(0);
    let before_s = channels.time_s.first().map_or(0.0, |first| if began_ns == 0 { first.min(0.0) } else { 0.0 });
    if before_s < 0.0 {
        notes.push(format!("Time: it begins at {before_s} s; stamps count from its first row."));
    }
    let states: Vec<RavenState> = samples
        .iter()
        .zip(cycles(channels.time_s, began_ns - nanoseconds(before_s)))
        .map(|(sample, cycle)| {
            let mut state = sample::state_of(&cycle);
            for arm in &shown {
                sample::put(&mut state, arm, &sample::on_other_arm(&recorded, arm, sample));
            }
            state
        })
        .collect();
    notes.extend(notes::findings(recording, &recorded, &samples));
    Ok(States { states, notes })
}

fn recorded_side(recording: &Recording) -> Result<Side, StatesError> {
    let Some(found) = recording.metadata.get("arm") else {
        return Ok(Side::Gold);
    };
    Side::from_name(found)
        .ok_or_else(|| StatesError::UnknownArm { recording: recording.name.clone(), found: found.escape_debug().to_string() })
}

/// Header times of every row; `zero_ns` is when its time was 0. The first `dt` is one control period, as for text recordings (ravenstate.md, section 2).
fn cycles(time_s: &[f64], zero_ns: i64) -> impl Iterator<Item = Cycle> {
    let period_s = sample::nominal(Side::Gold).encoders.period_s();
    let start = time_s.first().copied().unwrap_or(0.0);
    time_s.iter().enumerate().map(move |(index, now)| Cycle {
        index: index as u64,
        since_start_ns: nanoseconds(now - start),
        stamp_ns: zero_ns.saturating_add(nanoseconds(*now)),
        dt_ns: nanoseconds(if index == 0 { period_s } else { now - time_s[index - 1] }),
    })
}

/// Whole seconds apart, or a wall-clock time would lose its last digits to the product.
fn nanoseconds(seconds: f64) -> i64 {
    let whole = seconds.floor();
    whole as i64 * 1_000_000_000 + ((seconds - whole) * 1e9).round() as i64
}

/// All rows of the recorded arm.
fn samples(channels: &Channels, arm: &Arm) -> Vec<ArmSample> {
    let mut samples: Vec<ArmSample> = (0..channels.time_s.len()).map(|row| standing(channels, arm, row)).collect();
    let motors: Vec<_> = samples.iter().map(|sample| sample.motors).collect();
    for (row, sample) in samples.iter_mut().enumerate() {
        sample.motor_speeds = std::array::from_fn(|i| match channels.motor_speeds[i] {
            Some(speeds) => speeds[row],
            None if row == 0 => 0.0,
            None => (motors[row][i] - motors[row - 1][i]) / channels.spacing_s(row),
        });
        if let Some(speeds) = channels.motor_speeds[2] {
            follow_insertion(channels, arm, speeds[row], &mut sample.motor_speeds);
        }
    }
    samples
}

/// A row without speeds.
fn standing(channels: &Channels, arm: &Arm, row: usize) -> ArmSample {
    let at = |column: Option<&[f64]>| column.map(|values| values[row]);
    let (joints, motors) = if channels.from_motors {
        let base = channels.motors.map(|column| at(column).unwrap_or(0.0));
        let resting = arm.transmission.motors_at(&[0.0; JOINTS], base[2]);
        let motors: Joints = std::array::from_fn(|i| at(channels.motors[i]).unwrap_or(resting[i]));
        (arm.transmission.joints(&motors), motors)
    } else {
        let joints = channels.joints.map(|column| at(column).unwrap_or(0.0));
        (joints, arm.transmission.motors(&joints))
    };
    let (joints_d, motors_d) = if channels.joints_d.iter().any(Option::is_some) {
        let joints_d = std::array::from_fn(|i| at(channels.joints_d[i]).unwrap_or(joints[i]));
        (joints_d, arm.transmission.motors_at(&joints_d, motors[2]))
    } else {
        (joints, motors)
    };
    let torque_nm = std::array::from_fn(|i| match (at(channels.torque[i]), at(channels.dac[i])) {
        (Some(shaft_nm), _) => shaft_nm * arm.amplifiers.gear()[i],
        (None, Some(counts)) => arm.amplifiers.torque(i, counts),
        (None, None) => 0.0,
    });
    let dac = std::array::from_fn(|i| match at(channels.dac[i]) {
        Some(counts) => counts.round() as i32,
        None => arm.amplifiers.counts(i, torque_nm[i]),
    });
    let encoder_offsets = ENCODER_OFFSETS[arm.side.index()];
    ArmSample { joints, joints_d, motors, motors_d, motor_speeds: [0.0; JOINTS], torque_nm, dac, encoder_offsets }
}

/// Tool motors that are not recorded follow motor 3 in speed as in position, with the tool joints at rest.
fn follow_insertion(channels: &Channels, arm: &Arm, motor_3_speed: f64, speeds: &mut [f64; JOINTS]) {
    if !channels.from_motors {
        return;
    }
    let resting = arm.transmission.motors_at(&[0.0; JOINTS], motor_3_speed);
    for i in 3..JOINTS {
        if channels.motors[i].is_none() && channels.motor_speeds[i].is_none() {
            speeds[i] = resting[i];
        }
    }
}
