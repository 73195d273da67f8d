//! Which weight format is exact enough for a network: measured against float64 when it is loaded, never in the loop.

use super::examples::{evaluate, random_input};
use super::{Format, InstructionSet, Plan, rounding};
use nalgebra::DMatrix;
use ravenpose_importer::{Network, Random};
use std::cell::OnceCell;
use std::fmt;
use thiserror::Error;

/// Random inputs beside the golden ones.
pub const RANDOM_INPUTS: usize = 256;
/// Formats that a free choice tries, smallest first: 12 bits only where they take less room than 16. Of those with 16 the one with the
/// least error.
const CANDIDATES: [Format; 4] = [Format::I8, Format::I12, Format::I16, Format::F32];

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
    let truths = evaluate(network, &inputs, |_, _| ());
    let candidates = asked.as_ref().map_or(&CANDIDATES[..], std::slice::from_ref);
    let set = InstructionSet::best();
    let (mut last, known) = (None, OnceCell::new());
    for &format in candidates.iter().filter(|format| asked.is_some() || **format != Format::I12 || set.packs_12_bits()) {
        // The same for each format that wants them.
        let spreads: &[_] = if format.is_rounded_together() { known.get_or_init(|| rounding::spreads(network)) } else { &[] };
        let mut plan = Plan::rounded(network, set, format, spreads);
        let deviation = measure(&mut plan, &inputs, &truths);
        // Written so that NaN fails.
        if deviation.worst <= limit || format == Format::F32 {
            return Ok(Choice { plan: plan.in_one_piece(), deviation });
        }
        last = Some(NotExactEnough { format, worst: deviation.worst, limit });
    }
    Err(last.unwrap_or(NotExactEnough { format: Format::F32, worst: f64::NAN, limit }))
}

fn measure(plan: &mut Plan, inputs: &[Vec<f32>], truths: &DMatrix<f64>) -> Deviation {
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0_usize);
    let mut output = vec![0.0_f32; plan.output_width()];
    for (input, truth) in inputs.iter().zip(truths.column_iter()) {
        plan.run(input, &mut output);
        for (found, truth) in output.iter().zip(truth.iter()) {
            let difference = (f64::from(*found) - truth).abs();
            // `max` would forget NaN.
            worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
            squares += difference * difference;
            count += 1;
        }
    }
    Deviation { worst, rms: (squares / count.max(1) as f64).sqrt(), inputs: inputs.len() }
}
