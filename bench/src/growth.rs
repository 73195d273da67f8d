//! How the time grows: with the size of the network, and with the number of networks that share a core.

use crate::kernel::stream;
use crate::table::{Table, quantiles};
use ravenpose::network::{Format, InstructionSet, Plan};
use ravenpose_importer::{Activation, Network, Random};
use ravenpose_transport::now_ns;

/// Widths of the three hidden layers.
const WIDTHS: [usize; 6] = [32, 100, 250, 550, 1200, 2200];
/// Networks that take turns.
const STREAMS: [usize; 3] = [1, 2, 8];
const ROUNDS: usize = 3;

/// 118 inputs, three hidden layers of this width, 3 outputs, random weights.
fn network(width: usize) -> Network {
    let mut random = Random::new(1);
    Network::dense(&[118, width, width, width, 3], Activation::Sigmoid, |_, inputs| {
        (random.uniform() as f32 - 0.5) * (6.0 / inputs as f32).sqrt()
    })
}

/// Median time of one turn of all plans, µs, and beside it that of reading all of their weights once: bytes over the bandwidth from where
/// they lie. The smallest of some rounds each, in turn.
fn time(plans: &mut [Plan]) -> (f64, f64) {
    let bytes: usize = plans.iter().map(Plan::bytes).sum();
    let runs = (400_000_000 / bytes.max(1)).clamp(20, 4000);
    let input = [0.3_f32; 118];
    let mut output = [0.0_f32; 3];
    let (mut best, mut floor) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        best = best.min(median(runs, || plans.iter_mut().for_each(|plan| plan.run(&input, &mut output))));
        let read = || {
            std::hint::black_box(plans.iter().flat_map(Plan::memory).map(stream).fold(0, u64::wrapping_add));
        };
        floor = floor.min(median(runs, read));
    }
    std::hint::black_box(output);
    (best, floor)
}

/// µs of one turn.
fn median(runs: usize, mut turn: impl FnMut()) -> f64 {
    let mut taken: Vec<i64> = (0..runs)
        .map(|_| {
            let start = now_ns();
            turn();
            now_ns() - start
        })
        .collect();
    quantiles(&mut taken)[0]
}

/// Both tables.
pub(crate) fn run() -> Vec<Table> {
    let plan = |network: &Network, format| Plan::with(network, InstructionSet::best(), format).in_one_piece();
    let mut sizes = Table::new(
        "Growth with the network: 118-w-w-w-3, median us",
        &["weights k", "i16 MB", "i16", "floor", "x floor", "f32", "floor", "x floor", "GB/s"],
    );
    for width in WIDTHS {
        let network = network(width);
        let weights: usize = network.layers.iter().map(|layer| layer.weights.len()).sum();
        let mut row = vec![weights as f64 / 1e3];
        for format in [Format::I16, Format::F32] {
            let mut plans = [plan(&network, format)];
            let (bytes, (time_us, floor_us)) = (plans[0].bytes() as f64, time(&mut plans));
            if format == Format::I16 {
                row.push(bytes / 1e6);
            }
            row.extend([time_us, floor_us, time_us / floor_us]);
            if format == Format::F32 {
                row.push(bytes / time_us / 1e3);
            }
        }
        sizes.row(&format!("w = {width}"), &row);
    }
    let mut streams = Table::new(
        "Growth with the arms on one core: 118-550-550-550-3, median us for all",
        &["i16 MB", "i16", "per arm", "floor", "x floor"],
    );
    let network = network(550);
    for count in STREAMS {
        let mut plans: Vec<Plan> = (0..count).map(|_| plan(&network, Format::I16)).collect();
        let bytes: usize = plans.iter().map(Plan::bytes).sum();
        let (time_us, floor_us) = time(&mut plans);
        let row = [bytes as f64 / 1e6, time_us, time_us / count as f64, floor_us, time_us / floor_us];
        streams.row(&format!("{count} networks in turn"), &row);
    }
    vec![sizes, streams]
}
