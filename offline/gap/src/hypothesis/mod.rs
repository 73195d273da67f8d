//! The library: every physics of the vocabulary as columns that it adds to the residuals.

mod actuation;
mod dictionary;
mod environment;
mod friction;
mod gravity;
mod hysteresis;
mod inertial;
mod kinematic;
mod signs;
mod timing;
mod transmission;
mod unknown;
mod windows;

pub(crate) use actuation::{RIPPLE, shaken, torque_scale};
pub(crate) use friction::{
    BY_LOAD, HEATING_S, Part, STRIBECK, are_parts, fades_within, levels_what_fades, may_fade, part, rub_together,
};
pub(crate) use hysteresis::{OWN_STIFFNESS, START};
pub(crate) use timing::LATE_TORQUES;
pub(crate) use transmission::{DRIFTS, GROUND, LATE_COUPLING, SENSOR};
pub use unknown::UNMODELLED;
pub(crate) use unknown::{HARDENING, SQUARED, STEPS_IN_TIME};

use std::sync::Arc;

use dictionary::Besides;
pub use dictionary::{Column, Dictionary};
pub use environment::direction;
pub(crate) use environment::{STEADY_FORCE, WALL};
pub(crate) use friction::{AT_MOTOR, STRIBECK_RANGE};
pub(crate) use gravity::{IN_THE_PLANE, OUT_OF_PLANE, WITH_OTHER_LINKS};
pub(crate) use inertial::{AT_THE_TIP, CARRIED, ROTOR};
pub(crate) use kinematic::{TOOL_LENGTH, TOOL_TWIST, TWISTED, shift};
pub use windows::{ALWAYS, NEVER, Window, Windows, with_both_edges, with_one_edge};

use crate::cell::Channel;

/// What a coefficient may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// Anything.
    Free,
    /// Not negative: friction takes energy away, a weight pulls down.
    Positive,
    /// Within these.
    Between(f64, f64),
    /// Positive, and at most so many times the coefficient before; or, if it is large enough to be held against that (a fifth), so many times what that
    /// adds to what is there, the second number.
    UpTo(f64, f64),
    /// At most so many times the first coefficient, of either sign.
    Within(f64),
}

/// Columns for a shape.
type Columns = dyn Fn(&Dictionary, &[f64]) -> Vec<Column> + Send + Sync;

/// A number of a shape that the coefficients fitted to it tell.
pub type Told = dyn Fn(&[f64]) -> f64 + Send + Sync;

/// Numbers that follow another: the shape before, and the one to be tried.
pub type Carry = dyn Fn(&[f64], &mut [f64]) + Send + Sync;

/// One form of a physics at its place: linear in its coefficients, for shapes that are searched.
pub struct Family {
    /// Name in the vocabulary.
    pub physics: &'static str,
    /// Joints (links) it is tied to; empty: to none.
    pub joints: Vec<usize>,
    /// Which form of it.
    pub form: &'static str,
    /// Channel where it shows most.
    pub channel: Channel,
    /// Names of the numbers of its shape.
    pub shape: Vec<&'static str>,
    /// Shapes to begin with; one empty shape where there is nothing to search.
    pub grid: Vec<Vec<f64>>,
    /// First step of the numbers that are refined between the grid's; none for those that are choices. NaN: half the
    /// distance to the grid's next.
    pub steps: Vec<Option<f64>>,
    /// The choices among them that are made anew once the others are settled: on the grid the others are too coarse to decide.
    pub choices: Vec<usize>,
    /// Between which values the numbers of its shape lie; none: each number is searched for itself, wherever it leads.
    pub limits: Vec<[f64; 2]>,
    /// Has it a constant of its own, which does not count for how large it is?
    pub with_constant: bool,
    /// Are the columns secants from 0 to the shape, so that the fit's own first coefficients are the next shape?
    pub secant: bool,
    /// One per coefficient.
    pub bounds: Vec<Bound>,
    /// Rank among equals: smaller is simpler or likelier before any data.
    pub penalty_nats: f64,
    /// What the other numbers of its shape follow when one is refined.
    pub carry: Option<Arc<Carry>>,
    /// The number of its shape that its coefficients tell.
    pub told: Option<(usize, Arc<Told>)>,
    columns: Arc<Columns>,
    /// Least size of its coefficient, where it has parts.
    pub least: f64,
    /// Parts of its one column: of what it explains, the first has to bear it out.
    apart: Option<Arc<Columns>>,
    /// How the numbers of its shape lie.
    pub valley: Valley,
}

/// How the numbers of a shape lie where the misfit is least: what it takes to find them from the grid's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Valley {
    /// Each by itself.
    Plain,
    /// One makes up for another, and both are known sharply: a memory that the motion shows in every sample.
    Sharp,
    /// One makes up for another: how slow, and since when.
    Long,
}

impl std::fmt::Debug for Family {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?} ({})", self.physics, self.joints, self.form)
    }
}

impl Family {
    /// A form whose columns do not depend on a shape.
    pub fn fixed(
        physics: &'static str,
        joints: &[usize],
        form: &'static str,
        channel: Channel,
        bounds: &[Bound],
        columns: impl Fn(&Dictionary) -> Vec<Column> + Send + Sync + 'static,
    ) -> Self {
        Self {
            physics,
            joints: joints.to_vec(),
            form,
            channel,
            shape: Vec::new(),
            grid: vec![Vec::new()],
            steps: Vec::new(),
            choices: Vec::new(),
            limits: Vec::new(),
            with_constant: false,
            secant: false,
            bounds: bounds.to_vec(),
            penalty_nats: 0.0,
            carry: None,
            told: None,
            columns: Arc::new(move |dictionary, _| columns(dictionary)),
            least: 0.0,
            apart: None,
            valley: Valley::Plain,
        }
    }

    /// A form whose columns have a shape: names with whether they are refined, and where to begin.
    #[expect(clippy::too_many_arguments, reason = "each is one field, and a table of forms reads best in one line each")]
    pub fn shaped(
        physics: &'static str,
        joints: &[usize],
        form: &'static str,
        channel: Channel,
        bounds: &[Bound],
        shape: &[(&'static str, bool)],
        grid: Vec<Vec<f64>>,
        columns: impl Fn(&Dictionary, &[f64]) -> Vec<Column> + Send + Sync + 'static,
    ) -> Self {
        Self {
            physics,
            joints: joints.to_vec(),
            form,
            channel,
            shape: shape.iter().map(|s| s.0).collect(),
            steps: shape.iter().map(|s| s.1.then_some(f64::NAN)).collect(),
            choices: Vec::new(),
            limits: Vec::new(),
            with_constant: false,
            secant: false,
            grid,
            bounds: bounds.to_vec(),
            penalty_nats: 0.0,
            carry: None,
            told: None,
            columns: Arc::new(columns),
            least: 0.0,
            apart: None,
            valley: Valley::Plain,
        }
    }

    /// A form in large numbers: the columns are secants from 0 to the shape, one coefficient for each of its numbers first.
    pub fn secant(
        physics: &'static str,
        joints: &[usize],
        form: &'static str,
        channel: Channel,
        bounds: &[Bound],
        shape: &[&'static str],
        columns: impl Fn(&Dictionary, &[f64]) -> Vec<Column> + Send + Sync + 'static,
    ) -> Self {
        let numbers: Vec<(&'static str, bool)> = shape.iter().map(|name| (*name, false)).collect();
        let start = vec![vec![0.0; shape.len()]];
        Self { secant: true, ..Self::shaped(physics, joints, form, channel, bounds, &numbers, start, columns) }
    }

    /// With the first steps of its refinement.
    #[must_use]
    pub fn stepped(mut self, steps: &[Option<f64>]) -> Self {
        self.steps = steps.to_vec();
        self
    }

    /// With numbers of its shape, refined by none, that are chosen anew once the others are; of families without limits.
    #[must_use]
    pub fn choosing(mut self, choices: &[usize]) -> Self {
        self.choices = choices.to_vec();
        self
    }

    /// What a choice of its shape may be instead, at the grid's values.
    pub fn other_choices(&self, k: usize, here: f64) -> Vec<f64> {
        let mut all: Vec<f64> = self.grid.iter().map(|point| point[k]).filter(|value| *value != here).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// With limits of its numbers, which then are refined all at once.
    #[must_use]
    pub fn limited(mut self, limits: &[[f64; 2]]) -> Self {
        self.limits = limits.to_vec();
        self
    }

    /// With a constant of its own.
    #[must_use]
    pub fn about_a_constant(mut self) -> Self {
        self.with_constant = true;
        self
    }

    /// With a number of its shape that the coefficients tell.
    #[must_use]
    pub fn telling(mut self, number: usize, told: impl Fn(&[f64]) -> f64 + Send + Sync + 'static) -> Self {
        self.told = Some((number, Arc::new(told)));
        self
    }

    /// With what its other numbers follow when one is refined: the shape before, and the one to be tried.
    #[must_use]
    pub fn carrying(mut self, carry: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static) -> Self {
        self.carry = Some(Arc::new(carry));
        self
    }

    /// With the least size of its one coefficient, and the parts of its column, of which the first has to say at least half as much.
    #[must_use]
    pub fn borne_out(mut self, least: f64, parts: impl Fn(&Dictionary) -> Vec<Column> + Send + Sync + 'static) -> Self {
        self.least = least;
        self.apart = Some(Arc::new(move |dictionary, _| parts(dictionary)));
        self
    }

    /// With numbers that lie in such a valley.
    #[must_use]
    pub fn lying_in(mut self, valley: Valley) -> Self {
        self.valley = valley;
        self
    }

    /// Which form of it, without what it depends on.
    pub fn side(&self) -> &'static str {
        self.form.split(',').next().unwrap_or(self.form)
    }

    /// May it be there in a part of a run only?
    pub fn comes_and_goes(&self) -> bool {
        !ALL_THE_TIME.contains(&self.physics) && self.may_have_edges()
    }

    /// Steps would have an edge more than they say; a drive stays as it is; and where a load hardly changes, two numbers of a bent spring are any
    /// constant (it is tried in the windows of a memory alone).
    pub fn may_have_edges(&self) -> bool {
        ![STEPS_IN_TIME, ROTOR].contains(&self.form) && !self.is_hardening()
    }

    /// Is it a spring that is bent, its numbers those of a load alone?
    pub(crate) fn is_hardening(&self) -> bool {
        HARDENING.contains(&self.form)
    }

    /// Less likely than its rivals by so much, before any data.
    #[must_use]
    pub fn penalised(mut self, nats: f64) -> Self {
        self.penalty_nats = nats;
        self
    }
}

/// What rubs.
const RUBS: [&str; 5] = ["coulomb_friction", "viscous_friction", "stribeck_friction", "load_dependent_friction", "thermal_drift"];

/// Not tried in windows: a curve at slow speed, in a window, passes for the force at one standstill.
const ALL_THE_TIME: [&str; 1] = ["stribeck_friction"];

/// Edges of windows closer than that are one, s: an effect takes its time to come, and its edge is known no better.
const SAME_EDGE_S: f64 = 0.3;

/// How well an edge is known, s.
const EDGE_KNOWN_S: f64 = 0.05;

/// A family at one shape and window, its columns made.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// What it says.
    pub family: Arc<Family>,
    /// Numbers that fix its shape, in the family's order.
    pub shape: Vec<f64>,
    /// When it is there; none: always.
    pub windows: Option<Windows>,
    /// One per coefficient; shared, since candidates are copied where they are compared.
    pub columns: Arc<Vec<Column>>,
    /// Parts of its one column, the first of which has to bear it out; none: nothing has to.
    pub(crate) apart: Arc<Vec<Column>>,
}

impl Candidate {
    /// Makes the columns.
    pub fn new(dictionary: &Dictionary, family: &Arc<Family>, shape: &[f64], windows: Option<&Windows>) -> Self {
        let silenced = |make: &Columns| {
            let mut columns = made(dictionary, make, shape, windows);
            for column in &mut columns {
                column.silence(dictionary.problem);
            }
            Arc::new(columns)
        };
        let apart = family.apart.as_ref().map_or_else(Arc::default, |parts| silenced(&**parts));
        Self {
            family: family.clone(),
            shape: shape.to_vec(),
            windows: windows.cloned(),
            columns: silenced(&*family.columns),
            apart,
        }
    }

    /// The same with what a dictionary bears now, refined by none.
    #[must_use]
    pub(crate) fn anew(&self, dictionary: &Dictionary) -> Self {
        Self::new(dictionary, &self.family, &self.shape, self.windows.as_ref())
    }

    /// Is it borne by cables as the links are?
    fn is_borne(&self) -> bool {
        CARRIED.contains(&self.family.physics) && !self.is_of_a_drive()
    }

    /// Is it what a motor has to give for?
    fn is_given(&self) -> bool {
        CARRIED.contains(&self.family.physics) || RUBS.contains(&self.family.physics) || self.family.physics == RIPPLE
    }

    /// Torques that it asks of the joints for given coefficients, where nothing is known of theirs too; empty where it asks none.
    fn asks(&self, dictionary: &Dictionary, coefficients: &[f64]) -> Vec<Vec<f64>> {
        let columns = made(dictionary, &*self.family.columns, &self.shape, self.windows.as_ref());
        let cell = |joint| dictionary.problem.cell(Channel::JointTorque, joint);
        (0..dictionary.joints()).map(|joint| cell(joint).map_or_else(Vec::new, |c| summed(&columns, c, coefficients))).collect()
    }

    /// Numbers of its windows that lie in the runs.
    pub fn edges(&self) -> usize {
        self.windows.as_ref().map_or(0, |windows| windows.edges().len())
    }

    /// The same within windows.
    #[must_use]
    pub fn within(&self, problem: &crate::problem::Problem, windows: &Windows) -> Self {
        let there = |columns: &[Column]| Arc::new(columns.iter().map(|column| column.within(problem, windows)).collect());
        let (columns, apart) = (there(&self.columns), there(&self.apart));
        Self { family: self.family.clone(), shape: self.shape.clone(), windows: Some(windows.clone()), columns, apart }
    }

    /// When it is there in a run.
    pub fn window_of(&self, run: usize) -> Window {
        self.windows.as_ref().map_or(ALWAYS, |windows| windows.of(run))
    }

    /// A number of its shape.
    pub fn shape_of(&self, name: &str) -> Option<f64> {
        self.family.shape.iter().position(|n| *n == name).map(|k| self.shape[k])
    }

    /// The effect in a cell for given coefficients; empty where it has none.
    pub fn effect(&self, cell: usize, coefficients: &[f64]) -> Vec<f64> {
        summed(&self.columns, cell, coefficients)
    }

    /// Takes the effect in a cell off a series.
    pub fn take_off(&self, cell: usize, coefficients: &[f64], series: &mut [f64]) {
        series.iter_mut().zip(self.effect(cell, coefficients)).for_each(|(y, p)| *y -= p);
    }

    /// RMS of the effect in a cell, about its mean where that is a constant of its own.
    pub fn varies_by(&self, cell: usize, coefficients: &[f64]) -> f64 {
        let effect = self.effect(cell, coefficients);
        let mean = if self.family.with_constant { crate::series::mean(&effect) } else { 0.0 };
        crate::series::rms(effect.into_iter().map(|x| x - mean))
    }

    /// RMS of the effect in a cell for given coefficients.
    pub fn rms(&self, cell: usize, coefficients: &[f64]) -> f64 {
        crate::series::rms(self.effect(cell, coefficients).into_iter())
    }

    /// The same of the rows where it is.
    pub fn rms_where_it_is(&self, cell: usize, coefficients: &[f64]) -> f64 {
        crate::series::rms(self.effect(cell, coefficients).into_iter().filter(|x| *x != 0.0))
    }

    /// Of each block, whether it shows there.
    pub fn blocks(&self, problem: &crate::problem::Problem) -> Vec<bool> {
        let mut shows = vec![false; problem.block_count];
        for (c, values) in self.columns.iter().flat_map(|column| &column.parts) {
            for (block, _) in problem.blocks[*c].iter().zip(values).filter(|(_, x)| **x != 0.0) {
                shows[*block] = true;
            }
        }
        shows
    }

    /// Of each block, whether it begins or ends there, or is still on its way: what is left of such a block says nothing of the others.
    pub fn blocks_of_edges(&self, problem: &crate::problem::Problem) -> Vec<bool> {
        let mut edges = vec![false; problem.block_count];
        for (cell, blocks) in problem.cells.iter().zip(&problem.blocks) {
            for (&(r, i), block) in cell.rows.iter().zip(blocks) {
                let t = problem.pairs[r].real.run.elapsed_s(i);
                edges[*block] |= self.window_of(r).iter().any(|edge| (edge - EDGE_KNOWN_S..edge + SAME_EDGE_S).contains(&t));
            }
        }
        edges
    }

    /// Does every coefficient reach some residual?
    pub fn shows(&self) -> bool {
        !self.columns.is_empty() && self.columns.iter().all(|column| !column.is_empty())
    }

    /// Does one begin or end where the other does?
    pub fn shares_edge(&self, other: &Self) -> bool {
        self.windows.as_ref().zip(other.windows.as_ref()).is_some_and(|(own, its)| own.share_edge(its, SAME_EDGE_S))
    }

    /// Is it hysteresis whose numbers say that nothing depends on the way?
    pub(crate) fn is_a_bent_spring(&self) -> bool {
        hysteresis::is_a_bent_spring(&self.family, &self.shape)
    }

    /// Is it a Stribeck curve as narrow as one may be?
    pub(crate) fn is_a_spike(&self) -> bool {
        friction::is_a_spike(&self.family, &self.shape)
    }

    /// Is it the inertia of a drive, not of a link?
    pub(crate) fn is_of_a_drive(&self) -> bool {
        self.family.form == ROTOR
    }

    /// Is it friction by load with a level of dry friction beside?
    pub fn is_by_load_and_level(&self) -> bool {
        self.family.physics == BY_LOAD && self.columns.len() > 1
    }

    /// Of dry friction: is a part of it there without any load?
    pub(crate) fn has_level(&self) -> bool {
        self.family.physics != BY_LOAD || self.is_by_load_and_level()
    }

    /// The same at the same time as others are; none: always.
    pub(crate) fn when(&self, problem: &crate::problem::Problem, windows: Option<&Windows>) -> Self {
        windows.map_or_else(|| self.clone(), |windows| self.within(problem, windows))
    }

    /// Is it this physics at these joints?
    pub(crate) fn is_of(&self, physics: &str, joints: &[usize]) -> bool {
        self.family.physics == physics && self.family.joints == joints
    }

    /// Of dry friction with these coefficients, the level that no load is needed for.
    pub(crate) fn level_of(&self, coefficients: &[f64]) -> f64 {
        coefficients.get(usize::from(self.is_by_load_and_level())).copied().unwrap_or(0.0)
    }

    /// Are the two of the same form and shape?
    pub fn same_start(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.family, &other.family) && self.shape == other.shape
    }

    /// Are the two of the same form?
    pub fn same_form(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.family, &other.family)
    }

    /// Do the two say the same physics at the same place?
    pub fn same_claim(&self, other: &Self) -> bool {
        self.family.physics == other.family.physics && self.family.joints == other.family.joints
    }
}

/// Columns of a shape, within windows.
fn made(dictionary: &Dictionary, make: &Columns, shape: &[f64], windows: Option<&Windows>) -> Vec<Column> {
    let columns = make(dictionary, shape);
    let Some(windows) = windows else { return columns };
    columns.iter().map(|column| column.within(dictionary.problem, windows)).collect()
}

/// What columns are together in a cell, each times its coefficient; empty where they are not.
fn summed(columns: &[Column], cell: usize, coefficients: &[f64]) -> Vec<f64> {
    let mut sum: Vec<f64> = Vec::new();
    for (column, theta) in columns.iter().zip(coefficients) {
        for (_, values) in column.parts.iter().filter(|(c, _)| *c == cell) {
            sum.resize(values.len(), 0.0);
            sum.iter_mut().zip(values).for_each(|(s, x)| *s += theta * f64::from(*x));
        }
    }
    sum
}

/// What some effects, each with its coefficients, ask beside what is believed.
pub(crate) fn besides<'a>(dictionary: &Dictionary, effects: impl IntoIterator<Item = (&'a Candidate, &'a [f64])>) -> Besides {
    let mut all = Besides::none(dictionary.joints());
    for (own, coefficients) in effects.into_iter().filter(|(own, _)| own.is_given()) {
        let asked = own.asks(dictionary, coefficients);
        if own.is_borne() {
            dictionary::add(&mut all.of_links, &asked);
        }
        dictionary::add(&mut all.of_all, &asked);
    }
    all
}

/// Every form of every physics that the residuals can show.
pub fn library(dictionary: &Dictionary) -> Vec<Arc<Family>> {
    let mut all = Vec::new();
    friction::push(dictionary, &mut all);
    inertial::push(dictionary, &mut all);
    transmission::push(dictionary, &mut all);
    actuation::push(dictionary, &mut all);
    kinematic::push(dictionary, &mut all);
    timing::push(dictionary, &mut all);
    environment::push(dictionary, &mut all);
    unknown::push(dictionary, &mut all);
    // Of what the model holds already the robot may have less.
    for family in &mut all {
        if dictionary.problem.robot.known.iter().any(|(physics, joints)| physics == family.physics && *joints == family.joints) {
            family.bounds.iter_mut().filter(|bound| **bound == Bound::Positive).for_each(|bound| *bound = Bound::Free);
        }
    }
    all.into_iter().map(Arc::new).collect()
}

/// Does a number of a shape only round a sign or a crossing? It is no claim of its own, and nobody asks for it.
pub(crate) fn rounds(name: &str) -> bool {
    matches!(name, "v_eps" | "presliding" | "settling" | "crossing" | "impulse")
}

/// So many numbers from one to another, each the same times the one before.
pub(crate) fn geometric(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| from * (to / from).powf(k as f64 / (count - 1) as f64)).collect()
}

/// All combinations of the axes of a grid.
fn product(axes: &[&[f64]]) -> Vec<Vec<f64>> {
    axes.iter().fold(vec![Vec::new()], |all, axis| {
        all.iter()
            .flat_map(|head| {
                axis.iter().map(move |x| {
                    let mut point = head.clone();
                    point.push(*x);
                    point
                })
            })
            .collect()
    })
}
