//! The network alone: our plan beside tract's runner and beside the floor, which is reading the weights once.
//!
//! This module contains `unsafe`: a call of a function compiled for an instruction set that was found on this machine.

use crate::table::{Table, quantiles};
use ravenpose::network::{InstructionSet, Plan};
use ravenpose_importer::{Expected, Oracle};
use ravenpose_transport::now_ns;

const ROUNDS: usize = 5;
const WARM_UP: usize = 500;
const INPUTS: usize = 64;

/// Sums the weights: the least that any evaluation must read. Written like the kernel, with eight accumulators.
#[inline(never)]
fn stream(weights: &[f32]) -> f32 {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the instruction set was found on this machine.
        return unsafe { stream_avx512(weights) };
    }
    stream_any(weights)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn stream_avx512(weights: &[f32]) -> f32 {
    stream_any(weights)
}

#[expect(clippy::inline_always, reason = "compiled for the caller's instruction set")]
#[inline(always)]
fn stream_any(weights: &[f32]) -> f32 {
    let mut sums = [0.0_f32; 128];
    for chunk in weights.chunks_exact(128) {
        for (sum, weight) in sums.iter_mut().zip(chunk) {
            *sum += weight;
        }
    }
    sums.iter().sum()
}

/// Times each engine in turn, round by round, so that drift of the machine meets all alike.
pub(crate) fn run(bytes: &[u8], runs: usize) -> Result<Table, String> {
    let expected = Expected { inputs: 118, outputs: 3 };
    let network = ravenpose_importer::import(bytes, &expected).map_err(|error| error.to_string())?;
    let mut plan = Plan::new(&network);
    let mut narrow = Plan::with(&network, InstructionSet::Avx2);
    let mut oracle = Oracle::new(bytes, &expected).map_err(|error| error.to_string())?;
    let weights = vec![0.5_f32; plan.bytes() / 4];
    let inputs = inputs(&network);
    let names = [
        format!("floor: read {:.2} MB of weights once", plan.bytes() as f64 / 1e6),
        format!("ravenpose f32, {}", plan.instruction_set().name()),
        format!("ravenpose f32, {}", narrow.instruction_set().name()),
        "tract, kept state".to_owned(),
        "ravenpose f32, denormal inputs".to_owned(),
        "ravenpose f32, inputs that saturate every sigmoid".to_owned(),
    ];
    let denormal = vec![vec![1e-40_f32; 118]];
    let saturating: Vec<Vec<f32>> =
        (0..INPUTS).map(|row| (0..118).map(|i| if (row * 7 + i) % 3 == 0 { 1e4 } else { -1e4 }).collect()).collect();
    let mut medians = vec![Vec::new(); names.len()];
    let mut times = vec![Vec::new(); names.len()];
    let mut sink = 0.0_f32;
    for round in 0..ROUNDS {
        for turn in 0..names.len() {
            let engine = (turn + round) % names.len();
            let mut output = [0.0_f32; 3];
            let mut taken = Vec::with_capacity(runs);
            for count in 0..WARM_UP + runs {
                let set = match engine {
                    4 => &denormal,
                    5 => &saturating,
                    _ => &inputs,
                };
                let input = &set[count % set.len()];
                let start = now_ns();
                match engine {
                    0 => sink += stream(&weights),
                    1 | 4 | 5 => plan.run(input, &mut output),
                    2 => narrow.run(input, &mut output),
                    _ => sink += oracle.run(input).map_err(|error| error.to_string())?[0],
                }
                if count >= WARM_UP {
                    taken.push(now_ns() - start);
                }
                sink += output[0];
            }
            medians[engine].push(quantiles(&mut taken.clone())[0]);
            times[engine].append(&mut taken);
        }
    }
    std::hint::black_box(sink);
    let median = |values: &[f64]| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    let (floor, tract) = (median(&medians[0]), median(&medians[3]));
    let mut table =
        Table::new("Network 118-600-500-400-3, one thread, tight loop, us", &["p50", "p99", "p99.9", "max", "x floor", "x tract"]);
    for (index, name) in names.iter().enumerate() {
        let mut row = quantiles(&mut times[index]).to_vec();
        row[0] = median(&medians[index]);
        row.extend([row[0] / floor, row[0] / tract]);
        table.row(name, &row);
    }
    Ok(table)
}

/// Inputs spread over what the network normalises for.
fn inputs(network: &ravenpose_importer::Network) -> Vec<Vec<f32>> {
    (0..INPUTS)
        .map(|row| {
            (0..network.input_width)
                .map(|column| {
                    let z = ((row * 31 + column * 17) % 41) as f32 / 10.0 - 2.0;
                    network.input_scale.as_ref().map_or(z, |step| step.shift[column] + z / step.scale[column])
                })
                .collect()
        })
        .collect()
}
