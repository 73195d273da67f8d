//! `ravenpose gap`: where simulation and recordings differ, and which physics is missing.

use crate::output;
use ::gap::analysis::{Given, Options, analyse};
use ::gap::search::Thresholds;
use ::gap::verdicts::sha256;
use arm::Side;
use gap_report::Status;
use recordings::open::{Kind, Opened, kind, open};
use recordings::table::{self, TableSource};
use recordings::tidy::{self, StateTable};
use recordings::{Arms, Recording, csv};
use simulator::RobotModel;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// What was asked for.
pub(crate) struct Wish<'a> {
    /// Recordings, one file per run.
    pub(crate) real: &'a [PathBuf],
    /// Simulations of them, in the same order, or none.
    pub(crate) sim: &'a [PathBuf],
    /// Robot file or URDF, or a name.
    pub(crate) robot: Option<&'a str>,
    /// Folder for the report.
    pub(crate) out: &'a Path,
    /// Written into the report.
    pub(crate) seed: u64,
    /// Say what the search tries.
    pub(crate) trace: bool,
}

/// Progress is shown on a terminal, and only of what takes longer.
const PATIENCE: Duration = Duration::from_secs(1);

pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    if !wish.sim.is_empty() && wish.sim.len() != wish.real.len() {
        return Err(format!(
            "{} recordings and {} simulations: give one --sim for each --real, in the same order",
            wish.real.len(),
            wish.sim.len()
        ));
    }
    if let Some(file) = wish.out.ancestors().find(|path| path.exists()).filter(|path| !path.is_dir()) {
        return Err(format!("{}: is a file; give a folder with --out", file.display()));
    }
    let model = RobotModel::load(wish.robot.unwrap_or("raven2-nominal")).map_err(|error| error.to_string())?;
    let mut given = Vec::new();
    for (k, path) in wish.real.iter().enumerate() {
        let mut notes = Vec::new();
        let side = model.side();
        let real = read(path, side, &mut notes)?;
        let sim = wish.sim.get(k).map(|path| Ok::<_, String>((read(path, side, &mut notes)?, hash(path)?))).transpose()?;
        given.push(Given { id: name(path, k, wish.real), real, real_sha256: hash(path)?, notes, sim });
    }
    let text = model.to_toml();
    let thresholds = Thresholds::default();
    let urdf = wish.robot.filter(|robot| Path::new(robot).extension().is_some_and(|end| end.eq_ignore_ascii_case("urdf")));
    let options = Options {
        thresholds,
        seed: wish.seed,
        trace: wish.trace,
        config_sha256: sha256(format!("{text}{thresholds:?}{}", wish.seed).as_bytes()),
        urdf_sha256: urdf.map(|path| hash(Path::new(path))).transpose()?,
    };
    let (begun, terminal) = (Instant::now(), std::io::stderr().is_terminal());
    let outcome = analyse(&model, &given, &options, &mut |what| {
        if terminal && begun.elapsed() > PATIENCE {
            eprint!("\r\x1b[K{what} ({:.0} s)", begun.elapsed().as_secs_f64());
        }
    });
    if terminal && begun.elapsed() > PATIENCE {
        eprint!("\r\x1b[K");
    }
    let outcome = outcome.map_err(|error| error.to_string())?;
    // What cannot be written at all leaves nothing behind.
    drop(gap_report::json(&outcome.report).map_err(|error| error.to_string())?);
    std::fs::create_dir_all(wish.out).map_err(|error| format!("{}: cannot be made: {error}", wish.out.display()))?;
    let corrected = wish.out.join("corrected.toml");
    match &outcome.corrected {
        Some(text) => output::whole(&corrected, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))?,
        // One of an earlier analysis would pass for this one's.
        None => drop(std::fs::remove_file(&corrected)),
    }
    gap_report::write(&outcome.report, &outcome.pictures, wish.out).map_err(|error| error.to_string())?;
    print!("{}", gap_report::words(&outcome.report));
    println!("{}", wish.out.join("report.html").display());
    Ok(match outcome.report.status {
        Status::NoMismatch => ExitCode::SUCCESS,
        Status::InsufficientData => ExitCode::from(2),
        _ => ExitCode::from(1),
    })
}

/// A recording of any format as a table in memory. Tidy CSV is read strictly but for empty cells, which are rows to leave out;
/// of two arms the robot's is taken; where a file ends early is noted.
fn read(path: &Path, side: Side, notes: &mut Vec<String>) -> Result<Recording, String> {
    if kind(path).map_err(|error| error.to_string())? == Kind::Csv {
        return csv::read_with_gaps(path).map_err(|error| error.to_string());
    }
    let mut source = states_or_table(path, None)?;
    if source.columns().iter().any(|column| column.name.starts_with("green_")) {
        source = states_or_table(path, Some(if side == Side::Green { Arms::Green } else { Arms::Gold }))?;
        notes.push(format!("{}: holds both arms; the {} one is looked at", path.display(), side.name()));
    }
    let recording = table::collect(&path.display().to_string(), source.as_mut()).map_err(|error| error.to_string())?;
    if let Some(damage) = source.damage() {
        notes.push(format!("{}: {}: {}: what stands before it is used", path.display(), damage.place, damage.what));
    }
    Ok(recording)
}

fn states_or_table(path: &Path, arms: Option<Arms>) -> Result<Box<dyn TableSource>, String> {
    let opened = open(path).map_err(|error| error.to_string())?;
    Ok(match opened {
        Opened::Table(source) => source,
        Opened::States(source) => {
            let options = tidy::Options { arms, all_truth: false };
            Box::new(StateTable::new(source, options).map_err(|error| error.to_string())?)
        }
    })
}

/// File name, with its place where two runs have the same.
fn name(path: &Path, k: usize, all: &[PathBuf]) -> String {
    let of = |path: &Path| path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    let own = of(path);
    if all.iter().filter(|other| of(other) == own).count() > 1 { format!("{own} ({})", k + 1) } else { own }
}

fn hash(path: &Path) -> Result<String, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: cannot be read: {error}", path.display()))?;
    Ok(sha256(&bytes))
}
