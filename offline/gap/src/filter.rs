//! One smoothing for everything: a Gaussian window and its first two derivatives, zero phase.
//!
//! Every term of an equation passes the same window (gap-design.md, section 1), so that filtering alone creates no verdict.

/// Samples of the window on each side, in standard deviations.
const REACH: f64 = 4.0;

/// A window of odd length with its derivatives.
#[derive(Debug, Clone)]
pub struct Window {
    half: usize,
    weights: [Vec<f64>; 3],
}

impl Window {
    /// A Gaussian of standard deviation `sigma_s` on samples `dt_s` apart; exact for constants, lines and parabolas.
    pub fn new(sigma_s: f64, dt_s: f64) -> Self {
        let half = ((REACH * sigma_s / dt_s).round() as usize).max(1);
        let (sigma, n) = ((sigma_s / dt_s).max(0.3), half as isize);
        let offsets: Vec<f64> = (-n..=n).map(|i| i as f64).collect();
        let bell: Vec<f64> = offsets.iter().map(|x| (-0.5 * (x / sigma).powi(2)).exp()).collect();
        let area: f64 = bell.iter().sum();
        let smooth: Vec<f64> = bell.iter().map(|w| w / area).collect();
        let moment = |power: i32| offsets.iter().zip(&smooth).map(|(x, w)| w * x.powi(power)).sum::<f64>();
        let (second, fourth) = (moment(2), moment(4));
        let first = offsets.iter().zip(&smooth).map(|(x, w)| w * x / (second * dt_s)).collect();
        // Orthogonal to constants, 1 for t²/2.
        let gain = 0.5 * (fourth - second * second) * dt_s * dt_s;
        let curve = offsets.iter().zip(&smooth).map(|(x, w)| w * (x * x - second) / gain).collect();
        Self { half, weights: [smooth, first, curve] }
    }

    /// No smoothing, no derivatives: for points without a clock.
    pub fn identity() -> Self {
        Self { half: 0, weights: [vec![1.0], vec![0.0], vec![0.0]] }
    }

    /// Samples at each end of a series whose result leans on samples that do not exist.
    pub fn margin(&self) -> usize {
        self.half
    }

    /// The smoothed `derivative` (0, 1 or 2) of a series, per second as often; at the ends the series is held.
    pub fn apply(&self, series: &[f64], derivative: usize) -> Vec<f64> {
        let weights = &self.weights[derivative];
        let (n, half) = (series.len(), self.half);
        let mut out = vec![0.0; n];
        for (i, out) in out.iter_mut().enumerate() {
            *out = if i >= half && i + half < n {
                series[i - half..=i + half].iter().zip(weights).map(|(x, w)| x * w).sum()
            } else {
                (0..=2 * half).map(|k| weights[k] * series[(i + k).saturating_sub(half).min(n - 1)]).sum()
            };
        }
        out
    }

    /// Autocovariance of white noise of variance 1 behind the window, at lags of `step` samples.
    pub fn autocovariance(&self, step: usize, lags: usize) -> Vec<f64> {
        let w = &self.weights[0];
        (0..=lags).map(|lag| w.iter().skip(lag * step).zip(w).map(|(a, b)| a * b).sum()).collect()
    }

    /// The smoothed value at one sample.
    pub fn at(&self, series: &[f64], i: usize) -> f64 {
        let n = series.len();
        (0..=2 * self.half).map(|k| self.weights[0][k] * series[(i + k).saturating_sub(self.half).min(n - 1)]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_differentiated_exactly() {
        let dt = 0.001;
        let series: Vec<f64> = (0..400).map(|i| 3.0 - 2.0 * (f64::from(i) * dt) + 5.0 * (f64::from(i) * dt).powi(2)).collect();
        let window = Window::new(0.012, dt);
        let t = 0.2;
        let (v, a) = (window.apply(&series, 1)[200], window.apply(&series, 2)[200]);
        assert!((v - (-2.0 + 10.0 * t)).abs() < 1e-9, "{v}");
        assert!((a - 10.0).abs() < 1e-6, "{a}");
        assert!((window.at(&series, 200) - window.apply(&series, 0)[200]).abs() < 1e-12);
    }

    #[test]
    fn a_constant_stays_to_the_ends() {
        let window = Window::new(0.012, 0.001);
        assert!(window.apply(&[7.0; 300], 0).iter().all(|x| (x - 7.0).abs() < 1e-12));
        assert!(window.apply(&[7.0; 300], 1).iter().all(|x| x.abs() < 1e-9));
    }
}
