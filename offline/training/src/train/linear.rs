//! What a line explains, fitted in one step before the network learns the rest. On inputs and the places of plays it is the model of
//! Prandtl and Ishlinskii: the cable's elasticity and lost motion.
//!
//! In the exported chain it runs through the hidden layers, one unit of each per output, on arguments so small that a tanh hardly bends
//! them. How much it does is part of what the network learns to make up for; beyond [`REACH`] deviations the line levels off.

use super::Rows;
use crate::network::{Activation, Network};
use nalgebra::DMatrix;
use ndarray::{Array1, Array2, Axis, concatenate, linalg::general_mat_mul, s};

/// Standard deviations of the labels at which the units saturate.
const REACH: f32 = 8.0;
/// Shares of the mean diagonal that are tried, to keep apart inputs that say almost the same; validation decides.
const RIDGES: [f64; 5] = [1e-7, 1e-5, 1e-4, 1e-3, 1e-2];

/// The line behind tanh units.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linear {
    /// By [`REACH`], outputs x inputs.
    weight: Array2<f32>,
    bias: Array1<f32>,
    /// Hidden layers that it passes.
    depth: usize,
}

impl Linear {
    /// Fits to the rows of training, for a network of so many hidden layers.
    pub(super) fn fit(train: &Rows, validation: &Rows, depth: usize) -> Self {
        let (inputs, outputs) = (train.x.ncols(), train.y.ncols());
        let mut normal = Array2::<f64>::zeros((inputs + 1, inputs + 1));
        let mut right = Array2::<f64>::zeros((inputs + 1, outputs));
        for (x, y) in train.x.axis_chunks_iter(Axis(0), super::CHUNK_ROWS).zip(train.y.axis_chunks_iter(Axis(0), super::CHUNK_ROWS))
        {
            let mut terms = Array2::<f64>::ones((x.nrows(), inputs + 1));
            terms.slice_mut(s![.., 1..]).assign(&x.mapv(f64::from));
            general_mat_mul(1.0, &terms.t(), &terms, 1.0, &mut normal);
            general_mat_mul(1.0, &terms.t(), &y.mapv(f64::from), 1.0, &mut right);
        }
        let diagonal = normal.diag().sum() / (inputs + 1) as f64;
        let right = DMatrix::from_fn(inputs + 1, outputs, |r, c| right[[r, c]]);
        let of_ridge = |ridge: f64| {
            // The constant is free.
            let added = |r: usize, c: usize| if r == c && r > 0 { ridge * diagonal } else { 0.0 };
            let matrix = DMatrix::from_fn(inputs + 1, inputs + 1, |r, c| normal[[r, c]] + added(r, c));
            let solved = matrix.cholesky()?.solve(&right);
            Some(Self {
                weight: Array2::from_shape_fn((outputs, inputs), |(o, i)| solved[(i + 1, o)] as f32 / REACH),
                bias: Array1::from_shape_fn(outputs, |o| solved[(0, o)] as f32 / REACH),
                depth,
            })
        };
        let left = |line: &Self| (&validation.y - &line.of(&validation.x)).iter().map(|rest| f64::from(*rest).powi(2)).sum::<f64>();
        let nothing = Self { weight: Array2::zeros((outputs, inputs)), bias: Array1::zeros(outputs), depth };
        RIDGES.into_iter().filter_map(of_ridge).min_by(|a, b| left(a).total_cmp(&left(b))).unwrap_or(nothing)
    }

    /// Its outputs for rows of inputs, as the units give them.
    pub(super) fn of(&self, x: &Array2<f32>) -> Array2<f32> {
        let mut y = x.dot(&self.weight.t()) + &self.bias;
        for _ in 0..self.depth {
            Activation::Tanh.apply(y.as_slice_mut().unwrap_or_default());
        }
        y * REACH
    }

    /// The network with the line's units behind its own.
    pub(super) fn joined(&self, mut network: Network) -> Network {
        let outputs = self.bias.len();
        let last = network.layers.len() - 1;
        for (index, layer) in network.layers.iter_mut().enumerate() {
            let (width, inputs) = layer.weight.dim();
            if index == last {
                let out = Array2::from_diag_elem(outputs, REACH);
                layer.weight = concatenate![Axis(1), layer.weight, out];
                continue;
            }
            let mut weight = Array2::zeros((width + outputs, inputs + if index == 0 { 0 } else { outputs }));
            weight.slice_mut(s![..width, ..inputs]).assign(&layer.weight);
            if index == 0 {
                weight.slice_mut(s![width.., ..]).assign(&self.weight);
            } else {
                weight.slice_mut(s![width.., inputs..]).assign(&Array2::eye(outputs));
            }
            let bias = if index == 0 { self.bias.clone() } else { Array1::zeros(outputs) };
            (layer.weight, layer.bias) = (weight, concatenate![Axis(0), layer.bias, bias]);
        }
        network
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::NormPlace;
    use crate::random::Random;

    #[test]
    fn the_joined_network_is_the_line_and_the_network() {
        let mut random = Random::new(3, 0);
        let x = Array2::from_shape_fn((400, 5), |_| random.normal() as f32);
        let y = Array2::from_shape_fn((400, 2), |(r, o)| 0.2 + x[[r, o]] - 0.5 * x[[r, 4]] + 0.01 * (x[[r, 3]] * 3.0).sin());
        let rows = Rows { x: x.clone(), y: y.clone() };
        for hidden in [&[7][..], &[7, 6], &[7, 6, 4]] {
            let widths = [&[5], hidden, &[2]].concat();
            let network = Network::new(&widths, Activation::Tanh, NormPlace::None, &mut random);
            let line = Linear::fit(&rows, &rows, hidden.len());
            let left = &y - &line.of(&x);
            let bent = |y: f32| 0.05 + y.abs().powi(3) / (REACH * REACH);
            assert!(left.iter().zip(&y).all(|(rest, y)| rest.abs() < bent(*y)), "no more than a tanh at {REACH} bends it");
            let sum = line.of(&x) + network.forward(&x.view());
            let joined = line.joined(network).forward(&x.view());
            assert!(sum.iter().zip(&joined).all(|(a, b)| (a - b).abs() < 2e-5));
        }
    }
}
