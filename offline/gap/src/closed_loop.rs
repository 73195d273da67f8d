//! The simulation run again with what was found in it, along the commands of the held-out runs (gap-design.md, section 8).
//!
//! Two figures per effect: in the loop with the controller, and with the recorded torque over short windows, since feedback
//! hides errors of the plant. Nothing here decides anything: what cannot be simulated is told in one line.

use gap_report::{DataQuality, Fit, FloorMethod, Level, Space};
use recordings::Recording;
use simulator::model::RobotModel;

use crate::builtin::{along_commands, along_torque};
use crate::cell::{Cell, Channel};
use crate::floors::floor;
use crate::found::Found;
use crate::given::Given;
use crate::motion::{Band, Motion};
use crate::parallel;
use crate::robot::Robot;
use crate::run::{Run, common};
use crate::series::rms;
use crate::told::{cell_name, cell_quantity, cell_unit, main_cell};

/// The check under which is told what could not be simulated.
const CHECK: &str = "simulated again";
/// The plant is started anew from the recorded state after so long, s.
const WINDOW_S: f64 = 1.0;
/// Stretches that are left out one at a time for an interval, s.
const BLOCK_S: f64 = 1.5;

/// Fits of every effect, in the order of the effects, and what there is to be told.
#[derive(Debug, Default)]
pub(crate) struct Again {
    /// One list per effect.
    pub(crate) fits: Vec<Vec<Fit>>,
    /// Why there are none.
    pub(crate) told: Vec<DataQuality>,
}

/// One held-out run beside the simulations of it.
struct Played {
    real: Motion,
    before: Motion,
    after: Motion,
}

/// What the simulator makes of a recording, from so long after its first row on, s; one line where it cannot.
type Play = dyn Fn(&RobotModel, &Recording, f64) -> Result<Recording, String> + Sync;
/// Told before what was held out begins, s: no sample of it lies at the edge.
const EARLIER_S: f64 = 0.1;

/// Plays the held-out runs with the model without the effects, and each with the one in which they are when they are there.
pub(crate) fn again(models: (&RobotModel, &[RobotModel]), found: &Found, given: &[Given], band: Band) -> Again {
    let mut out = Again { fits: vec![Vec::new(); found.answer.effects.len()], told: Vec::new() };
    if found.answer.effects.is_empty() || found.held.pairs.iter().any(|pair| pair.real.run.points) {
        return out;
    }
    let mut told = |what: String| {
        let message = format!("the corrected model was not simulated {what}");
        out.told.push(DataQuality::new(CHECK, Level::Warn, message));
    };
    // One way of playing after the other: the runs of each take much memory.
    let mut in_loop = false;
    if models.0.controller().is_some() {
        match played(models, found, given, band, &along_commands) {
            Ok(played) => {
                in_loop = true;
                add_fits(&mut out.fits, found, &|of| in_loop_fit(found, of, &played));
            }
            Err(why) => told(format!("in the loop: {why}")),
        }
    }
    match played(models, found, given, band, &|model, recording, from_s| along_torque(model, recording, WINDOW_S, from_s)) {
        Ok(played) => add_fits(&mut out.fits, found, &|of| driven_fit(found, of, &played)),
        // Where the loop says it, a recording without torque needs no line of its own.
        Err(why) if !in_loop => told(format!("with the recorded torque: {why}")),
        Err(_) => {}
    }
    out
}

/// One more fit for each effect, where there is one.
fn add_fits(fits: &mut [Vec<Fit>], found: &Found, fit: &dyn Fn(&Cell) -> Option<Fit>) {
    // Of one that is not there, playing says nothing.
    for k in (0..fits.len()).filter(|k| !found.is_absent(*k)) {
        let (effect, estimate) = (&found.answer.effects[k], &found.estimates[k]);
        let cell = main_cell(found.floors, &effect.chosen.candidate, &estimate.coefficients);
        fits[k].extend(fit(&found.problem.cells[cell]));
    }
}

fn played(
    models: (&RobotModel, &[RobotModel]),
    found: &Found,
    given: &[Given],
    band: Band,
    play: &Play,
) -> Result<Vec<Played>, String> {
    let first = given.len().saturating_sub(found.held.pairs.len());
    let runs = found.held.pairs.iter().zip(&given[first..]).zip(models.1);
    runs.map(|((pair, given), after)| {
        let from_s = (pair.real.run.since_s - EARLIER_S).max(0.0);
        let of = |model: &RobotModel| play(model, &given.real, from_s).and_then(|sim| run_of(&sim, found.robot));
        let (before, after) = parallel::both(|| of(models.0), || of(after));
        let (before, after) = (before?, after?);
        let brought = |sim: &Run| common(&pair.real.run, sim).map_err(|error| error.to_string());
        let ((real, before), (_, after)) = (brought(&before)?, brought(&after)?);
        let smooth = |run: Run| Motion::new(run, band);
        let (real, (before, after)) = parallel::both(|| smooth(real), || parallel::both(|| smooth(before), || smooth(after)));
        Ok(Played { real, before, after })
    })
    .collect()
}

fn run_of(sim: &Recording, robot: &Robot) -> Result<Run, String> {
    let wrong = sim.columns.iter().find(|column| column.values.iter().any(|value| !value.is_finite()));
    match wrong {
        Some(column) => Err(format!("{} runs away", column.name)),
        None => Run::new(sim, robot).map_err(|error| error.to_string()),
    }
}

/// In the loop: the quantity in which the effect shows most.
fn in_loop_fit(found: &Found, of: &Cell, played: &[Played]) -> Option<Fit> {
    let [before, after] = [false, true].map(|corrected| differences(of, played, corrected));
    let quantity = cell_quantity(found.robot, of);
    let mut fit = fit((quantity, cell_unit(found.robot, of)), played, before?, after?)?;
    fit.extra.set("x_drive", "commands");
    Some(fit)
}

/// Driven by the recorded torque: where the motor of the joint gets to. Of what shows at the tip there is nothing to be seen.
fn driven_fit(found: &Found, of: &Cell, played: &[Played]) -> Option<Fit> {
    if of.channel != Channel::JointTorque {
        return None;
    }
    let robot = found.robot;
    let position = |motion: &Motion| Some(motion.position[of.index].clone());
    let [before, after] = [false, true].map(|corrected| by_row(played, corrected, of, &position));
    let quantity = format!("position of {}, driven by the recorded torque for {WINDOW_S} s each", cell_name(robot, of));
    let (before, after) = (before?, after?);
    let (size_before, size_after) = (rms(before.residual.into_iter()), rms(after.residual.into_iter()));
    // Errors of a second of free motion have no floor that could be read off them.
    let figures = (size_before, size_after);
    let mut fit = Fit::rms(quantity, robot.position_unit(of.index), Space::ClosedLoop, figures, None, ids(played));
    fit.extra.set("x_drive", "recorded torque");
    figures_are_finite(&fit).then_some(fit)
}

/// Recording less simulation in a cell.
fn differences(of: &Cell, played: &[Played], corrected: bool) -> Option<Cell> {
    match of.channel {
        Channel::JointTorque => {
            by_row(played, corrected, of, &|motion| motion.torque.as_ref().map(|torque| torque[of.index].clone()))
        }
        Channel::Transmission => {
            by_row(played, corrected, of, &|motion| motion.deflection.as_ref().map(|series| series[of.index].clone()))
        }
        Channel::EndEffector => at_tip(played, corrected, of),
    }
}

fn by_row(played: &[Played], corrected: bool, of: &Cell, series: &dyn Fn(&Motion) -> Option<Vec<f64>>) -> Option<Cell> {
    let mut cell = Cell::new(of.channel, of.index);
    for (r, run) in played.iter().enumerate() {
        let (real, sim) = (series(&run.real)?, series(if corrected { &run.after } else { &run.before })?);
        cell.rows.extend(run.real.rows.iter().map(|i| (r, *i)));
        cell.residual.extend(run.real.rows.iter().map(|i| real[*i] - sim[*i]));
    }
    Some(cell)
}

fn at_tip(played: &[Played], corrected: bool, of: &Cell) -> Option<Cell> {
    let mut cell = Cell::new(of.channel, of.index);
    for (r, run) in played.iter().enumerate() {
        let sim = if corrected { &run.after } else { &run.before };
        let (real, sim) = (run.real.run.tip.as_ref()?, sim.run.tip.as_ref()?);
        cell.rows.extend(run.real.tip_rows.iter().map(|i| (r, *i)));
        cell.residual.extend(run.real.tip_rows.iter().map(|i| real[of.index][*i] - sim[of.index][*i]));
    }
    Some(cell)
}

/// RMS before and after with the noise that is in the differences before, fixed before anything was fitted.
fn fit((quantity, unit): (String, &str), played: &[Played], before: Cell, after: Cell) -> Option<Fit> {
    let floor = floor(&before);
    let interval = interval(played, &before, &after, floor);
    let sizes = (rms(before.residual.into_iter()), rms(after.residual.into_iter()));
    let floor = (floor > 0.0).then_some((floor, FloorMethod::Innovations));
    let mut fit = Fit::rms(quantity, unit, Space::ClosedLoop, sizes, floor, ids(played));
    fit.removed_fraction_ci95 = fit.removed_fraction.zip(interval).map(|(removed, half)| [removed - half, removed + half]);
    figures_are_finite(&fit).then_some(fit)
}

fn figures_are_finite(fit: &Fit) -> bool {
    fit.before.is_finite() && fit.after.is_finite()
}

fn ids(played: &[Played]) -> Vec<String> {
    played.iter().map(|run| run.real.run.id.clone()).collect()
}

/// Half the 95 % interval of the share that is gone: each stretch of time left out once.
fn interval(played: &[Played], before: &Cell, after: &Cell, floor: f64) -> Option<f64> {
    let mut blocks: Vec<[f64; 3]> = Vec::new();
    let mut last = None;
    for ((&(run, i), b), a) in before.rows.iter().zip(&before.residual).zip(&after.residual) {
        let block = (run, (i as f64 * played[run].real.run.dt_s / BLOCK_S) as usize);
        if last != Some(block) {
            blocks.push([0.0; 3]);
            last = Some(block);
        }
        let sums = blocks.last_mut()?;
        for (sum, more) in sums.iter_mut().zip([b * b, a * a, 1.0]) {
            *sum += more;
        }
    }
    let all: [f64; 3] = std::array::from_fn(|k| blocks.iter().map(|block| block[k]).sum());
    let without: Option<Vec<f64>> = blocks
        .iter()
        .map(|block| {
            let count = (all[2] - block[2]).max(1.0);
            let of = |k: usize| ((all[k] - block[k]).max(0.0) / count).sqrt();
            gap_report::removed_fraction(of(0), of(1), floor)
        })
        .collect();
    let (without, n) = (without?, blocks.len() as f64);
    let mean = crate::series::mean(&without);
    let variance = (n - 1.0) / n * without.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    (blocks.len() > 2 && variance.is_finite()).then(|| 1.96 * variance.sqrt())
}
