//! `ravenpose`: the command line for everything but the real-time service.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "they panic where the reader has gone: say! and complain! do not")]

#[macro_use]
mod output;

mod check;
mod clock;
mod convert;
mod evaluate;
mod gap;
mod infer;
mod info;
mod pair;
mod plot;
mod progress;
mod prove;
mod read;
mod record;
mod registration;
mod search;
mod simulate;
mod stats;
mod train;
mod vision;
mod webcams;

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
        /// Weight format: f32, f16, bf16, i16, i12 or i8
        #[arg(long, default_value = "f32")]
        weights: String,
        /// The rows are states in the order of time, one per period: a model with a memory remembers from row to row
        #[arg(long)]
        in_order: bool,
    },
    /// Turn a recording of any format into another one; the endings say which
    Convert {
        /// MCAP, rosbag v1, 252-column CSV, 235-column text, tidy CSV, Parquet, state file
        input: PathBuf,
        /// .mcap, .bag, .rvs, .txt (235 columns), .252.csv, .csv, .csv.gz, .parquet
        out: PathBuf,
        /// Arm that a table belongs to, or arms of states that a table shall show
        #[arg(long, value_parser = ["gold", "green", "both"])]
        arm: Option<String>,
        /// Leave out what comes before so many seconds of it
        #[arg(long, value_name = "S")]
        from: Option<f64>,
        /// Leave out what comes after so many seconds of it
        #[arg(long, value_name = "S")]
        to: Option<f64>,
    },
    /// What is in a recording: channels, rates, gaps, duplicates, saturation, standstill, damage
    Info {
        /// Recordings of any format
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// As JSON
        #[arg(long)]
        json: bool,
    },
    /// An overview of a run: commanded, reported, true; error over time, load, direction and posture
    Plot {
        /// Recording of any format
        run: PathBuf,
        /// Page to write (.html), or the figures alone (.svg)
        #[arg(long)]
        out: PathBuf,
    },
    /// Reported and true tip positions of the same moments: clock offset and drift, registration, labels, what was dropped
    Pair {
        /// Recording with the reported tip
        run: PathBuf,
        /// Recording with the true tip (vision's truth.csv); without it the truth is in RUN
        #[arg(long)]
        truth: Option<PathBuf>,
        /// Of a recording of both arms: the one whose tip is paired
        #[arg(long, value_parser = ["gold", "green"])]
        arm: Option<String>,
        /// Table of pairs to write (.csv), or the whole recording with the truth in frame 0 inside, for `train` (.mcap, .bag,
        /// .parquet); the report goes beside it as .report.json
        #[arg(long)]
        out: PathBuf,
        /// The cameras' frame is known: [registration] of this cameras.toml
        #[arg(long, value_name = "cameras.toml", conflicts_with_all = ["same", "register"])]
        cameras: Option<PathBuf>,
        /// Write the frame that fits this run into this cameras.toml, as [registration]
        #[arg(long, value_name = "cameras.toml", conflicts_with = "same")]
        register: Option<PathBuf>,
        /// The truth is on the states' clock and in frame 0 already
        #[arg(long, conflicts_with = "offset_s")]
        same: bool,
        /// When the truth's time 0 is on the states' clock, to 5 s; otherwise their start times say it, or they begin together
        #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
        offset_s: Option<f64>,
        /// That offset is exact, as where one wire or one clock triggers both: nothing of the clock is fitted to the motion
        #[arg(long, conflicts_with = "same")]
        clock_known: bool,
        /// The fixture's axes are the end effector's, as its rig.toml has them: nothing of the orientation is fitted
        #[arg(long)]
        mounting_known: bool,
    },
    /// Where a simulation and recordings differ, which physics is missing, how large it is, and the model with it
    Gap {
        /// Recordings of one robot, one file per run
        #[arg(long, required_unless_present = "watch", num_args = 1..)]
        real: Vec<PathBuf>,
        /// What a simulator made of the same commands, in the same order; without it the robot's model stands for it
        #[arg(long, num_args = 1..)]
        sim: Vec<PathBuf>,
        /// Robot file, URDF, or raven2-nominal (the default)
        #[arg(long)]
        robot: Option<String>,
        /// Folder for report.json, report.html and corrected.toml
        #[arg(long)]
        out: PathBuf,
        /// Of everything random; written into the report
        #[arg(long, default_value_t = 0)]
        seed: u64,
        /// Say on standard error what the search tries
        #[arg(long)]
        trace: bool,
        /// Say when the robot no longer is its model, from the newest minute: of one recording as it came, or, without --real, of
        /// what the running service's controller publishes, until Ctrl-C
        #[arg(long)]
        watch: bool,
        /// With --watch and without --real: stop by itself after so many seconds
        #[arg(long, requires = "watch", conflicts_with = "real")]
        seconds: Option<f64>,
    },
    /// Concealed-truth trials of `gap`: recordings with sealed causes, answers, score; stopped, it goes on where it was
    Prove {
        /// Which set of cases
        #[arg(long, default_value = "small", value_parser = ["small", "full", "dev"])]
        matrix: String,
        /// All cases follow from it
        #[arg(long)]
        seed: u64,
        /// Folder of the trial
        #[arg(long)]
        out: PathBuf,
        /// Cases at one time; the score does not depend on it
        #[arg(long)]
        jobs: Option<usize>,
    },
    /// Log the running service's states and poses to MCAP, on one clock; a kill loses at most the last second
    Record {
        /// File to write; it stands as NAME.part until the end
        #[arg(long)]
        out: PathBuf,
        /// Stop by itself after so many seconds
        #[arg(long)]
        seconds: Option<f64>,
        #[command(flatten)]
        webcams: webcams::Wish,
    },
    /// Runs of a simulated robot at 1 kHz and where the arm really was: full states of a RAVEN-II, tables of any other arm
    Simulate {
        /// Length of all runs together
        #[arg(long, required_unless_present = "commands", conflicts_with = "commands")]
        minutes: Option<f64>,
        /// Everything follows from it
        #[arg(long, required_unless_present = "commands")]
        seed: Option<u64>,
        /// What homing leaves follows from this seed and is the same in all runs: the robot is not homed between them
        #[arg(long)]
        homing_seed: Option<u64>,
        /// Folder to write run_0001.mcap (or .csv), ... into
        #[arg(long)]
        out: PathBuf,
        /// Robot file, plant file or URDF, or raven2-nominal (the default) or raven2-worn
        #[arg(long)]
        robot: Option<String>,
        /// Follow the commands of these recordings (jpos_d) instead of trajectories from the seed; run K is recording K
        #[arg(long, num_args = 1..)]
        commands: Vec<PathBuf>,
        /// Connected arms
        #[arg(long, default_value = "gold", value_parser = ["gold", "green", "both"])]
        arm: String,
        /// What they do
        #[arg(long, default_value = "mixed", value_parser = ["mixed", "teleoperation", "zigzag"], conflicts_with = "commands")]
        motion: String,
        /// Format of the runs: mcap for a RAVEN-II, csv for others, unless told otherwise
        #[arg(long, value_parser = ["mcap", "bag", "parquet", "csv", "csv.gz", "252.csv", "txt", "rvs"])]
        format: Option<String>,
        /// Longest run; each run homes the robot anew
        #[arg(long, default_value_t = 5.0, conflicts_with = "commands")]
        run_minutes: f64,
        /// So many runs follow each other at once, each as warm as the last ended; every run begins cold unless told otherwise
        #[arg(long, conflicts_with = "commands")]
        runs_per_session: Option<usize>,
        /// Threads; the files do not depend on it
        #[arg(long)]
        threads: Option<usize>,
    },
    /// Learn where the arm really is from recordings with truth: a model file with card, hash and curves
    Train(train::Wish),
    /// Try random recipes for `train`, the better ones longer: a hundred trainings in one command, which may be stopped
    Search(search::Wish),
    /// What a model leaves on runs that it has not seen, rivals beside it: report.json and report.html
    Evaluate(evaluate::Wish),
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
    /// True pose of the end effector from webcams and three coloured balls
    #[command(subcommand)]
    Vision(vision::Wish),
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
        Command::Infer { model, input, out, weights, in_order } => infer::run(&model, &input, &out, &weights, in_order),
        Command::Convert { input, out, arm, from, to } => {
            convert::stretch(from, to).and_then(|stretch| convert::run(&input, &out, arm.as_deref(), stretch))
        }
        Command::Info { files, json } => info::run(&files, json),
        Command::Plot { run, out } => plot::run(&run, &out),
        Command::Pair { run, truth, arm, out, cameras, register, same, offset_s, clock_known, mounting_known } => {
            pair::run(&pair::Wish {
                run: &run,
                truth: truth.as_deref(),
                arm: arm.as_deref(),
                out: &out,
                cameras: cameras.as_deref(),
                register: register.as_deref(),
                same,
                offset_s,
                clock_known,
                mounting_known,
            })
        }
        Command::Gap { real, sim, robot, out, seed, trace, watch, seconds } => {
            gap::run(&gap::Wish { real: &real, sim: &sim, robot: robot.as_deref(), out: &out, seed, trace, watch, seconds })
        }
        Command::Prove { matrix, seed, out, jobs } => prove::run(&prove::Wish { matrix: &matrix, seed, out: &out, jobs }),
        Command::Record { out, seconds, webcams } => record::run(&out, seconds, &webcams),
        Command::Simulate {
            minutes,
            seed,
            homing_seed,
            out,
            robot,
            commands,
            arm,
            motion,
            format,
            run_minutes,
            runs_per_session,
            threads,
        } => simulate::run(&simulate::Wish {
            minutes,
            seed,
            homing_seed,
            out: &out,
            robot: robot.as_deref(),
            commands: &commands,
            arm: &arm,
            motion: &motion,
            format: format.as_deref(),
            run_minutes,
            runs_per_session,
            threads,
        }),
        Command::Stats { watch, hgrm, runtime_dir } => stats::run(&runtime_dir, watch, hgrm.as_deref()),
        Command::Train(wish) => train::run(&wish),
        Command::Search(wish) => search::run(&wish),
        Command::Evaluate(wish) => evaluate::run(&wish),
        Command::Vision(wish) => vision::run(&wish),
        Command::Check { core, priority, spin, seconds } => check::run(core, priority, spin, seconds),
    };
    match done {
        Ok(code) => code,
        Err(message) => {
            complain!("ravenpose: {message}");
            ExitCode::from(2)
        }
    }
}
