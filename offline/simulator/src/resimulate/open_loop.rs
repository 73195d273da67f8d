//! The recorded torque drives the plant.

use std::ops::Range;

use super::hold::Held;
use super::{Hold, ResimulateError, Run, Simulated};
use crate::any_arm::{Sensors, is_timed};
use crate::model::RobotModel;
use crate::plant::{JOINTS_MAX, Plant, State, Vector};

/// How the recorded torque drives the plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenLoop {
    /// After so long the plant starts again from the measured state, s: without a controller, weight and friction that are
    /// slightly off carry it away. Infinite: never.
    pub window_s: f64,
    /// What the torque does between two samples.
    pub hold: Hold,
    /// Rows earlier than this after the first, s, are simulated and not kept.
    pub from_s: f64,
}

impl Default for OpenLoop {
    /// Windows of one second, torque in steps.
    fn default() -> Self {
        Self { window_s: 1.0, hold: Hold::Steps, from_s: 0.0 }
    }
}

/// The run of a robot whose motors are driven by the recorded torque. Each window starts with motors and speeds as recorded
/// and the joints where weight puts them; what cables and friction remember is kept, but for what is wound up ([`Plant::wind_up`]). Without motors it starts at rest at 0.
///
/// # Errors
/// [`ResimulateError`] without torque, and for effects that cannot be where they are.
pub fn open_loop(model: &RobotModel, run: &Run, options: OpenLoop) -> Result<Simulated, ResimulateError> {
    let Some(torque) = &run.torque else {
        return Err(
            run.missing("tau_1_nm", "an open loop needs the torque of every motor (tau, dac with known constants, or jtau)")
        );
    };
    let mut plant = model.plant()?;
    let mut sensors = Sensors::new(model, run.period_s());
    if let Some(joints) = run.joints.as_ref().filter(|_| model.as_raven().is_some()) {
        sensors.use_tool_of(&joints[0]);
    }
    let gears = gears(&plant);
    let parts = (run.period_s() / plant.step_s() - 1e-9).ceil().max(1.0) as usize;
    let held = Held::new(run, torque, options.hold, parts);
    let timed = is_timed(model);
    let mut state = State::ZERO;
    let kept_from = run.row_from(options.from_s);
    let mut out = Simulated::new(model.joint_count(), run.len() - kept_from);
    // Where nothing is remembered, windows that are not kept say nothing of those that are.
    let remembers = plant.remembers() || sensors.remember();
    for window in windows(run, options.window_s).filter(|window| remembers || window.end > kept_from) {
        for row in window.clone() {
            let time_s = run.time_s[row] - run.time_s[0];
            if timed {
                plant.at(time_s);
            }
            if row == window.start {
                state = start(&mut plant, &sensors, run, row, &state);
            }
            let seen = sensors.see(&state, time_s);
            if row >= kept_from {
                out.push(run.time_s[row], &seen, &torque[row]);
            }
            let Some(next_s) = run.time_s.get(row + 1) else { break };
            let part_s = (next_s - run.time_s[row]) / held.parts() as f64;
            for part in 0..held.parts() {
                let mut applied = held.at(row, part);
                applied.iter_mut().zip(&gears).for_each(|(torque, gear)| *torque *= gear);
                plant.advance(&mut state, &applied, part_s);
            }
        }
    }
    Ok(out)
}

/// Rows of the windows, each of which begins with the first row so long after the one before began.
fn windows(run: &Run, window_s: f64) -> impl Iterator<Item = Range<usize>> {
    let from = move |start: usize| {
        let begun_s = run.time_s.get(start)? - run.time_s[0];
        Some(start..run.row_from(begun_s + window_s - 1e-9).max(start + 1))
    };
    std::iter::successors(from(0), move |window| from(window.end))
}

/// Shaft to capstan, per joint.
pub(super) fn gears(plant: &Plant) -> Vector {
    std::array::from_fn(|i| if i < plant.joints() { plant.drive(i).gear } else { 1.0 })
}

fn start(plant: &mut Plant, sensors: &Sensors, run: &Run, row: usize, before: &State) -> State {
    let (motors, speeds) = run.state_at(row).unwrap_or(([0.0; JOINTS_MAX], [0.0; JOINTS_MAX]));
    let mut state = plant.at_rest_with(&sensors.counted_from_zero(&motors), &before.memories);
    let n = plant.joints();
    state.speeds[..n].copy_from_slice(&speeds[..n]);
    state.rates = sensors.joints_of(&speeds, false);
    if let Some(torque) = &run.torque {
        let gears = gears(plant);
        plant.wind_up(&mut state, &std::array::from_fn(|i| if i < n { gears[i] * torque[row][i] } else { 0.0 }));
    }
    plant.follow(&mut state);
    state
}
