//! Lets the tool answer every case, one process per case, and publishes the hashes of its reports.

use crate::verify::{manifest, read, sha256, write_whole};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Runs `tool gap` on every case of the manifest that has no report yet; returns how many reports stand.
///
/// # Errors
///
/// A folder without a manifest; a report that is no longer what was published (lost ones are asked for again). Cases that get no report are
/// told on standard error only.
pub fn run(folder: &Path, tool: &Path, jobs: usize) -> Result<usize, String> {
    let cases: Vec<String> = manifest(&folder.join("manifest.json"))?.into_keys().collect();
    let published = folder.join("reports").join("manifest.json");
    if published.is_file() {
        // It is written anew; what was changed since must not get into it.
        drop(read(&manifest(&published)?, |case| report(folder, case), true)?);
    }
    let (next, troubles) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if !report(folder, case).is_file()
                        && let Err(trouble) = answer(folder, tool, case)
                        && let Ok(mut troubles) = troubles.lock()
                    {
                        troubles.insert(case.clone(), trouble);
                    }
                }
            });
        }
    });
    for (case, trouble) in troubles.into_inner().unwrap_or_default() {
        eprintln!("{case}: {trouble}");
    }
    publish(folder)
}

/// Where the report of a case stands.
pub fn report(folder: &Path, case: &str) -> PathBuf {
    folder.join("reports").join(case).join("report.json")
}

fn files(folder: &Path, start: &str) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let is_run = |path: &PathBuf| path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.starts_with(start));
    let mut paths: Vec<_> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).filter(is_run).collect();
    paths.sort();
    Ok(paths)
}

fn answer(folder: &Path, tool: &Path, case: &str) -> Result<(), String> {
    let data = folder.join("cases").join(case);
    let out = folder.join("reports").join(case);
    let mut words: Vec<OsString> = vec!["gap".into(), "--real".into()];
    words.extend(files(&data, "real_")?.into_iter().map(OsString::from));
    words.push("--sim".into());
    words.extend(files(&data, "sim_")?.into_iter().map(OsString::from));
    words.extend(["--robot".into(), data.join("robot.urdf").into(), "--out".into(), out.into(), "--seed".into(), "1".into()]);
    let done =
        Command::new(tool).args(words).stdin(Stdio::null()).stdout(Stdio::null()).output().map_err(|error| error.to_string())?;
    // 0 no mismatch, 1 mismatch, 2 trouble; a report may stand even then
    if report(folder, case).is_file() {
        return Ok(());
    }
    Err(format!("no report ({}): {}", done.status, String::from_utf8_lossy(&done.stderr).lines().next().unwrap_or("silent")))
}

/// Writes `reports/manifest.json` over the reports that stand; returns how many.
///
/// # Errors
///
/// A folder without a manifest, or trouble with the disk.
pub fn publish(folder: &Path) -> Result<usize, String> {
    let cases = manifest(&folder.join("manifest.json"))?;
    let mut hashes = BTreeMap::new();
    for case in cases.keys() {
        if let Ok(bytes) = std::fs::read(report(folder, case)) {
            hashes.insert(case.clone(), sha256(&bytes));
        }
    }
    let count = hashes.len();
    let text = serde_json::json!({
        "schema": "ravenpose-report-manifest-1",
        "hash": "SHA-256 of each report.json",
        "cases": hashes,
    });
    let path = folder.join("reports").join("manifest.json");
    std::fs::create_dir_all(folder.join("reports")).map_err(|error| error.to_string())?;
    write_whole(&path, format!("{text:#}\n").as_bytes()).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(count)
}
