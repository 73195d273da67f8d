//! `make bench-ci` and `make bench`: the network, and the whole path, side by side in one run.
//!
//! These machines are shared and noisy: compare by ratio, within one run.

mod growth;
mod kernel;
mod memory;
mod neighbours;
mod onnxruntime;
mod openvino;
mod page;
mod path;
mod soak;
mod stages;
mod svg;
mod table;
mod wheel;

use ravenpose::network::{Format, InstructionSet};
use ravenpose::{check, realtime};
use ravenpose_transport::Settings;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;
use table::Table;

/// Core of this process, which plays the robot; the service and the kernel benchmark take the last core.
const ROBOT_CORE: usize = 0;
const ROBOT_PRIORITY: i32 = 90;
const SERVICE_PRIORITY: i32 = 80;
/// What the first version must reach (issue 2): state handed over to pose handed over, 99.9 %.
const INPUT_TO_OUTPUT_US: f64 = 150.0;
const BASELINE: &str = "this machine: wake-up of a FIFO thread, 10 s";

/// Most of tract's time in the same process, in the tight loop, that a run may take: what the instruction sets reach (docs/performance.md) and
/// a quarter or more, since such machines are shared. With VNNI, with AVX2, and of float32 with any.
const OF_TRACT_VNNI: [(Format, f64); 4] = [OF_TRACT_ANY[0], (Format::I16, 0.45), (Format::I12, 0.33), (Format::I8, 0.2)];
const OF_TRACT_AVX2: [(Format, f64); 4] = [OF_TRACT_ANY[0], (Format::I16, 0.55), (Format::I12, 0.52), (Format::I8, 0.4)];
const OF_TRACT_ANY: [(Format, f64); 1] = [(Format::F32, 0.85)];

/// What is measured.
#[derive(Default)]
struct Parts {
    kernel: bool,
    /// Of the kernel only the tight loop.
    tight_only: bool,
    growth: bool,
    memory: bool,
    stages: bool,
    means: bool,
    arms: bool,
    waits: Vec<&'static str>,
}

impl Parts {
    /// All of `ci` or `full`, or what `RAVENPOSE_BENCH_ONLY` names: `tight` or `kernel` for the network alone; `memory` for what caches and pages bring; `stages` for a cycle's
    /// parts; `sleep`, `spin` or `event` for one way of waiting; `means` for what makes the default one fast; `arms` for what arms and models cost.
    fn wanted(full: bool, only: Option<&str>) -> Result<Self, String> {
        const WAITS: [&str; 3] = ["sleep", "spin", "event"];
        Ok(match only {
            None => Self {
                kernel: true,
                growth: true,
                memory: full,
                stages: true,
                means: full,
                arms: full,
                waits: WAITS.to_vec(),
                ..Self::default()
            },
            Some("tight") => Self { kernel: true, tight_only: true, ..Self::default() },
            Some("kernel") => Self { kernel: true, ..Self::default() },
            Some("memory") => Self { memory: true, ..Self::default() },
            Some("stages") => Self { stages: true, ..Self::default() },
            Some("means") => Self { means: true, ..Self::default() },
            Some("arms") => Self { arms: true, ..Self::default() },
            Some(other) => match WAITS.into_iter().find(|wait| *wait == other) {
                Some(wait) => Self { waits: vec![wait], ..Self::default() },
                None => {
                    return Err(format!(
                        "RAVENPOSE_BENCH_ONLY={other} must be tight, kernel, memory, stages, means, arms, sleep, spin or event"
                    ));
                }
            },
        })
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (full, write) = match arguments[..] {
        ["ci"] => (false, false),
        ["full"] => (true, false),
        ["full", "--write"] => (true, true),
        ["soak"] => return ended(soak("30")),
        ["soak", minutes] => return ended(soak(minutes)),
        ["neighbours"] => return ended(neighbours("3", None)),
        ["neighbours", minutes] => return ended(neighbours(minutes, None)),
        ["neighbours", minutes, only] => return ended(neighbours(minutes, Some(only))),
        // What this program asks of itself.
        ["client", ends, prefix, root] => {
            let settings = Settings { prefix: prefix.to_owned(), root: root.to_owned() };
            return ended(neighbours::be_a_client(ends == "holds", &settings));
        }
        // On the core where it then is.
        ["asleep"] => return ended(memory::asleep(false).map(|found| println!("{found}"))),
        ["asleep", memory::SMALL_PAGES] => return ended(memory::asleep(true).map(|found| println!("{found}"))),
        _ => {
            eprintln!(
                "usage: ravenpose-bench ci|full [--write]|soak [MINUTES]|neighbours [MINUTES [idle|clients|service]] (from the repository's top)"
            );
            return ExitCode::from(2);
        }
    };
    let only = std::env::var("RAVENPOSE_BENCH_ONLY").ok();
    if write && only.is_some() {
        return ended(Err("--write replaces the whole page; leave RAVENPOSE_BENCH_ONLY unset".to_owned()));
    }
    ended(Parts::wanted(full, only.as_deref()).and_then(|parts| measure(&parts, full, write)))
}

fn ended(done: Result<(), String>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("ravenpose-bench: {message}");
            ExitCode::FAILURE
        }
    }
}

fn minutes_of(text: &str) -> Result<u64, String> {
    let wanted = text.parse().ok().filter(|minutes| (1..=24 * 60).contains(minutes));
    wanted.ok_or_else(|| format!("{text}: must be minutes from 1 to 1440"))
}

/// What processes that are killed, or never read, cost the others.
fn neighbours(minutes: &str, only: Option<&str>) -> Result<(), String> {
    let minutes = minutes_of(minutes)?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    println!("{}; robot on core {ROBOT_CORE}, service and neighbours on core {}", page::machine(cores), cores - 1);
    neighbours::run(minutes, only, become_the_robot, cores - 1)
}

/// The service for long, under load, with clients that never read, and faults.
fn soak(minutes: &str) -> Result<(), String> {
    let wanted = minutes_of(minutes)?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    println!("{}; robot and load on core {ROBOT_CORE}, service on core {}", page::machine(cores), cores - 1);
    // Before this thread gets a core and a priority, which its threads would have as well.
    let load = soak::Load::new(ROBOT_CORE)?;
    become_the_robot();
    let table = soak::run(wanted, load, cores - 1, SERVICE_PRIORITY)?;
    println!("\n{table}");
    Ok(())
}

/// Memory, core and priority of a control process, as far as the machine gives them.
fn become_the_robot() {
    let missing = [realtime::lock_memory(), realtime::pin(ROBOT_CORE), realtime::set_fifo(ROBOT_PRIORITY)];
    for missing in missing.into_iter().filter_map(Result::err) {
        println!("note: {missing}");
    }
}

/// Services side by side: core, rounds, seconds of each.
type Compared = fn(usize, usize, u64) -> Result<Table, String>;

fn measure(parts: &Parts, full: bool, write: bool) -> Result<(), String> {
    let (runs, seconds) = if full { (10_000, 40) } else { (3_000, 20) };
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let service_core = cores - 1;
    // Before this thread is pinned: it then knows of one core.
    let machine = page::machine(cores);
    println!("{machine}; robot on core {ROBOT_CORE}, service on core {service_core}; every figure in us\n");
    let mut tables = Vec::new();
    if parts.kernel {
        tables = network(parts, service_core, runs)?;
    }
    if parts.memory {
        let table = on_core(service_core, || memory::run(service_core))?;
        println!("{table}");
        tables.push(table);
    }
    if parts.stages {
        let table = on_core(service_core, stages::run)?;
        println!("{table}");
        tables.push(table);
    }
    if parts.means || parts.arms || !parts.waits.is_empty() {
        become_the_robot();
    }
    for (_, compared) in
        [(parts.means, path::means as Compared), (parts.arms, path::arms)].into_iter().filter(|(wanted, _)| *wanted)
    {
        let table = compared(service_core, 3, seconds / 4)?;
        println!("{table}");
        tables.push(table);
    }
    if !parts.waits.is_empty() {
        let table = through_shared_memory(&parts.waits, service_core, seconds)?;
        println!("{table}");
        let found = |name: &str| table.find(name).map_or(f64::NAN, |row| row[2]);
        let (reached, woken) = (found("    input_to_output"), found(BASELINE));
        println!(
            "input to output, {}: p99.9 {reached:.1} us (wanted below {INPUT_TO_OUTPUT_US} us on a quiet machine), {:.1} x the machine's own wake-up p99.9",
            parts.waits[0],
            reached / woken
        );
        let asked = path::asked(&table, &parts.waits);
        println!("{asked}");
        tables.extend([table, asked]);
    }
    if write { page::write(&tables, &machine) } else { Ok(()) }
}

/// The network beside its peers, and its growth; an error if it is not fast enough beside tract.
fn network(parts: &Parts, core: usize, runs: usize) -> Result<Vec<Table>, String> {
    let model = "models/untrained.onnx";
    let bytes = std::fs::read(model).map_err(|cause| format!("{model}: {cause}; run from the repository's top"))?;
    let tables = on_core(core, || {
        let mut tables = kernel::run(&bytes, Path::new(model), runs, parts.tight_only)?;
        if parts.growth {
            tables.extend(growth::run());
        }
        Ok(tables)
    })?;
    for table in &tables {
        println!("{table}");
    }
    let gated = match InstructionSet::best() {
        // Without vector instructions whole numbers are no faster.
        InstructionSet::Portable => &OF_TRACT_ANY[..],
        InstructionSet::Avx512Vnni => &OF_TRACT_VNNI[..],
        _ => &OF_TRACT_AVX2[..],
    };
    for (format, most) in gated {
        let found = kernel::over_tract(&tables, *format).ok_or("the network was not measured beside tract")?;
        if found > *most {
            return Err(format!("{format} takes {found:.2} times tract's time in the same process, more than {most}"));
        }
    }
    Ok(tables)
}

/// In a thread on this core; without FIFO: one that computes without a pause would meet real-time throttling.
fn on_core<T: Send>(core: usize, work: impl FnOnce() -> Result<T, String> + Send) -> Result<T, String> {
    let pinned = || {
        let _ = realtime::pin(core);
        work()
    };
    std::thread::scope(|scope| scope.spawn(pinned).join().map_err(|_| "a part of the benchmark failed".to_owned())?)
}

/// A wake-up baseline of the same minute, then each way of waiting.
fn through_shared_memory(waits: &[&str], service_core: usize, seconds: u64) -> Result<Table, String> {
    let mut table =
        Table::new(&format!("1 kHz for {seconds} s through shared memory, one arm"), &["p50", "p99", "p99.9", "max", "missed"]);
    let wakeup =
        check::measure_wakeup(Duration::from_secs(10), Some(service_core), SERVICE_PRIORITY).map_err(|error| error.to_string())?;
    let us = |ns: u64| ns as f64 / 1000.0;
    table.row(BASELINE, &[us(wakeup.p50_ns), us(wakeup.p99_ns), us(wakeup.p999_ns), us(wakeup.max_ns), f64::NAN]);
    let mut row = path::hop(service_core, SERVICE_PRIORITY)?.to_vec();
    row.push(f64::NAN);
    table.row(path::HOP, &row);
    if waits.contains(&"event") {
        let mut row = path::woken_hop(service_core, SERVICE_PRIORITY)?.to_vec();
        row.push(f64::NAN);
        table.row(path::WOKEN_HOP, &row);
    }
    for wait in waits {
        path::run(&mut table, wait, service_core, seconds)?;
    }
    Ok(table)
}
