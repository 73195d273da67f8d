//! Autoregressive noise of a cell: fit, whitening, correlation time.

/// Largest order.
const ORDER_MAX: usize = 8;

/// Noise `e_k = Σ φ_i e_{k-i} + w_k`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// φ.
    pub coefficients: Vec<f64>,
}

impl Noise {
    /// Fits to segments (one per run) by the Yule-Walker equations, order by BIC.
    pub fn fit(segments: &[&[f64]]) -> Self {
        let count: usize = segments.iter().map(|s| s.len()).sum();
        let top = ORDER_MAX.min(count / 20);
        Self::from_autocovariance(&autocovariance(segments, top), count)
    }

    /// From the autocovariance at lags 0, 1, ...; `count` samples decide the order by BIC.
    pub fn from_autocovariance(lagged: &[f64], count: usize) -> Self {
        if lagged[0] <= 0.0 {
            return Self::default();
        }
        let (mut best, mut best_score) = (Vec::new(), count as f64 * lagged[0].ln());
        let (mut phi, mut variance) = (Vec::<f64>::new(), lagged[0]);
        // Levinson-Durbin.
        for order in 1..lagged.len() {
            let reach: f64 = phi.iter().enumerate().map(|(i, p)| p * lagged[order - 1 - i]).sum();
            let reflection = (lagged[order] - reach) / variance;
            let mut next: Vec<f64> = (0..order - 1).map(|i| phi[i] - reflection * phi[order - 2 - i]).collect();
            next.push(reflection);
            phi = next;
            variance *= 1.0 - reflection * reflection;
            if variance <= 0.0 {
                break;
            }
            let score = count as f64 * variance.ln() + order as f64 * (count as f64).ln();
            if score < best_score {
                (best, best_score) = (phi.clone(), score);
            }
        }
        Self { coefficients: best }
    }

    /// Innovations of one segment; the first ones, whose past is not there, are left out as zeros.
    pub fn whiten(&self, segment: &[f64], out: &mut Vec<f64>) {
        let order = self.coefficients.len();
        out.extend(std::iter::repeat_n(0.0, order.min(segment.len())));
        out.extend(segment.windows(order + 1).map(|last| {
            let (past, now) = (&last[..order], last[order]);
            now - self.coefficients.iter().zip(past.iter().rev()).map(|(p, x)| p * x).sum::<f64>()
        }));
    }
}

/// Sums of products at lags 0 to `top`.
fn autocovariance(segments: &[&[f64]], top: usize) -> Vec<f64> {
    (0..=top).map(|lag| segments.iter().map(|s| s.iter().skip(lag).zip(s.iter()).map(|(a, b)| a * b).sum::<f64>()).sum()).collect()
}

/// Integrated autocorrelation time in samples, at least 1: how many samples count as one (initial positive sequence).
pub fn correlation_time(segments: &[&[f64]]) -> f64 {
    let longest = segments.iter().map(|s| s.len()).max().unwrap_or(0);
    let lagged = autocovariance(segments, (longest / 4).min(400));
    if lagged[0] <= 0.0 {
        return 1.0;
    }
    let mut sum = 1.0;
    for pair in lagged[1..].chunks(2) {
        let both: f64 = pair.iter().sum::<f64>() / lagged[0];
        if both <= 0.0 {
            break;
        }
        sum += 2.0 * both;
    }
    sum.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_autoregression_is_found_and_whitened() {
        let mut state = 1_u64;
        let mut white = || {
            (0..12)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (state >> 11) as f64 / (1_u64 << 53) as f64
                })
                .sum::<f64>()
                - 6.0
        };
        let mut series = vec![0.0, 0.0];
        for k in 2..4000 {
            let next = 1.2 * series[k - 1] - 0.5 * series[k - 2] + white();
            series.push(next);
        }
        let noise = Noise::fit(&[&series]);
        assert!((noise.coefficients[0] - 1.2).abs() < 0.06 && (noise.coefficients[1] + 0.5).abs() < 0.06, "{noise:?}");
        let mut left = Vec::new();
        noise.whiten(&series, &mut left);
        let correlation = left.windows(2).map(|p| p[0] * p[1]).sum::<f64>() / left.iter().map(|x| x * x).sum::<f64>();
        assert!(correlation.abs() < 0.05, "{correlation}");
    }
}
