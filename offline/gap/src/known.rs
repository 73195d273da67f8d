//! What a model with effects already holds: a corrected model is known no better than the forms of its effects are.

use simulator::model::{ModelError, RobotModel};

use crate::builtin::along_motion;
use crate::cell::{Cell, Channel};
use crate::given::Given;
use crate::motion::{Band, Motion};
use crate::pair::held;
use crate::parallel;
use crate::problem::Problem;
use crate::robot::{Robot, effects_of};
use crate::run::{Run, common};
use crate::series::rms;

/// Share of what the model's effects do in a cell that a further effect must have there to be one: less is what the form of
/// the first one gets wrong. Half of the 20 % by which a gravely wrong form misses; a parameter 30 % off stands far above.
const OF_KNOWN: f64 = 0.1;

/// Times the model's own error that an effect must reach: what explains nothing but that error is no larger than it is.
const BEYOND: f64 = 1.2;
/// The same of more or less of an effect that the model has: of an error of another form a part passes for it.
const PASSES: f64 = 0.4;

/// Raises what an effect must amount to: beyond the model's own error, and a share of what its effects do.
pub(crate) fn put_on(problem: &mut Problem, model: &RobotModel, given: &[Given], band: Band) {
    let done = done(model, problem, given, band);
    let practical = &mut problem.practical;
    for (c, cell) in problem.cells.iter().enumerate() {
        let error = own_error(&model.model_error, cell);
        practical.any[c] = practical.any[c].max(BEYOND * error).max(OF_KNOWN * done[c]);
        practical.known[c] = practical.known[c].max(PASSES * error).max(OF_KNOWN * done[c]);
    }
    practical.effects = effects_of(model);
}

/// RMS of what the model's own effects do in each cell.
fn done(model: &RobotModel, problem: &Problem, given: &[Given], band: Band) -> Vec<f64> {
    if model.effects().is_empty() {
        return vec![0.0; problem.cells.len()];
    }
    let mut bare = model.clone();
    bare.effects_mut().clear();
    let both: Vec<Option<[Motion; 2]>> = problem
        .pairs
        .iter()
        .zip(given)
        .map(|(pair, given)| both(model, &bare, problem.robot, given, &pair.real.run, band))
        .collect();
    let of = |cell: &Cell| {
        rms(cell.rows.iter().filter_map(|&(r, i)| {
            let [with, without] = both[r].as_ref()?;
            Some(value(with, cell.channel, cell.index, i)? - value(without, cell.channel, cell.index, i)?)
        }))
    };
    problem.cells.iter().map(of).collect()
}

/// What the model is known to get wrong in a cell.
fn own_error(error: &ModelError, cell: &Cell) -> f64 {
    let of = match cell.channel {
        Channel::JointTorque => &error.torque,
        Channel::Transmission => &error.deflection,
        Channel::EndEffector => &error.tip_m,
    };
    of.get(cell.index).copied().unwrap_or(0.0)
}

/// What a model leaves of simulations that it was learnt from: RMS in each channel, where the drives move.
pub(crate) fn model_error(model: &RobotModel, robot: &Robot, given: &[Given], band: Band) -> ModelError {
    let both = |one: &Given| {
        let (sim, _) = one.sim.as_ref()?;
        let of = |recording| Run::new(recording, robot).ok();
        let (sim, own) = common(&of(sim)?, &of(&along_motion(model, sim).ok()?)?).ok()?;
        Some([sim, own].map(|run| Motion::new(run, band)))
    };
    let pairs: Vec<[Motion; 2]> = parallel::map(given, both).into_iter().flatten().collect();
    let of = |channel: Channel, count: usize| -> Vec<f64> {
        let left = |index: usize| {
            pairs.iter().flat_map(move |[sim, own]| {
                // An axis of the tip is no drive; an arm of two joints has fewer of these.
                let still = if channel == Channel::EndEffector { Vec::new() } else { held(sim, index) };
                let rows = if channel == Channel::EndEffector { &sim.tip_rows } else { &sim.rows };
                let moving = rows.iter().filter(move |i| channel == Channel::EndEffector || !still[**i]);
                moving.filter_map(move |&i| Some(value(sim, channel, index, i)? - value(own, channel, index, i)?))
            })
        };
        let known = !pairs.is_empty() && (0..count).all(|index| left(index).next().is_some());
        if known { (0..count).map(|index| rms(left(index))).collect() } else { Vec::new() }
    };
    let n = robot.joint_count();
    ModelError { torque: of(Channel::JointTorque, n), deflection: of(Channel::Transmission, n), tip_m: of(Channel::EndEffector, 3) }
}

/// The recorded motion in the model with its effects, and without.
fn both(model: &RobotModel, bare: &RobotModel, robot: &Robot, given: &Given, real: &Run, band: Band) -> Option<[Motion; 2]> {
    let of = |model: &RobotModel| {
        let sim = Run::new(&along_motion(model, &given.real).ok()?, robot).ok()?;
        let (real, sim) = common(real, &sim).ok()?;
        // Rows of the problem count from the start of its own run.
        (real.len() == sim.len()).then(|| Motion::new(sim, band))
    };
    let (with, without) = parallel::both(|| of(model), || of(bare));
    Some([with?, without?])
}

fn value(motion: &Motion, channel: Channel, index: usize, i: usize) -> Option<f64> {
    let series = |set: &Option<Vec<Vec<f64>>>| set.as_ref().and_then(|set| set[index].get(i).copied());
    match channel {
        Channel::JointTorque => series(&motion.torque),
        Channel::Transmission => series(&motion.deflection),
        Channel::EndEffector => motion.run.tip.as_ref().and_then(|tip| tip[index].get(i).copied()).filter(|x| x.is_finite()),
    }
}
