//! The network as a fixed plan: every buffer exists, padded and aligned, before the first run.
//!
//! A dense layer at batch 1 is a stream of weights: the cost is reading them once. Rows are padded to 64-byte lanes and worked on
//! four at a time; the widest instruction set of the machine is chosen when the plan is made (`docs/decisions/0004`).

mod activation;
mod kernel;

pub use kernel::InstructionSet;

use kernel::{LANE, Lane, ROWS};
use ravenpose_importer::{Activation, Network};

/// Weights below this are zero: they change no output of any use, and keep products out of the denormal range, where some
/// processors are a hundred times slower.
const SMALLEST_WEIGHT: f32 = 1e-30;

struct Layer {
    weights: Box<[Lane]>,
    bias: Box<[Lane]>,
    /// Lanes of one row.
    row_lanes: usize,
    activation: Activation,
}

/// A network compiled for repeated evaluation without allocation.
pub struct Plan {
    input_width: usize,
    output_width: usize,
    shift: Box<[Lane]>,
    scale: Box<[Lane]>,
    layers: Box<[Layer]>,
    /// Activations; each layer reads one and writes the other.
    front: Box<[Lane]>,
    back: Box<[Lane]>,
    instruction_set: InstructionSet,
}

fn lanes(width: usize) -> usize {
    width.div_ceil(LANE)
}

fn zeros(count: usize) -> Box<[Lane]> {
    vec![Lane([0.0; LANE]); count].into_boxed_slice()
}

fn padded(values: &[f32], count: usize) -> Box<[Lane]> {
    let mut out = zeros(count);
    for (to, from) in out.iter_mut().flat_map(|lane| lane.0.iter_mut()).zip(values) {
        *to = *from;
    }
    out
}

impl Plan {
    /// Compiles a network for the widest instruction set of this machine.
    pub fn new(network: &Network) -> Self {
        Self::with(network, InstructionSet::best())
    }

    /// Compiles a network for a given instruction set, or the widest available one below it.
    pub fn with(network: &Network, instruction_set: InstructionSet) -> Self {
        let widest = network.layers.iter().map(|layer| layer.outputs.next_multiple_of(ROWS)).max().unwrap_or(0);
        let widest = lanes(widest.max(network.input_width));
        let layers = network.layers.iter().map(Layer::new).collect();
        let input_lanes = lanes(network.input_width);
        let ones = vec![1.0; network.input_width];
        let (shift, scale) = network.input_scale.as_ref().map_or_else(
            || (zeros(input_lanes), padded(&ones, input_lanes)),
            |step| (padded(&step.shift, input_lanes), padded(&step.scale, input_lanes)),
        );
        Self {
            input_width: network.input_width,
            output_width: network.output_width,
            shift,
            scale,
            layers,
            front: zeros(widest),
            back: zeros(widest),
            instruction_set: instruction_set.available(),
        }
    }

    /// Number of inputs.
    pub fn input_width(&self) -> usize {
        self.input_width
    }

    /// Number of outputs.
    pub fn output_width(&self) -> usize {
        self.output_width
    }

    /// The instruction set in use.
    pub fn instruction_set(&self) -> InstructionSet {
        self.instruction_set
    }

    /// Bytes of weights and biases that one run reads.
    pub fn bytes(&self) -> usize {
        self.layers.iter().map(|layer| size_of_val(&*layer.weights) + size_of_val(&*layer.bias)).sum()
    }

    /// Evaluates the network. `input` and `output` must have the plan's widths; what is missing reads as zero, what is too much is
    /// ignored. NaN and infinity propagate; callers check inputs before and outputs after.
    pub fn run(&mut self, input: &[f32], output: &mut [f32]) {
        for lane in &mut self.front {
            lane.0 = [0.0; LANE];
        }
        for ((to, from), (shift, scale)) in self
            .front
            .iter_mut()
            .flat_map(|lane| lane.0.iter_mut())
            .zip(input.iter().take(self.input_width))
            .zip(self.shift.iter().flat_map(|lane| lane.0).zip(self.scale.iter().flat_map(|lane| lane.0)))
        {
            let value = (from - shift) * scale;
            // Denormals are slow on some processors and mean nothing here. NaN is not smaller: it passes.
            *to = if value.abs() < SMALLEST_WEIGHT { 0.0 } else { value };
        }
        for layer in &self.layers {
            kernel::dense(self.instruction_set, &layer.weights, &layer.bias, layer.row_lanes, &self.front, &mut self.back);
            activation::apply(self.instruction_set, layer.activation, &mut self.back[..layer.bias.len()]);
            std::mem::swap(&mut self.front, &mut self.back);
        }
        for (to, from) in output.iter_mut().zip(self.front.iter().flat_map(|lane| lane.0)).take(self.output_width) {
            *to = from;
        }
    }
}

impl Layer {
    fn new(dense: &ravenpose_importer::Dense) -> Self {
        let row_lanes = lanes(dense.inputs);
        let rows = dense.outputs.next_multiple_of(ROWS);
        let mut weights = zeros(rows * row_lanes);
        for (row, from) in dense.weights.chunks_exact(dense.inputs.max(1)).enumerate() {
            let to = &mut weights[row * row_lanes..(row + 1) * row_lanes];
            for (to, from) in to.iter_mut().flat_map(|lane| lane.0.iter_mut()).zip(from) {
                *to = if from.abs() < SMALLEST_WEIGHT { 0.0 } else { *from };
            }
        }
        Self { weights, bias: padded(&dense.bias, lanes(rows)), row_lanes, activation: dense.activation }
    }
}
