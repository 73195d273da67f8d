//! Batch normalisation (Ioffe and Szegedy 2015).

use ndarray::{Array1, Array2, Axis};

/// Added to the variance, as Keras has it.
pub const EPSILON: f32 = 1e-3;
/// How slowly the running statistics follow, as Keras has it.
const MOMENTUM: f32 = 0.99;

/// Scale and shift of normalised values, with running statistics for use.
#[derive(Debug, Clone, PartialEq)]
pub struct Norm {
    /// Factor after normalising.
    pub gamma: Array1<f32>,
    /// Added after that.
    pub beta: Array1<f32>,
    /// Running mean.
    pub mean: Array1<f32>,
    /// Running variance.
    pub variance: Array1<f32>,
}

/// What the way back needs.
pub(super) struct NormCache {
    normalised: Array2<f32>,
    inverse_sd: Array1<f32>,
}

/// Gradients of gamma and beta.
pub(super) struct NormGradient {
    pub(super) gamma: Array1<f32>,
    pub(super) beta: Array1<f32>,
}

impl Norm {
    /// The identity on standardised values.
    pub fn new(width: usize) -> Self {
        Self { gamma: Array1::ones(width), beta: Array1::zeros(width), mean: Array1::zeros(width), variance: Array1::ones(width) }
    }

    /// Factor and shift per unit with the running statistics: y = a x + b.
    pub fn affine(&self) -> (Vec<f64>, Vec<f64>) {
        let a: Vec<f64> = self
            .gamma
            .iter()
            .zip(&self.variance)
            .map(|(gamma, variance)| f64::from(*gamma) / (f64::from(*variance) + f64::from(EPSILON)).sqrt())
            .collect();
        let b = a.iter().zip(&self.beta).zip(&self.mean).map(|((a, beta), mean)| f64::from(*beta) - a * f64::from(*mean)).collect();
        (a, b)
    }

    pub(super) fn apply(&self, x: &mut Array2<f32>) {
        let (a, b) = self.affine();
        let a: Array1<f32> = a.iter().map(|a| *a as f32).collect();
        let b: Array1<f32> = b.iter().map(|b| *b as f32).collect();
        *x *= &a;
        *x += &b;
    }

    /// Normalises with the batch's own statistics and lets the running ones follow.
    pub(super) fn train(&mut self, x: &mut Array2<f32>) -> NormCache {
        let n = x.nrows().max(1) as f32;
        let mean = x.sum_axis(Axis(0)) / n;
        *x -= &mean;
        let variance = x.map(|value| value * value).sum_axis(Axis(0)) / n;
        let inverse_sd = variance.mapv(|value| 1.0 / (value + EPSILON).sqrt());
        *x *= &inverse_sd;
        let normalised = x.clone();
        *x *= &self.gamma;
        *x += &self.beta;
        self.mean.zip_mut_with(&mean, |running, now| *running = MOMENTUM * *running + (1.0 - MOMENTUM) * now);
        self.variance.zip_mut_with(&variance, |running, now| *running = MOMENTUM * *running + (1.0 - MOMENTUM) * now);
        NormCache { normalised, inverse_sd }
    }

    /// Turns the gradient of the output into that of the input.
    pub(super) fn backward(&self, cache: &NormCache, gradient: &mut Array2<f32>) -> NormGradient {
        let n = gradient.nrows().max(1) as f32;
        let beta = gradient.sum_axis(Axis(0));
        let gamma = (&*gradient * &cache.normalised).sum_axis(Axis(0));
        let factor = &self.gamma * &cache.inverse_sd;
        let (mean_beta, mean_gamma) = (&beta / n, &gamma / n);
        for (mut row, normalised) in gradient.rows_mut().into_iter().zip(cache.normalised.rows()) {
            for i in 0..row.len() {
                row[i] = factor[i] * (row[i] - mean_beta[i] - normalised[i] * mean_gamma[i]);
            }
        }
        NormGradient { gamma, beta }
    }
}
