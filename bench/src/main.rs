//! `make bench-ci` and `make bench`: the network, and the whole path, side by side in one run.
//!
//! These machines are shared and noisy: compare by ratio, within one run.

mod kernel;
mod onnxruntime;
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

fn main() -> ExitCode {
    let (runs, seconds) = match std::env::args().nth(1).as_deref() {
        Some("ci") => (4_000, 60),
        Some("full") => (20_000, 200),
        _ => {
            eprintln!("usage: ravenpose-bench ci|full (from the repository's top)");
            return ExitCode::from(2);
        }
    };
    match measure(runs, seconds) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("ravenpose-bench: {message}");
            ExitCode::FAILURE
        }
    }
}

fn measure(runs: usize, seconds: u64) -> Result<(), String> {
    let model = "models/untrained.onnx";
    let bytes = std::fs::read(model).map_err(|cause| format!("{model}: {cause}; run from the repository's top"))?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let service_core = cores - 1;
    println!("{cores} cores; robot on core {ROBOT_CORE}, service on core {service_core}; every figure in us\n");

    // Without FIFO here: a thread that computes without a pause would meet real-time throttling.
    let tables = std::thread::scope(|scope| {
        scope
            .spawn(|| {
                let _ = realtime::pin(service_core);
                kernel::run(&bytes, runs)
            })
            .join()
            .map_err(|_| "the kernel benchmark failed".to_owned())?
    })?;
    for table in tables {
        println!("{table}");
    }
    // RAVENPOSE_BENCH_ONLY=tight or =kernel measures the network alone, =sleep, =spin or =event one way of waiting.
    let only = std::env::var("RAVENPOSE_BENCH_ONLY").ok();
    if only.as_deref().is_some_and(|only| ["tight", "kernel"].contains(&only)) {
        return Ok(());
    }

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
    let baseline = [us(wakeup.p50_ns), us(wakeup.p99_ns), us(wakeup.p999_ns), us(wakeup.max_ns), f64::NAN];
    table.row("this machine: wake-up of a FIFO thread, 10 s", &baseline);
    for wait in ["sleep", "spin", "event"].into_iter().filter(|wait| only.as_deref().is_none_or(|only| only == *wait)) {
        path::run(&mut table, wait, service_core, seconds)?;
    }
    println!("{table}");
    let reached = table.find("    input_to_output").map_or(f64::NAN, |row| row[2]);
    println!(
        "input to output in the default mode: p99.9 {reached:.1} us (wanted below {INPUT_TO_OUTPUT_US} us on a quiet machine), {:.1} x the machine's own wake-up p99.9",
        reached / us(wakeup.p999_ns)
    );
    Ok(())
}
