//! Recordings whose commands are followed.

use crate::read;
use arm::Side;
use recordings::open::{Opened, open};
use recordings::stream::Record;
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
        if model.as_raven().is_some() {
            of_asked_arm(file, &recording, if arms == Arms::Green { Side::Green } else { Side::Gold })?;
        }
        let run = Run::from_recording(&model.mapped(recording), model).map_err(|error| error.to_string())?;
        Commands::of_run(model, &run).map_err(|error| error.to_string())?;
        runs.push(run);
    }
    Ok((runs, status))
}

/// Refuses a recording that says that it is of the other arm alone: the commands of this one are zeros there.
fn of_asked_arm(file: &Path, recording: &Recording, asked: Side) -> Result<(), String> {
    let of = match open(file).map_err(|error| error.to_string())? {
        Opened::States(mut source) => {
            let first = std::iter::from_fn(|| source.next().ok().flatten()).find_map(|record| match record {
                Record::State(state) => Some(state.connected()),
                Record::Truth(_) => None,
            });
            let has = |side: &Side| first.is_none_or(|arms| arms == 0 || arms & (1 << side.index()) != 0);
            if has(&asked) { Some(asked) } else { Side::ALL.into_iter().find(has) }
        }
        Opened::Table(_) => recording.metadata.get("arm").and_then(|name| Side::from_name(name)),
    };
    match of {
        Some(of) if of != asked => Err(format!(
            "{}: is of the {of} arm, not of the {asked} one; write --arm {of}",
            file.display(),
            of = of.name(),
            asked = asked.name()
        )),
        _ => Ok(()),
    }
}

fn recording(file: &Path, arms: Arms) -> Result<(Recording, ExitCode), String> {
    let name = file.to_string_lossy();
    if name.ends_with(".csv") || name.ends_with(".csv.gz") {
        return Ok((csv::read(file).map_err(|error| error.to_string())?, ExitCode::SUCCESS));
    }
    read::read_with(file, tidy::Options { arms: Some(arms), ..tidy::Options::default() })
}
