//! Figures of an error signal.

use crate::figure::bins::select;

/// Mean, spread and size of finite values; NaN where there are none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Finite values.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation about the mean (divided by the count).
    pub sd: f64,
    /// Root mean square.
    pub rms: f64,
    /// Median of the absolute values.
    pub median: f64,
    /// 95th percentile of the absolute values, between neighbours by straight lines.
    pub p95: f64,
    /// Greatest absolute value.
    pub max: f64,
}

impl Statistics {
    /// Of the finite values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let finite: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        let count = finite.len();
        let mean = finite.iter().sum::<f64>() / count as f64;
        let square = finite.iter().map(|value| value * value).sum::<f64>() / count as f64;
        let variance = finite.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count as f64;
        let mut sizes: Vec<f64> = finite.into_iter().map(f64::abs).collect();
        Self {
            count,
            mean,
            sd: variance.sqrt(),
            rms: square.sqrt(),
            median: select(&mut sizes, 0.5),
            p95: select(&mut sizes, 0.95),
            max: sizes.into_iter().fold(f64::NAN, f64::max),
        }
    }
}
