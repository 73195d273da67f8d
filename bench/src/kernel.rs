//! The network alone: our plan in every format beside ONNX Runtime, tract and the floor of each format, which is reading its weights
//! once. Once a millisecond between sleeps, with everything out of the caches, and in a tight loop; and what is asked of it beside what
//! it reached.
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
/// Rounds between sleeps, and out of the caches: short ones, since the machine is in another mood every few seconds.
const SLOW_ROUNDS: usize = 9;
/// Read between two runs so that nothing is left in any cache, of an engine whose memory nobody knows as well: four times a third cache of
/// 32 MiB.
pub(crate) const EVICTED: usize = 128 << 20;
/// For so long before its input comes the service reads its weights again and again.
const KEPT_WARM_NS: i64 = 200_000;
/// Fewest times of which a thousandth is told.
const THOUSANDTHS: usize = 3_000;
/// What the names of the engines end with that are run so.
const WARM: &str = ", kept warm";
/// Titles of the tables that what is asked looks into.
const ONCE_A_MS: &str = "Network 118-600-500-400-3, one thread, once a millisecond, asleep between, us";
const EVICTED_TITLE: &str = "The same with everything out of the caches, us";
const TIGHT: &str = "The same in a tight loop, us";

/// Sums the bytes of the weights as words: the least that any evaluation must read. Eight accumulators, like the kernel.
#[inline(never)]
pub(crate) fn stream(weights: &[u8]) -> u64 {
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
    /// As the service runs it: its weights read while it waits for the input.
    KeptWarm(Box<Plan>),
    OnnxRuntime(Box<onnxruntime::Session>),
    /// Run again and again while it waits.
    OnnxRuntimeKeptWarm(Box<onnxruntime::Session>, Vec<f32>),
    OpenVino(Box<openvino::Session>),
    Tract(Box<Oracle>),
}

impl Engine {
    fn run(&mut self, input: &[f32]) -> f32 {
        match self {
            Self::Floor(plan) => plan.memory().map(stream).fold(0, u64::wrapping_add) as f32,
            Self::Plan(plan) | Self::KeptWarm(plan) => {
                let mut output = [0.0_f32; 3];
                plan.run(input, &mut output);
                output[0]
            }
            Self::OnnxRuntime(session) | Self::OnnxRuntimeKeptWarm(session, _) => session.run(input),
            Self::OpenVino(session) => session.run(input),
            Self::Tract(oracle) => oracle.run(input).map_or(f32::NAN, |output| output[0]),
        }
    }

    /// Sleeps until then; or keeps itself warm for the last part of it.
    fn await_input(&mut self, until_ns: i64) {
        let mut warm: Box<dyn FnMut() + '_> = match self {
            Self::KeptWarm(plan) => Box::new(|| {
                std::hint::black_box(plan.memory().map(stream).fold(0, u64::wrapping_add));
            }),
            Self::OnnxRuntimeKeptWarm(session, input) => Box::new(|| {
                std::hint::black_box(session.run(input));
            }),
            _ => return sleep_until_ns(until_ns),
        };
        sleep_until_ns(until_ns - KEPT_WARM_NS);
        while now_ns() < until_ns {
            warm();
        }
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
    fn round(&mut self, warm_up: usize, runs: usize, mut before: impl FnMut(&mut Engine)) -> f32 {
        let mut sink = 0.0;
        let mut taken = Vec::with_capacity(runs);
        for count in 0..warm_up + runs {
            before(&mut self.engine);
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
    let tight = table(TIGHT, &mut contenders);
    if tight_only {
        tables.push(tight);
        return Ok(tables);
    }

    let usual = contenders.len();
    contenders.extend(kept_warm(&network, &contenders));
    contenders.extend(runtime_kept_warm(bytes, &network)?);
    sink += in_turn(&mut contenders, SLOW_ROUNDS, |contender| {
        let mut next = now_ns();
        contender.round(20, runs / 24, |engine| {
            next = (next + 1_000_000).max(now_ns());
            engine.await_input(next);
        })
    });
    // What a robot sees comes first.
    tables.push(table(ONCE_A_MS, &mut contenders));

    contenders.truncate(usual);
    let other = vec![1_u8; EVICTED];
    sink += in_turn(&mut contenders, SLOW_ROUNDS, |contender| {
        contender.round(2, runs / 250, |_| {
            std::hint::black_box(stream(&other));
        })
    });
    tables.push(table(EVICTED_TITLE, &mut contenders));
    tables.push(tight);
    tables.insert(0, asked(&tables));
    std::hint::black_box(sink);
    Ok(tables)
}

/// The formats that the service may choose, as it runs them between two states.
fn kept_warm(network: &Network, contenders: &[Contender]) -> Vec<Contender> {
    let inputs = inputs(network);
    [Format::F32, Format::I16, Format::I12, Format::I8]
        .map(|format| {
            let plan = Plan::with(network, InstructionSet::best(), format).in_one_piece();
            let name = named(&plan);
            let floor = contenders.iter().find(|contender| contender.name == name).map_or(0, |contender| contender.floor);
            Contender::new(format!("{name}{WARM}"), Engine::KeptWarm(Box::new(plan)), floor, &inputs)
        })
        .into()
}

/// ONNX Runtime, if it is installed, that runs until its input comes.
fn runtime_kept_warm(bytes: &[u8], network: &Network) -> Result<Option<Contender>, String> {
    let Some(session) = runtime(bytes)? else { return Ok(None) };
    let inputs = inputs(network);
    let name = format!("{}{WARM}", name_of_runtime(&session));
    let engine = Engine::OnnxRuntimeKeptWarm(Box::new(session), inputs.first().cloned().unwrap_or_default());
    Ok(Some(Contender::new(name, engine, 0, &inputs)))
}

fn runtime(bytes: &[u8]) -> Result<Option<onnxruntime::Session>, String> {
    let library = wheel::library("onnxruntime/capi", "libonnxruntime.so.");
    library.map(|library| onnxruntime::Session::open(&library, bytes, "ravenstate", "position_error", [118, 3])).transpose()
}

fn name_of_runtime(session: &onnxruntime::Session) -> String {
    format!("ONNX Runtime {}, C, bound memory", session.version)
}

fn named(plan: &Plan) -> String {
    format!("  ravenpose {}, {}", plan.format(), plan.instruction_set().name())
}

/// What is asked of the network (issue 7), beside what these tables say; of the widest instruction set of this machine.
fn asked(tables: &[Table]) -> Table {
    let mut all = Table::new("What is asked of the network, and what this run reached", &["asked", "reached", "met"]);
    let deviation = |format: &str| tables[0].find(&format!("ravenpose {format}")).map_or(f64::NAN, |row| row[0]);
    let best = InstructionSet::best();
    for table in &tables[1..] {
        let titled = table.heading().rsplit(", ").next().unwrap_or_default().trim_start_matches("The same ");
        for (format, floor, runtime) in
            [(Format::F32, 1.08, 1.4), (Format::I16, 1.25, 3.0), (Format::I12, 1.25, 3.0), (Format::I8, 2.2, 5.5)]
        {
            let name = format!("  ravenpose {format}, {}", best.name());
            let ours = table.find(&name);
            let (Some(ours), peer) = (ours, table.find_starting("ONNX Runtime")) else { continue };
            all.row(&format!("{format}, {titled}: times its floor, at most"), &met(floor, ours[4], ours[4] <= floor));
            if let Some(peer) = peer {
                let faster = 1.0 / ours[5];
                all.row("    times as fast as ONNX Runtime, at least", &met(runtime, faster, faster >= runtime));
                for (name, at) in [("p99", 1), ("p99.9", 2)].into_iter().filter(|(_, at)| ours[*at].is_finite()) {
                    all.row(&format!("    {name}, us, at most ONNX Runtime's"), &met(peer[at], ours[at], ours[at] <= peer[at]));
                }
                let both = table.find(&format!("{name}{WARM}")).zip(table.find_with("ONNX Runtime", WARM));
                if let Some((warm, peer)) = both {
                    let faster = peer[0] / warm[0];
                    all.row("    times as fast, both kept warm", &met(runtime, faster, faster >= runtime));
                }
            }
        }
    }
    for (format, most) in [("i16", 10.0), ("i12", 10.0), ("i8", 25.0)] {
        let worst = deviation(format);
        all.row(&format!("{format}: worst deviation, um, at most"), &met(most, worst, worst <= most));
    }
    all
}

fn met(asked: f64, reached: f64, met: bool) -> [f64; 3] {
    [asked, reached, f64::from(u8::from(met))]
}

/// All of them round after round, each time another one first.
fn in_turn(contenders: &mut [Contender], rounds: usize, mut one: impl FnMut(&mut Contender) -> f32) -> f32 {
    let count = contenders.len();
    (0..rounds).flat_map(|round| (0..count).map(move |turn| (turn + round) % count)).map(|at| one(&mut contenders[at])).sum()
}

fn contenders(bytes: &[u8], model: &Path, network: &Network, expected: &Expected) -> Result<Vec<Contender>, String> {
    let usual = inputs(network);
    let mut all = Vec::new();
    // One floor for what is stored in as many bytes, to a fiftieth, in front of the first of them.
    let mut floors: Vec<(usize, usize)> = Vec::new();
    for format in [Format::F32, Format::F16, Format::Bf16, Format::I16, Format::I12, Format::I8] {
        let mut sets = vec![InstructionSet::best(), InstructionSet::Avx2.available()];
        sets.extend((format == Format::I16).then_some(InstructionSet::Portable));
        sets.dedup();
        for set in sets {
            let plan = Plan::with(network, set, format).in_one_piece();
            let bytes = plan.bytes();
            let floor = floors.iter().find(|(of, _)| 50 * of.abs_diff(bytes) < bytes).map_or(all.len(), |(_, floor)| *floor);
            if floor == all.len() {
                floors.push((bytes, floor));
                let title = format!("floor: read {:.2} MB once", bytes as f64 / 1e6);
                all.push(Contender::new(title, Engine::Floor(Box::new(plan.clone())), floor, &usual));
            }
            all.push(Contender::new(named(&plan), Engine::Plan(Box::new(plan)), floor, &usual));
        }
    }
    match runtime(bytes)? {
        Some(session) => {
            let name = name_of_runtime(&session);
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
    let plan = || Engine::Plan(Box::new(Plan::with(network, InstructionSet::best(), Format::F32).in_one_piece()));
    all.push(Contender::new("  ravenpose f32, denormal inputs".to_owned(), plan(), 0, &[vec![1e-40_f32; 118]]));
    let saturating: Vec<Vec<f32>> =
        (0..INPUTS).map(|row| (0..118).map(|i| if (row * 7 + i) % 3 == 0 { 1e4 } else { -1e4 }).collect()).collect();
    all.push(Contender::new("  ravenpose f32, saturated sigmoids".to_owned(), plan(), 0, &saturating));
    Ok(all)
}

/// Time of a format on the widest instruction set over that of tract, in the tight loop.
pub(crate) fn over_tract(tables: &[Table], format: Format) -> Option<f64> {
    let name = format!("  ravenpose {format}, {}", InstructionSet::best().name());
    tables.iter().find(|table| TIGHT.starts_with(table.heading()))?.find(&name)?.last().copied()
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
        if contender.times.len() < THOUSANDTHS {
            row[2] = f64::NAN;
        }
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
