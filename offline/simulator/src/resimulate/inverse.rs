//! The recorded motion is given, the torque is computed.

use super::open_loop::gears;
use super::{ResimulateError, Run, Simulated};
use crate::any_arm::{Sensors, is_timed};
use crate::model::RobotModel;
use crate::plant::{Given, JOINTS_MAX, Memory, State, Vector};

/// A motion with its derivatives, one entry per row.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Whose: motors as encoders show them (rad), or the joints themselves (rad and m).
    pub given: Given,
    /// Time, s, rising.
    pub time_s: Vec<f64>,
    /// Positions.
    pub positions: Vec<Vector>,
    /// Rates, per s.
    pub rates: Vec<Vector>,
    /// Accelerations, per s².
    pub accelerations: Vec<Vector>,
}

impl Motion {
    /// Of the motors, or of the joints as instruments at the joints saw them, by local cubics over `half_width` rows on either
    /// side (Savitzky-Golay, also where the rows are not evenly spaced).
    ///
    /// # Errors
    /// [`ResimulateError`] where the recording does not have that motion in every row.
    pub fn of_run(run: &Run, given: Given, half_width: usize) -> Result<Self, ResimulateError> {
        let (rows, column) = match given {
            Given::Motors => (&run.motors, "mpos_1_rad"),
            Given::Joints => (&run.true_joints, "truth_jpos_1_*"),
        };
        let Some(rows) = rows.as_ref().filter(|rows| rows.iter().flatten().all(|value| value.is_finite())) else {
            return Err(run.missing(column, "the inverse model needs it in every row"));
        };
        let mut motion =
            Self { given, time_s: run.time_s.clone(), positions: Vec::new(), rates: Vec::new(), accelerations: Vec::new() };
        for row in 0..rows.len() {
            let [position, rate, acceleration] = cubic(&run.time_s, rows, row, half_width.max(2));
            motion.positions.push(position);
            motion.rates.push(rate);
            motion.accelerations.push(acceleration);
        }
        Ok(motion)
    }
}

/// Position, rate and acceleration of the cubic that fits the rows round one best.
fn cubic(time_s: &[f64], rows: &[Vector], row: usize, half_width: usize) -> [Vector; 3] {
    let (first, last) = (row.saturating_sub(half_width), (row + half_width).min(rows.len() - 1));
    let scale_s = (time_s[last] - time_s[first]).max(f64::MIN_POSITIVE);
    let mut normal = nalgebra::Matrix4::<f64>::zeros();
    let mut sums = [nalgebra::Vector4::<f64>::zeros(); JOINTS_MAX];
    for k in first..=last {
        let t = (time_s[k] - time_s[row]) / scale_s;
        let powers = nalgebra::Vector4::new(1.0, t, t * t, t * t * t);
        normal += powers * powers.transpose();
        for (sum, value) in sums.iter_mut().zip(&rows[k]) {
            *sum += powers * *value;
        }
    }
    let Some(factor) = normal.cholesky() else { return [rows[row], [0.0; JOINTS_MAX], [0.0; JOINTS_MAX]] };
    let fitted = sums.map(|sum| factor.solve(&sum));
    [fitted.map(|fit| fit[0]), fitted.map(|fit| fit[1] / scale_s), fitted.map(|fit| 2.0 * fit[2] / (scale_s * scale_s))]
}

/// Torque that a robot needs for a motion, and where the other side of its cables is; see [`crate::plant::Plant::needed`].
/// `true_joints` are those of the model, `motors` too; delays of sensors apply.
///
/// # Errors
/// [`ResimulateError`] for effects that cannot be where they are.
pub fn inverse(model: &RobotModel, motion: &Motion) -> Result<Simulated, ResimulateError> {
    let mut plant = model.plant()?;
    let steps: Vec<f64> = motion.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let period_s = steps.first().copied().unwrap_or(1e-3);
    let mut sensors = Sensors::new(model, period_s);
    let (gears, timed, n) = (gears(&plant), is_timed(model), model.joint_count());
    let mut memory = Memory::NEW;
    let mut out = Simulated::new(n, motion.time_s.len());
    for row in 0..motion.time_s.len() {
        let time_s = motion.time_s[row] - motion.time_s[0];
        if timed {
            plant.at(time_s);
        }
        let position = match motion.given {
            Given::Motors => sensors.counted_from_zero(&motion.positions[row]),
            Given::Joints => motion.positions[row],
        };
        let parts = [&position, &motion.rates[row], &motion.accelerations[row]];
        let step_s = if row == 0 { 0.0 } else { steps[row - 1] };
        let needed = plant.needed(motion.given, parts, &mut memory, step_s);
        let speeds = match motion.given {
            Given::Motors => motion.rates[row],
            Given::Joints => sensors.motor_rates(&motion.rates[row], &model.coupling()),
        };
        let state = State { joints: needed.joints, motors: needed.motors, speeds, ..State::ZERO };
        let torque = std::array::from_fn(|i| needed.torque[i] / gears[i]);
        out.push(motion.time_s[row], &sensors.see(&state, time_s), &torque);
    }
    Ok(out)
}
