//! Amplifier commands of a recording played into the plant, without a controller: how far the motors run from those recorded.

use arm::{Arm, JOINTS, Side};

use crate::model::Robot;
use crate::plant::{JOINTS_MAX, Plant, PlantError, State, Vector};
use crate::robot_plant;
use crate::tool_axes::FIRST;

/// Motors 1 to 3 of a recording, one row per millisecond.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotorRecord {
    /// Angles, rad.
    pub angles: Vec<[f64; FIRST]>,
    /// Speeds, rad/s.
    pub speeds: Vec<[f64; FIRST]>,
    /// Amplifier commands, counts.
    pub dac: Vec<[f64; FIRST]>,
}

/// Why a recording cannot be replayed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReplayError {
    /// A column that is needed.
    #[error("has no column {0}; replay needs mpos, mvel and dac of motors 1 to 3")]
    Column(String),
    /// Not 1 kHz.
    #[error("has a step of {0} s; replay needs 1 ms")]
    Step(f64),
}

impl MotorRecord {
    /// From a table in SI units.
    ///
    /// # Errors
    /// [`ReplayError`] for missing columns and another rate than 1 kHz.
    pub fn from_recording(recording: &recordings::Recording) -> Result<Self, ReplayError> {
        let column = |name: String| recording.column(&name).ok_or(ReplayError::Column(name));
        let three = |quantity: &str, unit: &str| -> Result<Vec<[f64; FIRST]>, ReplayError> {
            let columns = [1, 2, 3].map(|motor| column(format!("{quantity}_{motor}_{unit}")));
            let [a, b, c] = columns;
            let (a, b, c) = (a?, b?, c?);
            Ok((0..a.len()).map(|row| [a[row], b[row], c[row]]).collect())
        };
        let time_s = recording.time_s().ok_or_else(|| ReplayError::Column("t_s".to_owned()))?;
        if let Some(pair) = time_s.windows(2).find(|pair| (pair[1] - pair[0] - 1e-3).abs() > 1e-4) {
            return Err(ReplayError::Step(pair[1] - pair[0]));
        }
        Ok(Self { angles: three("mpos", "rad")?, speeds: three("mvel", "rad_s")?, dac: three("dac", "counts")? })
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.angles.len()
    }

    /// Has it no row?
    pub fn is_empty(&self) -> bool {
        self.angles.is_empty()
    }

    /// Some of its rows.
    #[must_use]
    pub fn part(&self, rows: std::ops::Range<usize>) -> Self {
        Self {
            angles: self.angles[rows.clone()].to_vec(),
            speeds: self.speeds[rows.clone()].to_vec(),
            dac: self.dac[rows].to_vec(),
        }
    }
}

/// A plant that follows recorded commands.
#[derive(Debug, Clone)]
pub struct Replay {
    plant: Plant,
    arm: Arm,
}

impl Replay {
    /// The plant of an arm of a robot, homed perfectly.
    ///
    /// # Errors
    /// [`PlantError`] for effects that cannot be where they are.
    pub fn new(robot: &Robot, side: Side) -> Result<Self, PlantError> {
        let (plant, _) = robot_plant::build(robot, side, &[0.0; JOINTS])?;
        Ok(Self { plant, arm: robot.raven.arm(side) })
    }

    /// Motor angles, rad, one row per row of the record, from the measured state at its beginning: motors as recorded, joints
    /// where gravity and the motors' speeds put them; what a motor drags along is wound up as far as the command in the first row says.
    pub fn free_run(&mut self, record: &MotorRecord) -> Vec<[f64; FIRST]> {
        let mut state = self.start(record);
        let mut angles = Vec::with_capacity(record.len());
        for dac in &record.dac {
            angles.push([state.motors[0], state.motors[1], state.motors[2]]);
            let mut torque = [0.0; JOINTS_MAX];
            for i in 0..FIRST {
                torque[i] = self.arm.amplifiers.torque(i, dac[i]);
            }
            self.plant.advance(&mut state, &torque, 1e-3);
        }
        angles
    }

    fn start(&mut self, record: &MotorRecord) -> State {
        let mut motors: Vector = [0.0; JOINTS_MAX];
        let mut state = State::ZERO;
        if let (Some(angles), Some(speeds), Some(dac)) = (record.angles.first(), record.speeds.first(), record.dac.first()) {
            motors[..FIRST].copy_from_slice(angles);
            state = self.plant.at_rest(&motors);
            let mut all = [0.0; JOINTS];
            all[..FIRST].copy_from_slice(speeds);
            state.speeds[..FIRST].copy_from_slice(speeds);
            state.rates[..FIRST].copy_from_slice(&self.arm.transmission.joints(&all)[..FIRST]);
            self.plant
                .wind_up(&mut state, &std::array::from_fn(|i| if i < FIRST { self.arm.amplifiers.torque(i, dac[i]) } else { 0.0 }));
        }
        state
    }

    /// RMS difference of motor angles, rad, over windows that each start from the measured state; a rest shorter than a
    /// window is left out.
    pub fn rms(&mut self, record: &MotorRecord, window: usize) -> [f64; FIRST] {
        rms_of(record, window, |part| self.free_run(part))
    }
}

/// RMS difference to a robot whose motors stay where they are, rad.
pub fn standing_still_rms(record: &MotorRecord, window: usize) -> [f64; FIRST] {
    rms_of(record, window, |part| vec![part.angles[0]; part.len()])
}

fn rms_of(record: &MotorRecord, window: usize, mut run: impl FnMut(&MotorRecord) -> Vec<[f64; FIRST]>) -> [f64; FIRST] {
    let mut squares = [0.0; FIRST];
    let mut count = 0;
    for begin in (0..=record.len().saturating_sub(window)).step_by(window.max(1)) {
        let part = record.part(begin..begin + window);
        for (found, recorded) in run(&part).iter().zip(&part.angles) {
            for i in 0..FIRST {
                squares[i] += (found[i] - recorded[i]).powi(2);
            }
            count += 1;
        }
    }
    squares.map(|sum| (sum / f64::from(count.max(1))).sqrt())
}
