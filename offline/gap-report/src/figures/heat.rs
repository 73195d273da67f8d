//! Where and when the error is.

use plot::figure::{Axis, Cells, Figure, Mark, Panel, Ramp};

use crate::text::{joint, short};
use crate::{Channel, HeatMap, HeatRun};

/// Height of a row, px.
const ROW_PX: f64 = 26.0;
/// Room between two runs, as a share of all of them.
const GAP: f64 = 0.012;
/// Width of a cell at least, px.
const CELL_PX: f64 = 3.0;

/// Greatest value of all maps, at least 3, so that noise alone stays pale: the end of their common scale.
pub(crate) fn hottest(maps: &[HeatMap]) -> f64 {
    let values = maps.iter().flat_map(|map| &map.runs).flat_map(|run| run.values.iter().flatten());
    values.copied().filter(|value| value.is_finite()).fold(3.0, f64::max).min(1000.0)
}

/// One channel; `most` is the end of the scale of colours.
pub(crate) fn heat_map(map: &HeatMap, most: f64, width_px: f64) -> Figure {
    let rows = map.rows.len();
    let total: f64 = map.runs.iter().map(length).sum();
    let gap = GAP * total;
    let px_per_s = (width_px - 110.0) / (total + gap * map.runs.len() as f64).max(1e-9);
    let (mut at, mut panel, mut names) = (0.0, Panel::new(Axis::new("")), Vec::new());
    for run in &map.runs {
        let start = if map.runs.len() == 1 { run.start_s } else { at };
        let run_length = length(run);
        panel = panel.mark(cells(run, rows, start, most, CELL_PX / px_per_s));
        names.push((start + 0.5 * run_length, run.run.clone()));
        at = start + run_length + gap;
    }
    let x = match map.runs.as_slice() {
        [one] => Axis::new(format!("Time in {}, s", one.run)).range(one.start_s, one.start_s + length(one)),
        _ => Axis::new("Runs, one after another").names(names).range(0.0, (at - gap).max(1e-9)),
    };
    let row_names = map.rows.iter().rev().enumerate().map(|(i, name)| (i as f64 + 0.5, name.replace('_', " ")));
    let y = Axis::new("").names(row_names).range(0.0, rows.max(1) as f64);
    let panel = Panel { y, ..panel }.height(ROW_PX * rows.max(1) as f64);
    Figure::new(channel_title(map.channel), x).panel(panel).width(width_px).caption(caption(map))
}

fn length(run: &HeatRun) -> f64 {
    run.bin_s * run.values.iter().map(Vec::len).max().unwrap_or(0) as f64
}

/// Cells of a run; neighbours are joined (as the root of the mean square) until a cell is wide enough to be seen.
fn cells(run: &HeatRun, rows: usize, start: f64, most: f64, least_s: f64) -> Mark {
    let bins = run.values.iter().map(Vec::len).max().unwrap_or(0);
    let join = ((least_s / run.bin_s).ceil() as usize).clamp(1, bins.max(1));
    let columns = bins.div_ceil(join);
    let mut values = Vec::with_capacity(rows * columns);
    for row in (0..rows).rev() {
        let of_row = run.values.get(row).map_or(&[][..], Vec::as_slice);
        for column in 0..columns {
            let here = of_row.iter().skip(column * join).take(join).copied().filter(|value| value.is_finite());
            let (count, squares) = here.fold((0_u32, 0.0), |(count, sum), value| (count + 1, sum + value * value));
            values.push(if count == 0 { f64::NAN } else { (squares / f64::from(count)).sqrt() });
        }
    }
    let end = start + run.bin_s * (columns * join) as f64;
    let cells = Cells { x: (start, end), y: (0.0, rows.max(1) as f64), columns, values };
    Mark::Cells { cells, ramp: Ramp::Ratio { most }, title: String::new() }
}

/// The worst place in words.
fn caption(map: &HeatMap) -> String {
    let mut worst: Option<(f64, &str, &HeatRun, usize)> = None;
    for run in &map.runs {
        for (name, values) in map.rows.iter().zip(&run.values) {
            for (bin, value) in values.iter().enumerate() {
                if value.is_finite() && worst.is_none_or(|(most, ..)| *value > most) {
                    worst = Some((*value, name, run, bin));
                }
            }
        }
    }
    match worst {
        None => "Nothing could be compared.".to_owned(),
        Some((value, ..)) if value < 1.5 => format!("Nowhere above {} times noise.", short(value)),
        Some((value, name, run, bin)) => {
            let time = run.start_s + run.bin_s * (bin as f64 + 0.5);
            let place = if map.channel == Channel::JointTorque { joint(name) } else { name.replace('_', " ") };
            format!("Greatest: {place} in {} at {} s, {} times noise.", run.run, short(time), short(value))
        }
    }
}

/// A channel as a title.
pub(crate) fn channel_title(channel: Channel) -> &'static str {
    match channel {
        Channel::JointTorque => "Joint torque",
        Channel::Transmission => "Transmission: motor against joint",
        Channel::EndEffector => "Tool position",
        Channel::Timing => "Timing",
        Channel::ClosedLoopOutput => "Whole loop",
        Channel::Command => "Commands",
    }
}
