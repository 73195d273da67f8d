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

/// By how much the commands of a simulation come later than those of the recording, s; none where they come together, or are not the same, or the
/// joints follow them at another time: then they were only logged late.
pub(crate) fn of_commands(real: &Run, sim: &Run) -> Option<f64> {
    let of = |all: [&[Vec<f64>]; 2], lag_s: f64| off((real, all[0]), (sim, all[1]), lag_s);
    let commands: [&[Vec<f64>]; 2] = [real.command.as_ref()?, sim.command.as_ref()?];
    let off = |lag_s: f64| of(commands, lag_s);
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
    let positions: [&[Vec<f64>]; 2] = [&real.position, &sim.position];
    (off(lag_s) < LEFT * together && of(positions, lag_s) < of(positions, 0.0)).then_some(lag_s)
}

/// By how much two sources differ where the second is so much later, of the first one's own size, in the joint where that is most; 0 where none moves.
fn off((real, wanted): (&Run, &[Vec<f64>]), (sim, had): (&Run, &[Vec<f64>]), lag_s: f64) -> f64 {
    let rows: Vec<usize> = (0..real.len()).step_by(real.len().div_ceil(ASKED).max(1)).collect();
    let of_joint = |(wanted, had): (&Vec<f64>, &Vec<f64>)| {
        let size = spread(wanted);
        let differences = rows.iter().filter_map(|&i| Some((wanted[i] - at(had, sim, real.time_s(i) + lag_s)?) / size));
        let all: Vec<f64> = differences.filter(|x| x.is_finite()).collect();
        match (size > 0.0, 2 * all.len() < rows.len()) {
            (false, _) => 0.0,
            (_, true) => f64::INFINITY,
            _ => rms(all.into_iter()),
        }
    };
    wanted.iter().zip(had).map(of_joint).fold(0.0, f64::max)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// One joint that follows its command at once; either may be late.
    fn run(command_late_s: f64, position_late_s: f64) -> Run {
        let series = |late_s: f64| (0..4000).map(|i| (3.0 * (f64::from(i) * 1e-3 - late_s)).sin()).collect::<Vec<f64>>();
        Run { command: Some(vec![series(command_late_s)]), ..Run::of_one_joint(&series(position_late_s)) }
    }

    #[test]
    fn a_clock_is_told_by_the_commands_if_the_joints_agree() {
        let real = run(0.0, 0.0);
        let lag_s = of_commands(&real, &run(0.0123, 0.0123)).expect("a lag");
        assert!((lag_s - 0.0123).abs() < 1e-4, "{lag_s}");
        assert_eq!(of_commands(&real, &run(0.0, 0.0)), None);
        // Commands that were logged late, of a robot that moves at the same time; and another robot that is late.
        assert_eq!(of_commands(&real, &run(0.02, 0.0)), None);
        assert_eq!(of_commands(&real, &run(0.0, 0.02)), None);
    }
}
