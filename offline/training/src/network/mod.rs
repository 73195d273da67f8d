//! A dense network: forward, backward, its numbers as slices. Rows are samples.

mod activation;
mod adam;
mod norm;

use crate::random::Random;
use ndarray::{Array1, Array2, ArrayView2, Axis, linalg::general_mat_mul};
use norm::NormCache;
use serde::{Deserialize, Serialize};

pub use activation::Activation;
pub use adam::Adam;
pub use norm::{EPSILON, Norm};

/// Where batch normalisation stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NormPlace {
    /// Nowhere.
    None,
    /// Between sum and activation.
    Before,
    /// After the activation.
    After,
}

/// One dense layer with what follows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Weights, out x in.
    pub weight: Array2<f32>,
    /// Bias.
    pub bias: Array1<f32>,
    /// Batch normalisation, if any.
    pub norm: Option<Norm>,
    /// Does it stand after the activation?
    pub norm_after: bool,
    /// Activation.
    pub activation: Activation,
}

/// Dense layers in a chain; the last one has neither activation nor normalisation.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// From input to output.
    pub layers: Vec<Layer>,
}

/// What the way back needs of one layer.
struct Cache {
    input: Array2<f32>,
    norm: Option<NormCache>,
    activated: Array2<f32>,
}

/// Caches of a forward pass.
pub struct Tape {
    caches: Vec<Cache>,
}

impl Network {
    /// A network with random weights (Glorot and Bengio's uniform) and biases of zero.
    pub fn new(widths: &[usize], activation: Activation, place: NormPlace, random: &mut Random) -> Self {
        let count = widths.len().saturating_sub(1);
        let layers = (0..count)
            .map(|index| {
                let (inputs, outputs) = (widths[index], widths[index + 1]);
                let limit = (6.0 / (inputs + outputs) as f64).sqrt();
                let weight = Array2::from_shape_fn((outputs, inputs), |_| (limit * (2.0 * random.share() - 1.0)) as f32);
                let last = index + 1 == count;
                Layer {
                    weight,
                    bias: Array1::zeros(outputs),
                    norm: (!last && place != NormPlace::None).then(|| Norm::new(outputs)),
                    norm_after: place == NormPlace::After,
                    activation: if last { Activation::Identity } else { activation },
                }
            })
            .collect();
        Self { layers }
    }

    /// Outputs with the running statistics of batch normalisation.
    pub fn forward(&self, input: &ArrayView2<f32>) -> Array2<f32> {
        let mut x = input.to_owned();
        for layer in &self.layers {
            let mut y = layer.sum(&x);
            match &layer.norm {
                Some(norm) if !layer.norm_after => {
                    norm.apply(&mut y);
                    layer.activate(&mut y);
                }
                Some(norm) => {
                    layer.activate(&mut y);
                    norm.apply(&mut y);
                }
                None => layer.activate(&mut y),
            }
            x = y;
        }
        x
    }

    /// Outputs with the statistics of this batch, and what the way back needs.
    pub fn forward_train(&mut self, input: Array2<f32>) -> (Array2<f32>, Tape) {
        let mut x = input;
        let mut caches = Vec::with_capacity(self.layers.len());
        for layer in &mut self.layers {
            let mut y = layer.sum(&x);
            let mut norm = None;
            if !layer.norm_after {
                norm = layer.norm.as_mut().map(|norm| norm.train(&mut y));
            }
            layer.activation.apply(y.as_slice_mut().unwrap_or_default());
            let activated = if layer.activation == Activation::Identity { Array2::zeros((0, 0)) } else { y.clone() };
            if layer.norm_after {
                norm = layer.norm.as_mut().map(|norm| norm.train(&mut y));
            }
            caches.push(Cache { input: std::mem::replace(&mut x, y), norm, activated });
        }
        (x, Tape { caches })
    }

    /// Gradients in the order of [`Network::numbers`], from the gradient of the outputs.
    pub fn backward(&self, tape: &Tape, gradient: Array2<f32>) -> Vec<Vec<f32>> {
        let mut gradient = gradient;
        let mut all = Vec::new();
        for (index, (layer, cache)) in self.layers.iter().zip(&tape.caches).enumerate().rev() {
            let mut norm_gradient = None;
            if let (Some(norm), Some(kept), true) = (&layer.norm, &cache.norm, layer.norm_after) {
                norm_gradient = Some(norm.backward(kept, &mut gradient));
            }
            let activated = cache.activated.as_slice().unwrap_or_default();
            layer.activation.backward(activated, gradient.as_slice_mut().unwrap_or_default());
            if let (Some(norm), Some(kept), false) = (&layer.norm, &cache.norm, layer.norm_after) {
                norm_gradient = Some(norm.backward(kept, &mut gradient));
            }
            let mut weight = Array2::<f32>::zeros(layer.weight.raw_dim());
            general_mat_mul(1.0, &gradient.t(), &cache.input, 0.0, &mut weight);
            let bias = gradient.sum_axis(Axis(0));
            if let Some(found) = norm_gradient {
                all.push(found.beta.to_vec());
                all.push(found.gamma.to_vec());
            }
            all.push(bias.to_vec());
            all.push(weight.into_raw_vec_and_offset().0);
            if index > 0 {
                gradient = gradient.dot(&layer.weight);
            }
        }
        all.reverse();
        all
    }

    /// What is learnt: weight, bias, gamma, beta of each layer.
    pub fn numbers(&mut self) -> Vec<&mut [f32]> {
        let mut all = Vec::new();
        for layer in &mut self.layers {
            all.push(layer.weight.as_slice_mut().unwrap_or_default());
            all.push(layer.bias.as_slice_mut().unwrap_or_default());
            if let Some(norm) = &mut layer.norm {
                all.push(norm.gamma.as_slice_mut().unwrap_or_default());
                all.push(norm.beta.as_slice_mut().unwrap_or_default());
            }
        }
        all
    }

    /// Everything that has to be kept: [`Network::numbers`] and running statistics, layer by layer.
    pub fn all_numbers(&mut self) -> Vec<&mut [f32]> {
        let mut all = Vec::new();
        for layer in &mut self.layers {
            all.push(layer.weight.as_slice_mut().unwrap_or_default());
            all.push(layer.bias.as_slice_mut().unwrap_or_default());
            if let Some(norm) = &mut layer.norm {
                for part in [&mut norm.gamma, &mut norm.beta, &mut norm.mean, &mut norm.variance] {
                    all.push(part.as_slice_mut().unwrap_or_default());
                }
            }
        }
        all
    }

    /// Which of [`Network::numbers`] are weights, on which penalties work.
    pub fn is_weight(&self) -> Vec<bool> {
        self.layers
            .iter()
            .flat_map(|layer| if layer.norm.is_some() { vec![true, false, false, false] } else { vec![true, false] })
            .collect()
    }
}

impl Layer {
    fn sum(&self, x: &Array2<f32>) -> Array2<f32> {
        let mut y = Array2::zeros((x.nrows(), self.weight.nrows()));
        general_mat_mul(1.0, x, &self.weight.t(), 0.0, &mut y);
        y += &self.bias;
        y
    }

    fn activate(&self, y: &mut Array2<f32>) {
        self.activation.apply(y.as_slice_mut().unwrap_or_default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loss(network: &Network, x: &Array2<f32>) -> f64 {
        let (y, _) = network.clone().forward_train(x.clone());
        y.iter().enumerate().map(|(i, y)| 0.5 * f64::from(y - (i as f32 * 0.7).sin()).powi(2)).sum()
    }

    #[test]
    fn gradients_agree_with_differences() {
        for place in [NormPlace::None, NormPlace::Before, NormPlace::After] {
            let mut random = Random::new(4, 0);
            let network = Network::new(&[5, 7, 6, 2], Activation::Tanh, place, &mut random);
            let x = Array2::from_shape_fn((9, 5), |_| random.normal() as f32);
            let (y, tape) = network.clone().forward_train(x.clone());
            let gradient = Array2::from_shape_fn(y.raw_dim(), |(r, c)| y[[r, c]] - ((r * 2 + c) as f32 * 0.7).sin());
            let found = network.backward(&tape, gradient);
            for (slot, found) in found.iter().enumerate() {
                for at in [0, found.len() / 2, found.len() - 1] {
                    let h = 2e-3;
                    let shifted = |by: f32| {
                        let mut other = network.clone();
                        other.numbers()[slot][at] += by;
                        loss(&other, &x)
                    };
                    let expected = (shifted(h) - shifted(-h)) / f64::from(2.0 * h);
                    assert!((f64::from(found[at]) - expected).abs() < 3e-3 * expected.abs().max(1.0), "{place:?} {slot} {at}");
                }
            }
        }
    }
}
