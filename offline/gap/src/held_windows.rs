//! When an effect is there in what was held out. Its size is not fitted there; when it comes and goes may be, as far as it is otherwise in each
//! run: nobody picks a weight up at the same time twice.

use crate::cell::Channel;
use crate::hypothesis::{ALWAYS, Candidate, NEVER, Window, Windows, with_both_edges, with_one_edge};
use crate::problem::Problem;
use crate::told::main_cell;

/// Steps of the grid of edges in a run, and halvings of one until an edge is settled.
const EDGES: usize = 24;
const HALVINGS: usize = 6;
/// Share of what is left above the noise with the windows of the fit that other windows may leave at most,
const LEAVES: f64 = 0.25;
/// squared errors, in those of the noise, that they have to explain more at least,
const EXPLAINS: f64 = 100.0;
/// and what there may be for each row outside of them, in that measure, or of what the effect would be there.
const NOTHING: f64 = 2.25;
const NEXT_TO_NOTHING: f64 = 0.1;

/// A run of what was held out, in some cells: the time of each row, and there residual beside the others and effect, in units of the noise.
struct Seen<'p> {
    smoothing: &'p crate::filter::Window,
    rows: Vec<(f64, f64, f64)>,
    length_s: [f64; 2],
}

/// A cell of what was held out in which an effect shows.
struct Told {
    cell: usize,
    /// Of the noise.
    floor: f64,
    /// Beside the other effects.
    residual: Vec<f64>,
    effect: Vec<f64>,
}

impl<'p> Seen<'p> {
    fn new<'s>(held: &'p Problem, run: usize, cells: impl IntoIterator<Item = &'s Told>) -> Self {
        let motion = &held.pairs[run].real;
        let mut rows = Vec::new();
        for Told { cell, floor, residual, effect } in cells {
            let of_run = held.cells[*cell].rows.iter().enumerate().filter(|(_, (r, _))| *r == run);
            rows.extend(of_run.map(|(k, &(_, i))| (motion.run.elapsed_s(i), residual[k] / floor, effect[k] / floor)));
        }
        let length_s = [motion.run.elapsed_s(0), motion.run.elapsed_s(motion.run.len() - 1)];
        Self { smoothing: &motion.window, rows, length_s }
    }

    fn weight(&self, [from, to]: Window, t: f64) -> f64 {
        self.smoothing.of_a_step(t - from) - self.smoothing.of_a_step(t - to)
    }

    /// Squared error in units of the noise.
    fn left(&self, window: Window) -> f64 {
        self.rows.iter().map(|(t, y, e)| (y - self.weight(window, *t) * e).powi(2)).sum()
    }

    /// Is there nothing outside a window, or next to nothing of what the effect would be?
    fn is_empty_outside(&self, window: Window) -> bool {
        let outside = self.rows.iter().filter(|(t, ..)| self.weight(window, *t) < 0.5);
        let [rows, left, effect] =
            outside.fold([0.0; 3], |[rows, left, effect], (_, y, e)| [rows + 1.0, left + y * y, effect + e * e]);
        left <= (NOTHING * rows).max(NEXT_TO_NOTHING * effect)
    }

    /// The window that explains most. An edge explains more than none, and two more than one, or they are not there.
    fn best(&self) -> Window {
        let [first, last] = self.length_s;
        let step = (last - first) / EDGES as f64;
        let edges: Vec<f64> = (1..EDGES).map(|k| first + k as f64 * step).collect();
        let least = |all: Vec<Window>| all.into_iter().min_by(|a, b| self.left(*a).total_cmp(&self.left(*b))).unwrap_or(ALWAYS);
        let mut best = least(vec![ALWAYS, NEVER]);
        for more in [least(with_one_edge(&edges).collect()), least(with_both_edges(&edges).collect())] {
            if self.left(more) + EXPLAINS < self.left(best) {
                best = more;
            }
        }
        let mut step = 0.5 * step;
        for _ in 0..HALVINGS {
            for edge in [0, 1] {
                let moved = [-step, step].map(|by| {
                    let mut there = best;
                    there[edge] += by;
                    there
                });
                best = least([best].into_iter().chain(moved.into_iter().filter(|[from, to]| from < to)).collect());
            }
            step *= 0.5;
        }
        best
    }

    /// The window of the fit (none: each run had its own), or another one where that leaves much that this one explains.
    fn window(&self, best: Window, as_fitted: Option<Window>) -> Window {
        let rows = self.rows.len() as f64;
        let whole_or_none = || if self.is_empty_outside(NEVER) { NEVER } else { ALWAYS };
        let otherwise = as_fitted.unwrap_or_else(whole_or_none);
        let (left, before) = (self.left(best), self.left(otherwise));
        let explains = before - left > EXPLAINS && (left - rows).max(0.0) < LEAVES * (before - rows);
        if explains && self.is_empty_outside(best) { best } else { otherwise }
    }
}

/// When each of some effects is there in what was held out. `whole` are the effects with their coefficients, without windows, and `fitted` those of
/// the fit; `floors` are those of the cells of what was held out, infinite where it is not to be asked.
pub(crate) fn windows(
    held: &Problem,
    floors: &[f64],
    whole: &[(Candidate, &[f64])],
    fitted: &[Option<Windows>],
) -> Vec<Option<Windows>> {
    let runs = held.pairs.len();
    // All runs alike, or each by itself.
    let alike = |windows: &Option<Windows>| windows.as_ref().map_or(Some(ALWAYS), Windows::in_all);
    let mut found: Vec<Vec<Window>> = fitted.iter().map(|windows| vec![alike(windows).unwrap_or(ALWAYS); runs]).collect();
    for k in 0..whole.len() {
        let (own, theta) = &whole[k];
        if !(own.family.comes_and_goes() || fitted[k].is_some()) || held.of_points() {
            continue;
        }
        let main = main_cell(floors, own, theta);
        let told = |cell: usize| {
            let (floor, effect) = (floors[cell], own.effect(cell, theta));
            let mut residual = held.cells[cell].residual.clone();
            for (other, (candidate, theta)) in whole.iter().enumerate().filter(|(other, _)| *other != k) {
                let there = Windows::each(&found[other]).map(|windows| candidate.within(held, &windows));
                there.as_ref().unwrap_or(candidate).take_off(cell, theta, &mut residual);
            }
            (floor.is_finite() && floor > 0.0 && !effect.is_empty()).then_some(Told { cell, floor, residual, effect })
        };
        let cells: Vec<Told> = (0..held.cells.len()).filter_map(told).collect();
        let Some(highest) = cells.iter().find(|told| told.cell == main) else { continue };
        for (run, window) in found[k].iter_mut().enumerate() {
            // What stands still says nothing of when it begins: others may. Whether it is otherwise is seen where it stands highest.
            let best = Seen::new(held, run, &cells).best();
            *window = Seen::new(held, run, [highest]).window(best, alike(&fitted[k]));
        }
    }
    found.iter().map(|windows| Windows::each(windows)).collect()
}

/// Noise floors of the cells of what was held out; infinite where nothing is asked: where something is known only roughly, or each run has a
/// constant of its own.
pub(crate) fn floors(problem: &Problem, floors: &[f64], held: &Problem) -> Vec<f64> {
    let of_cell = |channel: Channel, index: usize| {
        let cell = problem.cell(channel, index)?;
        problem.nuisances[cell].columns.is_empty().then(|| floors[cell])
    };
    held.cells.iter().map(|cell| of_cell(cell.channel, cell.index).unwrap_or(f64::INFINITY)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten seconds of an effect of eight times the noise, which is there in a window only.
    fn seen(smoothing: &crate::filter::Window, there: Window, size: impl Fn(f64) -> f64) -> Seen<'_> {
        let row = |k: usize| {
            let t = 0.02 * k as f64;
            let effect = 8.0 * (3.0 * t).sin() * size(t);
            let noise = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            let is_there = f64::from(u8::from(there[0] <= t && t < there[1]));
            (t, is_there * effect + noise, effect)
        };
        Seen { smoothing, rows: (0..500).map(row).collect(), length_s: [0.0, 10.0] }
    }

    fn near(found: Window, wanted: Window) {
        let alike = found.iter().zip(wanted).all(|(a, b)| *a == b || (a - b).abs() < 0.1);
        assert!(alike, "{found:?}, not {wanted:?}");
    }

    #[test]
    fn an_effect_is_when_it_is() {
        let smoothing = crate::filter::Window::new(0.012, 0.001);
        let inside = [2.3, 6.1];
        for there in [ALWAYS, NEVER, [3.7, f64::INFINITY], [f64::NEG_INFINITY, 5.2], inside] {
            let seen = seen(&smoothing, there, |_| 1.0);
            for as_fitted in [Some(ALWAYS), Some([1.0, 9.0]), None] {
                near(seen.window(seen.best(), as_fitted), there);
            }
        }
    }

    #[test]
    fn what_is_small_while_an_arm_stands_has_no_edge_there() {
        let smoothing = crate::filter::Window::new(0.012, 0.001);
        let stands = |t: f64| if t < 3.0 { 0.05 } else { 1.0 };
        for there in [ALWAYS, NEVER] {
            let seen = seen(&smoothing, there, stands);
            near(seen.window(seen.best(), None), there);
        }
    }

    #[test]
    fn what_fits_for_a_while_only_is_no_window() {
        // Something else, of the same size: where it happens to be alike is no place where the effect is.
        let smoothing = crate::filter::Window::new(0.012, 0.001);
        let mut other = seen(&smoothing, ALWAYS, |_| 1.0);
        for (t, y, _) in &mut other.rows {
            *y = 8.0 * (3.4 * *t).sin();
        }
        for as_fitted in [Some(ALWAYS), None] {
            near(other.window(other.best(), as_fitted), ALWAYS);
        }
    }
}
