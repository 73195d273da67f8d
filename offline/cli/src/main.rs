//! `ravenpose`: the command line for everything but the real-time service.

mod check;
mod convert;
mod infer;
mod output;
mod stats;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Where RAVEN-II really is: tools around ravenposed. Research software, no clinical use.
#[derive(Parser)]
#[command(name = "ravenpose", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a model on rows of a CSV file: in_0..in_117 to out_0..out_2, with the service's own plan
    Infer {
        /// ONNX file
        #[arg(long)]
        model: PathBuf,
        /// CSV with columns in_0..in_117; other columns are ignored
        input: PathBuf,
        /// CSV to write
        #[arg(long)]
        out: PathBuf,
        /// Weight format
        #[arg(long, default_value = "f32")]
        weights: String,
    },
    /// Turn a recording into a file of full states that a stand-in replays (OUT ends in .rvs)
    Convert {
        /// Recording (tidy CSV, also .csv.gz), or `synthetic:SECONDS` for a generated one
        input: String,
        /// State file to write
        out: PathBuf,
        /// Arm that the recording belongs to
        #[arg(long, default_value = "gold", value_parser = ["gold", "green", "both"])]
        arm: String,
    },
    /// Latency histograms and counters of the running service
    Stats {
        /// Show them anew each second until Ctrl-C
        #[arg(long)]
        watch: bool,
        /// Also write one .hgrm per stage: FILE with the stage's name before its extension
        #[arg(long)]
        hgrm: Option<PathBuf>,
        /// Where the service writes stats.json
        #[arg(long, default_value = "/run/ravenpose")]
        runtime_dir: PathBuf,
    },
    /// Is this machine ready for hard real time? Exact remedies
    Check {
        /// Core that the loop will be pinned to
        #[arg(long)]
        core: Option<usize>,
        /// FIFO priority of the loop
        #[arg(long, default_value_t = 80)]
        priority: i32,
        /// The service is configured with wait = "spin"
        #[arg(long)]
        spin: bool,
        /// Measure wake-up latency for this many seconds (0: do not)
        #[arg(long, default_value_t = 5)]
        seconds: u64,
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Infer { model, input, out, weights } => infer::run(&model, &input, &out, &weights),
        Command::Convert { input, out, arm } => convert::run(&input, &out, &arm),
        Command::Stats { watch, hgrm, runtime_dir } => stats::run(&runtime_dir, watch, hgrm.as_deref()),
        Command::Check { core, priority, spin, seconds } => check::run(core, priority, spin, seconds),
    };
    match done {
        Ok(code) => code,
        Err(message) => {
            eprintln!("ravenpose: {message}");
            ExitCode::from(2)
        }
    }
}
