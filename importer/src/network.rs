//! The network as plain numbers.

use std::collections::BTreeMap;

/// Elementwise step before the first layer: `y[i] = (x[i] - shift[i]) * scale[i]`.
///
/// It is kept apart and never folded into the first weights: `(x - mean) / std` with a mean of 1e4 and a std of 1e-3 cancels
/// catastrophically in float32 once it is written as `x * scale + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct InputScale {
    /// Subtracted first, in the input's own units; one number per input.
    pub shift: Vec<f32>,
    /// Multiplied second, per unit of the input; one number per input.
    pub scale: Vec<f32>,
}

/// A play of half width r: it follows its input x only where x leaves [y - r, y + r], so x - y tells where x came from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Play {
    /// Index of the input that it follows.
    pub input: usize,
    /// r, in the unit of that input; finite and above 0.
    pub half_width: f32,
}

/// The function after a layer's sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Activation {
    /// `y = x`
    Identity,
    /// `y = 1 / (1 + exp(-x))`
    Sigmoid,
    /// `y = tanh(x)`
    Tanh,
    /// `y = max(x, 0)`
    Relu,
    /// `y = x` for `x > 0`, otherwise `alpha * (exp(x) - 1)`
    Elu {
        /// The negative limit's distance from zero; finite.
        alpha: f32,
    },
}

impl Activation {
    /// The function in double precision.
    pub fn apply_f64(self, x: f64) -> f64 {
        match self {
            Self::Identity => x,
            Self::Sigmoid => 1.0 / (1.0 + (-x).exp()),
            Self::Tanh => x.tanh(),
            // Not `max`: it would turn a NaN into 0 and hide it.
            Self::Relu => {
                if x < 0.0 {
                    0.0
                } else {
                    x
                }
            }
            Self::Elu { alpha } => {
                if x < 0.0 {
                    f64::from(alpha) * x.exp_m1()
                } else {
                    x
                }
            }
        }
    }
}

/// One dense layer: `y = activation(weights * x + bias)`. All numbers are finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Dense {
    /// Length of `x`.
    pub inputs: usize,
    /// Length of `y`.
    pub outputs: usize,
    /// Row-major `[outputs][inputs]`.
    pub weights: Vec<f32>,
    /// One number per output.
    pub bias: Vec<f32>,
    /// Applied to each output.
    pub activation: Activation,
}

/// A network of dense layers, each taking the previous one's outputs. Units of input and output are the caller's business.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Numbers that [`Network::evaluate_f64`] takes: the file's inputs, behind them one place x - y per play, and the friction.
    pub input_width: usize,
    /// Numbers that it gives.
    pub output_width: usize,
    /// The memory in front of the first layer; empty where the file has none.
    pub plays: Vec<Play>,
    /// How many numbers of friction stand behind the places; whoever runs the network has to know them, 0 is what is usual.
    pub friction: usize,
    /// Step before the first layer, absent when it would change nothing.
    pub input_scale: Option<InputScale>,
    /// At least one layer.
    pub layers: Vec<Dense>,
    /// The file's `metadata_props`, as they stand there: unchecked text, to be escaped before it is printed.
    pub metadata: BTreeMap<String, String>,
}

impl Network {
    /// Evaluates in double precision: the reference for faster kernels (it allocates per layer).
    ///
    /// A NaN in the input comes out as NaN, unlike in tract.
    ///
    /// # Panics
    ///
    /// If `input` does not have `input_width` numbers.
    pub fn evaluate_f64(&self, input: &[f32]) -> Vec<f64> {
        let evaluate = |x: Vec<f64>, layer: &Dense| layer.evaluate_f64(&x);
        self.layers.iter().fold(self.scaled_f64(input), evaluate)
    }

    /// An input as the first layer gets it, in double precision.
    ///
    /// # Panics
    ///
    /// If `input` does not have `input_width` numbers.
    pub fn scaled_f64(&self, input: &[f32]) -> Vec<f64> {
        assert_eq!(input.len(), self.input_width, "length of the input vector");
        scaled_f64(self.input_scale.as_ref(), input)
    }

    /// The raw input that the network's own scaling turns into `z`; `z` itself where it has none.
    ///
    /// # Panics
    ///
    /// If there is no such input.
    pub fn raw_input(&self, index: usize, z: f64) -> f32 {
        let raw = match &self.input_scale {
            Some(step) if step.scale[index] != 0.0 => f64::from(step.shift[index]) + z / f64::from(step.scale[index]),
            _ => z,
        };
        raw as f32
    }

    /// A chain of dense layers of these widths, inputs first, with zero biases, `hidden` activations and a linear last layer. `weight`
    /// gives the weight at a place of a layer, row by row, for the number of the layer's inputs. For benchmarks and tests.
    pub fn dense(widths: &[usize], hidden: Activation, mut weight: impl FnMut(usize, usize) -> f32) -> Self {
        let last = widths.len().saturating_sub(2);
        let layer = |(number, ends): (usize, &[usize])| Dense {
            inputs: ends[0],
            outputs: ends[1],
            weights: (0..ends[0] * ends[1]).map(|place| weight(place, ends[0])).collect(),
            bias: vec![0.0; ends[1]],
            activation: if number == last { Activation::Identity } else { hidden },
        };
        let layers = widths.windows(2).enumerate().map(layer).collect();
        Self {
            input_width: widths.first().copied().unwrap_or(0),
            output_width: widths.last().copied().unwrap_or(0),
            plays: Vec::new(),
            friction: 0,
            input_scale: None,
            layers,
            metadata: BTreeMap::new(),
        }
    }

    /// Numbers that a kernel has to read: weights, biases and input scaling.
    pub fn parameter_count(&self) -> usize {
        let layers: usize = self.layers.iter().map(|l| l.weights.len() + l.bias.len()).sum();
        layers + self.input_scale.as_ref().map_or(0, |s| s.shift.len() + s.scale.len())
    }
}

impl Dense {
    fn evaluate_f64(&self, x: &[f64]) -> Vec<f64> {
        let rows = self.weights.chunks_exact(self.inputs).zip(&self.bias);
        rows.map(|(row, bias)| self.activation.apply_f64(dot_f64(row, x) + f64::from(*bias))).collect()
    }
}

/// Eight sums side by side: one after the other, each addition would wait for the last.
fn dot_f64(weights: &[f32], x: &[f64]) -> f64 {
    let (weights, weights_left) = weights.as_chunks::<8>();
    let (x, x_left) = x.as_chunks::<8>();
    let mut sums = [0.0_f64; 8];
    for (weights, x) in weights.iter().zip(x) {
        for ((sum, weight), x) in sums.iter_mut().zip(weights).zip(x) {
            *sum += f64::from(*weight) * x;
        }
    }
    let left: f64 = weights_left.iter().zip(x_left).map(|(weight, x)| f64::from(*weight) * x).sum();
    sums.iter().sum::<f64>() + left
}

pub(crate) fn scaled_f64(scale: Option<&InputScale>, input: &[f32]) -> Vec<f64> {
    let plain = input.iter().map(|x| f64::from(*x));
    match scale {
        None => plain.collect(),
        Some(InputScale { shift, scale }) => {
            plain.zip(shift).zip(scale).map(|((x, m), s)| (x - f64::from(*m)) * f64::from(*s)).collect()
        }
    }
}
