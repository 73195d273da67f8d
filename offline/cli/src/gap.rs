//! `ravenpose gap`: where simulation and recordings differ, and which physics is missing.

mod live;
mod memory;

use crate::output;
use ::gap::analysis::analyse;
use ::gap::found::Outcome;
use ::gap::given::{Given, Options};
use ::gap::needed::keep_needed;
use ::gap::parallel;
use ::gap::search::Thresholds;
use ::gap::verdicts::{sha256, sha256_of};
use ::gap::watch;
use arm::Side;
use gap_report::Status;
use recordings::open::{Kind, kind};
use recordings::table::{self, TableSource};
use recordings::tidy;
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
    /// Look at the newest minute of one recording, or of the running service, again and again.
    pub(crate) watch: bool,
    /// End of a watch of the running service, s.
    pub(crate) seconds: Option<f64>,
}

/// What is written into the folder, or removed if it is an older one.
const WRITTEN: [&str; 3] = ["report.json", "report.html", "corrected.toml"];

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
    output::check_folder(wish.out, "--out")?;
    let inputs: Vec<&Path> = wish.real.iter().chain(wish.sim).map(PathBuf::as_path).chain(wish.robot.map(Path::new)).collect();
    for name in WRITTEN {
        output::check_no_input(&wish.out.join(name), &inputs)?;
    }
    let model = RobotModel::load(wish.robot.unwrap_or("raven2-nominal")).map_err(|error| error.to_string())?;
    let file = |path: &Path| {
        let mut notes = Vec::new();
        let mut recording = read(path, model.side(), &mut notes)?;
        keep_needed(&mut recording, &model);
        Ok::<_, String>((recording, hash(path)?, notes))
    };
    let mut given = Vec::new();
    // One run after the other: before what nobody needs is dropped, each file takes three times the memory.
    for (k, path) in wish.real.iter().enumerate() {
        let (real, sim) = parallel::both(|| file(path), || wish.sim.get(k).map(|path| file(path)).transpose());
        let (real, real_sha256, mut notes) = real?;
        let sim = sim?.map(|(sim, sha256, of_sim)| {
            notes.extend(of_sim);
            (sim, sha256)
        });
        given.push(Given { id: name(path, k, wish.real), real, real_sha256, notes, sim });
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
        free_bytes: memory::free_bytes,
    };
    if wish.watch && wish.real.is_empty() {
        return live::watch(&model, &options, wish);
    }
    if wish.watch {
        let [only] = given.as_slice() else { return Err("--watch looks at one recording; give one --real".to_owned()) };
        return watched(&model, only, &options, wish.out);
    }
    let outcome = quietly(&model, &given, &options)?;
    write(&outcome, wish.out)?;
    output::say(format_args!("{}", gap_report::words(&outcome.report)));
    if !outcome.left_out.is_empty() {
        say!(
            "note: of {} of the effects above corrected.toml lacks all or a part; its first lines say what and why",
            outcome.left_out.len()
        );
    }
    say!("{}", wish.out.join("report.html").display());
    Ok(status(outcome.report.status))
}

fn status(status: Status) -> ExitCode {
    match status {
        Status::NoMismatch => ExitCode::SUCCESS,
        Status::InsufficientData => ExitCode::from(2),
        _ => ExitCode::from(1),
    }
}

fn differs(outcome: &Outcome) -> bool {
    !matches!(outcome.report.status, Status::NoMismatch | Status::InsufficientData)
}

/// The analysis with its progress on a terminal.
fn quietly(model: &RobotModel, given: &[Given], options: &Options) -> Result<Outcome, String> {
    let (begun, terminal) = (Instant::now(), std::io::stderr().is_terminal());
    let outcome = analyse(model, given, options, &mut |what| {
        if terminal && begun.elapsed() > PATIENCE {
            output::complain(format_args!("\r\x1b[K{what} ({:.0} s)", begun.elapsed().as_secs_f64()));
        }
    });
    if terminal && begun.elapsed() > PATIENCE {
        output::complain(format_args!("\r\x1b[K"));
    }
    outcome.map_err(|error| error.to_string())
}

/// Report, page and corrected model in their folder.
fn write(outcome: &Outcome, out: &Path) -> Result<(), String> {
    // What cannot be written at all leaves nothing behind.
    drop(gap_report::json(&outcome.report).map_err(|error| error.to_string())?);
    output::make_folder(out)?;
    let corrected = out.join("corrected.toml");
    match &outcome.corrected {
        Some(text) => output::all(&corrected, text.as_bytes())?,
        // One of an earlier analysis would pass for this one's.
        None => drop(std::fs::remove_file(&corrected)),
    }
    gap_report::write(&outcome.report, &outcome.pictures, out).map_err(|error| error.to_string())
}

/// One line per window of a recording; the report is that of the last window in which the robot was not its model, else of the
/// last one. The status is that of the report.
fn watched(model: &RobotModel, given: &Given, options: &Options, out: &Path) -> Result<ExitCode, String> {
    let mut told: Option<Outcome> = None;
    let mut fault = None;
    for end_s in watch::ends(&given.real).map_err(|error| error.to_string())? {
        let real = watch::newest(&given.real, end_s);
        let from_s = real.time_s().and_then(|time| time.first().copied()).unwrap_or(end_s);
        let sim = given.sim.as_ref().map(|(sim, hash)| (watch::newest(sim, end_s), hash.clone()));
        let (id, real_sha256) = (given.id.clone(), given.real_sha256.clone());
        let window = Given { id, real, real_sha256, notes: given.notes.clone(), sim };
        let outcome = quietly(model, &[window], options);
        let said = match &outcome {
            Ok(outcome) => gap_report::headlines(&outcome.report).join(" "),
            // A minute in which the arm stands is no end of the watch.
            Err(why) => format!("not looked at: {why}"),
        };
        match outcome {
            Ok(outcome) if differs(&outcome) || !told.as_ref().is_some_and(differs) => told = Some(outcome),
            Ok(_) => {}
            Err(why) => fault = Some(why),
        }
        if !output::say(format_args!("{from_s:.0} to {end_s:.0} s: {said}\n")) {
            break;
        }
    }
    let outcome = told.ok_or_else(|| fault.unwrap_or_else(|| format!("{}: has no rows", given.real.name)))?;
    write(&outcome, out)?;
    say!("{}", out.join("report.html").display());
    Ok(status(outcome.report.status))
}

/// A recording of any format as a table in memory. Tidy CSV is read strictly but for empty cells, which are rows to leave out;
/// of two arms the robot's is taken; where a file ends early is noted.
fn read(path: &Path, side: Side, notes: &mut Vec<String>) -> Result<Recording, String> {
    if kind(path).map_err(|error| error.to_string())? == Kind::Csv {
        return csv::read_with_gaps(path).map_err(|error| error.to_string());
    }
    let mut source = table_of(path, None)?;
    if tidy::has_both_arms(source.columns()) {
        source = table_of(path, Some(arms_of(side)))?;
        notes.push(format!("{}: holds both arms; the {} one is looked at", path.display(), side.name()));
    }
    let recording = table::collect(&path.display().to_string(), source.as_mut()).map_err(|error| error.to_string())?;
    if let Some(damage) = source.damage() {
        notes.push(format!("{}: {}: {}: what stands before it is used", path.display(), damage.place, damage.what));
    }
    Ok(recording)
}

fn arms_of(side: Side) -> Arms {
    if side == Side::Green { Arms::Green } else { Arms::Gold }
}

fn table_of(path: &Path, arms: Option<Arms>) -> Result<Box<dyn TableSource>, String> {
    tidy::open(path, tidy::Options { arms, ..tidy::Options::default() }).map_err(|error| error.to_string())
}

/// File name, with its place where two runs have the same.
fn name(path: &Path, k: usize, all: &[PathBuf]) -> String {
    let of = |path: &Path| path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    let own = of(path);
    if all.iter().filter(|other| of(other) == own).count() > 1 { format!("{own} ({})", k + 1) } else { own }
}

fn hash(path: &Path) -> Result<String, String> {
    let hash = std::fs::File::open(path).and_then(sha256_of);
    hash.map_err(|error| format!("{}: cannot be read: {error}", path.display()))
}
