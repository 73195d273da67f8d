//! The network alone: our plan in every format beside ONNX Runtime, tract and the floor of each format, which is reading its weights
//! once. In a tight loop, once a millisecond between sleeps, and with the weights flushed from the cache.
//!
//! This module contains `unsafe`: calls of functions compiled for an instruction set that was found on this machine, and flushing lines.

use crate::table::{Table, quantiles};
use crate::{onnxruntime, openvino, wheel};
use ravenpose::network::{Format, InstructionSet, Plan, choose};
use ravenpose_importer::{Expected, Network, Oracle};
use ravenpose_transport::{now_ns, sleep_until_ns};
use std::path::Path;

const ROUNDS: usize = 5;
const WARM_UP: usize = 500;
const INPUTS: usize = 64;
/// What a first answer may be off, mm: formats differ, networks more.
const SAME_MM: f64 = 0.2;
/// Rounds between sleeps, and with flushed weights: short ones, since the machine is in another mood every few seconds.
const SLOW_ROUNDS: usize = 9;

/// Sums the bytes of the weights as words: the least that any evaluation must read. Eight accumulators, like the kernel.
#[inline(never)]
fn stream(weights: &[u8]) -> u64 {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the instruction set was found on this machine.
        return unsafe { stream_avx512(weights) };
    }
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: as above.
        return unsafe { stream_avx2(weights) };
    }
    let mut sums = [0_u64; 8];
    for line in weights.as_chunks::<64>().0 {
        for (sum, word) in sums.iter_mut().zip(line.as_chunks::<8>().0) {
            *sum = sum.wrapping_add(u64::from_le_bytes(*word));
        }
    }
    sums.iter().fold(0, |total, sum| total.wrapping_add(*sum))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn stream_avx512(weights: &[u8]) -> u64 {
    use std::arch::x86_64::{_mm512_add_epi64, _mm512_loadu_si512, _mm512_reduce_add_epi64, _mm512_setzero_si512};
    let mut sums = [_mm512_setzero_si512(); 8];
    for lines in weights.as_chunks::<512>().0 {
        for (sum, line) in sums.iter_mut().zip(lines.as_chunks::<64>().0) {
            // SAFETY: a line is 64 bytes.
            *sum = _mm512_add_epi64(*sum, unsafe { _mm512_loadu_si512(line.as_ptr().cast()) });
        }
    }
    sums.into_iter().fold(0, |total, sum| total.wrapping_add(_mm512_reduce_add_epi64(sum).cast_unsigned()))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn stream_avx2(weights: &[u8]) -> u64 {
    use std::arch::x86_64::{_mm256_add_epi64, _mm256_loadu_si256, _mm256_setzero_si256, _mm256_storeu_si256};
    let mut sums = [_mm256_setzero_si256(); 8];
    for lines in weights.as_chunks::<256>().0 {
        for (sum, half) in sums.iter_mut().zip(lines.as_chunks::<32>().0) {
            // SAFETY: half a line is 32 bytes.
            *sum = _mm256_add_epi64(*sum, unsafe { _mm256_loadu_si256(half.as_ptr().cast()) });
        }
    }
    let total = sums.into_iter().reduce(|a, b| _mm256_add_epi64(a, b)).unwrap_or(_mm256_setzero_si256());
    let mut words = [0_u64; 4];
    // SAFETY: four words are 32 bytes.
    unsafe { _mm256_storeu_si256(words.as_mut_ptr().cast(), total) };
    words.into_iter().fold(0, u64::wrapping_add)
}

/// Something that takes time.
enum Engine {
    Floor(Box<Plan>),
    Plan(Box<Plan>),
    OnnxRuntime(Box<onnxruntime::Session>),
    OpenVino(Box<openvino::Session>),
    Tract(Box<Oracle>),
}

impl Engine {
    fn run(&mut self, input: &[f32]) -> f32 {
        match self {
            Self::Floor(plan) => plan.memory().map(stream).fold(0, u64::wrapping_add) as f32,
            Self::Plan(plan) => {
                let mut output = [0.0_f32; 3];
                plan.run(input, &mut output);
                output[0]
            }
            Self::OnnxRuntime(session) => session.run(input),
            Self::OpenVino(session) => session.run(input),
            Self::Tract(oracle) => oracle.run(input).map_or(f32::NAN, |output| output[0]),
        }
    }

    /// Flushes the weights from every cache; false where they cannot be reached, or not flushed.
    fn flush(&self) -> bool {
        match self {
            Self::Floor(plan) | Self::Plan(plan) => plan.memory().for_each(|bytes| flush(bytes.as_ptr(), bytes.len())),
            Self::OnnxRuntime(_) | Self::OpenVino(_) | Self::Tract(_) => return false,
        }
        cfg!(any(target_arch = "x86_64", target_arch = "aarch64"))
    }
}

/// Puts memory out of every cache; on processors that are neither x86-64 nor 64-bit Arm nothing happens.
pub(crate) fn flush(from: *const u8, length: usize) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..length).step_by(64) {
        // SAFETY: an address inside memory that the caller borrows; flushing changes no value.
        unsafe { std::arch::x86_64::_mm_clflush(from.add(offset)) };
    }
    #[cfg(target_arch = "aarch64")]
    {
        for offset in (0..length).step_by(64) {
            // SAFETY: as above; Linux lets programs clean and invalidate lines.
            unsafe { std::arch::asm!("dc civac, {}", in(reg) from.add(offset), options(nostack, preserves_flags)) };
        }
        // SAFETY: waits until that is done.
        unsafe { std::arch::asm!("dsb ish", options(nostack, preserves_flags)) };
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _ = (from, length);
}

/// An engine with its times.
struct Contender {
    name: String,
    engine: Engine,
    /// The floor that it is held against: its place among the contenders.
    floor: usize,
    inputs: Vec<Vec<f32>>,
    medians: Vec<f64>,
    times: Vec<i64>,
}

impl Contender {
    fn new(name: String, engine: Engine, floor: usize, inputs: &[Vec<f32>]) -> Self {
        Self { name, engine, floor, inputs: inputs.to_vec(), medians: Vec::new(), times: Vec::new() }
    }

    /// One round: `warm_up` runs that do not count, then `runs` that do, with `before` in front of each.
    fn round(&mut self, warm_up: usize, runs: usize, mut before: impl FnMut(&Engine)) -> f32 {
        let mut sink = 0.0;
        let mut taken = Vec::with_capacity(runs);
        for count in 0..warm_up + runs {
            before(&self.engine);
            let input = &self.inputs[count % self.inputs.len()];
            let start = now_ns();
            sink += self.engine.run(input);
            if count >= warm_up {
                taken.push(now_ns() - start);
            }
        }
        self.medians.push(quantiles(&mut taken)[0]);
        self.times.append(&mut taken);
        sink
    }

    fn median(&self) -> f64 {
        let mut sorted = self.medians.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }
}

/// Times every engine in turn, round by round, so that drift of the machine meets all alike; in the tight loop, and unless that is all
/// that is wanted between sleeps and with flushed weights. `model` is the file that holds `bytes`.
pub(crate) fn run(bytes: &[u8], model: &Path, runs: usize, tight_only: bool) -> Result<Vec<Table>, String> {
    let expected = Expected { inputs: 118, outputs: 3 };
    let network = ravenpose_importer::import(bytes, &expected).map_err(|error| error.to_string())?;
    let mut contenders = contenders(bytes, model, &network, &expected)?;
    for contender in contenders.iter_mut().filter(|contender| !matches!(contender.engine, Engine::Floor(_))) {
        let (found, truth) = (contender.engine.run(&contender.inputs[0]), network.evaluate_f64(&contender.inputs[0])[0]);
        if (f64::from(found) - truth).abs() > SAME_MM.max(0.05 * truth.abs()) || found.is_nan() {
            return Err(format!("{}: answers {found}, wanted {truth}: not the same network", contender.name.trim()));
        }
    }
    let mut sink = 0.0_f32;
    let mut tables = vec![deviations(&network)];

    sink += in_turn(&mut contenders, ROUNDS, |contender| contender.round(WARM_UP, runs, |_| ()));
    tables.push(table("Network 118-600-500-400-3, one thread, tight loop, us", &mut contenders));
    if tight_only {
        return Ok(tables);
    }

    sink += in_turn(&mut contenders, SLOW_ROUNDS, |contender| {
        let mut next = now_ns();
        contender.round(20, runs / 24, |_| {
            next = (next + 1_000_000).max(now_ns());
            sleep_until_ns(next);
        })
    });
    tables.push(table("The same once a millisecond, asleep between", &mut contenders));

    contenders.retain(|contender| contender.engine.flush());
    sink += in_turn(&mut contenders, SLOW_ROUNDS, |contender| {
        contender.round(5, runs / 120, |engine| {
            engine.flush();
        })
    });
    tables.push(table("The same with the weights flushed from every cache", &mut contenders));
    std::hint::black_box(sink);
    Ok(tables)
}

/// All of them round after round, each time another one first.
fn in_turn(contenders: &mut [Contender], rounds: usize, mut one: impl FnMut(&mut Contender) -> f32) -> f32 {
    let count = contenders.len();
    (0..rounds).flat_map(|round| (0..count).map(move |turn| (turn + round) % count)).map(|at| one(&mut contenders[at])).sum()
}

fn contenders(bytes: &[u8], model: &Path, network: &Network, expected: &Expected) -> Result<Vec<Contender>, String> {
    let usual = inputs(network);
    let mut all = Vec::new();
    let name = |plan: &Plan| format!("  ravenpose {}, {}", plan.format(), plan.instruction_set().name());
    // One floor for what is stored in as many bytes, to a fiftieth, in front of the first of them.
    let mut floors: Vec<(usize, usize)> = Vec::new();
    for format in [Format::F32, Format::F16, Format::I16, Format::I12, Format::I8] {
        let mut sets = vec![InstructionSet::best(), InstructionSet::Avx2.available()];
        sets.extend((format == Format::I16).then_some(InstructionSet::Portable));
        sets.dedup();
        for set in sets {
            let plan = Plan::with(network, set, format);
            let bytes = plan.bytes();
            let floor = floors.iter().find(|(of, _)| 50 * of.abs_diff(bytes) < bytes).map_or(all.len(), |(_, floor)| *floor);
            if floor == all.len() {
                floors.push((bytes, floor));
                let title = format!("floor: read {:.2} MB once", bytes as f64 / 1e6);
                all.push(Contender::new(title, Engine::Floor(Box::new(plan.clone())), floor, &usual));
            }
            all.push(Contender::new(name(&plan), Engine::Plan(Box::new(plan)), floor, &usual));
        }
    }
    match wheel::library("onnxruntime/capi", "libonnxruntime.so.") {
        Some(library) => {
            let session = onnxruntime::Session::open(&library, bytes, "ravenstate", "position_error", [118, 3])?;
            let name = format!("ONNX Runtime {}, C, bound memory", session.version);
            all.push(Contender::new(name, Engine::OnnxRuntime(Box::new(session)), 0, &usual));
        }
        None => println!("note: no ONNX Runtime to compare with; `make venv` installs it"),
    }
    // A large download: `make bench-peers` has it.
    if let Some(library) = wheel::library("openvino/libs", "libopenvino_c.so") {
        let session = openvino::Session::open(&library, model, [118, 3])?;
        let name = format!("OpenVINO {}, C, f32", session.version);
        all.push(Contender::new(name, Engine::OpenVino(Box::new(session)), 0, &usual));
    }
    let oracle = Oracle::new(bytes, expected).map_err(|error| error.to_string())?;
    all.push(Contender::new("tract, kept state".to_owned(), Engine::Tract(Box::new(oracle)), 0, &usual));
    let plan = || Engine::Plan(Box::new(Plan::with(network, InstructionSet::best(), Format::F32)));
    all.push(Contender::new("  ravenpose f32, denormal inputs".to_owned(), plan(), 0, &[vec![1e-40_f32; 118]]));
    let saturating: Vec<Vec<f32>> =
        (0..INPUTS).map(|row| (0..118).map(|i| if (row * 7 + i) % 3 == 0 { 1e4 } else { -1e4 }).collect()).collect();
    all.push(Contender::new("  ravenpose f32, saturated sigmoids".to_owned(), plan(), 0, &saturating));
    Ok(all)
}

/// Time of float32 on the widest instruction set over that of tract, in the tight loop.
pub(crate) fn ratio_to_tract(tables: &[Table]) -> Option<f64> {
    let name = format!("  ravenpose f32, {}", InstructionSet::best().name());
    tables.iter().find_map(|table| table.find(&name))?.last().copied()
}

/// Rows of the contenders, whose times are taken away.
fn table(title: &str, contenders: &mut [Contender]) -> Table {
    let mut table = Table::new(title, &["p50", "p99", "p99.9", "max", "x floor", "/ ORT", "/ tract"]);
    let median_of = |word: &str| contenders.iter().find(|c| c.name.starts_with(word)).map_or(f64::NAN, Contender::median);
    let (runtime, tract) = (median_of("ONNX Runtime"), median_of("tract"));
    let floors: Vec<f64> =
        contenders.iter().map(|contender| contenders.get(contender.floor).map_or(f64::NAN, Contender::median)).collect();
    for (contender, floor) in contenders.iter_mut().zip(floors) {
        let mut row = quantiles(&mut contender.times).to_vec();
        row[0] = contender.median();
        row.extend([row[0] / floor, row[0] / runtime, row[0] / tract]);
        table.row(&contender.name, &row);
        contender.times.clear();
        contender.medians.clear();
    }
    table
}

/// How far each format is off, in µm, as the service measures it at start.
fn deviations(network: &Network) -> Table {
    let mut table = Table::new("Deviation from float64 on 256 random inputs, um", &["worst", "rms", "MB"]);
    for format in Format::ALL {
        if let Ok(choice) = choose(network, &[], f64::INFINITY, Some(format)) {
            let um = |mm: f64| mm * 1000.0;
            let row = [um(choice.deviation.worst), um(choice.deviation.rms), choice.plan.bytes() as f64 / 1e6];
            table.row(&format!("ravenpose {format}"), &row);
        }
    }
    table
}

/// Inputs spread over what the network normalises for.
fn inputs(network: &Network) -> Vec<Vec<f32>> {
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
