//! Recordings whose commands are followed.

use crate::read;
use recordings::{Arms, Recording, csv, tidy};
use simulator::RobotModel;
use simulator::resimulate::{Commands, Run};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Every recording, as columns of the robot, and the status to end with: 1 where a part of one is lost, which is told. One without
/// commands is refused before anything is written.
pub(super) fn all(files: &[PathBuf], model: &RobotModel, arm: &str) -> Result<(Vec<Run>, ExitCode), String> {
    let arms = if arm == "green" { Arms::Green } else { Arms::Gold };
    let (mut runs, mut status) = (Vec::new(), ExitCode::SUCCESS);
    for file in files {
        let (recording, of_this) = recording(file, arms)?;
        if of_this != ExitCode::SUCCESS {
            status = of_this;
        }
        let run = Run::from_recording(&model.mapped(recording), model).map_err(|error| error.to_string())?;
        Commands::of_run(model, &run).map_err(|error| error.to_string())?;
        runs.push(run);
    }
    Ok((runs, status))
}

fn recording(file: &Path, arms: Arms) -> Result<(Recording, ExitCode), String> {
    let name = file.to_string_lossy();
    if name.ends_with(".csv") || name.ends_with(".csv.gz") {
        return Ok((csv::read(file).map_err(|error| error.to_string())?, ExitCode::SUCCESS));
    }
    read::read_with(file, tidy::Options { arms: Some(arms), ..tidy::Options::default() })
}
