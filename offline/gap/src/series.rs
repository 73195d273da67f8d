//! What is said of a series of numbers.

/// Root of the mean square.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), x| (sum + x * x, count + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// Standard deviation of what scatters about 0, from the median of its size (0.6745 of one): what is rare does not count. 0 of nothing.
pub fn robust_deviation(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).map_or(0.0, |median| median / 0.6745)
}

/// Noise of a series, from how much it differs three rows apart, where these may be compared: half of them by less than noise gives, so that
/// effects, which change slowly or seldom, do not count.
pub fn noise_of(series: &[f64], comparable: impl Fn(usize, usize) -> bool) -> f64 {
    let steps = (3..series.len()).filter(|&k| comparable(k - 3, k)).map(|k| series[k] - series[k - 3]);
    robust_deviation(steps) / std::f64::consts::SQRT_2
}

/// Mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Least and largest.
pub fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// A series less its mean over each run: where it stands in a run is not known.
pub fn less_means(series: &[f64], run_of: impl Fn(usize) -> usize) -> Vec<f64> {
    let runs = (0..series.len()).map(&run_of).max().map_or(0, |last| last + 1);
    let means: Vec<f64> =
        (0..runs).map(|r| mean(&(0..series.len()).filter(|k| run_of(*k) == r).map(|k| series[k]).collect::<Vec<_>>())).collect();
    series.iter().enumerate().map(|(k, y)| y - means[run_of(k)]).collect()
}

/// The value below which a share of some lies, which it sorts; 0 of nothing.
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let at = (share * (values.len() - 1) as f64).round() as usize;
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Smallest step between two samples that differ; infinite where none do.
pub(crate) fn resolution(series: &[f64]) -> f64 {
    series.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min)
}
