//! The newest stretch of a stream, analysed again and again: has the robot changed since its model was made?

use recordings::{Column, Recording};

use crate::clock::Clock;
use crate::run_error::RunError;

/// Length of what is looked at, s: long enough for every joint to move, short enough for a change to fill it in a minute.
pub const WINDOW_S: f64 = 60.0;
/// Time from one look to the next, s.
pub const STEP_S: f64 = 15.0;

/// Ends of the windows of a run, s on its own clock: one after the other, the last at its end. One window, shorter, of a run
/// that is no longer than one.
///
/// # Errors
/// [`RunError`] where it has no time, or one that is no clock.
pub fn ends(run: &Recording) -> Result<Vec<f64>, RunError> {
    let time = run.time_s().ok_or_else(|| RunError::NoTime { run: run.name.clone() })?;
    Clock::of(&run.name, time)?;
    let (first, last) = (time[0], time[time.len() - 1]);
    let count = ((last - first - WINDOW_S) / STEP_S).floor();
    if count < 0.0 {
        return Ok(vec![last]);
    }
    let mut ends: Vec<f64> = (0..=count as usize).map(|k| first + WINDOW_S + k as f64 * STEP_S).collect();
    // What is left at the end is worth a look of its own where it is more than a moment.
    if ends.last().is_none_or(|end| last - end > 1.0) {
        ends.push(last);
    }
    Ok(ends)
}

/// The rows of the window that ends at a time.
#[must_use]
pub fn newest(run: &Recording, end_s: f64) -> Recording {
    let rows: Vec<usize> = run.time_s().map_or_else(Vec::new, |time| {
        time.iter().enumerate().filter(|(_, t)| **t <= end_s && **t > end_s - WINDOW_S).map(|(row, _)| row).collect()
    });
    let cut = |column: &Column| Column::new(column.name.clone(), rows.iter().map(|row| column.values[*row]).collect());
    Recording {
        name: run.name.clone(),
        metadata: run.metadata.clone(),
        columns: run.columns.iter().map(cut).collect(),
        ..Recording::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(seconds: usize) -> Recording {
        let time: Vec<f64> = (0..seconds * 10).map(|i| 5.0 + i as f64 * 0.1).collect();
        let columns = vec![Column::new("t_s", time.clone()), Column::new("mpos_1_rad", time)];
        Recording { columns, ..Recording::default() }
    }

    #[test]
    fn every_window_is_a_minute_and_the_last_ends_with_the_run() {
        let run = run(100);
        let ends = ends(&run).expect("a clock");
        assert_eq!(ends.len(), 4);
        for (end, wanted) in ends.iter().zip([65.0, 80.0, 95.0, 104.9]) {
            assert!((end - wanted).abs() < 1e-9, "{ends:?}");
            let window = newest(&run, *end);
            assert!((599..=601).contains(&window.rows()), "{} rows", window.rows());
            assert!((window.time_s().expect("time").last().expect("rows") - end).abs() < 0.11);
        }
    }

    #[test]
    fn a_short_run_is_one_window() {
        let ends = |run: &Recording| super::ends(run).expect("a clock");
        assert_eq!(ends(&run(20)).len(), 1);
        assert_eq!(newest(&run(20), ends(&run(20))[0]).rows(), 200);
    }

    #[test]
    fn what_is_no_clock_has_no_windows() {
        let refused = |run: &Recording| ends(run).expect_err("refused").to_string();
        assert!(refused(&Recording::default()).contains("no column t_s"));
        // A first row of before the clock was set: a hundred million windows.
        let mut jump = run(100);
        jump.columns[0].values[0] = -1.7e9;
        assert!(refused(&jump).contains("time jumps"), "{}", refused(&jump));
    }
}
