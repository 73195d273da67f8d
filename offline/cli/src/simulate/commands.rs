//! Recordings whose commands are followed.

use recordings::open::{Opened, open};
use recordings::{Arms, Recording, csv, table, tidy};
use simulator::RobotModel;
use simulator::resimulate::{Commands, Run};
use std::path::{Path, PathBuf};

/// Every recording, as columns of the robot; one without commands is refused before anything is written.
pub(super) fn all(files: &[PathBuf], model: &RobotModel, arm: &str) -> Result<Vec<Run>, String> {
    let arms = if arm == "green" { Arms::Green } else { Arms::Gold };
    let one = |file: &PathBuf| {
        let run = Run::from_recording(&recording(file, arms)?, model).map_err(|error| error.to_string())?;
        Commands::of_run(model, &run).map_err(|error| error.to_string())?;
        Ok(run)
    };
    files.iter().map(one).collect()
}

fn recording(file: &Path, arms: Arms) -> Result<Recording, String> {
    let name = file.to_string_lossy();
    if name.ends_with(".csv") || name.ends_with(".csv.gz") {
        return csv::read(file).map_err(|error| error.to_string());
    }
    match open(file).map_err(|error| error.to_string())? {
        Opened::States(states) => {
            let options = tidy::Options { arms: Some(arms), all_truth: false, orientation: false };
            tidy::to_recording(&name, states, options).map_err(|error| error.to_string())
        }
        Opened::Table(mut source) => table::collect(&name, source.as_mut()).map_err(|error| error.to_string()),
    }
}
