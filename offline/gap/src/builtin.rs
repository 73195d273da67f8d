//! What the built-in simulator makes of a recording's commands, where no other simulation is given.

use recordings::{Column, Recording};
use simulator::model::RobotModel;
use simulator::plant::Given;
use simulator::resimulate::{ClosedLoop, Motion, OpenLoop, ResimulateError, Run, Simulated, closed_loop, inverse, open_loop};

/// Half width of the window in which the recorded motion is differentiated, s.
const REACH_S: f64 = 0.012;

/// The run of the model: its controller along the recorded commands where both are known, else the torque that the model asks
/// for the recorded motion. None where the recording has neither.
pub fn simulated(model: &RobotModel, recording: &Recording) -> Option<Recording> {
    let in_loop = |run: Run| closed_loop(model, &run, ClosedLoop::default()).or_else(|_| given(model, run));
    along(model, recording, |run| if model.controller().is_some() { in_loop(run) } else { given(model, run) }).ok()
}

/// The model's controller along the recorded commands, told from so long after the first row on, s.
///
/// # Errors
/// What keeps it from being simulated, in one line.
pub fn along_commands(model: &RobotModel, recording: &Recording, from_s: f64) -> Result<Recording, String> {
    along(model, recording, |mut run| {
        run.keep_commands();
        closed_loop(model, &run, ClosedLoop { from_s, ..ClosedLoop::default() })
    })
}

/// The model driven by the recorded torque, started anew from the recorded state after every `window_s`, told from `from_s` on.
///
/// # Errors
/// What keeps it from being simulated, in one line.
pub fn along_torque(model: &RobotModel, recording: &Recording, window_s: f64, from_s: f64) -> Result<Recording, String> {
    let options = OpenLoop { window_s, from_s, ..OpenLoop::default() };
    along(model, recording, |mut run| {
        // The torque drives it; these would only take memory meanwhile.
        (run.joints_d, run.true_joints) = (None, None);
        open_loop(model, &run, options)
    })
}

/// The torque that the model asks for the recorded motion, and where its joints and its tip then are.
///
/// # Errors
/// What keeps it from being simulated, in one line.
pub fn along_motion(model: &RobotModel, recording: &Recording) -> Result<Recording, String> {
    along(model, recording, |run| given(model, run))
}

fn along(
    model: &RobotModel,
    recording: &Recording,
    play: impl FnOnce(Run) -> Result<Simulated, ResimulateError>,
) -> Result<Recording, String> {
    let played = run(model, recording).and_then(play);
    played.map(|simulated| named(model, recording, &simulated)).map_err(|error| error.to_string())
}

/// The recording as a run, its empty cells bridged.
fn run(model: &RobotModel, recording: &Recording) -> Result<Run, ResimulateError> {
    // Minutes of it take much memory: a copy only where there is something to bridge.
    let whole = |column: &Column| column.values.iter().all(|value| value.is_finite());
    if recording.columns.iter().all(whole) {
        return Run::from_recording(recording, model);
    }
    let mut recording = recording.clone();
    for column in &mut recording.columns {
        // A simulation of an empty cell is empty from there on.
        let _ = crate::run::bridged(&mut column.values, 1.0, f64::INFINITY);
    }
    Run::from_recording(&recording, model)
}

fn named(model: &RobotModel, recording: &Recording, simulated: &Simulated) -> Recording {
    simulated.to_recording(&format!("{} simulated by {}", recording.name, model.name()), model)
}

fn given(model: &RobotModel, run: Run) -> Result<Simulated, ResimulateError> {
    let half_width = ((REACH_S / run.period_s()).round() as usize).max(2);
    let motion = Motion::of_run(&run, Given::Motors, half_width)?;
    // A run of minutes takes much memory; from here on the motion has all that is needed.
    drop(run);
    inverse(model, &motion)
}
