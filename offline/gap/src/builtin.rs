//! What the built-in simulator makes of a recording's commands, where no other simulation is given.

use recordings::Recording;
use simulator::model::RobotModel;
use simulator::plant::Given;
use simulator::resimulate::{ClosedLoop, Motion, ResimulateError, Run, closed_loop, inverse};

/// Half width of the window in which the recorded motion is differentiated, s.
const REACH_S: f64 = 0.012;

/// The run of the model: its controller along the recorded commands where both are known, else the torque that the model asks
/// for the recorded motion. None where the recording has neither.
pub fn simulated(model: &RobotModel, recording: &Recording) -> Option<Recording> {
    let mut recording = recording.clone();
    for column in &mut recording.columns {
        // A simulation of an empty cell is empty from there on.
        let _ = crate::run::bridged(&mut column.values, 1.0, f64::INFINITY);
    }
    let run = Run::from_recording(&recording, model).ok()?;
    let played = if model.controller().is_some() { closed_loop(model, &run, ClosedLoop::default()) } else { given(model, &run) };
    let simulated = played.or_else(|_| given(model, &run)).ok()?;
    Some(simulated.to_recording(&format!("{} simulated by {}", recording.name, model.name()), model))
}

fn given(model: &RobotModel, run: &Run) -> Result<simulator::resimulate::Simulated, ResimulateError> {
    let half_width = ((REACH_S / run.period_s()).round() as usize).max(2);
    inverse(model, &Motion::of_run(run, Given::Motors, half_width)?)
}
