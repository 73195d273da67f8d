//! Noise of the residuals, before anything is fitted to them.

use gap_report::FloorMethod;

use crate::cell::Cell;
use crate::problem::Problem;
use crate::run::Run;
use crate::series::{less_means, mean, noise_of, rms, robust_deviation};

/// Points whose likest other is looked for, at most: enough for a median.
const ASKED: usize = 2000;
/// Visits so near in their order do not count as one that was made again.
const NEAR: usize = 3;

/// Noise of a cell, as [`noise_of`] has it, where it says something.
pub fn floor(cell: &Cell) -> f64 {
    let says = cell.says();
    noise_of(&cell.residual, |k, other| cell.rows[k].0 == cell.rows[other].0 && says[k] && says[other])
}

/// Noise of every cell, and how it was found. Of points, between which a robot moves as far as it likes, also by how much those differ that
/// were commanded alike and reached from alike; whichever is less.
pub fn floors(problem: &Problem) -> Vec<(f64, FloorMethod)> {
    // All cells of points have the same rows.
    let alike = match problem.cells.first() {
        Some(cell) if problem.of_points() => alike(problem, &cell.rows),
        _ => Vec::new(),
    };
    let of_cell = |cell: &Cell| {
        let steps = floor(cell);
        let level = less_means(&cell.residual, |k| cell.rows[k].0);
        let differences =
            alike.iter().filter(|pair| pair.iter().all(|k| *k < level.len())).map(|&[k, other]| level[k] - level[other]);
        let repeats = robust_deviation(differences) / std::f64::consts::SQRT_2;
        if repeats > 0.0 && repeats < steps { (repeats, FloorMethod::Repeats) } else { (steps, FloorMethod::Innovations) }
    };
    problem.cells.iter().map(of_cell).collect()
}

/// Of each point, the place in the order of commands (points of one command are one visit), and the joints as they were commanded there and
/// at the visit before.
fn visits(run: &Run) -> Vec<(usize, Vec<f64>)> {
    let at = |i: usize| run.position.iter().map(move |q| q[i]);
    let (mut visit, mut before, mut out) = (0, 0, Vec::with_capacity(run.len()));
    for i in 0..run.len() {
        if i > 0 && !at(i).eq(at(i - 1)) {
            (visit, before) = (visit + 1, i - 1);
        }
        out.push((visit, at(i).chain(at(before)).collect()));
    }
    out
}

/// Pairs of rows: each of some points, and of another visit the point that was commanded and reached most alike.
fn alike(problem: &Problem, rows: &[(usize, usize)]) -> Vec<[usize; 2]> {
    let scatter = |j: usize| {
        let all: Vec<f64> = problem.pairs.iter().flat_map(|pair| pair.real.run.position[j].iter().copied()).collect();
        let middle = mean(&all);
        rms(all.iter().map(|q| q - middle)).max(1e-12)
    };
    let n = problem.robot.joint_count();
    let scatters: Vec<f64> = (0..2 * n).map(|k| scatter(k % n)).collect();
    let of_runs: Vec<Vec<(usize, Vec<f64>)>> = problem.pairs.iter().map(|pair| visits(&pair.real.run)).collect();
    let of_rows: Vec<(usize, &(usize, Vec<f64>))> = rows.iter().map(|&(r, i)| (r, &of_runs[r][i])).collect();
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).zip(&scatters).map(|((a, b), s)| ((a - b) / s).powi(2)).sum::<f64>();
    let likest = |k: usize| {
        let (run, (visit, reached)) = of_rows[k];
        let others = of_rows.iter().enumerate().filter(|(_, (r, (other, _)))| *r != run || visit.abs_diff(*other) > NEAR);
        let nearest = others.map(|(other, (_, (_, there)))| (other, distance(reached, there))).min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.map(|(other, _)| [k, other])
    };
    (0..rows.len()).step_by(rows.len().div_ceil(ASKED).max(1)).filter_map(likest).collect()
}
