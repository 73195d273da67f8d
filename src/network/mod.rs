//! The network as a fixed plan: every buffer exists, padded and aligned, before the first run.
//!
//! A dense layer at batch 1 is a stream of weights: the cost is reading them once, so that smaller weights are faster weights
//! (`docs/decisions/0013`). The widest instruction set of the machine is chosen when the plan is made.

mod activation;
mod deviation;
mod examples;
mod format;
mod instructions;
mod pairs;
mod region;
mod rounding;
mod rows;
#[cfg(target_arch = "x86_64")]
mod tiles;
mod warmth;

pub use deviation::{Choice, Deviation, NotExactEnough, RANDOM_INPUTS, choose};
pub use format::{Format, UnknownFormat};
pub use instructions::InstructionSet;

use instructions::{LANE, Lane, bytes_of};
use pairs::{Numbers, Pairs};
use ravenpose_importer::{Activation, Dense, Network};
use region::Lines;
use rounding::{Spread, Whole};
use rows::{Float, Rows};
use std::sync::Arc;
#[cfg(target_arch = "x86_64")]
use tiles::{Digits, Tiles};

/// Weights below this are zero: they change no output of any use, and keep products out of the denormal range, where some
/// processors are a hundred times slower.
const SMALLEST_WEIGHT: f32 = 1e-30;

/// Most inputs of a layer whose sums of products of bytes fit in 32 bits.
#[cfg(target_arch = "x86_64")]
const TILES_INPUTS_MAX: usize = 65_000;

/// Lines of weights that one call of [`Plan::keep_warm`] reads: 16 KiB, half a microsecond.
const WARM_LINES: usize = 256;

/// A layer of fewer outputs takes no more room as float32 in groups of four rows than as numbers of 16 bits in a tile of sixteen, and loses
/// nothing.
const TILE_OUTPUTS_MIN: usize = 9;

enum Weights {
    Rows(Rows),
    Pairs(Pairs),
    #[cfg(target_arch = "x86_64")]
    Tiles(Tiles),
}

struct Layer {
    weights: Weights,
    outputs: usize,
    bias: Box<[Lane]>,
    activation: Activation,
}

/// A network compiled for repeated evaluation without allocation. Clones read the same weights: two arms with one model keep half as much
/// in the caches.
#[derive(Clone)]
pub struct Plan {
    input_width: usize,
    output_width: usize,
    shift: Box<[Lane]>,
    scale: Box<[Lane]>,
    layers: Arc<[Layer]>,
    /// Activations; each layer reads one and writes the other.
    front: Box<[Lane]>,
    back: Box<[Lane]>,
    #[cfg(target_arch = "x86_64")]
    digits: Digits,
    numbers: Numbers,
    instruction_set: InstructionSet,
    format: Format,
    /// Where [`Plan::keep_warm`] goes on: layer and line.
    warm: (usize, usize),
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

fn scaled(from: &[f32; LANE], shift: &Lane, scale: &Lane) -> Lane {
    Lane(std::array::from_fn(|index| {
        let value = (from[index] - shift.0[index]) * scale.0[index];
        // Denormals are slow on some processors and mean nothing here. NaN is not smaller: it passes.
        if value.abs() < SMALLEST_WEIGHT { 0.0 } else { value }
    }))
}

impl Plan {
    /// Compiles a network for the widest instruction set of this machine, with weights as they are.
    pub fn new(network: &Network) -> Self {
        Self::with(network, InstructionSet::best(), Format::F32)
    }

    /// Compiles a network for a given instruction set, or the widest available one below it, with weights of a given format.
    ///
    /// With [`Format::I8`] and [`Format::I12`] the first layer keeps four bits more: its inputs are as unlike one another as they come. In
    /// the others, rounding makes up for itself (`rounding.rs`). A layer of a few outputs is float32 whatever the whole numbers.
    pub fn with(network: &Network, instruction_set: InstructionSet, format: Format) -> Self {
        let spreads = if format.is_rounded_together() { rounding::spreads(network) } else { Vec::new() };
        Self::rounded(network, instruction_set, format, &spreads)
    }

    /// As [`Plan::with`], with the spreads of the layers' inputs if the format is rounded together.
    fn rounded(network: &Network, instruction_set: InstructionSet, format: Format, spreads: &[Option<Spread>]) -> Self {
        let instruction_set = instruction_set.available();
        let layer = |(index, dense): (usize, &Dense)| match spreads.get(index).and_then(Option::as_ref) {
            None => Layer::new(dense, instruction_set, format.unrelated(), None),
            spread => Layer::new(dense, instruction_set, format, spread),
        };
        let widest = network.layers.iter().map(|layer| layer.outputs).max().unwrap_or(0);
        let widest = lanes(widest.max(network.input_width));
        let layers = network.layers.iter().enumerate().map(layer).collect();
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
            #[cfg(target_arch = "x86_64")]
            digits: Digits::new(widest),
            numbers: Numbers::new(widest),
            instruction_set,
            format,
            warm: (0, 0),
        }
    }

    /// Moves the weights of all layers into one piece of memory, in huge pages where the system has them: for a plan that is to run for long. It
    /// may take milliseconds. A plan that was cloned before stays as it is.
    #[must_use]
    pub fn in_one_piece(mut self) -> Self {
        if let Some(layers) = Arc::get_mut(&mut self.layers) {
            region::gather(layers.iter_mut().map(|layer| layer.weights.lines_mut()));
        }
        self
    }

    /// Are the weights in huge pages?
    pub fn is_in_huge_pages(&self) -> bool {
        self.layers.iter().all(|layer| layer.weights.lines().is_huge())
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

    /// The format of the weights.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The weights as one run reads them, layer by layer: addresses, for prefetching and for benchmarks that evict them.
    pub fn memory(&self) -> impl Iterator<Item = &[u8]> {
        self.layers.iter().map(|layer| bytes_of(layer.weights.lines()))
    }

    /// Bytes of weights that one run reads.
    pub fn bytes(&self) -> usize {
        self.memory().map(<[u8]>::len).sum()
    }

    /// Reads the next 16 KiB of the weights, round and round with each call. Called by whoever waits for an input, so that a run finds
    /// its weights in the caches and the vector unit awake: after a sleep neither is.
    pub fn keep_warm(&mut self) {
        let (layer, line) = self.warm;
        let lines = self.layers.get(layer).map_or(&[][..], |layer| layer.weights.lines());
        let end = lines.len().min(line + WARM_LINES);
        warmth::touch(self.instruction_set, lines.get(line..end).unwrap_or_default());
        self.warm = if end < lines.len() { (layer, end) } else { ((layer + 1) % self.layers.len().max(1), 0) };
    }

    /// Evaluates the network. `input` and `output` must have the plan's widths; what is missing reads as zero, what is too much is
    /// ignored. NaN propagates; infinity gives what float64 does, or NaN. Callers check inputs before and outputs after.
    pub fn run(&mut self, input: &[f32], output: &mut [f32]) {
        let given = input.len().min(self.input_width);
        let (whole, rest) = input[..given].as_chunks::<LANE>();
        let steps = self.shift.iter().zip(&*self.scale);
        for ((to, from), (shift, scale)) in self.front.iter_mut().zip(whole).zip(steps.clone()) {
            *to = scaled(from, shift, scale);
        }
        if let Some((to, (shift, scale))) = self.front.iter_mut().zip(steps).nth(whole.len()) {
            let mut last = [0.0; LANE];
            last[..rest.len()].copy_from_slice(rest);
            *to = scaled(&last, shift, scale);
            // What pads has neither shift nor scale; what was not given reads as zero.
            to.0[rest.len()..].fill(0.0);
        }
        for lane in self.front[..self.shift.len()].iter_mut().skip(whole.len() + 1) {
            lane.0 = [0.0; LANE];
        }
        for Layer { weights, outputs, bias, activation } in &*self.layers {
            match weights {
                Weights::Rows(rows) => rows.run(self.instruction_set, *activation, bias, &self.front, &mut self.back),
                Weights::Pairs(pairs) => {
                    pairs.run(self.instruction_set, *activation, bias, &self.front, &mut self.numbers, &mut self.back);
                }
                #[cfg(target_arch = "x86_64")]
                Weights::Tiles(tiles) => tiles.run(*activation, bias, &self.front, &mut self.digits, &mut self.back),
            }
            // What pads would be a half of a sigmoid, and count in the scale of the next layer's whole numbers.
            if let (Some(last), 1..) = (self.back.get_mut(outputs / LANE), outputs % LANE) {
                last.0[outputs % LANE..].fill(0.0);
            }
            std::mem::swap(&mut self.front, &mut self.back);
        }
        for (to, from) in output.iter_mut().zip(self.front.iter().flat_map(|lane| lane.0)).take(self.output_width) {
            *to = from;
        }
    }
}

impl Layer {
    /// `spread` is that of the inputs for which whole numbers are rounded.
    fn new(dense: &Dense, set: InstructionSet, format: Format, spread: Option<&Spread>) -> Self {
        let rows = |float| Weights::Rows(Rows::new(&dense.weights, dense.inputs, float));
        let (weights, bias) = match format {
            Format::F32 => (rows(Float::F32), None),
            Format::F16 => (rows(Float::F16), None),
            Format::Bf16 => (rows(Float::Bf16), None),
            Format::I16 | Format::I12 | Format::I8 if dense.outputs < TILE_OUTPUTS_MIN => (rows(Float::F32), None),
            Format::I16 | Format::I12 | Format::I8 => {
                let whole = Whole::new(dense, format, spread);
                (Weights::whole(&whole, set), Some(whole.bias))
            }
        };
        let bias = padded(bias.as_ref().unwrap_or(&dense.bias), lanes(dense.outputs));
        Self { weights, outputs: dense.outputs, bias, activation: dense.activation }
    }
}

impl Weights {
    #[cfg_attr(not(target_arch = "x86_64"), expect(unused_variables, reason = "one layout for all that they have"))]
    fn whole(whole: &Whole, set: InstructionSet) -> Self {
        #[cfg(target_arch = "x86_64")]
        if set == InstructionSet::Avx512Vnni && whole.inputs <= TILES_INPUTS_MAX {
            return Self::Tiles(Tiles::new(whole));
        }
        Self::Pairs(Pairs::new(whole))
    }

    fn lines(&self) -> &Lines {
        match self {
            Self::Rows(rows) => &rows.lines,
            Self::Pairs(pairs) => &pairs.lines,
            #[cfg(target_arch = "x86_64")]
            Self::Tiles(tiles) => &tiles.lines,
        }
    }

    fn lines_mut(&mut self) -> &mut Lines {
        match self {
            Self::Rows(rows) => &mut rows.lines,
            Self::Pairs(pairs) => &mut pairs.lines,
            #[cfg(target_arch = "x86_64")]
            Self::Tiles(tiles) => &mut tiles.lines,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Format, InstructionSet, Plan};
    use ravenpose_importer::{Activation, Network};
    use std::collections::BTreeSet;

    #[test]
    fn clones_read_the_same_weights_and_leave_one_another_alone() {
        let network = Network::dense(&[30, 90, 70, 3], Activation::Tanh, |place, inputs| (place % 17) as f32 / inputs as f32 - 0.1);
        for format in Format::ALL {
            let mut plan = Plan::with(&network, InstructionSet::best(), format);
            let mut clone = plan.clone();
            assert!(plan.memory().zip(clone.memory()).all(|(mine, its)| std::ptr::eq(mine, its)), "{format}");
            let answer = |plan: &mut Plan, value: f32| {
                let mut output = [0.0; 3];
                plan.run(&[value; 30], &mut output);
                output
            };
            let first = answer(&mut plan, 0.3);
            assert_ne!(answer(&mut clone, -0.7), first, "{format}");
            drop(plan);
            assert_eq!(answer(&mut clone, 0.3), first, "{format}");
        }
    }

    #[test]
    fn keeping_warm_reads_every_line_of_every_layer_once_a_round() {
        let network = Network::dense(&[30, 500, 70, 3], Activation::Tanh, |place, inputs| place as f32 / inputs as f32);
        let mut plan = Plan::with(&network, InstructionSet::best(), Format::I16);
        let mut read = 0;
        let mut places = BTreeSet::new();
        loop {
            let (layer, line) = plan.warm;
            plan.keep_warm();
            let end =
                if plan.warm.0 == layer && plan.warm.1 > line { plan.warm.1 } else { plan.layers[layer].weights.lines().len() };
            assert!(places.insert((layer, line)) && end > line && end - line <= super::WARM_LINES);
            read += end - line;
            if plan.warm == (0, 0) {
                break;
            }
        }
        assert_eq!(read * 64, plan.bytes());
    }
}
