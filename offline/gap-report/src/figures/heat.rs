//! Where and when the error is.

use plot::figure::{Axis, Cells, Figure, Mark, Panel, Ramp};

use super::channel_title;
use crate::text::{joint, short};
use crate::{Channel, HeatMap, HeatRun};

/// Height of a row, px.
const ROW_PX: f64 = 26.0;
/// Room between two runs, as a share of all of them.
const GAP: f64 = 0.012;
/// Width of a cell at least, px.
const CELL_PX: f64 = 3.0;
/// Width of a character of a run's name, and room between two names, px.
const NAME_PX: (f64, f64) = (6.5, 8.0);

/// Greatest value of all maps, at least 3, so that noise alone stays pale: the end of their common scale.
pub(crate) fn hottest(maps: &[&HeatMap]) -> f64 {
    let values = maps.iter().flat_map(|map| &map.runs).flat_map(|run| run.values.iter().flatten());
    values.copied().filter(|value| value.is_finite()).fold(3.0, f64::max).min(1000.0)
}

/// Maps of the same runs, one below the other; maps of other runs make another figure.
pub(crate) fn grouped<'a>(maps: &[&'a HeatMap]) -> Vec<Vec<&'a HeatMap>> {
    let mut groups: Vec<Vec<&HeatMap>> = Vec::new();
    for &map in maps {
        let same = |group: &&mut Vec<&HeatMap>| {
            let (a, b) = (&group[0].runs, &map.runs);
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.run == b.run && a.start_s == b.start_s && length(a) == length(b))
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.push(map),
            None => groups.push(vec![map]),
        }
    }
    groups
}

/// One group; `most` is the end of the scale of colours.
pub(crate) fn heat_maps(group: &[&HeatMap], most: f64, width_px: f64) -> Figure {
    let runs = group.first().map_or(&[][..], |map| &map.runs);
    let total: f64 = runs.iter().map(length).sum();
    let gap = GAP * total;
    let px_per_s = (width_px - 110.0) / (total + gap * runs.len() as f64).max(1e-9);
    // Where each run starts on the common axis.
    let mut starts = Vec::new();
    let mut end = 0.0;
    for run in runs {
        starts.push(if runs.len() == 1 { run.start_s } else { end });
        end += length(run) + gap;
    }
    let x = match runs {
        [one] => Axis::new(format!("Time in {}, s", one.run)).range(one.start_s, one.start_s + length(one)),
        _ => Axis::new("Runs, one after another").names(names(runs, &starts, px_per_s)).range(0.0, (end - gap).max(1e-9)),
    };
    let mut figure = Figure::new("Error of the simulation, in units of noise", x).width(width_px);
    for map in group {
        let rows = map.rows.len();
        let row_names = map.rows.iter().rev().enumerate().map(|(i, name)| (i as f64 + 0.5, name.replace('_', " ")));
        let y = Axis::new(channel_title(map.channel)).names(row_names).range(0.0, rows.max(1) as f64);
        let marks = map.runs.iter().zip(&starts).map(|(run, start)| cells(run, rows, *start, most, CELL_PX / px_per_s));
        figure = figure.panel(Panel::new(y).marks(marks).height(ROW_PX * rows.max(1) as f64));
    }
    let captions: Vec<String> = group.iter().map(|map| caption(map)).collect();
    figure.caption(captions.join(" "))
}

/// Names of the runs in the middle of their stretches; without what all of them begin with where there is no room for it.
fn names(runs: &[HeatRun], starts: &[f64], px_per_s: f64) -> Vec<(f64, String)> {
    let fits = |run: &HeatRun| run.run.chars().count() as f64 * NAME_PX.0 + NAME_PX.1 <= length(run) * px_per_s;
    let common = if runs.iter().all(fits) { 0 } else { common_start(runs) };
    let name = |run: &HeatRun| run.run.get(common..).filter(|name| !name.is_empty()).unwrap_or(&run.run).to_owned();
    runs.iter().zip(starts).map(|(run, start)| (start + 0.5 * length(run), name(run))).collect()
}

/// Length in bytes of what all names begin with, up to a separator.
fn common_start(runs: &[HeatRun]) -> usize {
    let Some(first) = runs.first() else { return 0 };
    let shared = |other: &HeatRun| first.run.bytes().zip(other.run.bytes()).take_while(|(a, b)| a == b).count();
    let shared = runs.iter().map(shared).min().unwrap_or(0);
    let ends = first.run.char_indices().filter(|(_, c)| matches!(c, '-' | '_' | '/' | '.' | ' ')).map(|(i, c)| i + c.len_utf8());
    ends.filter(|end| *end <= shared).max().unwrap_or(0)
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
    let channel = channel_title(map.channel);
    match worst {
        None => format!("{channel}: nothing could be compared."),
        Some((value, ..)) if value < 1.5 => format!("{channel}: nowhere above {} times noise.", short(value)),
        Some((value, name, run, bin)) => {
            let time = run.start_s + run.bin_s * (bin as f64 + 0.5);
            let place = if map.channel == Channel::EndEffector { name.replace('_', " ") } else { joint(name) };
            format!("{channel}: most at {place}, {} times noise in {} at {} s.", short(value), run.run, short(time))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(name: &str) -> HeatRun {
        HeatRun { run: name.to_owned(), start_s: 0.0, bin_s: 1.0, values: vec![vec![1.0; 10]] }
    }

    #[test]
    fn long_names_lose_what_they_share() {
        let names = |runs: &[&str], px_per_s: f64| {
            let runs: Vec<HeatRun> = runs.iter().map(|name| run(name)).collect();
            names(&runs, &vec![0.0; runs.len()], px_per_s).into_iter().map(|name| name.1).collect::<Vec<_>>()
        };
        assert_eq!(names(&["case-7-run-01", "case-7-run-02"], 100.0), ["case-7-run-01", "case-7-run-02"]);
        assert_eq!(names(&["case-7-run-01", "case-7-run-02"], 2.0), ["01", "02"]);
        assert_eq!(names(&["a-", "a-b"], 0.1), ["a-", "b"]);
        assert_eq!(names(&["über-1", "übel-2"], 0.1), ["über-1", "übel-2"]);
    }

    #[test]
    fn maps_of_the_same_runs_stand_together() {
        let map = |channel, run_names: &[&str]| HeatMap {
            channel,
            rows: vec!["a".to_owned()],
            runs: run_names.iter().map(|name| run(name)).collect(),
        };
        let maps = [map(Channel::JointTorque, &["1", "2"]), map(Channel::Timing, &["1"]), map(Channel::EndEffector, &["1", "2"])];
        let groups = grouped(&maps.iter().collect::<Vec<_>>());
        assert_eq!(groups.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
    }
}
