//! Shared by the tests on recordings of real robots.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use std::path::{Path, PathBuf};

use gap::analysis::analyse;
use gap::found::Outcome;
use gap::given::{Given, Options};
use gap_report::{Report, Role, Verdict};
use simulator::RobotModel;

/// `RAVENPOSE_DATA`, or `../shared/data` beside the repository.
pub(crate) fn data() -> PathBuf {
    std::env::var_os("RAVENPOSE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from)
}

/// A model of the repository.
pub(crate) fn model(name: &str) -> RobotModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
    RobotModel::load(&path.to_string_lossy()).expect("model")
}

/// Analyses recordings, or says plainly that they are absent.
pub(crate) fn report(robot: &str, real: &[&str], sim: &[&str]) -> Option<Report> {
    outcome(robot, real, sim).map(|outcome| outcome.report)
}

pub(crate) fn outcome(robot: &str, real: &[&str], sim: &[&str]) -> Option<Outcome> {
    let mut given = Vec::new();
    for (k, name) in real.iter().enumerate() {
        let read = |name: &str| {
            let path = data().join(name);
            if !path.exists() {
                println!("skipped: {} is absent", path.display());
                return None;
            }
            Some(recordings::csv::read(&path).expect("recording"))
        };
        let sim = match sim.get(k) {
            Some(name) => Some((read(name)?, "0".repeat(64))),
            None => None,
        };
        given.push(Given { id: (*name).to_owned(), real: read(name)?, real_sha256: "0".repeat(64), sim, notes: Vec::new() });
    }
    let options = Options::default();
    let outcome = analyse(&model(robot), &given, &options, &mut |_| {}).expect("a report");
    println!("{}", gap_report::words(&outcome.report));
    Some(outcome)
}

/// Primary verdicts of a physics.
pub(crate) fn primary<'a>(report: &'a Report, physics: &str) -> Vec<&'a Verdict> {
    report.verdicts.iter().filter(|v| v.role == Role::Primary && v.physics.to_string() == physics).collect()
}

/// A parameter with its interval.
pub(crate) fn parameter(verdict: &Verdict, name: &str) -> (f64, [f64; 2]) {
    let found = verdict.parameters.iter().find(|p| p.name == name).expect("parameter");
    (found.value, found.ci95)
}
