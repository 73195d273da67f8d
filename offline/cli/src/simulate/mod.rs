//! `ravenpose simulate`: runs of a simulated robot at 1 kHz with their truth: states of a RAVEN-II, tables of any other arm.

mod any_arm;
mod commands;
mod raven;
mod workers;

use crate::output;
use simulator::RobotModel;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What the command line says.
pub(crate) struct Wish<'a> {
    pub(crate) minutes: Option<f64>,
    pub(crate) seed: Option<u64>,
    pub(crate) homing_seed: Option<u64>,
    pub(crate) out: &'a Path,
    pub(crate) robot: Option<&'a str>,
    pub(crate) commands: &'a [PathBuf],
    pub(crate) arm: &'a str,
    pub(crate) motion: &'a str,
    pub(crate) format: Option<&'a str>,
    pub(crate) run_minutes: f64,
    pub(crate) runs_per_session: Option<usize>,
    pub(crate) threads: Option<usize>,
}

/// A run of one control cycle at least, and no more than ten years in all.
const MINUTES: std::ops::RangeInclusive<f64> = 1e-4..=5e6;
/// The longest run: its commands are made before it begins.
const RUN_MINUTES: f64 = 1e4;
/// Most runs: each is a file.
const RUNS: f64 = 1e5;

pub(crate) fn run(wish: &Wish<'_>) -> Result<ExitCode, String> {
    // Without --minutes there are --commands (the parser sees to it), whose length counts.
    for (name, value) in [("--minutes", wish.minutes.unwrap_or(1.0)), ("--run-minutes", wish.run_minutes)] {
        if !MINUTES.contains(&value) {
            let [least, most] = [MINUTES.start(), MINUTES.end()];
            return Err(format!("{name} {value}: must be a number of minutes from {least} to {most}; write {name} 10"));
        }
    }
    if let Some(minutes) = wish.minutes {
        let (name, length) = ("--run-minutes", wish.run_minutes);
        let runs = (minutes / length).ceil();
        if runs > RUNS {
            return Err(format!(
                "{name} {length}: cuts {minutes} minutes into {runs} runs, {RUNS} are the most; write longer ones"
            ));
        }
        if minutes.min(length) > RUN_MINUTES {
            return Err(format!("{name} {length}: a run has {RUN_MINUTES} minutes at most; write {name} 60"));
        }
    }
    if wish.runs_per_session == Some(0) {
        return Err("--runs-per-session 0: a session has at least one run; write --runs-per-session 7".to_owned());
    }
    let model = RobotModel::load(wish.robot.unwrap_or("raven2-nominal")).map_err(|error| error.to_string())?;
    if model.as_raven().is_some() {
        return raven::run(wish, model);
    }
    if wish.runs_per_session.is_some() {
        return Err(format!("--runs-per-session: {} is no RAVEN-II, whose runs alone make sessions; leave it out", model.name()));
    }
    any_arm::run(wish, &model)
}

/// Files of the runs, and the summary beside them: none may be there already. Makes the folder.
fn files(wish: &Wish<'_>, runs: usize, format: &str) -> Result<(Vec<PathBuf>, PathBuf), String> {
    let files: Vec<PathBuf> = (1..=runs).map(|run| wish.out.join(format!("run_{run:04}.{format}"))).collect();
    let summary = wish.out.join("simulation.txt");
    output::make_folder(wish.out)?;
    if let Some(file) = files.iter().chain([&summary]).find(|file| file.exists()) {
        return Err(format!("{}: is there already; choose another --out or remove it", file.display()));
    }
    Ok((files, summary))
}

/// The line of the summary that tells how each run was homed, where that was asked for.
fn homing_line(wish: &Wish<'_>) -> String {
    wish.homing_seed.map_or_else(String::new, |seed| format!("homing seed = {seed}\n"))
}

/// What is wrong with a run whose numbers grew without bound.
fn runs_away(robot: &str) -> String {
    format!(
        "{robot}: the simulation runs away: its steps cannot follow what pulls at a joint; give less stiffness or damping, or shorter steps"
    )
}

/// Writes the summary and says in one line what was made.
fn finish(wish: &Wish<'_>, model: &RobotModel, runs: &str, summary: &Path, text: &str) -> Result<(), String> {
    output::all(summary, text.as_bytes())?;
    let seed = wish.seed.map_or_else(String::new, |seed| format!(", seed {seed}"));
    say!("{}: {runs}, robot {}{seed}", wish.out.display(), model.name());
    Ok(())
}

fn name(file: &Path) -> String {
    file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}
