//! `make bench-ci` and `make bench`: the network, and the whole path, side by side in one run.
//!
//! These machines are shared and noisy: compare by ratio, within one run.

mod growth;
mod kernel;
mod onnxruntime;
mod page;
mod path;
mod table;

use ravenpose::{check, realtime};
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

/// The kernel has to stay faster than tract's runner in the same process by at least this much; it takes about half the time.
const RATIO_TO_TRACT_MAX: f64 = 0.9;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (runs, seconds, write) = match arguments[..] {
        ["ci"] => (4_000, 50, false),
        ["full"] => (10_000, 60, false),
        ["full", "--write"] => (10_000, 60, true),
        _ => {
            eprintln!("usage: ravenpose-bench ci|full [--write] (from the repository's top)");
            return ExitCode::from(2);
        }
    };
    match measure(runs, seconds, write) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("ravenpose-bench: {message}");
            ExitCode::FAILURE
        }
    }
}

fn measure(runs: usize, seconds: u64, write: bool) -> Result<(), String> {
    let model = "models/untrained.onnx";
    let bytes = std::fs::read(model).map_err(|cause| format!("{model}: {cause}; run from the repository's top"))?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let service_core = cores - 1;
    // RAVENPOSE_BENCH_ONLY=tight or =kernel measures the network alone, =sleep, =spin or =event one way of waiting.
    let only = std::env::var("RAVENPOSE_BENCH_ONLY").ok();
    println!("{}; robot on core {ROBOT_CORE}, service on core {service_core}; every figure in us\n", page::machine());

    // Without FIFO here: a thread that computes without a pause would meet real-time throttling.
    let mut tables = std::thread::scope(|scope| {
        scope
            .spawn(|| {
                let _ = realtime::pin(service_core);
                let mut tables = kernel::run(&bytes, runs, only.as_deref() == Some("tight"))?;
                if only.is_none() {
                    tables.extend(growth::run());
                }
                Ok::<_, String>(tables)
            })
            .join()
            .map_err(|_| "the kernel benchmark failed".to_owned())?
    })?;
    for table in &tables {
        println!("{table}");
    }
    let gate = kernel::ratio_to_tract(&tables).ok_or("the network was not measured beside tract")?;
    if gate > RATIO_TO_TRACT_MAX {
        return Err(format!("float32 takes {gate:.2} times tract's time in the same process, more than {RATIO_TO_TRACT_MAX}"));
    }
    if only.as_deref().is_some_and(|only| ["tight", "kernel"].contains(&only)) {
        return Ok(());
    }

    let table = through_shared_memory(service_core, seconds, only.as_deref())?;
    println!("{table}");
    let found = |name: &str| table.find(name).map_or(f64::NAN, |row| row[2]);
    let (reached, machine) = (found("    input_to_output"), found(BASELINE));
    println!(
        "input to output in the default mode: p99.9 {reached:.1} us (wanted below {INPUT_TO_OUTPUT_US} us on a quiet machine), {:.1} x the machine's own wake-up p99.9",
        reached / machine
    );
    tables.push(table);
    if write { page::write(&tables, &page::machine()) } else { Ok(()) }
}

/// A wake-up baseline of the same minute, then each way of waiting.
fn through_shared_memory(service_core: usize, seconds: u64, only: Option<&str>) -> Result<Table, String> {
    for missing in
        [realtime::lock_memory(), realtime::pin(ROBOT_CORE), realtime::set_fifo(ROBOT_PRIORITY)].into_iter().filter_map(Result::err)
    {
        println!("note: {missing}");
    }
    let mut table =
        Table::new(&format!("1 kHz for {seconds} s through shared memory, one arm"), &["p50", "p99", "p99.9", "max", "missed"]);
    let wakeup =
        check::measure_wakeup(Duration::from_secs(10), Some(service_core), SERVICE_PRIORITY).map_err(|error| error.to_string())?;
    let us = |ns: u64| ns as f64 / 1000.0;
    table.row(BASELINE, &[us(wakeup.p50_ns), us(wakeup.p99_ns), us(wakeup.p999_ns), us(wakeup.max_ns), f64::NAN]);
    for wait in ["sleep", "spin", "event"].into_iter().filter(|wait| only.is_none_or(|only| only == *wait)) {
        path::run(&mut table, wait, service_core, seconds)?;
    }
    Ok(table)
}
