//! Intervals that hold for few cases.

use serde::Serialize;

/// A share with its interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Rate {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
    /// Share, 0 where there is none to count.
    pub share: f64,
    /// Wilson's 95 % interval.
    pub ci95: [f64; 2],
}

impl Rate {
    /// Of yes and no.
    pub fn of(answers: impl IntoIterator<Item = bool>) -> Self {
        let (hits, of) = answers.into_iter().fold((0, 0), |(hits, of), hit| (hits + usize::from(hit), of + 1));
        Self { hits, of, share: if of == 0 { 0.0 } else { hits as f64 / of as f64 }, ci95: wilson(hits, of) }
    }
}

/// Wilson's score interval of 95 %.
pub fn wilson(hits: usize, of: usize) -> [f64; 2] {
    if of == 0 {
        return [0.0, 1.0];
    }
    let (n, z) = (of as f64, 1.959_964);
    let p = hits as f64 / n;
    let middle = p + z * z / (2.0 * n);
    let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + z * z / n;
    [((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0)]
}

/// Clopper and Pearson's one-sided upper bound of 95 %.
pub fn clopper_upper(hits: usize, of: usize) -> f64 {
    if of == 0 || hits >= of {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let p = 0.5 * (low + high);
        if at_most(hits, of, p) > 0.05 {
            low = p;
        } else {
            high = p;
        }
    }
    high
}

/// Probability of at most `hits` of `of`.
fn at_most(hits: usize, of: usize, p: f64) -> f64 {
    let (mut log, mut sum) = (of as f64 * (-p).ln_1p(), 0.0);
    for k in 0..=hits {
        sum += log.exp();
        log += ((of - k) as f64 / (k + 1) as f64).ln() + p.ln() - (-p).ln_1p();
    }
    sum
}

/// A quantile with its interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quantile {
    /// Number of values.
    pub of: usize,
    /// The quantile.
    pub value: f64,
    /// Bootstrap's 95 % interval.
    pub ci95: [f64; 2],
}

/// A quantile in [0, 1] of unordered values, by linear interpolation.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = share * last as f64;
    let (below, above) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    below + (at - at.floor()) * (above - below)
}

/// A quantile with the interval of 400 resamples of a fixed seed.
pub fn bootstrap(values: &[f64], share: f64) -> Quantile {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut next = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as usize % below.max(1)
    };
    let resampled: Vec<f64> = (0..if values.is_empty() { 0 } else { 400 })
        .map(|_| quantile(&(0..values.len()).map(|_| values[next(values.len())]).collect::<Vec<_>>(), share))
        .collect();
    Quantile { of: values.len(), value: quantile(values, share), ci95: [quantile(&resampled, 0.025), quantile(&resampled, 0.975)] }
}

#[cfg(test)]
mod tests {
    use super::{Rate, bootstrap, clopper_upper, quantile, wilson};

    #[test]
    fn known_intervals() {
        // 0 of 300: the rule of three
        assert!((clopper_upper(0, 300) - 0.009_936).abs() < 1e-5, "{}", clopper_upper(0, 300));
        // 2 of 20, one-sided 95 %
        assert!((clopper_upper(2, 20) - 0.282_619).abs() < 1e-4, "{}", clopper_upper(2, 20));
        let [low, high] = wilson(8, 10);
        assert!((low - 0.490_16).abs() < 1e-4 && (high - 0.943_31).abs() < 1e-4, "{low} {high}");
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
        assert_eq!(Rate::of([true, false, true, true]).hits, 3);
    }

    #[test]
    fn quantiles() {
        assert_eq!(quantile(&[3.0, 1.0, 2.0], 0.5), 2.0);
        assert_eq!(quantile(&[0.0, 10.0], 0.9), 9.0);
        assert_eq!(quantile(&[], 0.5), 0.0);
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let median = bootstrap(&values, 0.5);
        assert!(median.ci95[0] > 35.0 && median.ci95[0] < median.value && median.ci95[1] < 65.0, "{median:?}");
    }
}
