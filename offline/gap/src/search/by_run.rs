//! When an effect is there, run by run: a weight is not picked up at the same time of every run, and a cable that has slipped stays so.

use super::{Scored, Search};
use crate::hypothesis::{ALWAYS, Candidate, NEVER, Window, Windows, with_both_edges, with_one_edge};
use crate::score::{Fit, Grams};
use crate::series::robust_deviation;
use std::collections::BTreeMap;

/// Steps of the grid of edges in a run.
const EDGES: usize = 12;
/// The same for a first look.
const ROUGH: usize = 4;
/// Jumps that are tried as edges, how long one takes, s, and how many times that they are apart at least.
const JUMPS: usize = 4;
const JUMP_S: f64 = 0.1;
const APART: i64 = 3;
/// Runs, at most, in or from which an effect is looked for to begin with.
const SOME_RUNS: usize = 6;
/// Times that all runs are gone through.
const SWEEPS: usize = 3;

impl Search<'_, '_> {
    /// Windows to begin with: a beginning, an end, or both, alike in every run, on a grid and where what a fit leaves jumps; or from one run to the next.
    pub(super) fn windows(&self, grams: &Grams, fit: &Fit) -> Vec<Windows> {
        let pairs = &self.problem.pairs;
        let shortest = pairs.iter().map(|p| p.real.run.len() as f64 * p.real.run.dt_s).fold(f64::INFINITY, f64::min);
        let since = pairs.iter().map(|p| p.real.run.since_s).fold(f64::INFINITY, f64::min);
        let edges: Vec<f64> = (1..EDGES).map(|k| since + shortest * k as f64 / EDGES as f64).collect();
        let some_edges: Vec<f64> = edges.iter().copied().step_by(2).collect();
        let jumps = self.jumps(grams, fit);
        // No shorter than on the grid: a stroke of the arm begins and ends by jumps as well.
        let least = 2.0 * shortest / EDGES as f64;
        let of_jumps = with_one_edge(&jumps).chain(with_both_edges(&jumps).filter(|[from, to]| to - from >= least));
        let alike = with_one_edge(&edges).chain(with_both_edges(&some_edges)).chain(of_jumps).map(Windows::alike);
        let of_runs = |is_there: &dyn Fn(usize) -> bool| {
            let all: Vec<Window> = (0..pairs.len()).map(|run| if is_there(run) { ALWAYS } else { NEVER }).collect();
            Windows::each(&all)
        };
        let runs = if self.runs_may_differ() { pairs.len() } else { 1 };
        // Of many runs some: the others are gone through one by one.
        let some = (1..runs).step_by(runs.div_ceil(SOME_RUNS));
        let from_a_run = some.clone().flat_map(|first| [of_runs(&|run| run >= first), of_runs(&|run| run < first)]);
        let in_one_run = some.filter(|one| one + 1 < runs).flat_map(|one| [of_runs(&|run| run == one), of_runs(&|run| run != one)]);
        alike.chain(from_a_run.chain(in_one_run).flatten()).collect()
    }

    /// Where what a fit leaves jumps most, s from the start of a run, in their order: what comes and goes at once is met there, and by no edge of a grid.
    fn jumps(&self, grams: &Grams, fit: &Fit) -> Vec<f64> {
        let mut at: BTreeMap<(usize, i64), f64> = BTreeMap::new();
        for (cell, left) in self.problem.cells.iter().zip(self.scorer.left(grams, fit)) {
            // Of what is no jump.
            let usual = robust_deviation(left.iter().copied()).max(1e-300);
            for (&(run, i), x) in cell.rows.iter().zip(&left) {
                let time_s = self.problem.pairs[run].real.run.elapsed_s(i);
                *at.entry((run, (time_s / JUMP_S).round() as i64)).or_default() += (x / usual).powi(2);
            }
        }
        let mut largest: Vec<(i64, f64)> = at.into_iter().map(|((_, place), size)| (place, size)).collect();
        largest.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut jumps: Vec<i64> = Vec::new();
        for (place, _) in largest {
            if jumps.len() < JUMPS && jumps.iter().all(|other| (place - other).abs() > APART) {
                jumps.push(place);
            }
        }
        jumps.sort_unstable();
        jumps.into_iter().map(|place| place as f64 * JUMP_S).collect()
    }

    /// May each run have windows of its own? Not where those of the runs that are held out cannot be told: of points, and beside what is known only
    /// roughly.
    fn runs_may_differ(&self) -> bool {
        let problem = self.problem;
        problem.pairs.len() > 1 && !problem.of_points() && problem.nuisances.iter().all(|beside| beside.columns.is_empty())
    }

    /// A claim with the windows, each run's by itself, where that explains more than it costs.
    pub(super) fn run_by_run(&self, grams: &Grams, base: &Fit, scored: &mut Scored) {
        if !self.runs_may_differ() || !scored.candidate.family.comes_and_goes() {
            return;
        }
        let whole = Candidate::new(self.dictionary, &scored.candidate.family, &scored.candidate.shape, None);
        for _ in 0..SWEEPS {
            let before = scored.score;
            for run in 0..self.problem.pairs.len() {
                // Where no rough change of a run's window helps, no fine one is looked for.
                let window = scored.candidate.window_of(run);
                self.with_a_window_of(run, ROUGH, &whole, grams, base, scored);
                if scored.candidate.window_of(run) != window {
                    self.with_a_window_of(run, EDGES, &whole, grams, base, scored);
                }
            }
            if scored.score <= before {
                break;
            }
        }
    }

    /// A claim with the window of one run that explains most.
    fn with_a_window_of(&self, run: usize, steps: usize, whole: &Candidate, grams: &Grams, base: &Fit, scored: &mut Scored) {
        let own: Vec<Window> = (0..self.problem.pairs.len()).map(|run| scored.candidate.window_of(run)).collect();
        let others = self.windows_of(run, steps, own[run]).into_iter().map(|window| {
            let mut all = own.clone();
            all[run] = window;
            Windows::each(&all).map_or_else(|| whole.clone(), |windows| whole.within(self.problem, &windows))
        });
        let there = others.filter(Candidate::shows).filter_map(|candidate| self.score(grams, base, &candidate));
        if let Some(better) = there.max_by(|a, b| a.score.total_cmp(&b.score)).filter(|best| best.score > scored.score) {
            *scored = better;
        }
    }

    /// What a window of a run may be instead: all of it, nothing, with another beginning or end, or, roughly, a while of it.
    fn windows_of(&self, run: usize, steps: usize, [from, to]: Window) -> Vec<Window> {
        let of = &self.problem.pairs[run].real.run;
        let at = |k: usize| of.since_s + of.len() as f64 * of.dt_s * k as f64 / steps as f64;
        let edges: Vec<f64> = (1..steps).map(at).collect();
        let begins = edges.iter().filter(|edge| to.is_finite() && **edge < to).map(|edge| [*edge, to]);
        let ends = edges.iter().filter(|edge| from.is_finite() && **edge > from).map(|edge| [from, *edge]);
        // What is there for a while cannot be come to by one edge after the other from nothing.
        let rough: Vec<f64> = (1..ROUGH).map(|k| at(k * steps / ROUGH)).collect();
        let whiles = with_both_edges(&rough);
        [ALWAYS, NEVER].into_iter().chain(with_one_edge(&edges)).chain(begins).chain(ends).chain(whiles).collect()
    }
}
