//! A whole trial: open both envelopes, judge every case, add up.

use crate::judge::{Judged, judge};
use crate::report::Report;
use crate::run::report;
use crate::score::{Score, score};
use crate::truth::Truth;
use crate::verify::{data, manifest, read, sha256};
use std::path::Path;

/// Scores the folder of a trial. `answered_only`: cases without a report are left out instead of counted as failures.
///
/// # Errors
///
/// Anything that was changed after publication, is missing, or cannot be read.
pub fn trial(folder: &Path, answered_only: bool) -> Result<Score, String> {
    let paths = [folder.join("manifest.json"), folder.join("reports").join("manifest.json")];
    let truths = read(&manifest(&paths[0])?, |case| folder.join("sealed").join(format!("{case}.json")), false)?;
    let reports = read(&manifest(&paths[1])?, |case| report(folder, case), false)?;
    if let Some(stranger) = reports.keys().find(|case| !truths.contains_key(*case)) {
        return Err(format!("{}: a report on case {stranger}, which the truths do not know", paths[1].display()));
    }
    let mut judged: Vec<Judged> = Vec::new();
    for (case, bytes) in &truths {
        let truth: Truth = serde_json::from_slice(bytes).map_err(|error| format!("sealed/{case}.json: {error}"))?;
        data(&folder.join("cases").join(case), &truth.files)?;
        let answer: Option<Report> = reports
            .get(case)
            .map(|bytes| serde_json::from_slice(bytes).map_err(|error| format!("reports/{case}/report.json: {error}")))
            .transpose()?;
        if answer.is_some() || !answered_only {
            judged.push(judge(&truth, answer.as_ref()));
        }
    }
    let hash =
        |path: &Path| std::fs::read(path).map(|bytes| sha256(&bytes)).map_err(|error| format!("{}: {error}", path.display()));
    Ok(score(judged, [hash(&paths[0])?, hash(&paths[1])?]))
}
