//! The residuals: cells (a channel of a joint or an axis) of rows, over all runs, in blocks of time.

use arm::serial::Workspace;

use crate::cell::{Cell, Channel, zero_at};
use crate::motion::Motion;
use crate::nominal::{Evaluator, Load, Nominal};
use crate::nuisance::Nuisance;
use crate::pair::{Frames, Pair};
use crate::robot::Robot;
use crate::series::{noise_of, rms};
use crate::shaking::Shaking;

/// Least RMS of an effect in each cell: what is smaller may be the error of the nominal model. All 0 where that is not known.
#[derive(Debug, Clone, Default)]
pub struct Practical {
    /// Of any effect.
    pub any: Vec<f64>,
    /// Of more or less of an effect that the model has already: its form is known, so that little of another error passes for it.
    pub known: Vec<f64>,
    /// Physics and joints of the model's own effects.
    pub effects: Vec<(String, Vec<usize>)>,
}

impl Practical {
    /// For an effect, per cell.
    pub fn of(&self, physics: &str, joints: &[usize]) -> &[f64] {
        let known = self.effects.iter().any(|(name, own)| name == physics && own == joints);
        if known { &self.known } else { &self.any }
    }

    /// Is there a cell in which an effect must amount to something?
    pub fn is_known(&self) -> bool {
        self.any.iter().any(|least| *least > 0.0)
    }
}

/// Everything that hypotheses are tested on.
pub struct Problem<'a> {
    /// The robot.
    pub robot: &'a Robot,
    /// What is believed of it.
    pub nominal: &'a Nominal,
    /// The runs.
    pub pairs: &'a [Pair],
    /// The residuals.
    pub cells: Vec<Cell>,
    /// Block of each row of each cell.
    pub blocks: Vec<Vec<usize>>,
    /// Number of blocks.
    pub block_count: usize,
    /// Nominal load at each row of the joints' cells, per run, in the order of [`Motion::rows`].
    pub loads: Vec<Vec<Load>>,
    /// Where elastic joints shake each other, per run, at the same rows.
    pub shaking: Vec<Shaking>,
    /// Does the tip residual start from measured joints?
    pub tip_from_truth: bool,
    /// What is known only roughly, per cell.
    pub nuisances: Vec<Nuisance>,
    /// What an effect must amount to.
    pub practical: Practical,
    /// Was the nominal model learnt from a recording? What is left is then the model's error, not the sensors' noise.
    pub from_recording: bool,
}

/// Times that an effect has to exceed what the nominal model leaves of the robot that it was learnt from.
const BEYOND: f64 = 2.0;
/// Share of a torque that half a control cycle makes, a millisecond of motions that take half a second, and as much again.
const WITHIN_A_CYCLE: f64 = 2e-3;
/// Share of what the model leaves of its own simulation's torque that may be left: of nulls of an arm that mostly stands a third is.
const OF_ITS_OWN: f64 = 0.5;
/// Share of what the model misses of the simulation's torque at a row that may be left there: nearly all that such nulls leave is less.
const OF_A_MISS: f64 = 0.4;
/// Does a joint move, in some run, so that its torque says more than where it hangs?
fn moves(robot: &Robot, pairs: &[Pair], j: usize) -> bool {
    pairs.iter().any(|pair| robot.moves(j, &pair.real.position[j]))
}

impl<'a> Problem<'a> {
    /// Forms the residuals of the runs.
    pub fn new(robot: &'a Robot, nominal: &'a Nominal, pairs: &'a [Pair], block_s: f64) -> Self {
        let n = robot.joint_count();
        let mut evaluator = Evaluator::new(robot, nominal);
        let loads: Vec<Vec<Load>> =
            pairs.iter().map(|pair| pair.real.rows.iter().map(|&i| evaluator.load(&pair.real, i)).collect()).collect();
        let sim_loads: Vec<Option<Vec<Load>>> = pairs
            .iter()
            .map(|pair| pair.sim.as_ref().map(|sim| pair.real.rows.iter().map(|&i| evaluator.load(sim, i)).collect()))
            .collect();
        let shaking =
            pairs.iter().zip(&sim_loads).map(|(pair, loads)| Shaking::new(robot, nominal, pair, loads.as_deref())).collect();
        let tip_from_truth = pairs.iter().all(|pair| pair.real.run.truth.is_some());
        let mut problem = Self {
            robot,
            nominal,
            pairs,
            cells: Vec::new(),
            blocks: Vec::new(),
            block_count: 0,
            loads,
            shaking,
            tip_from_truth,
            nuisances: Vec::new(),
            practical: Practical::default(),
            from_recording: false,
        };
        if pairs.iter().all(|pair| pair.real.torque.is_some()) {
            (0..n).filter(|j| moves(robot, pairs, *j)).for_each(|j| problem.push_torque(j, &sim_loads));
        }
        if pairs.iter().all(|pair| pair.real.deflection.is_some()) {
            (0..n).for_each(|j| problem.push_transmission(j, &sim_loads));
        }
        if pairs.iter().all(|pair| !pair.real.tip_rows.is_empty()) {
            problem.push_tip();
        }
        problem.lay_blocks(block_s);
        problem.nuisances = vec![Nuisance::default(); problem.cells.len()];
        let nothing = vec![0.0; problem.cells.len()];
        problem.practical = Practical { any: nothing.clone(), known: nothing, effects: Vec::new() };
        problem
    }

    /// The same, of simulations that move otherwise than the recording: what the model leaves of their own torques does not cancel.
    #[must_use]
    pub fn not_by_sample(mut self) -> Self {
        let of =
            |cell: &Cell| if cell.channel == Channel::JointTorque { BEYOND * self.nominal.torque_error[cell.index] } else { 0.0 };
        self.practical.any = self.cells.iter().map(of).collect();
        self.practical.known.clone_from(&self.practical.any);
        self
    }

    /// Of a robot that its own model stands in for: an effect has to be more than when, within a control cycle, a torque acts that is written with it.
    pub(crate) fn beyond_the_cycle(&mut self) {
        for c in 0..self.cells.len() {
            let Cell { channel: Channel::JointTorque, index, rows, .. } = &self.cells[c] else { continue };
            let at = |(r, i): (usize, usize)| self.pairs[r].real.torque.as_ref().map_or(0.0, |torque| torque[*index][i]);
            let least = WITHIN_A_CYCLE * rms(rows.iter().map(|row| at(*row)));
            self.practical.any[c] = self.practical.any[c].max(least);
            self.practical.known[c] = self.practical.known[c].max(least);
        }
    }

    /// What the model's error may leave of a cell, though it goes where recording and simulation move alike: each turns round when it does.
    pub(crate) fn own_error(&self, c: usize) -> f64 {
        match self.cells[c].channel {
            Channel::JointTorque => OF_ITS_OWN * self.nominal.torque_error[self.cells[c].index],
            _ => 0.0,
        }
    }

    /// At which rows of a cell the model misses the simulation's own torque by far more than an effect is: where it is wrong, recording and simulation
    /// differ by a part of its error as soon as they do not pass by there alike.
    pub(crate) fn is_within_a_miss<'e>(&'e self, c: usize, effect: &'e [f64]) -> impl Iterator<Item = bool> + 'e {
        let missed = self.cells[c].missed.iter().copied().chain(std::iter::repeat(0.0));
        effect.iter().zip(missed).map(|(e, missed)| e.abs() < OF_A_MISS * missed.abs())
    }

    /// Are its rows points without a clock?
    pub(crate) fn of_points(&self) -> bool {
        self.pairs.iter().all(|pair| pair.real.run.points)
    }

    fn push_torque(&mut self, j: usize, sim_loads: &[Option<Vec<Load>>]) {
        let coupling = self.robot.coupling();
        let dry: Vec<(usize, f64)> = (0..self.robot.joint_count())
            .map(|d| (d, coupling[(d, j)] * self.nominal.drives[d][2]))
            .filter(|(_, coulomb)| *coulomb != 0.0)
            .collect();
        let mut cell = Cell::new(Channel::JointTorque, j);
        for (r, pair) in self.pairs.iter().enumerate() {
            let expected = |motion: &Motion, loads: &[Load]| -> Vec<f64> {
                let signs: Vec<(f64, Vec<f64>)> =
                    dry.iter().map(|(d, coulomb)| (*coulomb, self.nominal.dry_sign(motion, *d))).collect();
                let friction = |i: usize| signs.iter().map(|(coulomb, s)| coulomb * s[i]).sum::<f64>();
                pair.real.rows.iter().zip(loads).map(|(&i, load)| load.motor[j] + friction(i)).collect()
            };
            let torque = &pair.real.torque.as_ref().expect("checked by the caller")[j];
            let mut residual: Vec<f64> =
                pair.real.rows.iter().zip(expected(&pair.real, &self.loads[r])).map(|(&i, e)| torque[i] - e).collect();
            let first_row = cell.rows.len();
            let own: Option<Vec<f64>> = pair.sim.as_ref().zip(sim_loads[r].as_ref()).and_then(|(sim, loads)| {
                let torque = &sim.torque.as_ref()?[j];
                Some(pair.real.rows.iter().zip(expected(sim, loads)).map(|(&i, e)| torque[i] - e).collect())
            });
            if let Some(own) = &own {
                residual.iter_mut().zip(own).for_each(|(out, own)| *out -= own);
            }
            let noise = noise_of(&residual, |_, _| true);
            if let Some(own) = own {
                cell.silent.extend(self.shaking[r].rows(&own, pair, j, noise).map(|k| first_row + k));
                cell.missed.resize(first_row, 0.0);
                cell.missed.extend(own);
            }
            for motion in std::iter::once(&pair.real).chain(&pair.sim) {
                for held in dry.iter().map(|(d, coulomb)| self.nominal.turns[*d].unknown(motion, *d, noise / coulomb.abs())) {
                    let first = cell.rows.len();
                    let silent = pair.real.rows.iter().enumerate().filter(|(_, i)| held[**i]);
                    cell.silent.extend(silent.map(|(k, _)| first + k));
                }
            }
            cell.rows.extend(pair.real.rows.iter().map(|&i| (r, i)));
            cell.residual.extend(residual);
        }
        zero_at(&mut cell.residual, &cell.silent);
        self.cells.push(cell);
    }

    fn push_transmission(&mut self, j: usize, sim_loads: &[Option<Vec<Load>>]) {
        let shares = self.robot.strain_shares();
        let expected = |load: &Load| self.nominal.deflection(&shares, j, &load.link);
        let mut cell = Cell::new(Channel::Transmission, j);
        for (r, pair) in self.pairs.iter().enumerate() {
            let deflection = &pair.real.deflection.as_ref().expect("checked by the caller")[j];
            let sim = pair.sim.as_ref().and_then(|sim| sim.deflection.as_ref()).zip(sim_loads[r].as_ref());
            for (k, &i) in pair.real.rows.iter().enumerate() {
                let mut value = deflection[i] - expected(&self.loads[r][k]);
                if let Some((sim, loads)) = sim {
                    value -= sim[j][i] - expected(&loads[k]);
                }
                cell.rows.push((r, i));
                cell.residual.push(value);
            }
        }
        self.cells.push(cell);
    }

    fn push_tip(&mut self) {
        let mut cells = [0, 1, 2].map(|axis| Cell::new(Channel::EndEffector, axis));
        let mut ws = Workspace::new(&self.robot.arm);
        for (r, pair) in self.pairs.iter().enumerate() {
            let tip = pair.real.run.tip.as_ref().expect("checked by the caller");
            let sim = pair.sim.as_ref().and_then(|sim| Some((sim, sim.run.tip.as_ref()?, Frames::of(sim)?)));
            let mut off = |motion: &Motion, seen: &[Vec<f64>; 3], i: usize| {
                let expected = self.tip(&mut ws, motion, i);
                [0, 1, 2].map(|a| seen[a][i] - expected[a])
            };
            for &i in &pair.real.tip_rows {
                let mut left = off(&pair.real, tip, i);
                // What the simulation is off by changes slowly, its tip does not: the line is drawn between the former.
                if let Some((sim, seen, [first, last])) =
                    sim.as_ref().and_then(|(sim, seen, frames)| Some((sim, seen, frames.around(i)?)))
                {
                    let share = if last > first { (i - first) as f64 / (last - first) as f64 } else { 0.0 };
                    for (frame, share) in [(first, 1.0 - share), (last, share)] {
                        if share > 0.0 {
                            let beside = off(sim, seen, frame);
                            left.iter_mut().zip(beside).for_each(|(left, off)| *left -= share * off);
                        }
                    }
                }
                for (cell, left) in cells.iter_mut().zip(left) {
                    cell.rows.push((r, i));
                    cell.residual.push(left);
                }
            }
        }
        self.cells.extend(cells);
    }

    /// Tip of the nominal kinematics where the joints are measured to be, or where the motors say.
    fn tip(&self, ws: &mut Workspace, motion: &Motion, i: usize) -> [f64; 3] {
        let q = self.joints(motion, i);
        self.robot.arm.tip(ws, &q).translation.vector.into()
    }

    /// Joints from which the tip is expected.
    pub fn joints(&self, motion: &Motion, i: usize) -> Vec<f64> {
        match (&motion.run.truth, self.tip_from_truth) {
            (Some(truth), true) => truth.iter().map(|series| motion.window.at(series, i)).collect(),
            _ => motion.position.iter().map(|series| series[i]).collect(),
        }
    }

    /// Blocks of equal time within each run, for holding out.
    fn lay_blocks(&mut self, block_s: f64) {
        let mut first = Vec::new();
        let mut count = 0;
        for pair in self.pairs {
            let span = pair.real.run.len() as f64 * pair.real.run.dt_s;
            first.push((count, ((span / block_s).round() as usize).max(2), span));
            count += first[first.len() - 1].1;
        }
        self.block_count = count;
        self.blocks = self
            .cells
            .iter()
            .map(|cell| {
                cell.rows
                    .iter()
                    .map(|&(r, i)| {
                        let (start, blocks, span) = first[r];
                        let share = i as f64 * self.pairs[r].real.run.dt_s / span;
                        start + ((share * blocks as f64) as usize).min(blocks - 1)
                    })
                    .collect()
            })
            .collect();
    }

    pub(crate) fn silence_nuisances(&mut self) {
        for (cell, nuisance) in self.cells.iter().zip(&mut self.nuisances) {
            for column in &mut nuisance.columns {
                cell.silence(column);
            }
        }
    }

    /// Is there any cell of a channel?
    pub fn has(&self, channel: Channel) -> bool {
        self.cells.iter().any(|cell| cell.channel == channel)
    }

    /// Index of a cell, if the recording has it.
    pub fn cell(&self, channel: Channel, index: usize) -> Option<usize> {
        self.cells.iter().position(|cell| cell.channel == channel && cell.index == index)
    }
}

#[cfg(test)]
mod tests {
    use super::{Cell, Channel};
    use crate::motion::{Band, Motion};
    use crate::pair::held;
    use crate::run::Run;

    #[test]
    fn rows_that_say_nothing_are_no_rows_without_error() {
        let mut cell = Cell::new(Channel::JointTorque, 0);
        cell.rows = (0..5).map(|i| (0, i)).collect();
        cell.residual = vec![3.0, 0.0, 0.0, -3.0, 0.0];
        assert!((cell.rms(&cell.residual) - 18.0_f64.sqrt() / 5.0_f64.sqrt()).abs() < 1e-12);
        // One of them for two reasons.
        cell.silent = vec![1, 2, 2, 4];
        assert_eq!(cell.says(), [true, false, false, true, false]);
        assert!((cell.rms(&cell.residual) - 3.0).abs() < 1e-12);
        assert!(Cell::new(Channel::JointTorque, 0).rms(&[]).abs() < 1e-12);
    }

    #[test]
    fn a_drive_is_held_until_it_has_moved_away() {
        // It moves, stands from 2 to 3 s, trembles by a tenth of what frees it until 4 s, and moves on.
        let place = |i: i32| {
            let t = f64::from(i) * 1e-3;
            match i {
                0..2000 => t,
                2000..3000 => 2.0,
                3000..4000 => 2.0 + 1e-3 * (40.0 * (t - 3.0)).sin(),
                _ => t - 2.0 + 1e-3 * 40.0_f64.sin(),
            }
        };
        let series: Vec<f64> = (0..6000).map(place).collect();
        let motion = Motion::new(Run::of_one_joint(&series), Band::SLOW);
        let held = held(&motion, 0);
        assert!((2000..3990).all(|i| held[i]));
        assert!((0..1900).chain(4100..6000).all(|i| !held[i]));
    }
}
