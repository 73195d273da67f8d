//! Folds elementwise steps into the dense layers, in double precision.
//!
//! Before the first layer they become the input scaling; between a layer and its activation they go into that layer; after an
//! activation into the next layer.

use std::collections::BTreeMap;

use crate::chain::{Link, Matrix, Step};
use crate::error::ImportError;
use crate::network::{Activation, Dense, InputScale, Network};

/// A network and how much rounding another evaluation of the same file may show.
pub(crate) struct Folded {
    pub(crate) network: Network,
    /// Inputs whose scaling the file writes as `a * x + b`, which rounds as coarsely as its terms.
    pub(crate) cancelling: Vec<bool>,
    /// Per layer and output: sum of the absolute values of the sums that were folded into the bias.
    pub(crate) bias_terms: Vec<Vec<f64>>,
}

pub(crate) fn fold(links: Vec<Link>, input_width: usize, metadata: BTreeMap<String, String>) -> Result<Folded, ImportError> {
    let mut folder = Folder { inputs: vec![Channel::default(); input_width], layers: Vec::new(), pending: None };
    for Link { node, step } in links {
        match step {
            Step::Scale(by) => folder.scale(&by),
            Step::Shift(by) => folder.shift(&by),
            Step::Dense(matrix) => folder.dense(node, matrix),
            Step::Activate(activation) => folder.activate(node, activation)?,
        }
    }
    folder.finish(metadata)
}

/// `y = (x - shift) * scale + offset`
#[derive(Clone, Copy)]
struct Channel {
    shift: f64,
    scale: f64,
    offset: f64,
}

impl Default for Channel {
    fn default() -> Self {
        Self { shift: 0.0, scale: 1.0, offset: 0.0 }
    }
}

impl Channel {
    fn scale(&mut self, by: f64) {
        self.scale *= by;
        self.offset *= by;
    }

    /// A shift that comes first stays a shift, exactly as the file has it.
    fn shift_input(&mut self, by: f64) {
        if self.scale == 1.0 && self.offset == 0.0 { self.shift -= by } else { self.offset += by }
    }

    /// Whether the file writes `a * x + b`: the centre is then hidden in `b`. A centre that the file subtracts is kept exactly.
    fn is_uncentred(self) -> bool {
        self.scale != 0.0 && self.offset.abs() > (self.scale * self.shift).abs()
    }

    /// Shift and scale in float32, and what they leave to be added to `y`.
    fn narrow(self) -> (f32, f32, f64) {
        let scale = self.scale as f32;
        let centre = self.shift - self.offset / self.scale;
        if self.is_uncentred() && (centre as f32).is_finite() {
            // The rounding of the centre is known, so it is corrected in the first layer's bias.
            return (centre as f32, scale, (f64::from(centre as f32) - centre) * self.scale);
        }
        let centre = if self.scale == 0.0 { 0.0 } else { self.shift };
        let shift = centre as f32;
        (shift, scale, self.offset + (f64::from(shift) - centre) * self.scale)
    }
}

struct Layer {
    node: String,
    matrix: Matrix,
    bias: Vec<f64>,
    terms: Vec<f64>,
    activation: Option<Activation>,
}

impl Layer {
    fn scale(&mut self, by: &[f64]) {
        for (row, factor) in self.matrix.weights.chunks_exact_mut(self.matrix.inputs).zip(by) {
            for weight in row {
                *weight *= factor;
            }
        }
        self.bias.iter_mut().zip(by).for_each(|(b, factor)| *b *= factor);
        self.terms.iter_mut().zip(by).for_each(|(t, factor)| *t *= factor.abs());
    }

    fn shift(&mut self, by: &[f64]) {
        // Each sum on the way rounds by its own size, of which the bias so far is a part.
        self.terms.iter_mut().zip(&self.bias).zip(by).for_each(|((t, b), v)| *t += b.abs() + v.abs());
        self.bias.iter_mut().zip(by).for_each(|(b, v)| *b += v);
    }

    /// Adds `offset` to the layer's input.
    fn shift_input(&mut self, offset: &[f64]) {
        for (index, row) in self.matrix.weights.chunks_exact(self.matrix.inputs).enumerate() {
            let products = row.iter().zip(offset).map(|(w, v)| w * v);
            self.bias[index] += products.clone().sum::<f64>();
            self.terms[index] += products.map(f64::abs).sum::<f64>();
        }
    }

    fn scale_input(&mut self, by: &[f64]) {
        for row in self.matrix.weights.chunks_exact_mut(self.matrix.inputs) {
            row.iter_mut().zip(by).for_each(|(w, factor)| *w *= factor);
        }
    }

    fn narrow(self) -> Result<Dense, ImportError> {
        Ok(Dense {
            inputs: self.matrix.inputs,
            outputs: self.matrix.outputs,
            weights: narrow(&self.matrix.weights, || format!("{} weights", self.node))?,
            bias: narrow(&self.bias, || format!("{} bias", self.node))?,
            activation: self.activation.unwrap_or(Activation::Identity),
        })
    }
}

struct Folder {
    inputs: Vec<Channel>,
    layers: Vec<Layer>,
    /// Scale and offset since the last layer's activation.
    pending: Option<Vec<Channel>>,
}

impl Folder {
    /// The elementwise steps that stand between the last layer's activation and the next layer, or at the network's input.
    fn open_channels(&mut self) -> &mut Vec<Channel> {
        match self.layers.last() {
            None => &mut self.inputs,
            Some(layer) => self.pending.get_or_insert_with(|| vec![Channel::default(); layer.matrix.outputs]),
        }
    }

    /// The last layer, while its activation has not come yet.
    fn open_layer(&mut self) -> Option<&mut Layer> {
        self.layers.last_mut().filter(|layer| layer.activation.is_none())
    }

    fn scale(&mut self, by: &[f64]) {
        match self.open_layer() {
            Some(layer) => layer.scale(by),
            None => self.open_channels().iter_mut().zip(by).for_each(|(c, factor)| c.scale(*factor)),
        }
    }

    fn shift(&mut self, by: &[f64]) {
        if let Some(layer) = self.open_layer() {
            return layer.shift(by);
        }
        let at_input = self.layers.is_empty();
        for (channel, value) in self.open_channels().iter_mut().zip(by) {
            if at_input { channel.shift_input(*value) } else { channel.offset += value }
        }
    }

    fn dense(&mut self, node: String, matrix: Matrix) {
        if let Some(layer) = self.open_layer() {
            layer.activation = Some(Activation::Identity);
        }
        let zeros = vec![0.0; matrix.outputs];
        let mut layer = Layer { node, matrix, bias: zeros.clone(), terms: zeros, activation: None };
        if let Some(pending) = self.pending.take() {
            layer.shift_input(&pending.iter().map(|c| c.offset).collect::<Vec<_>>());
            layer.scale_input(&pending.iter().map(|c| c.scale).collect::<Vec<_>>());
        }
        self.layers.push(layer);
    }

    fn activate(&mut self, node: String, activation: Activation) -> Result<(), ImportError> {
        match self.open_layer() {
            Some(layer) => layer.activation = Some(activation),
            None => return Err(ImportError::NotAChain { node, found: "an activation without a dense layer before it".to_owned() }),
        }
        Ok(())
    }

    fn finish(mut self, metadata: BTreeMap<String, String>) -> Result<Folded, ImportError> {
        if let Some(pending) = &self.pending {
            // Scaling of the outputs after a last activation has no layer to go into, so it becomes one.
            let matrix = unit_matrix(pending.len());
            self.dense("output scaling".to_owned(), matrix);
        }
        let Some(first) = self.layers.first_mut() else {
            return Err(ImportError::NotAChain { node: "graph".to_owned(), found: "no dense layer".to_owned() });
        };
        let input_width = self.inputs.len();
        let cancelling = self.inputs.iter().map(|c| c.is_uncentred()).collect();
        let input_scale = input_scale(&self.inputs, first)?;
        let output_width = self.layers.last().map_or(0, |l| l.matrix.outputs);
        let bias_terms = self.layers.iter().map(|l| l.terms.clone()).collect();
        let layers = self.layers.into_iter().map(Layer::narrow).collect::<Result<_, _>>()?;
        let network = Network { input_width, output_width, plays: Vec::new(), friction: 0, input_scale, layers, metadata };
        Ok(Folded { network, cancelling, bias_terms })
    }
}

fn unit_matrix(size: usize) -> Matrix {
    let mut weights = vec![0.0; size * size];
    weights.iter_mut().step_by(size + 1).for_each(|w| *w = 1.0);
    Matrix { inputs: size, outputs: size, weights }
}

fn input_scale(channels: &[Channel], first: &mut Layer) -> Result<Option<InputScale>, ImportError> {
    let mut step = InputScale { shift: Vec::new(), scale: Vec::new() };
    let mut rest = Vec::new();
    for channel in channels {
        let (shift, scale, offset) = channel.narrow();
        step.shift.push(shift);
        step.scale.push(scale);
        rest.push(offset);
    }
    finite(step.shift.iter().map(|v| f64::from(*v)), || "input shift".to_owned())?;
    finite(step.scale.iter().map(|v| f64::from(*v)), || "input scale".to_owned())?;
    first.shift_input(&rest);
    let changes_nothing = step.shift.iter().all(|v| *v == 0.0) && step.scale.iter().all(|v| *v == 1.0);
    Ok(if changes_nothing { None } else { Some(step) })
}

fn finite(numbers: impl Iterator<Item = f64>, name: impl Fn() -> String) -> Result<(), ImportError> {
    match numbers.enumerate().find(|(_, v)| !v.is_finite()) {
        Some((index, value)) => Err(ImportError::NotFinite { tensor: name(), index, value }),
        None => Ok(()),
    }
}

/// To float32; a product of finite float32 numbers may lie beyond its range.
fn narrow(wide: &[f64], name: impl Fn() -> String) -> Result<Vec<f32>, ImportError> {
    let narrow: Vec<f32> = wide.iter().map(|v| *v as f32).collect();
    match narrow.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(ImportError::NotFinite { tensor: name(), index, value: wide[index] }),
        None => Ok(narrow),
    }
}
