//! One smoothing for everything: a Gaussian window and its first two derivatives, zero phase.
//!
//! Every term of an equation passes the same window (gap-design.md, section 1), so that filtering alone creates no verdict.
//!
//! This module contains `unsafe`: a call of a function compiled for an instruction set that was found on this machine. It gives the same bits.

#![expect(clippy::inline_always, reason = "inlined into a function compiled for an instruction set, or it would not use it")]

/// Samples of the window on each side, in standard deviations.
const REACH: f64 = 4.0;
/// Neighbours that are summed side by side: each sum waits for its own last term only.
const SIDE_BY_SIDE: usize = 16;
/// The same of rows apart.
const ROWS: usize = 4;

/// A window of odd length with its derivatives.
#[derive(Debug, Clone)]
pub struct Window {
    sigma_s: f64,
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
        Self { sigma_s, half, weights: [smooth, first, curve] }
    }

    /// No smoothing, no derivatives: for points without a clock.
    pub fn identity() -> Self {
        Self { sigma_s: 0.0, half: 0, weights: [vec![1.0], vec![0.0], vec![0.0]] }
    }

    /// Its standard deviation, s.
    pub fn sigma_s(&self) -> f64 {
        self.sigma_s
    }

    /// Variance of a derivative (0, 1 or 2) behind the window of white noise of variance 1, 1/s per derivative.
    pub fn noise_gain(&self, derivative: usize) -> f64 {
        self.weights[derivative].iter().map(|w| w * w).sum()
    }

    /// The largest gain that a wave of any frequency has in the second derivative, 1/s².
    pub fn steepest(&self) -> f64 {
        if self.sigma_s > 0.0 { 2.0 * (-1.0_f64).exp() / (self.sigma_s * self.sigma_s) } else { 0.0 }
    }

    /// What a step from 0 to 1 is at a time after it, s, to a hundredth: the logistic curve stands for the Gaussian's integral.
    pub fn of_a_step(&self, after_s: f64) -> f64 {
        if after_s.abs() < REACH * self.sigma_s {
            1.0 / (1.0 + (-1.702 * after_s / self.sigma_s).exp())
        } else {
            f64::from(u8::from(after_s >= 0.0))
        }
    }

    /// Samples at each end of a series whose result leans on samples that do not exist.
    pub fn margin(&self) -> usize {
        self.half
    }

    /// The smoothed `derivative` (0, 1 or 2) of a series, per second as often; at the ends the series is held.
    pub fn apply(&self, series: &[f64], derivative: usize) -> Vec<f64> {
        let weights = &self.weights[derivative];
        let (n, half) = (series.len(), self.half);
        let mut out = Vec::with_capacity(n);
        out.extend((0..half.min(n)).map(|i| self.held(weights, series, i)));
        summed(weights, half, series, &mut out);
        out.extend((out.len()..n).map(|i| self.held(weights, series, i)));
        out
    }

    /// One sum; beyond the ends the series is held.
    fn held(&self, weights: &[f64], series: &[f64], i: usize) -> f64 {
        let last = series.len() - 1;
        (0..=2 * self.half).map(|k| weights[k] * series[(i + k).saturating_sub(self.half).min(last)]).sum()
    }

    /// Autocovariance of white noise of variance 1 behind the window, at lags of `step` samples.
    pub fn autocovariance(&self, step: usize, lags: usize) -> Vec<f64> {
        let w = &self.weights[0];
        (0..=lags).map(|lag| w.iter().skip(lag * step).zip(w).map(|(a, b)| a * b).sum()).collect()
    }

    /// The smoothed value at one sample.
    pub fn at(&self, series: &[f64], i: usize) -> f64 {
        self.held(&self.weights[0], series, i)
    }

    /// The smoothed values at some samples.
    pub fn at_all(&self, series: &[f64], samples: &[usize]) -> Vec<f64> {
        let weights = &self.weights[0];
        let (half, n) = (self.half, series.len());
        let mut out = Vec::with_capacity(samples.len());
        for some in samples.chunks(ROWS) {
            match <&[usize; ROWS]>::try_from(some) {
                Ok(rows) if rows.iter().all(|i| *i >= half && i + half < n) => {
                    out.extend(apart(weights, &rows.map(|i| &series[i - half..=i + half])));
                }
                _ => out.extend(some.iter().map(|i| self.held(weights, series, *i))),
            }
        }
        out
    }
}

/// Appends sums that lean on no sample beyond the ends, so many at a time.
fn summed(weights: &[f64], half: usize, series: &[f64], out: &mut Vec<f64>) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the instruction set was found on this machine.
        return unsafe { summed_avx2(weights, half, series, out) };
    }
    summed_any(weights, half, series, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn summed_avx2(weights: &[f64], half: usize, series: &[f64], out: &mut Vec<f64>) {
    summed_any(weights, half, series, out);
}

#[inline(always)]
fn summed_any(weights: &[f64], half: usize, series: &[f64], out: &mut Vec<f64>) {
    while out.len() + SIDE_BY_SIDE <= series.len().saturating_sub(half) {
        out.extend(side_by_side(weights, &series[out.len() - half..]));
    }
}

/// Weighted sums of a series from each of its first places on.
#[inline(always)]
fn side_by_side(weights: &[f64], series: &[f64]) -> [f64; SIDE_BY_SIDE] {
    let mut sums = [0.0; SIDE_BY_SIDE];
    for (k, weight) in weights.iter().enumerate() {
        let Some(values) = series[k..].first_chunk::<SIDE_BY_SIDE>() else { break };
        sums.iter_mut().zip(values).for_each(|(sum, x)| *sum += weight * x);
    }
    sums
}

/// Weighted sums of several stretches, each as long as the weights.
fn apart(weights: &[f64], stretches: &[&[f64]; ROWS]) -> [f64; ROWS] {
    let [a, b, c, d] = *stretches;
    let mut sums = [0.0; ROWS];
    for ((((weight, a), b), c), d) in weights.iter().zip(a).zip(b).zip(c).zip(d) {
        sums[0] += weight * a;
        sums[1] += weight * b;
        sums[2] += weight * c;
        sums[3] += weight * d;
    }
    sums
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

    #[test]
    fn a_step_is_what_the_window_makes_of_one() {
        let window = Window::new(0.012, 0.001);
        let raw: Vec<f64> = (0..200).map(|i| f64::from(u8::from(i >= 100))).collect();
        for (i, smoothed) in window.apply(&raw, 0).into_iter().enumerate() {
            // The step lies between two samples.
            let told = window.of_a_step((i as f64 - 99.5) * 0.001);
            assert!((told - smoothed).abs() < 0.012, "{i}: {told} {smoothed}");
        }
        assert_eq!([-1e-9, 0.0].map(|after| Window::identity().of_a_step(after)), [0.0, 1.0]);
    }

    #[test]
    fn sums_side_by_side_are_those_one_by_one_to_the_ends() {
        let window = Window::new(0.012, 0.001);
        for count in [1, 60, 96, 97, 98, 113, 300] {
            let series: Vec<f64> = (0..count).map(|i| (f64::from(i) * 0.37).sin() + f64::from(i) * 0.01).collect();
            let one_by_one: Vec<f64> = (0..series.len()).map(|i| window.at(&series, i)).collect();
            let rows: Vec<usize> = (0..series.len()).collect();
            for all in [window.apply(&series, 0), window.at_all(&series, &rows)] {
                assert_eq!(all.len(), series.len());
                assert!(all.iter().zip(&one_by_one).all(|(a, b)| (a - b).abs() < 1e-12), "{count}");
            }
        }
    }
}
