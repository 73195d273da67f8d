//! Which weight format is exact enough for a network: measured against float64 when it is loaded, never in the loop.

use super::{Format, InstructionSet, Plan};
use ravenpose_importer::{Dense, Network, Random};
use std::fmt;
use thiserror::Error;

/// Random inputs beside the golden ones.
pub const RANDOM_INPUTS: usize = 256;
/// Formats that a free choice tries, smallest first. Of those with 16 bits the one with the least error.
const CANDIDATES: [Format; 3] = [Format::I8, Format::I16, Format::F32];

/// How far a plan's outputs are from float64's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Largest difference of any output, in the network's unit.
    pub worst: f64,
    /// Root mean square over inputs and outputs, in the network's unit.
    pub rms: f64,
    /// Inputs on which it was measured.
    pub inputs: usize,
}

/// A plan, and how far it is off.
pub struct Choice {
    /// Ready to run.
    pub plan: Plan,
    /// Measured on the golden and on random inputs.
    pub deviation: Deviation,
}

/// The format that was asked for deviates too far.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("weights of format {format} deviate by up to {worst:.4} from float64, more than the {limit} allowed")]
pub struct NotExactEnough {
    /// The format.
    pub format: Format,
    /// Largest deviation, in the network's unit.
    pub worst: f64,
    /// Largest one allowed, in the same unit.
    pub limit: f64,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Compiles `network` for this machine in the smallest format whose worst deviation from a float64 evaluation is at most `limit` (in
/// the unit of the outputs), or in the format `asked` for.
///
/// Measured on `golden` and on [`RANDOM_INPUTS`] normal inputs, spread as the network's own input scaling says.
///
/// # Errors
/// [`NotExactEnough`] if the format asked for deviates by more. Float32 is always allowed: it is the network as it came.
pub fn choose(network: &Network, golden: &[Vec<f32>], limit: f64, asked: Option<Format>) -> Result<Choice, NotExactEnough> {
    let mut random = Random::new(0x0005_EED0_F0DD);
    let mut inputs: Vec<Vec<f32>> = golden.to_vec();
    inputs.extend((0..RANDOM_INPUTS).map(|_| random_input(network, &mut random)));
    let truths: Vec<Vec<f64>> = inputs.iter().map(|input| network.evaluate_f64(input)).collect();
    let candidates = asked.as_ref().map_or(&CANDIDATES[..], std::slice::from_ref);
    let mut last = None;
    for &format in candidates {
        let mut plan = Plan::with(network, InstructionSet::best(), format);
        let deviation = measure(&mut plan, &inputs, &truths);
        // Written so that NaN fails.
        if deviation.worst <= limit || format == Format::F32 {
            return Ok(Choice { plan, deviation });
        }
        last = Some(NotExactEnough { format, worst: deviation.worst, limit });
    }
    Err(last.unwrap_or(NotExactEnough { format: Format::F32, worst: f64::NAN, limit }))
}

/// What goes into each layer that is `wanted`, layer by layer, over as many random inputs as are asked for: others than those that
/// deviations are measured on.
pub(super) fn examples(network: &Network, count: usize, wanted: impl Fn((usize, &Dense)) -> bool) -> Vec<Vec<Vec<f64>>> {
    let mut random = Random::new(0x00CA_11B0);
    let mut examples: Vec<Vec<Vec<f64>>> = network.layers.iter().map(|_| Vec::new()).collect();
    for _ in 0..count {
        let trace = network.trace_f64(&random_input(network, &mut random));
        for ((layer, examples), x) in network.layers.iter().enumerate().zip(&mut examples).zip(trace) {
            if wanted(layer) {
                examples.push(x);
            }
        }
    }
    examples
}

fn measure(plan: &mut Plan, inputs: &[Vec<f32>], truths: &[Vec<f64>]) -> Deviation {
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0_usize);
    let mut output = vec![0.0_f32; plan.output_width()];
    for (input, truth) in inputs.iter().zip(truths) {
        plan.run(input, &mut output);
        for (found, truth) in output.iter().zip(truth) {
            let difference = (f64::from(*found) - truth).abs();
            // `max` would forget NaN.
            worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
            squares += difference * difference;
            count += 1;
        }
    }
    Deviation { worst, rms: (squares / count.max(1) as f64).sqrt(), inputs: inputs.len() }
}

/// Normal, by Box and Muller.
fn normal(random: &mut Random) -> f64 {
    (-2.0 * random.uniform().max(1e-300).ln()).sqrt() * (std::f64::consts::TAU * random.uniform()).cos()
}

fn random_input(network: &Network, random: &mut Random) -> Vec<f32> {
    (0..network.input_width).map(|index| network.raw_input(index, normal(random))).collect()
}
