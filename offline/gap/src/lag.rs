//! Both sides follow the same commands: where both have them, they tell by how much one clock is ahead of the other.

use crate::run::Run;
use crate::series::{mean, rms};

/// Furthest that it is looked for, s.
const REACH_S: f64 = 0.25;
/// Share of their own size by which commands may differ and be at the same time; and, of what they differ by so, that they may differ by at another.
const SAME: f64 = 5e-4;
const LEFT: f64 = 0.1;
/// Samples that are compared, at most.
const ASKED: usize = 2000;

/// By how much the commands of a simulation come later than those of the recording, s; none where they come together, or are not the same.
pub(crate) fn of_commands(real: &Run, sim: &Run) -> Option<f64> {
    let (wanted, had) = (real.command.as_ref()?, sim.command.as_ref()?);
    let sizes: Vec<f64> = wanted.iter().map(|series| spread(series)).collect();
    let moves = || (0..wanted.len().min(had.len())).filter(|j| sizes[*j] > 0.0);
    moves().next()?;
    let rows: Vec<usize> = (0..real.len()).step_by(real.len().div_ceil(ASKED).max(1)).collect();
    let off = |lag_s: f64| {
        let of_joint = |j: usize| {
            let differences =
                rows.iter().filter_map(|&i| Some((wanted[j][i] - at(&had[j], sim, real.time_s(i) + lag_s)?) / sizes[j]));
            let all: Vec<f64> = differences.filter(|x| x.is_finite()).collect();
            if 2 * all.len() < rows.len() { f64::INFINITY } else { rms(all.into_iter()) }
        };
        moves().map(of_joint).fold(0.0, f64::max)
    };
    let together = off(0.0);
    if !(together > SAME && together.is_finite()) {
        return None;
    }
    let steps = (REACH_S / real.dt_s).ceil() as i64;
    let of_samples = (-steps..=steps).map(|k| k as f64 * real.dt_s);
    let mut lag_s = of_samples.min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
    // Between samples, by halves.
    let mut step = real.dt_s;
    for _ in 0..8 {
        step *= 0.5;
        lag_s = [lag_s - step, lag_s, lag_s + step].into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
    }
    (off(lag_s) < LEFT * together).then_some(lag_s)
}

fn spread(series: &[f64]) -> f64 {
    let middle = mean(series);
    rms(series.iter().map(|x| x - middle))
}

/// A series of a run at a time; none beyond its ends.
fn at(series: &[f64], run: &Run, time_s: f64) -> Option<f64> {
    let place = (time_s - run.start_s) / run.dt_s;
    let k = place.floor();
    if k < 0.0 {
        return None;
    }
    let (this, next) = (*series.get(k as usize)?, *series.get(k as usize + 1)?);
    Some(this + (place - k) * (next - this))
}
