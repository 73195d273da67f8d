//! `ravenpose convert`: recordings to the state file that the stand-in replays.

use recordings::states::{self, Arms, States};
use recordings::{csv, statefile, synthetic};
use std::path::Path;
use std::process::ExitCode;

/// Seed of the generated recording; stated here so that everybody gets the same.
const SYNTHETIC_SEED: u64 = 1;

pub(crate) fn run(input: &str, out: &Path, arm: &str) -> Result<ExitCode, String> {
    if out.extension().is_none_or(|extension| extension != "rvs") {
        return Err(format!("{}: only state files (.rvs) can be written by this version; name the output OUT.rvs", out.display()));
    }
    let arms = match arm {
        "green" => Arms::Green,
        "both" => Arms::Both,
        _ => Arms::Gold,
    };
    let made = match input.strip_prefix("synthetic:") {
        Some(seconds) => generated(seconds, arms)?,
        None => recorded(input, arms)?,
    };
    for note in &made.notes {
        println!("note: {note}");
    }
    statefile::write(out, &made.states, statefile::PERIOD_NS).map_err(|error| error.to_string())?;
    println!("{}: {} states, {:.3} s", out.display(), made.states.len(), made.states.len() as f64 * 1e-3);
    Ok(ExitCode::SUCCESS)
}

fn generated(seconds: &str, arms: Arms) -> Result<States, String> {
    let seconds: f64 = seconds.parse().map_err(|_| format!("synthetic:{seconds}: not a number of seconds; write synthetic:20"))?;
    synthetic::states(SYNTHETIC_SEED, seconds, arms).map_err(|error| error.to_string())
}

fn recorded(input: &str, arms: Arms) -> Result<States, String> {
    let recording = csv::read(Path::new(input)).map_err(|error| error.to_string())?;
    states::from_recording(&recording, arms).map_err(|error| error.to_string())
}
