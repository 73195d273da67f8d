//! The exported form: shift, scale, and dense layers that map raw inputs to the labels' unit; everything else is folded in.

use crate::network::Activation;
use crate::train::Trained;
use ndarray::{Array1, Array2, ArrayView2, linalg::general_mat_mul};
use ravenpose::load::MOTORS;
use ravenpose::memory::Play;

/// Rows that are evaluated at a time.
const CHUNK_ROWS: usize = 4096;

/// One dense layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Dense {
    /// Weights, out x in.
    pub weight: Array2<f32>,
    /// Bias.
    pub bias: Vec<f32>,
    /// What follows.
    pub activation: Activation,
}

/// (x - shift) · scale, then dense layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Subtracted from each input, its unit.
    pub shift: Vec<f32>,
    /// Factor after that; 0 for an input that is not looked at.
    pub scale: Vec<f32>,
    /// At least one.
    pub layers: Vec<Dense>,
    /// The memory in front, whose places are the last inputs but for the friction.
    pub plays: Vec<Play>,
    /// Is the friction of motors 1 to 3 behind them?
    pub friction: bool,
}

impl Chain {
    /// Folds normalisation, preparation, batch normalisation and the labels' unit into the layers, in double precision.
    pub fn of(trained: &Trained, plays: &[Play], friction: bool) -> Self {
        let prepared = &trained.prepared;
        let inputs = prepared.mean.len();
        let (mut before_weight, mut before_bias) = prepared.fold();
        let mut layers = Vec::new();
        let count = trained.network.layers.len();
        for (index, layer) in trained.network.layers.iter().enumerate() {
            let weight = layer.weight.mapv(f64::from);
            let mut bias = weight.dot(&before_bias) + layer.bias.mapv(f64::from);
            let mut weight = if index == 0 { weight.dot(&before_weight) } else { &weight * &before_weight.row(0) };
            if let (Some(norm), false) = (&layer.norm, layer.norm_after) {
                let (a, b) = norm.affine();
                for (row, (a, b)) in a.iter().zip(&b).enumerate() {
                    weight.row_mut(row).mapv_inplace(|value| value * a);
                    bias[row] = bias[row] * a + b;
                }
            }
            // What stands after an activation is a factor and a shift for the next layer.
            let width = weight.nrows();
            (before_weight, before_bias) = (Array2::ones((1, width)), Array1::zeros(width));
            if let (Some(norm), true) = (&layer.norm, layer.norm_after) {
                let (a, b) = norm.affine();
                before_weight.row_mut(0).assign(&Array1::from(a));
                before_bias = Array1::from(b);
            }
            if index + 1 == count {
                weight *= trained.label_scale;
                bias = bias * trained.label_scale + Array1::from(trained.label_mean.clone());
            }
            let bias = bias.iter().map(|value| *value as f32).collect();
            layers.push(Dense { weight: weight.mapv(|value| value as f32), bias, activation: layer.activation });
        }
        Self {
            shift: prepared.mean.iter().map(|mean| *mean as f32).collect(),
            scale: (0..inputs).map(|input| prepared.scale(input) as f32).collect(),
            layers,
            plays: plays.to_vec(),
            friction,
        }
    }

    /// Inputs beyond the recording's own: places of plays, and friction.
    pub fn remembered(&self) -> usize {
        self.plays.len() + self.frictions()
    }

    /// Inputs of friction.
    pub fn frictions(&self) -> usize {
        if self.friction { MOTORS } else { 0 }
    }

    /// Width of the input row, all that is remembered included.
    pub fn inputs(&self) -> usize {
        self.shift.len()
    }

    /// Width of the output row.
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.bias.len())
    }

    /// Outputs for rows of raw inputs, row-major, in float32 as any runtime computes them.
    pub fn estimate(&self, inputs: &[f32]) -> Vec<f32> {
        let width = self.inputs().max(1);
        let mut out = Vec::with_capacity(inputs.len() / width * self.outputs());
        for rows in inputs.chunks(width * CHUNK_ROWS) {
            let normal: Vec<f32> = rows
                .chunks_exact(width)
                .flat_map(|row| row.iter().zip(&self.shift).zip(&self.scale).map(|((x, shift), scale)| (x - shift) * scale))
                .collect();
            let Ok(view) = ArrayView2::from_shape((normal.len() / width, width), &normal) else { continue };
            let mut x = view.to_owned();
            for layer in &self.layers {
                let mut y = Array2::zeros((x.nrows(), layer.bias.len()));
                general_mat_mul(1.0, &x, &layer.weight.t(), 0.0, &mut y);
                for mut row in y.rows_mut() {
                    row.iter_mut().zip(&layer.bias).for_each(|(y, bias)| *y += bias);
                }
                layer.activation.apply(y.as_slice_mut().unwrap_or_default());
                x = y;
            }
            out.extend(x.iter());
        }
        out
    }

    /// Outputs for one row in double precision: what golden pairs state.
    pub fn estimate_exactly(&self, row: &[f32]) -> Vec<f64> {
        let mut x: Vec<f64> = row
            .iter()
            .zip(&self.shift)
            .zip(&self.scale)
            .map(|((x, shift), scale)| (f64::from(*x) - f64::from(*shift)) * f64::from(*scale))
            .collect();
        for layer in &self.layers {
            let sums = layer.weight.rows().into_iter().zip(&layer.bias);
            x = sums
                .map(|(weights, bias)| {
                    let sum = weights.iter().zip(&x).map(|(w, x)| f64::from(*w) * x).sum::<f64>() + f64::from(*bias);
                    exactly(layer.activation, sum)
                })
                .collect();
        }
        x
    }
}

fn exactly(activation: Activation, x: f64) -> f64 {
    match activation {
        Activation::Identity => x,
        Activation::Sigmoid => 1.0 / (1.0 + (-x).exp()),
        Activation::Tanh => x.tanh(),
        Activation::Relu => x.max(0.0),
        Activation::Elu => {
            if x > 0.0 {
                x
            } else {
                x.exp_m1()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Trajectory;
    use crate::network::{Network, NormPlace};
    use crate::prepare::{Preparation, Prepared};
    use crate::random::Random;

    #[test]
    fn everything_folded_gives_what_the_trained_network_gives() {
        let mut random = Random::new(5, 0);
        let inputs: Vec<f32> = (0..200 * 4).map(|i| (1000.0 * (i % 4) as f64 + random.normal()) as f32).collect();
        let one = Trajectory { time_s: vec![0.0; 200], inputs, ..Trajectory::default() };
        let prepared = Prepared::fit(std::slice::from_ref(&one), 4, Preparation::Standard).expect("map");
        for place in [NormPlace::None, NormPlace::Before, NormPlace::After] {
            for activation in [Activation::Sigmoid, Activation::Elu] {
                let mut network = Network::new(&[4, 9, 8, 2], activation, place, &mut random);
                for numbers in network.all_numbers() {
                    for number in numbers {
                        *number += 0.1 + 0.02 * random.normal() as f32;
                    }
                }
                let trained = Trained {
                    network,
                    prepared: prepared.clone(),
                    label_mean: vec![0.5, -2.0],
                    label_scale: 3.0,
                    curves: Vec::new(),
                    seconds: 0.0,
                    has_line: false,
                };
                let chain = Chain::of(&trained, &[], false);
                for (a, b) in trained.estimate(&one.inputs).iter().zip(chain.estimate(&one.inputs)) {
                    assert!((a - b).abs() < 2e-4 * a.abs().max(1.0), "{place:?} {activation:?}: {a} {b}");
                }
                let (fast, exact) = (chain.estimate(&one.inputs[..4]), chain.estimate_exactly(&one.inputs[..4]));
                assert!(fast.iter().zip(exact).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-4 * b.abs().max(1.0)));
            }
        }
    }
}
