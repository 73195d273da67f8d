//! `ravenpose info`: what is in a recording.

use crate::progress::Progress;
use recordings::describe;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Describes every file; one that cannot be read does not keep the others from being described.
pub(crate) fn run(files: &[PathBuf], json: bool) -> Result<ExitCode, String> {
    let mut failed = Vec::new();
    let mut described = Vec::new();
    for file in files {
        match one(file) {
            Ok(description) if json => described.push(description),
            Ok(description) => say!("{description}"),
            Err(message) => failed.push(message),
        }
    }
    if json {
        let text = serde_json::to_string_pretty(&described).map_err(|error| format!("info: cannot be written as JSON: {error}"))?;
        say!("{text}");
    }
    for message in &failed {
        complain!("ravenpose: {message}");
    }
    Ok(if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(2) })
}

fn one(file: &Path) -> Result<describe::Description, String> {
    let mut progress = Progress::bytes();
    let description = describe::describe(file, &mut |done, total| progress.at(done, total)).map_err(|error| error.to_string());
    progress.end();
    description
}
