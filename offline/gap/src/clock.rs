//! The uniform clock that a run is laid on, and the times that cannot be one.

use crate::run_error::RunError;

/// Samples of the uniform clock per row of the file at most: further apart, a time is taken for wrong.
const SPREAD: f64 = 20.0;
/// Seconds between samples beyond which an uneven clock is none.
const SLOW_S: f64 = 0.1;

/// A uniform clock laid over the recording's own.
pub(crate) struct Clock {
    pub(crate) start_s: f64,
    pub(crate) dt_s: f64,
    pub(crate) count: usize,
    uniform: bool,
    pub(crate) points: bool,
}

/// Are these times those of points that were measured one after the other?
pub(crate) fn by_points(time: &[f64]) -> bool {
    if time.len() < 3 || !time.iter().all(|t| t.is_finite()) {
        return false;
    }
    let clock = Clock::new(time);
    !clock.uniform && clock.dt_s > SLOW_S
}

impl Clock {
    /// A clock for these times, which have to be fit for one.
    pub(crate) fn of(run: &str, time: &[f64]) -> Result<Self, RunError> {
        if time.len() < 2 {
            return Err(RunError::Rows { run: run.to_owned(), rows: time.len() });
        }
        let wrong = |row: usize, what: String| Err(RunError::Time { run: run.to_owned(), row: row + 1, what });
        if let Some(row) = time.iter().position(|t| !t.is_finite()) {
            return wrong(row, "has no time; remove the row".to_owned());
        }
        if let Some(k) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
            let (before, now) = (time[k], time[k + 1]);
            return wrong(k + 1, format!("time {now} s does not rise above {before} s; sort the rows and drop repeated times"));
        }
        let clock = Self::new(time);
        if clock.count as f64 > SPREAD * time.len() as f64 {
            let widest = time.windows(2).enumerate().max_by(|a, b| (a.1[1] - a.1[0]).total_cmp(&(b.1[1] - b.1[0])));
            let k = widest.map_or(0, |(k, _)| k);
            let (before, now) = (time[k], time[k + 1]);
            return wrong(k + 1, format!("time jumps from {before} s to {now} s; make two runs of the recording"));
        }
        Ok(clock)
    }

    /// A clock that counts: for points without times.
    pub(crate) fn of_points(count: usize) -> Self {
        Self { start_s: 0.0, dt_s: 1.0, count, uniform: true, points: true }
    }

    fn new(time: &[f64]) -> Self {
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let median = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
        // Times are rounded: where no sample is missing, the mean step says more than any one of them.
        let even = steps.first().zip(steps.last()).is_some_and(|(least, most)| *least > 0.75 * median && *most < 1.25 * median);
        let dt_s = if even { (time[time.len() - 1] - time[0]) / steps.len() as f64 } else { median };
        let (start_s, span) = (time[0], time[time.len() - 1] - time[0]);
        let count = ((span / dt_s).round() as usize).saturating_add(1);
        let uniform =
            count == time.len() && time.iter().enumerate().all(|(i, t)| (t - start_s - i as f64 * dt_s).abs() < 0.25 * dt_s);
        Self { start_s, dt_s, count, uniform, points: false }
    }

    /// Linear between rows that follow one another; where rows were lost, NaN. Beside an empty cell, the nearer row within half
    /// a period: a camera's frames stay what they are.
    pub(crate) fn resample(&self, time: &[f64], values: &[f64]) -> Vec<f64> {
        if self.uniform {
            return values.to_vec();
        }
        let mut k = 0;
        (0..self.count)
            .map(|i| {
                let t = self.start_s + i as f64 * self.dt_s;
                while k + 2 < time.len() && time[k + 1] < t {
                    k += 1;
                }
                let (step, share) = (time[k + 1] - time[k], ((t - time[k]) / (time[k + 1] - time[k])).clamp(0.0, 1.0));
                let between = values[k] + share * (values[k + 1] - values[k]);
                if between.is_finite() && step <= 1.75 * self.dt_s {
                    return between;
                }
                let near = if share < 0.5 { k } else { k + 1 };
                if (time[near] - t).abs() <= 0.5 * self.dt_s { values[near] } else { f64::NAN }
            })
            .collect()
    }
}
