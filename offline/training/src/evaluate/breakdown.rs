//! RMS before and after, and how often the bound holds, by region of the workspace, speed, direction, torque, and time into the run.

use super::{Rest, Trust};
use crate::data::Trajectory;
use serde::Serialize;

/// One cell of the breakdown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// What the rows are sorted by.
    pub by: String,
    /// Which of them.
    pub part: String,
    /// Rows.
    pub rows: usize,
    /// RMS of the vector as reported, mm.
    pub before: f64,
    /// RMS of the vector with the model, mm.
    pub after: f64,
    /// Share within the stated bound over all axes, percent; NaN where none is stated.
    pub holds: f64,
}

/// [`Cell::by`] of the rows by when they are in their run.
pub const BY_TIME: &str = "time into the run";
/// Ends of the parts of a run, minutes.
const PARTS_MIN: [f64; 5] = [5.0, 15.0, 30.0, 60.0, 120.0];

/// Features of `raven118-v1`: reported tip, capstan torque of joint 2, motor speeds and lags of joints 1 to 3.
const TIP: usize = 0;
const TORQUE: [usize; 3] = [40, 41, 42];
const SPEED: [usize; 3] = [64, 65, 66];
const LAG: [(usize, usize); 3] = [(80, 48), (81, 49), (82, 50)];

/// One row with what is asked of it.
struct Row<'a> {
    time_s: f64,
    inputs: &'a [f32],
    before: f64,
    after: f64,
    /// Share of the axes within the bound.
    held: f64,
}

/// All cells; a bound may be missing.
pub(super) fn cells(test: &[Trajectory], estimates: &[Rest], trust: &Trust) -> Vec<Cell> {
    let rows: Vec<Row> = test
        .iter()
        .zip(estimates)
        .flat_map(|(one, estimate)| {
            let width = (one.inputs.len() / one.rows().max(1)).max(1);
            let inputs = one.time_s.iter().zip(one.inputs.chunks_exact(width));
            inputs.zip(one.exact.chunks_exact(3).zip(estimate.chunks_exact(3))).enumerate().map(
                move |(row, ((time_s, inputs), (truth, estimate)))| {
                    let rest = |axis: usize| f64::from(truth[axis] - estimate[axis]);
                    let bound95 = trust.published(one, row);
                    let inside = bound95.iter().enumerate().filter(|(axis, bound)| rest(*axis).abs() <= **bound).count();
                    Row {
                        time_s: *time_s,
                        inputs,
                        before: (0..3).map(|axis| f64::from(truth[axis]).powi(2)).sum(),
                        after: (0..3).map(|axis| rest(axis).powi(2)).sum(),
                        held: inside as f64 / bound95.len() as f64,
                    }
                },
            )
        })
        .collect();
    let mut cells = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let by = format!("reported {name}, thirds");
        thirds(&rows, &by, &|row| f64::from(row.inputs[TIP + axis]), ["low", "middle", "high"], &mut cells);
    }
    let speed = |row: &Row| SPEED.iter().map(|feature| f64::from(row.inputs[*feature]).abs()).sum();
    thirds(&rows, "speed of motors 1 to 3, thirds", &speed, ["slow", "middle", "fast"], &mut cells);
    for (joint, torque) in TORQUE.iter().enumerate() {
        let load = move |row: &Row| f64::from(row.inputs[*torque]).abs();
        thirds(&rows, &format!("torque of joint {}, thirds", joint + 1), &load, ["light", "middle", "heavy"], &mut cells);
    }
    for (joint, (wanted, is)) in LAG.into_iter().enumerate() {
        let way = move |row: &Row| f64::from(row.inputs[wanted]) - f64::from(row.inputs[is]);
        let by = format!("direction of joint {}", joint + 1);
        cells.push(cell(&by, "negative", rows.iter().filter(|row| way(row) < 0.0)));
        cells.push(cell(&by, "positive", rows.iter().filter(|row| way(row) > 0.0)));
    }
    for (index, from) in std::iter::once(0.0).chain(PARTS_MIN).enumerate() {
        let to = PARTS_MIN.get(index).copied().unwrap_or(f64::INFINITY);
        let name = if to.is_finite() { format!("{from} to {to} min") } else { format!("after {from} min") };
        let cell = cell(BY_TIME, &name, rows.iter().filter(|row| (from..to).contains(&(row.time_s / 60.0))));
        cells.extend((cell.rows > 0).then_some(cell));
    }
    cells
}

fn thirds(rows: &[Row], by: &str, of: &dyn Fn(&Row) -> f64, names: [&str; 3], cells: &mut Vec<Cell>) {
    let mut sorted: Vec<f64> = rows.iter().map(of).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |third: usize| sorted.get(third * sorted.len() / 3).copied().unwrap_or(0.0);
    let (low, high) = (at(1), at(2));
    let part = |value: f64| if value < low { 0 } else { usize::from(value >= high) + 1 };
    for (index, name) in names.into_iter().enumerate() {
        cells.push(cell(by, name, rows.iter().filter(|row| part(of(row)) == index)));
    }
}

fn cell<'a>(by: &str, part: &str, rows: impl Iterator<Item = &'a Row<'a>>) -> Cell {
    let (mut n, mut before, mut after, mut held) = (0, 0.0, 0.0, 0.0);
    for row in rows {
        n += 1;
        before += row.before;
        after += row.after;
        held += row.held;
    }
    let mean = |sum: f64| sum / f64::from(n).max(1.0);
    let (before, after, holds) = (mean(before).sqrt(), mean(after).sqrt(), 100.0 * mean(held));
    Cell { by: by.to_owned(), part: part.to_owned(), rows: n as usize, before, after, holds }
}
