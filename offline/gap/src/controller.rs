//! Has the recording the controller that the simulation has?
//!
//! Other gains leave no residual in torque, transmission or tip: the robot does what its torque makes it do. They show in how
//! torque answers the tracking error. The law is learnt from the simulation, where it has to explain nearly all of the torque,
//! and applied to what the recording's controller saw.

use crate::cell::Channel;
use crate::held_out::{Sized, left};
use crate::hypothesis::{CARRIED, torque_scale};
use crate::linear::least_squares;
use crate::motion::Motion;
use crate::nominal::Evaluator;
use crate::problem::Problem;
use crate::series::{less_means, rms};

/// Share of the simulation's torque that its law may leave.
const LAW: f64 = 0.1;
/// Share of it from which on what the law leaves counts: a simulation without noise, of which the law leaves nothing, says no more of each gain.
const NOTHING: f64 = 0.01;
/// Times that share, and share of the torque, by which the recording has to miss the law.
const BEYOND: f64 = 4.0;
const LEAST: f64 = 0.03;
/// Share of what it misses that other gains may leave in the part kept aside.
const LEFT: f64 = 0.6;
/// Times what either's own law leaves that one law may leave of both.
const ONE_LAW: f64 = 1.6;
/// Of every run, what is kept aside.
const KEPT: f64 = 1.0 / 3.0;
/// Error, its derivative, its integral.
const GAINS: usize = 3;
/// Which of the columns is what the motor has to give.
const OF_MOTOR: usize = 4;

/// A joint whose torque answers its tracking error otherwise than in the simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Changed {
    /// The joint.
    pub joint: usize,
    /// Ratio of the recording's proportional gain to the simulation's.
    pub gain: f64,
    /// RMS that the simulation's law misses in the part kept aside, and what other gains leave there, N·m or N.
    pub missed: [f64; 2],
}

/// How the recorded torque of a joint may be read.
struct Reading {
    /// A motor that gives so many times its torque may be logged as what it gives, or as what it was asked for.
    scale: f64,
    /// What the motor has to give beside the nominal load, row by row of the joint's torque: a law that the simulation's torque cannot tell from its
    /// load asks for that too. Empty: nothing.
    added: Vec<f64>,
}

/// What a controller sees at the rows, and the torque that it gives.
struct Seen {
    columns: Vec<Vec<f64>>,
    torque: Vec<f64>,
    /// Run and sample.
    rows: Vec<(usize, usize)>,
    kept: Vec<bool>,
}

/// The joint where it shows most, if any, beside the effects that were found: however the recorded torque is read, the controller is another one.
pub fn changed(problem: &Problem, effects: &[Sized]) -> Option<Changed> {
    let sims: Vec<&Motion> = problem.pairs.iter().filter_map(|pair| pair.sim.as_ref()).collect();
    let reals: Vec<&Motion> = problem.pairs.iter().map(|pair| &pair.real).collect();
    if sims.len() < reals.len() {
        return None;
    }
    let all = (0..problem.robot.joint_count()).filter_map(|j| {
        let as_logged = at_joint(problem, &reals, &sims, j, &Reading { scale: 1.0, added: Vec::new() })?;
        let told = |reading: &Reading| at_joint(problem, &reals, &sims, j, reading).is_some();
        readings(problem, effects, j).iter().all(told).then_some(as_logged)
    });
    all.max_by(|a, b| (a.missed[0] / a.missed[1]).total_cmp(&(b.missed[0] / b.missed[1])))
}

/// How else than as it was logged the torque of a joint may be read, by what was found.
fn readings(problem: &Problem, effects: &[Sized], j: usize) -> Vec<Reading> {
    let of_motor = effects.iter().filter(|(claim, _)| claim.family.joints == [j]);
    let scales = of_motor.filter_map(|(claim, theta)| torque_scale(&claim.family, theta));
    let mut all: Vec<Reading> = scales.map(|scale| Reading { scale, added: Vec::new() }).collect();
    let Some(cell) = problem.cell(Channel::JointTorque, j) else { return all };
    let carried: Vec<Sized> = effects.iter().filter(|(claim, _)| CARRIED.contains(&claim.family.physics)).copied().collect();
    if !carried.is_empty() {
        let before = &problem.cells[cell].residual;
        let added = before.iter().zip(left(problem, cell, &carried)).map(|(y, left)| y - left).collect();
        all.push(Reading { scale: 1.0, added });
    }
    all
}

fn at_joint(problem: &Problem, reals: &[&Motion], sims: &[&Motion], j: usize, reading: &Reading) -> Option<Changed> {
    let sim = seen(problem, sims, j)?;
    let everything: Vec<usize> = (0..sim.columns.len()).collect();
    let law = fit(&[(Part { seen: &sim, whole: true, over: 1.0 }, &sim.torque)], &everything);
    let usual = rms(without_means(&sim, &sim.torque).into_iter());
    let left = rms(missed(&sim, &sim.torque, &everything, &law).into_iter()).max(NOTHING * usual);
    let mut real = seen(problem, reals, j)?;
    real.torque.iter_mut().for_each(|torque| *torque *= reading.scale);
    if let Some(cell) = problem.cell(Channel::JointTorque, j).filter(|_| !reading.added.is_empty()) {
        let rows = &problem.cells[cell].rows;
        for (row, load) in real.rows.iter().zip(&mut real.columns[OF_MOTOR]) {
            *load += rows.binary_search(row).map_or(0.0, |k| reading.added[k]);
        }
    }
    let off: Vec<f64> = missed(&real, &real.torque, &everything, &law);
    let gains: Vec<usize> = (0..GAINS).collect();
    let change = fit(&[(Part { seen: &real, whole: false, over: 1.0 }, &off)], &gains);
    let after = missed(&real, &off, &gains, &change);
    let aside = |series: &[f64]| rms(series.iter().zip(&real.kept).filter(|(_, kept)| **kept).map(|(y, _)| *y));
    let (before, after) = (aside(&off), aside(&after));
    // A simulation that its own model leads along the motion hardly errs: what gains it has, its torque does not say.
    let others: Vec<usize> = (GAINS..sim.columns.len()).collect();
    let ungained = fit(&[(Part { seen: &sim, whole: true, over: 1.0 }, &sim.torque)], &others);
    let asks = rms(missed(&sim, &sim.torque, &others, &ungained).into_iter()) > ONE_LAW * left;
    let told = asks && left <= LAW * usual && before > BEYOND * left && before > LEAST * usual && after < LEFT * before;
    // Where the simulation hardly asks for a gain, that of an integral above all, its own torque says little of it: one law may hold in both.
    // Each over what its own law leaves.
    let of_both = [
        (Part { seen: &sim, whole: true, over: left.max(1e-300) }, &*sim.torque),
        (Part { seen: &real, whole: false, over: after.max(left).max(1e-300) }, &*real.torque),
    ];
    let one = fit(&of_both, &everything);
    let of_sim = rms(missed(&sim, &sim.torque, &everything, &one).into_iter());
    let of_real = aside(&missed(&real, &real.torque, &everything, &one));
    let is_one_law = of_sim < ONE_LAW * left && of_real < ONE_LAW * after.max(left);
    (told && !is_one_law).then(|| Changed { joint: j, gain: 1.0 + change[0] / law[0], missed: [before, after] })
}

/// None where the recording has no commands or no torque.
fn seen(problem: &Problem, runs: &[&Motion], j: usize) -> Option<Seen> {
    let mut evaluator = Evaluator::new(problem.robot, problem.nominal);
    let mut out = Seen { columns: vec![Vec::new(); GAINS + 4], torque: Vec::new(), rows: Vec::new(), kept: Vec::new() };
    for (r, motion) in runs.iter().enumerate() {
        let (command, torque) = (motion.run.command.as_ref()?, motion.torque.as_ref()?);
        let goal = motion.window.apply(&command[j], 0);
        let (speed, acceleration) = (motion.window.apply(&command[j], 1), motion.window.apply(&command[j], 2));
        let mut integral = 0.0;
        let sums: Vec<f64> = goal
            .iter()
            .zip(&motion.position[j])
            .map(|(goal, q)| {
                integral += (goal - q) * motion.run.dt_s;
                integral
            })
            .collect();
        let aside = ((1.0 - KEPT) * motion.run.len() as f64) as usize;
        for &i in &motion.rows {
            let load = evaluator.load(motion, i);
            let values = [
                goal[i] - motion.position[j][i],
                speed[i] - motion.velocity[j][i],
                sums[i],
                load.link[j],
                load.motor[j],
                speed[i],
                acceleration[i],
            ];
            out.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
            out.torque.push(torque[j][i]);
            out.rows.push((r, i));
            out.kept.push(i >= aside);
        }
    }
    let finite = out.columns.iter().chain([&out.torque]).flatten().all(|x| x.is_finite());
    (finite && out.torque.len() > 10 * out.columns.len()).then_some(out)
}

/// A series less its mean over each run: where an integral began is not known.
fn without_means(seen: &Seen, series: &[f64]) -> Vec<f64> {
    less_means(series, |k| seen.rows[k].0)
}

/// What was seen, the whole or all but what is kept aside, over a number that says what it is worth.
struct Part<'s> {
    seen: &'s Seen,
    whole: bool,
    over: f64,
}

/// Least squares of a series of each part on some columns, all without their means.
fn fit(parts: &[(Part, &[f64])], columns: &[usize]) -> Vec<f64> {
    let rows = |part: &Part, series: &[f64]| -> Vec<f64> {
        let all = without_means(part.seen, series).into_iter().zip(&part.seen.kept);
        all.filter(|(_, kept)| part.whole || !**kept).map(|(y, _)| y / part.over).collect()
    };
    let column = |c: usize| parts.iter().flat_map(|(part, _)| rows(part, &part.seen.columns[c])).collect();
    let own: Vec<Vec<f64>> = columns.iter().map(|c| column(*c)).collect();
    let series: Vec<f64> = parts.iter().flat_map(|(part, series)| rows(part, series)).collect();
    least_squares(&own.iter().map(Vec::as_slice).collect::<Vec<_>>(), &series)
}

/// What a law on some columns misses of a series.
fn missed(seen: &Seen, series: &[f64], columns: &[usize], law: &[f64]) -> Vec<f64> {
    let told = (0..series.len()).map(|i| columns.iter().zip(law).map(|(c, theta)| theta * seen.columns[*c][i]).sum::<f64>());
    let left: Vec<f64> = series.iter().zip(told).map(|(y, p)| y - p).collect();
    without_means(seen, &left)
}
