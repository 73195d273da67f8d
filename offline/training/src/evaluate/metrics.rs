//! Figures of what is left: RMS, SD, median, 95th percentile, maximum, per axis and as a vector; reductions with intervals.

use crate::random::Random;
use serde::Serialize;

/// What is left of one trajectory: row-major, so many outputs per row.
pub(crate) type Rest = Vec<f32>;

/// Figures of one quantity, in the labels' unit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Figures {
    /// Root of the mean square.
    pub rms: f64,
    /// Standard deviation about the mean over all trajectories.
    pub sd: f64,
    /// Median of the absolute value.
    pub median: f64,
    /// 95 % of the absolute values are below.
    pub p95: f64,
    /// Largest absolute value.
    pub max: f64,
}

/// Figures per axis, then of the vector.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct AllFigures {
    /// One per output.
    pub axes: Vec<Figures>,
    /// Of the vector: its length; SD is the root of the sum of variances.
    pub vector: Figures,
}

/// A figure with its 95 % interval over trajectories; of fewer than [`FEW`] from the lowest to the highest of one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Interval {
    /// The figure.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Fewer trajectories have no percentiles.
pub const FEW: usize = 8;
/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;

/// Figures over all trajectories together.
pub fn figures(rests: &[Rest], outputs: usize) -> AllFigures {
    let axes: Vec<Figures> = (0..outputs)
        .map(|axis| {
            let values: Vec<f64> =
                rests.iter().flat_map(|rest| rest.iter().skip(axis).step_by(outputs)).map(|x| f64::from(*x)).collect();
            let mean = mean(&values);
            let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64;
            of_lengths(values.iter().map(|x| x.abs()).collect(), variance.sqrt())
        })
        .collect();
    let lengths = rests.iter().flat_map(|rest| rest.chunks_exact(outputs.max(1))).map(length).collect();
    let sd = axes.iter().map(|axis| axis.sd * axis.sd).sum::<f64>().sqrt();
    AllFigures { vector: of_lengths(lengths, sd), axes }
}

fn length(row: &[f32]) -> f64 {
    row.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn of_lengths(mut lengths: Vec<f64>, sd: f64) -> Figures {
    lengths.sort_by(f64::total_cmp);
    let at = |share: f64| lengths.get(((lengths.len() as f64 * share).ceil() as usize).saturating_sub(1)).copied().unwrap_or(0.0);
    let rms = mean(&lengths.iter().map(|x| x * x).collect::<Vec<_>>()).sqrt();
    Figures { rms, sd, median: at(0.5), p95: at(0.95), max: lengths.last().copied().unwrap_or(0.0) }
}

/// The mean of each trajectory taken off: what the best offset per run leaves.
pub(crate) fn centred(rests: &[Rest], outputs: usize) -> Vec<Rest> {
    rests
        .iter()
        .map(|rest| {
            let rows = (rest.len() / outputs.max(1)).max(1) as f64;
            let means: Vec<f64> = (0..outputs)
                .map(|axis| rest.iter().skip(axis).step_by(outputs).map(|x| f64::from(*x)).sum::<f64>() / rows)
                .collect();
            rest.iter().enumerate().map(|(i, x)| (f64::from(*x) - means[i % outputs]) as f32).collect()
        })
        .collect()
}

/// Sums of a trajectory that RMS and SD of any selection follow from.
struct Sums {
    rows: f64,
    squares: f64,
    means_times_rows: Vec<f64>,
}

fn sums(rest: &Rest, outputs: usize) -> Sums {
    Sums {
        rows: (rest.len() / outputs.max(1)) as f64,
        squares: rest.iter().map(|x| f64::from(*x).powi(2)).sum(),
        means_times_rows: (0..outputs).map(|axis| rest.iter().skip(axis).step_by(outputs).map(|x| f64::from(*x)).sum()).collect(),
    }
}

fn rms_and_sd(all: &[Sums], chosen: &[usize]) -> (f64, f64) {
    let rows: f64 = chosen.iter().map(|i| all[*i].rows).sum::<f64>().max(1.0);
    let mean_square = chosen.iter().map(|i| all[*i].squares).sum::<f64>() / rows;
    let outputs = all.first().map_or(0, |one| one.means_times_rows.len());
    let means: f64 =
        (0..outputs).map(|axis| (chosen.iter().map(|i| all[*i].means_times_rows[axis]).sum::<f64>() / rows).powi(2)).sum();
    (mean_square.sqrt(), (mean_square - means).max(0.0).sqrt())
}

/// By how many percent RMS and SD of the vector fall from `before` to `after`, with intervals over trajectories (bootstrap).
pub fn reductions(before: &[Rest], after: &[Rest], outputs: usize, seed: u64) -> (Interval, Interval) {
    let (a, b): (Vec<Sums>, Vec<Sums>) =
        (before.iter().map(|rest| sums(rest, outputs)).collect(), after.iter().map(|rest| sums(rest, outputs)).collect());
    let of = |chosen: &[usize]| {
        let ((rms_a, sd_a), (rms_b, sd_b)) = (rms_and_sd(&a, chosen), rms_and_sd(&b, chosen));
        (percent(rms_a, rms_b), percent(sd_a, sd_b))
    };
    let everything: Vec<usize> = (0..a.len()).collect();
    let (rms, sd) = of(&everything);
    if a.len() < FEW {
        let (all_rms, all_sd): (Vec<f64>, Vec<f64>) = everything.iter().map(|one| of(&[*one])).unzip();
        return (extent(rms, &all_rms), extent(sd, &all_sd));
    }
    let mut random = Random::new(seed, 21);
    let (mut all_rms, mut all_sd): (Vec<f64>, Vec<f64>) =
        (0..RESAMPLES).map(|_| of(&everything.iter().map(|_| random.below(a.len())).collect::<Vec<_>>())).unzip();
    (interval(rms, &mut all_rms), interval(sd, &mut all_sd))
}

fn percent(before: f64, after: f64) -> f64 {
    if before > 0.0 { 100.0 * (1.0 - after / before) } else { 0.0 }
}

fn extent(value: f64, all: &[f64]) -> Interval {
    let low = all.iter().copied().fold(f64::INFINITY, f64::min);
    let high = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Interval { value, low, high }
}

fn interval(value: f64, resampled: &mut [f64]) -> Interval {
    resampled.sort_by(f64::total_cmp);
    let at = |share: f64| resampled.get((resampled.len() as f64 * share) as usize).copied().unwrap_or(value);
    Interval { value, low: at(0.025), high: at(0.975) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_known_numbers() {
        let found = figures(&[vec![3.0, 4.0, 0.0, 0.0], vec![3.0, -4.0]], 2);
        assert!((found.vector.rms - (50.0_f64 / 3.0).sqrt()).abs() < 1e-9);
        assert!((found.axes[0].sd - 2.0_f64.sqrt()).abs() < 1e-9 && (found.axes[0].median - 3.0).abs() < 1e-9);
        assert!((found.vector.max - 5.0).abs() < 1e-9);
    }

    #[test]
    fn a_constant_per_run_is_gone_after_centring() {
        let left = centred(&[vec![1.0, 2.0, 1.0, 2.0], vec![-5.0, 0.0, -5.0, 0.0]], 2);
        assert!(left.iter().flatten().all(|x| x.abs() < 1e-6));
    }

    #[test]
    fn of_few_trajectories_the_interval_is_from_the_lowest_to_the_highest() {
        let before: Vec<Rest> = vec![vec![1.0, -1.0]; 3];
        let after: Vec<Rest> = [0.1, 0.2, 0.4].iter().map(|left| vec![*left, -left]).collect();
        let (rms, _) = reductions(&before, &after, 1, 1);
        assert!((rms.low - 60.0).abs() < 1e-4 && (rms.high - 90.0).abs() < 1e-4 && rms.low < rms.value && rms.value < rms.high);
    }

    #[test]
    fn half_of_the_error_is_half_of_the_error_in_every_resample() {
        let before: Vec<Rest> = (1..10).map(|k| vec![k as f32, -1.0, 0.5, k as f32]).collect();
        let after: Vec<Rest> = before.iter().map(|rest| rest.iter().map(|x| x / 2.0).collect()).collect();
        let (rms, sd) = reductions(&before, &after, 2, 1);
        for found in [rms, sd] {
            assert!((found.value - 50.0).abs() < 1e-6 && (found.low - 50.0).abs() < 1e-6 && (found.high - 50.0).abs() < 1e-6);
        }
    }
}
