//! Building blocks of the columns: series at the rows of the residuals, and how a torque or a deflection reaches each cell.

use std::sync::OnceLock;

use arm::serial::{PARAMETERS, SerialArm, Workspace};
use nalgebra::DMatrix;

use super::signs::Signs;
use super::windows::Windows;
use crate::cell::Channel;
use crate::motion::{Motion, State};
use crate::nominal::Evaluator;
use crate::problem::Problem;

/// One coefficient's part in every residual: `(cell, values)`, absent where it has none. The library is what fills the memory:
/// values in single precision take half of it, and differ by less than any recording resolves; sums are made in double.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Column {
    /// Cells in rising order.
    pub parts: Vec<(usize, Vec<f32>)>,
}

impl Column {
    /// Does it reach no cell?
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Adds a part; a cell that is not there takes nothing.
    pub fn push(&mut self, cell: Option<usize>, values: &[f64]) {
        if let Some(cell) = cell
            && values.iter().any(|x| *x != 0.0)
        {
            let at = self.parts.partition_point(|(c, _)| *c < cell);
            self.parts.insert(at, (cell, values.iter().map(|x| *x as f32).collect()));
        }
    }

    /// With the parts of another one.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        for (cell, values) in other.parts {
            match self.parts.binary_search_by_key(&cell, |(own, _)| *own) {
                Ok(at) => self.parts[at].1.iter_mut().zip(values).for_each(|(own, more)| *own += more),
                Err(at) => self.parts.insert(at, (cell, values)),
            }
        }
        self
    }

    /// Sums of the products with another one, row by row, of each cell that both have.
    pub(crate) fn products(&self, other: &Self) -> impl Iterator<Item = (usize, f64)> {
        self.parts.iter().filter_map(|(cell, own)| {
            let (_, its) = other.parts.iter().find(|(other, _)| other == cell)?;
            Some((*cell, own.iter().zip(its).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()))
        })
    }

    /// Sum of all of them.
    pub(crate) fn dot(&self, other: &Self) -> f64 {
        self.products(other).map(|(_, product)| product).sum()
    }

    /// Makes it 0 where a cell says nothing.
    pub fn silence(&mut self, problem: &Problem) {
        for (cell, values) in &mut self.parts {
            problem.cells[*cell].silence(values);
        }
    }

    /// The same within windows of the runs only: what begins at once begins in the rows as everything is smoothed in them.
    #[must_use]
    pub fn within(&self, problem: &Problem, windows: &Windows) -> Self {
        self.weighted(problem, |r, i| {
            let motion = &problem.pairs[r].real;
            let [from_s, to_s] = windows.of(r);
            let t = motion.run.elapsed_s(i);
            motion.window.of_a_step(t - from_s) - motion.window.of_a_step(t - to_s)
        })
    }

    /// What of it lies in one run.
    #[must_use]
    pub fn of_run(&self, problem: &Problem, run: usize) -> Self {
        self.weighted(problem, |r, _| f64::from(u8::from(r == run)))
    }

    /// Each row, of which run and sample are told, by its weight.
    fn weighted(&self, problem: &Problem, weight: impl Fn(usize, usize) -> f64) -> Self {
        let parts = self.parts.iter().map(|(cell, values)| {
            let rows = &problem.cells[*cell].rows;
            (*cell, values.iter().zip(rows).map(|(x, &(r, i))| x * weight(r, i) as f32).collect())
        });
        Self { parts: parts.collect() }
    }
}

/// A torque of each joint, at the grid; none: no torque.
pub(crate) type Torques = Vec<Option<Vec<f64>>>;

/// What joints are asked for beside what is believed of them.
#[derive(Debug, Clone)]
pub(crate) struct Besides {
    /// What bodies and forces ask, which cables bear.
    pub(crate) of_links: Torques,
    /// What all that the motors give for asks, the former too.
    pub(crate) of_all: Torques,
}

impl Besides {
    /// Nothing of so many joints.
    pub(crate) fn none(joints: usize) -> Self {
        Self { of_links: vec![None; joints], of_all: vec![None; joints] }
    }
}

/// Series at the rows that all joint cells share (the grid), and at those of the tip.
pub struct Dictionary<'a> {
    /// The residuals.
    pub problem: &'a Problem<'a>,
    /// Run, sample and place in the run's own rows of each grid row.
    pub grid: Vec<(usize, usize, usize)>,
    /// Jacobian of the tip's position at the tip's rows, 3×N row-major.
    pub tip_jacobian: Vec<Vec<f64>>,
    /// Rows of the tip.
    pub tip_rows: Vec<(usize, usize)>,
    /// Share of a strain of each drive's cable (column) that each joint sees.
    strain_shares: DMatrix<f64>,
    /// Row of the grid that is nearest to each of the tip's.
    tip_places: Vec<usize>,
    cable_loads: Vec<OnceLock<Vec<f64>>>,
    besides: Besides,
    pub(super) signs: Signs,
    regressor: OnceLock<Vec<Vec<f64>>>,
    links: OnceLock<[Vec<Vec<f64>>; 2]>,
}

impl<'a> Dictionary<'a> {
    /// For the rows of a problem.
    pub fn new(problem: &'a Problem<'a>) -> Self {
        let grid = problem
            .pairs
            .iter()
            .enumerate()
            .flat_map(|(r, pair)| pair.real.rows.iter().enumerate().map(move |(k, &i)| (r, i, k)))
            .collect();
        let tip_rows: Vec<(usize, usize)> =
            problem.cell(Channel::EndEffector, 0).map_or_else(Vec::new, |c| problem.cells[c].rows.clone());
        let n = problem.robot.joint_count();
        let mut ws = Workspace::new(&problem.robot.arm);
        let tip_jacobian = tip_rows
            .iter()
            .map(|&(r, i)| {
                let q = problem.joints(&problem.pairs[r].real, i);
                let mut jacobian = vec![0.0; 6 * n];
                problem.robot.arm.jacobian(&mut ws, &q, &nalgebra::Vector3::zeros(), &mut jacobian);
                jacobian[..3 * n].to_vec()
            })
            .collect();
        let strain_shares = problem.robot.strain_shares();
        Self {
            problem,
            grid,
            tip_jacobian,
            tip_places: places(problem, &tip_rows),
            tip_rows,
            strain_shares,
            cable_loads: vec![OnceLock::new(); n],
            besides: Besides::none(n),
            signs: Signs::default(),
            regressor: OnceLock::new(),
            links: OnceLock::new(),
        }
    }

    /// The arm's regressor at every grid row, N×10N row-major.
    pub fn regressor(&self) -> &[Vec<f64>] {
        self.regressor.get_or_init(|| self.regressor_of(&self.problem.robot.arm))
    }

    /// That of another arm, in the same motion.
    pub fn regressor_of(&self, arm: &SerialArm) -> Vec<Vec<f64>> {
        let n = self.joints();
        let mut ws = Workspace::new(arm);
        let at = |&(r, i, _): &(usize, usize, usize)| {
            let state = self.problem.pairs[r].real.link(i);
            let mut y = vec![0.0; n * n * PARAMETERS];
            arm.regressor(&mut ws, &state.position, &state.velocity, &state.acceleration, &mut y);
            y
        };
        self.grid.iter().map(at).collect()
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.problem.robot.joint_count()
    }

    /// A series at the grid from what is known at each row.
    pub fn at_grid(&self, mut value: impl FnMut(usize, usize, usize) -> f64) -> Vec<f64> {
        self.grid.iter().map(|&(r, i, k)| value(r, i, k)).collect()
    }

    /// A full-rate series per run, smoothed as everything is, at the grid.
    pub fn smoothed(&self, mut raw: impl FnMut(usize) -> Vec<f64>) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.grid.len());
        for (r, pair) in self.problem.pairs.iter().enumerate() {
            let series = raw(r);
            out.extend(pair.real.window.at_all(&series, &pair.real.rows));
        }
        out
    }

    /// Distance between the ends of a joint's motion, rad or m.
    pub fn travel(&self, j: usize) -> f64 {
        let q = self.at_grid(|r, i, _| self.problem.pairs[r].real.position[j][i]);
        let (low, high) = crate::series::range(q.iter().copied());
        (high - low).max(1e-9)
    }

    /// What is borne and given from now on beside what is believed: columns that depend on a load have to be made anew. Of what a motor gives the
    /// weight of its joint is of the new, the rest of what was given so far.
    pub(crate) fn bear(&mut self, besides: Besides, weight_of_new: impl Fn(usize) -> f64) {
        let before = std::mem::replace(&mut self.besides, besides).of_all;
        for (joint, before) in before.into_iter().enumerate() {
            let new = weight_of_new(joint);
            let given = &mut self.besides.of_all[joint];
            *given = weighted(&|k| [new, 1.0 - new][k], &[given.take(), before]);
        }
        self.cable_loads = vec![OnceLock::new(); self.joints()];
    }

    /// Load of a joint at the grid: what its links ask of the drives.
    pub fn load(&self, joint: usize) -> Vec<f64> {
        let of_links = self.at_grid(|r, _, k| self.problem.loads[r][k].link[joint]);
        plus(of_links, self.besides.of_links[joint].as_deref())
    }

    /// What the links ask for more, per unit of it, where joints are elsewhere and move otherwise than their motors say: by so much position,
    /// velocity and acceleration at a sample, each joint times its share. The position counts where no encoder at the joint tells it.
    pub fn moved_otherwise(&self, share: impl Fn(usize) -> f64, change: impl Fn(&Motion, usize) -> [f64; 3]) -> Column {
        self.asked_more(1e-3, |motion, i, state, step| {
            let [position, velocity, acceleration] = change(motion, i).map(|x| step * x);
            for joint in 0..state.position.len() {
                if motion.deflection.is_none() {
                    state.position[joint] += share(joint) * position;
                }
                state.velocity[joint] += share(joint) * velocity;
                state.acceleration[joint] += share(joint) * acceleration;
            }
        })
    }

    /// Share of a strain of a drive's cable that a joint sees.
    pub fn strain_share(&self, joint: usize, drive: usize) -> f64 {
        self.strain_shares[(joint, drive)]
    }

    /// The same in other states than those believed, from a change by one step.
    pub fn asked_more(&self, step: f64, change: impl Fn(&Motion, usize, &mut State, f64)) -> Column {
        if !self.problem.has(Channel::JointTorque) {
            return Column::default();
        }
        let mut evaluator = Evaluator::new(self.problem.robot, self.problem.nominal);
        let there = self.grid.iter().map(|&(r, i, _)| {
            let motion = &self.problem.pairs[r].real;
            let mut state = motion.link(i);
            change(motion, i, &mut state, step);
            evaluator.link(&state)
        });
        self.difference(&there.collect::<Vec<_>>(), self.believed(), step, false)
    }

    /// Joint torques per unit between two loads of the links, row by row, that are a step apart.
    pub fn difference(&self, there: &[Vec<f64>], here: &[Vec<f64>], step: f64, at_link: bool) -> Column {
        let of = |j: usize| there.iter().zip(here).map(|(there, here)| (there[j] - here[j]) / step).collect();
        self.effort(&(0..self.joints()).map(|j| Some(of(j))).collect::<Vec<_>>(), at_link)
    }

    /// What the links are believed to ask of the joints in their motion, without any friction, row by row.
    pub fn believed(&self) -> &[Vec<f64>] {
        &self.links()[0]
    }

    /// What the links alone ask of a joint at the grid, without any friction: in their motion, or to be held where they are.
    pub fn links_alone(&self, joint: usize, held: bool) -> Vec<f64> {
        self.links()[usize::from(held)].iter().map(|torques| torques[joint]).collect()
    }

    fn links(&self) -> &[Vec<Vec<f64>>; 2] {
        let of = |held: bool| {
            let mut evaluator = Evaluator::new(self.problem.robot, self.problem.nominal);
            let torques = self.grid.iter().map(|&(r, i, _)| {
                let mut state = self.problem.pairs[r].real.link(i);
                if held {
                    state.velocity.fill(0.0);
                    state.acceleration.fill(0.0);
                }
                evaluator.link(&state)
            });
            torques.collect::<Vec<_>>()
        };
        self.links.get_or_init(|| [of(false), of(true)])
    }

    /// What the links of another arm, of the same inertia, would ask of the joints in this motion, row by row.
    pub fn loads_of(&self, arm: &SerialArm) -> Vec<Vec<f64>> {
        let mut robot = self.problem.robot.clone();
        robot.arm = arm.clone();
        let mut evaluator = Evaluator::new(&robot, self.problem.nominal);
        self.grid.iter().map(|&(r, i, _)| evaluator.link(&self.problem.pairs[r].real.link(i))).collect()
    }

    /// Load on the cable of a drive at the grid, `f = C⁻ᵀ τ`: one that passes other joints bears no part of theirs, but they of its own.
    pub fn cable_load(&self, drive: usize) -> &[f64] {
        self.cable_loads[drive].get_or_init(|| {
            let of_links = self
                .at_grid(|r, _, k| self.carried(drive, &self.problem.loads[r][k].link) + self.problem.shaking[r].borne(drive, k));
            plus(of_links, weighted(&|joint| self.strain_shares[(joint, drive)], &self.besides.of_links).as_deref())
        })
    }

    /// What a drive has to give in all but the dry friction that is believed of it, at the grid.
    pub fn drive_torque(&self, drive: usize) -> Vec<f64> {
        let of_all = self.at_grid(|r, _, k| self.carried(drive, &self.problem.loads[r][k].motor));
        plus(of_all, weighted(&|joint| self.strain_shares[(joint, drive)], &self.besides.of_all).as_deref())
    }

    /// What torques at the joints ask of the cable of a drive.
    fn carried(&self, drive: usize, torques: &[f64]) -> f64 {
        self.strain_shares.column(drive).iter().zip(torques).map(|(share, torque)| share * torque).sum()
    }

    /// Values of the grid carried over to the tip's rows: those of the nearest row.
    pub fn to_tip(&self, grid: &[f64]) -> Vec<f64> {
        self.tip_places.iter().map(|place| grid[*place]).collect()
    }

    /// Torques that the joints need in addition, one series per joint (none: no torque). Those of the links also load the
    /// cables, so they stretch them by the nominal compliance, and move the tip where the joints are not measured.
    pub fn effort(&self, torques: &[Option<Vec<f64>>], at_link: bool) -> Column {
        let mut column = Column::default();
        for (j, torque) in torques.iter().enumerate() {
            let Some(torque) = torque else { continue };
            column.push(self.problem.cell(Channel::JointTorque, j), torque);
        }
        if at_link {
            let stretched = self.stretched_by(torques);
            self.stretch(&mut column, &stretched);
        }
        column
    }

    /// Deflections of the joints by torques at them: each loads the cables that hold it, `f = C⁻ᵀ τ`, those give way by their compliance, and
    /// `A⁻¹ m` takes that for motion of every joint that is read through them, `C⁻¹`.
    fn stretched_by(&self, torques: &[Option<Vec<f64>>]) -> Torques {
        let shares = &self.strain_shares;
        let compliance = |drive: usize| self.problem.nominal.compliance[drive][0];
        let strain = |drive: usize| weighted(&|joint| compliance(drive) * shares[(joint, drive)], torques);
        self.read_through(&(0..self.joints()).map(strain).collect::<Vec<_>>())
    }

    /// Deflections of the joints by strains of the drives' cables: joints whose position is read through others' cables see their share.
    fn read_through(&self, strains: &[Option<Vec<f64>>]) -> Torques {
        (0..self.joints()).map(|joint| weighted(&|drive| self.strain_shares[(joint, drive)], strains)).collect()
    }

    /// Deflections `A⁻¹ m - q` of the joints in addition.
    pub fn deflection(&self, deflections: &[Option<Vec<f64>>]) -> Column {
        let mut column = Column::default();
        self.stretch(&mut column, deflections);
        column
    }

    /// A deflection of one joint.
    pub fn deflection_of(&self, joint: usize, series: Vec<f64>) -> Column {
        let mut all = vec![None; self.joints()];
        all[joint] = Some(series);
        self.deflection(&all)
    }

    /// A deflection of one drive's cable, as [`Dictionary::read_through`] has it.
    pub fn strain_of(&self, drive: usize, series: Vec<f64>) -> Column {
        let mut strains = vec![None; self.joints()];
        strains[drive] = Some(series);
        self.deflection(&self.read_through(&strains))
    }

    /// A torque of one joint; not at the link: of its drive, which its cables carry to the joints that they pass.
    pub fn effort_of(&self, joint: usize, series: Vec<f64>, at_link: bool) -> Column {
        let mut all = vec![None; self.joints()];
        if !at_link {
            let coupling = self.problem.robot.coupling();
            for other in (0..self.joints()).filter(|other| *other != joint && coupling[(joint, *other)] != 0.0) {
                all[other] = Some(series.iter().map(|x| coupling[(joint, other)] * x).collect());
            }
        }
        all[joint] = Some(series);
        self.effort(&all, at_link)
    }

    fn stretch(&self, column: &mut Column, deflections: &[Option<Vec<f64>>]) {
        let mut tip = vec![vec![0.0; self.tip_rows.len()]; 3];
        for (j, deflection) in deflections.iter().enumerate() {
            let Some(deflection) = deflection else { continue };
            column.push(self.problem.cell(Channel::Transmission, j), deflection);
            if !self.problem.tip_from_truth && !self.tip_rows.is_empty() {
                // The link stays behind the motor by the deflection.
                for (row, d) in self.to_tip(deflection).into_iter().enumerate() {
                    for (axis, tip) in tip.iter_mut().enumerate() {
                        tip[row] -= self.tip_jacobian[row][axis * self.joints() + j] * d;
                    }
                }
            }
        }
        for (axis, tip) in tip.into_iter().enumerate() {
            column.push(self.problem.cell(Channel::EndEffector, axis), &tip);
        }
    }

    /// A displacement of the measured tip, m, at its rows.
    pub fn tip(&self, mut displacement: impl FnMut(usize, usize, usize) -> [f64; 3]) -> Column {
        let moved: Vec<[f64; 3]> = self.tip_rows.iter().enumerate().map(|(row, &(r, i))| displacement(r, i, row)).collect();
        let mut column = Column::default();
        for axis in 0..3 {
            column.push(self.problem.cell(Channel::EndEffector, axis), &moved.iter().map(|d| d[axis]).collect::<Vec<_>>());
        }
        column
    }
}

/// Two series, row by row.
pub(super) fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

/// A series with what is there besides.
fn plus(mut series: Vec<f64>, besides: Option<&[f64]>) -> Vec<f64> {
    series.iter_mut().zip(besides.into_iter().flatten()).for_each(|(x, more)| *x += more);
    series
}

/// Adds torques, joint by joint; empty: none.
pub(super) fn add(torques: &mut Torques, more: &[Vec<f64>]) {
    for (torque, more) in torques.iter_mut().zip(more).filter(|(_, more)| !more.is_empty()) {
        *torque = Some(plus(more.clone(), torque.as_deref()));
    }
}

/// A series with the other sign.
pub(super) fn minus(a: &[f64]) -> Vec<f64> {
    a.iter().map(|x| -x).collect()
}

/// Root of the mean square of a series.
pub(super) fn size(series: &[f64]) -> f64 {
    crate::series::rms(series.iter().copied())
}

/// Of each row of the tip, the grid's row that is nearest to it.
fn places(problem: &Problem, tip_rows: &[(usize, usize)]) -> Vec<usize> {
    let mut start = Vec::with_capacity(problem.pairs.len());
    let mut next = 0;
    for pair in problem.pairs {
        start.push(next);
        next += pair.real.rows.len();
    }
    tip_rows.iter().map(|&(r, i)| start[r] + nearest(&problem.pairs[r].real.rows, i)).collect()
}

/// Place of the row nearest to a sample; rows are missing where the recording has holes.
fn nearest(rows: &[usize], sample: usize) -> usize {
    let after = rows.partition_point(|row| *row < sample);
    let before = after.saturating_sub(1);
    if after < rows.len() && rows[after] - sample < sample.saturating_sub(rows[before]) { after } else { before }
}

/// Sum of series, each times its weight; none where none of them is there.
fn weighted(weight: &dyn Fn(usize) -> f64, series: &[Option<Vec<f64>>]) -> Option<Vec<f64>> {
    let mut out: Option<Vec<f64>> = None;
    for (k, series) in series.iter().enumerate().filter(|(k, _)| weight(*k) != 0.0) {
        let Some(series) = series else { continue };
        let out = out.get_or_insert_with(|| vec![0.0; series.len()]);
        out.iter_mut().zip(series).for_each(|(out, x)| *out += weight(k) * x);
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_row_nearest_to_a_sample_is_found_on_both_sides_of_a_hole() {
        let rows = [100, 120, 140, 400, 420];
        let of = |sample| super::nearest(&rows, sample);
        assert_eq!([of(90), of(109), of(111), of(140), of(250), of(300), of(415), of(1000)], [0, 0, 1, 2, 2, 3, 4, 4]);
    }
}
