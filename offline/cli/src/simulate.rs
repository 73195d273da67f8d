//! `ravenpose simulate`: runs of a simulated robot, full states at 1 kHz with their truth.

use crate::progress::Progress;
use arm::Side;
use recordings::save::{self, StateFormat, TableFormat};
use recordings::stream::Record;
use recordings::tidy::{self, StateTable};
use recordings::{open, table};
use simulator::Robot;
use simulator::production::{Motion, Plan, Player, Run};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// What the command line says.
pub(crate) struct Wish<'a> {
    pub(crate) minutes: f64,
    pub(crate) seed: u64,
    pub(crate) out: &'a Path,
    pub(crate) robot: Option<&'a str>,
    pub(crate) arm: &'a str,
    pub(crate) motion: &'a str,
    pub(crate) format: &'a str,
    pub(crate) run_minutes: f64,
    pub(crate) threads: Option<usize>,
}

/// A run of one control cycle at least, and no more than ten years in all.
const MINUTES: std::ops::RangeInclusive<f64> = 1e-4..=5e6;

pub(crate) fn run(wish: &Wish<'_>) -> Result<ExitCode, String> {
    for (name, value) in [("--minutes", wish.minutes), ("--run-minutes", wish.run_minutes)] {
        if !MINUTES.contains(&value) {
            return Err(format!("{name} {value}: must be a number of minutes above 0; write {name} 10"));
        }
    }
    let plan = Plan {
        robot: robot(wish.robot)?,
        sides: match wish.arm {
            "green" => vec![Side::Green],
            "both" => vec![Side::Gold, Side::Green],
            _ => vec![Side::Gold],
        },
        duration_s: wish.minutes * 60.0,
        run_s: wish.run_minutes * 60.0,
        seed: wish.seed,
        motion: match wish.motion {
            "teleoperation" => Motion::Teleoperation,
            "zigzag" => Motion::Zigzag,
            _ => Motion::Mixed,
        },
    };
    let runs = plan.runs();
    let files: Vec<PathBuf> = runs.iter().map(|run| wish.out.join(format!("run_{:04}.{}", run.index + 1, wish.format))).collect();
    std::fs::create_dir_all(wish.out).map_err(|error| format!("{}: cannot be made: {error}", wish.out.display()))?;
    let summary = wish.out.join("simulation.txt");
    if let Some(file) = files.iter().chain([&summary]).find(|file| file.exists()) {
        return Err(format!("{}: is there already; choose another --out or remove it", file.display()));
    }
    // Effects that cannot be are refused before anything is written.
    drop(Player::new(&plan, runs[0]).map_err(|error| format!("{}: {error}", plan.robot.name))?);
    let offsets = all(&plan, &runs, &files, wish.threads)?;
    let text = summary_text(&plan, &runs, &files, &offsets);
    crate::output::whole(&summary, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))?;
    println!(
        "{}: {} runs of {:.3} s, robot {}, seed {}",
        wish.out.display(),
        runs.len(),
        runs[0].duration_s,
        plan.robot.name,
        plan.seed
    );
    Ok(ExitCode::SUCCESS)
}

/// A robot by name, or by its file.
pub(crate) fn robot(wanted: Option<&str>) -> Result<Robot, String> {
    match wanted {
        None | Some("raven2-nominal") => Ok(Robot::nominal()),
        Some("raven2-worn") => Ok(Robot::worn()),
        Some(path) => {
            let text = std::fs::read_to_string(path)
                .map_err(|error| format!("{path}: cannot be read ({error}); give a robot file, raven2-nominal or raven2-worn"))?;
            Robot::from_toml(&text).map_err(|error| format!("{path}: {error}"))
        }
    }
}

/// Makes every run, on as many threads as wished; returns what homing left in each. On any failure nothing is left.
fn all(plan: &Plan, runs: &[Run], files: &[PathBuf], threads: Option<usize>) -> Result<Vec<Vec<[f64; arm::JOINTS]>>, String> {
    let next = AtomicUsize::new(0);
    let cycles = AtomicU64::new(0);
    let stop = AtomicBool::new(false);
    let failure: Mutex<Option<String>> = Mutex::new(None);
    let offsets: Mutex<Vec<Vec<[f64; arm::JOINTS]>>> = Mutex::new(vec![Vec::new(); runs.len()]);
    let total: u64 = runs.iter().map(Run::cycles).sum();
    let count = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).clamp(1, runs.len());
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= runs.len() || stop.load(Ordering::Relaxed) {
                return;
            }
            match one(plan, runs[index], &files[index], &cycles, &stop) {
                Ok(found) => lock(&offsets)[index] = found,
                Err(message) => {
                    stop.store(true, Ordering::Relaxed);
                    lock(&failure).get_or_insert(message);
                }
            }
        }
    };
    let mut progress = Progress::seconds();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..count).map(|_| scope.spawn(work)).collect();
        while workers.iter().any(|worker| !worker.is_finished()) {
            progress.at(cycles.load(Ordering::Relaxed) / 1000, total / 1000);
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    });
    progress.end();
    if let Some(message) = lock(&failure).take() {
        for file in files {
            drop(std::fs::remove_file(file));
        }
        return Err(message);
    }
    Ok(std::mem::take(&mut *lock(&offsets)))
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn one(plan: &Plan, run: Run, file: &Path, cycles: &AtomicU64, stop: &AtomicBool) -> Result<Vec<[f64; arm::JOINTS]>, String> {
    let mut player = Player::new(plan, run).map_err(|error| error.to_string())?;
    let offsets = plan.sides.iter().filter_map(|side| player.homing_offset(*side).copied()).collect();
    let metadata = [
        ("robot", plan.robot.name.clone()),
        ("simulated", "true".to_owned()),
        ("seed", plan.seed.to_string()),
        ("run", (run.index + 1).to_string()),
        ("motion", if run.zigzag { "zigzag" } else { "teleoperation" }.to_owned()),
        ("sample_hz", "1000".to_owned()),
    ]
    .map(|(key, value)| (key.to_owned(), value));
    // A tidy table is made of the states by the same code that converts recordings: through a file beside it.
    let table = if StateFormat::of_name(file).is_none() { TableFormat::of_name(file) } else { None };
    let states_file = if table.is_some() { file.with_extension("states.mcap") } else { file.to_owned() };
    let format = StateFormat::of_name(&states_file).ok_or_else(|| format!("{}: no format has this ending", file.display()))?;
    let mut sink = save::create_states(&states_file, format, &metadata).map_err(|error| error.to_string())?;
    player.records(|record| {
        if matches!(record, Record::State(_))
            && cycles.fetch_add(1, Ordering::Relaxed).is_multiple_of(1024)
            && stop.load(Ordering::Relaxed)
        {
            return Err("stopped".to_owned());
        }
        sink.write(record).map_err(|error| error.to_string())
    })?;
    sink.finish().map_err(|error| error.to_string())?;
    if let Some(format) = table {
        let made = tidy_table(&states_file, file, format);
        drop(std::fs::remove_file(&states_file));
        made?;
    }
    Ok(offsets)
}

fn tidy_table(states: &Path, out: &Path, format: TableFormat) -> Result<(), String> {
    let open::Opened::States(source) = open::open(states).map_err(|error| error.to_string())? else {
        return Err(format!("{}: is not a recording of states", states.display()));
    };
    let mut source = StateTable::new(source, tidy::Options { arms: None, all_truth: true }).map_err(|error| error.to_string())?;
    let metadata = table::TableSource::metadata(&source).to_vec();
    let columns = table::TableSource::columns(&source).to_vec();
    let mut sink = save::create_table(out, format, &columns, &metadata).map_err(|error| error.to_string())?;
    table::copy(&mut source, sink.as_mut(), &mut |_, _| {}).map_err(|error| error.to_string())?;
    sink.finish().map_err(|error| error.to_string())
}

fn summary_text(plan: &Plan, runs: &[Run], files: &[PathBuf], offsets: &[Vec<[f64; arm::JOINTS]>]) -> String {
    let mut text = format!("robot = {}\nseed = {}\nruns = {}\n", plan.robot.name, plan.seed, runs.len());
    for ((run, file), offsets) in runs.iter().zip(files).zip(offsets) {
        let name = file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let motion = if run.zigzag { "zigzag" } else { "teleoperation" };
        let _ = write!(text, "{name}: {:.3} s, {motion}", run.duration_s);
        for (side, offset) in plan.sides.iter().zip(offsets) {
            let _ = write!(text, ", homing offset {} {offset:?} (rad, joint 3 m)", side.name());
        }
        text.push('\n');
    }
    text
}
