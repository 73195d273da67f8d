//! What a model with effects already holds: a corrected model is known no better than the forms of its effects are.

use simulator::model::{Bound, RobotModel};

use crate::analysis::Given;
use crate::builtin::along_motion;
use crate::motion::{Band, Motion};
use crate::nominal::rms;
use crate::problem::{Channel, Problem};
use crate::robot::Robot;
use crate::run::{Run, common};

/// Share of what the model's effects do in a cell that a further effect must have there to be one: less is what the form of
/// the first one gets wrong. Half of the 20 % by which a gravely wrong form misses; a parameter 30 % off stands far above.
const OF_KNOWN: f64 = 0.1;

/// Physics and joints of the effects of a model, as families of hypotheses have them.
pub(crate) fn effects(model: &RobotModel) -> Vec<(String, Vec<usize>)> {
    let joints = |bound: Bound| match bound {
        Bound::Joint(joint) | Bound::Link(joint) => vec![joint],
        Bound::Pair(driven, driver) => vec![driven, driver],
        Bound::Channel(_) | Bound::Robot => Vec::new(),
    };
    model.effects().iter().map(|effect| (effect.physics.name().to_owned(), joints(effect.bound))).collect()
}

/// Least RMS of an effect in each cell of the problem; 0 where the model's own effects do nothing.
pub(crate) fn least(model: &RobotModel, problem: &Problem, given: &[Given], band: Band) -> Vec<f64> {
    let mut least = vec![0.0; problem.cells.len()];
    if model.effects().is_empty() {
        return least;
    }
    let mut bare = model.clone();
    bare.effects_mut().clear();
    let both: Vec<Option<[Motion; 2]>> = problem
        .pairs
        .iter()
        .zip(given)
        .map(|(pair, given)| both(model, &bare, problem.robot, given, &pair.real.run, band))
        .collect();
    for (c, cell) in problem.cells.iter().enumerate() {
        let differences = cell.rows.iter().filter_map(|&(r, i)| {
            let [with, without] = both[r].as_ref()?;
            Some(value(with, cell.channel, cell.index, i)? - value(without, cell.channel, cell.index, i)?)
        });
        least[c] = OF_KNOWN * rms(differences);
    }
    least
}

/// The recorded motion in the model with its effects, and without.
fn both(model: &RobotModel, bare: &RobotModel, robot: &Robot, given: &Given, real: &Run, band: Band) -> Option<[Motion; 2]> {
    let of = |model: &RobotModel| {
        let sim = Run::new(&along_motion(model, &given.real).ok()?, robot).ok()?;
        let (real, sim) = common(real, &sim).ok()?;
        // Rows of the problem count from the start of its own run.
        (real.len() == sim.len()).then(|| Motion::new(sim, band))
    };
    Some([of(model)?, of(bare)?])
}

fn value(motion: &Motion, channel: Channel, index: usize, i: usize) -> Option<f64> {
    let series = |set: &Option<Vec<Vec<f64>>>| set.as_ref().and_then(|set| set[index].get(i).copied());
    match channel {
        Channel::JointTorque => series(&motion.torque),
        Channel::Transmission => series(&motion.deflection),
        Channel::EndEffector => motion.run.tip.as_ref().and_then(|tip| tip[index].get(i).copied()).filter(|x| x.is_finite()),
    }
}
