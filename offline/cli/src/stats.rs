//! `ravenpose stats`: what the running service has measured, read from its `stats.json`.

use crate::output;
use ravenpose::report::{self, STATS_VERSION, Stats};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, SystemTime};

/// Older statistics mean that the service does not run.
const AGE_MAX_S: u64 = 5;

pub(crate) fn run(runtime_dir: &Path, watch: bool, hgrm: Option<&Path>) -> Result<ExitCode, String> {
    let path = runtime_dir.join("stats.json");
    if let Some(hgrm) = hgrm {
        let stats = read(&path)?;
        if let Some(why) = not_running(&stats) {
            return Err(format!("{}: {why}; no histograms are written of what does not run: start ravenposed", path.display()));
        }
        write_hgrm(&stats, hgrm)?;
    }
    loop {
        let stats = read(&path)?;
        if watch {
            // Home, draw, clear what is below: no flicker.
            let shown = table(&stats).replace('\n', "\x1b[K\n");
            if !output::say(format_args!("\x1b[H{shown}\x1b[J")) {
                return Ok(ExitCode::SUCCESS);
            }
            std::thread::sleep(Duration::from_secs(1));
        } else {
            output::say(format_args!("{}", table(&stats)));
            return Ok(if not_running(&stats).is_some() { ExitCode::FAILURE } else { ExitCode::SUCCESS });
        }
    }
}

fn read(path: &Path) -> Result<Stats, String> {
    let text = std::fs::read(path).map_err(|cause| {
        let remedy = if cause.kind() == std::io::ErrorKind::PermissionDenied {
            "run this as the service's user, or as a member of its group"
        } else {
            "is ravenposed running? give its report.runtime_dir with --runtime-dir"
        };
        format!("{}: {cause}; {remedy}", path.display())
    })?;
    let stats: Stats = serde_json::from_slice(&text).map_err(|cause| {
        format!("{}: not statistics of this version ({cause}); use the ravenpose of the service", path.display())
    })?;
    if stats.version != STATS_VERSION {
        return Err(format!(
            "{}: statistics of version {}, this program reads {STATS_VERSION}; use the ravenpose of the service",
            path.display(),
            stats.version
        ));
    }
    Ok(stats)
}

/// Why the service that wrote this does not run; none if it does.
fn not_running(stats: &Stats) -> Option<String> {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (age, ahead) = (now.saturating_sub(stats.written_unix_s), stats.written_unix_s.saturating_sub(now));
    let stopping = stats.arms.iter().any(|arm| arm.flags.iter().any(|flag| flag == "stopping"));
    if stopping {
        Some(format!("NOT RUNNING: stopped {age} s ago"))
    } else if age > AGE_MAX_S {
        Some(format!("NOT RUNNING: last statistics {age} s ago"))
    } else {
        (ahead > AGE_MAX_S).then(|| format!("NOT KNOWN TO RUN: last statistics {ahead} s ahead of this machine's clock"))
    }
}

fn table(stats: &Stats) -> String {
    let mut text = String::new();
    let state = not_running(stats).unwrap_or_else(|| "running".to_owned());
    let _ = writeln!(text, "ravenposed {state}, pid {}, up {} s", stats.pid, stats.uptime_s);
    for arm in &stats.arms {
        let model = if arm.model.is_empty() { "no model" } else { &arm.model };
        let _ = writeln!(text, "  {:5} {:9} {:40} {model}", arm.arm, arm.status, arm.flags.join(" "));
    }
    let _ = writeln!(
        text,
        "\n  {:18} {:>10} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "latency, us", "count", "min", "p50", "p99", "p99.9", "max"
    );
    for stage in &stats.stages {
        let us = |ns: u64| ns as f64 / 1000.0;
        let _ = writeln!(
            text,
            "  {:18} {:>10} {:>9.2} {:>9.2} {:>9.2} {:>9.2} {:>9.2}",
            stage.name,
            stage.count,
            us(stage.min),
            us(stage.p50),
            us(stage.p99),
            us(stage.p999),
            us(stage.max)
        );
    }
    let _ = writeln!(text);
    for row in stats.counters.chunks(4) {
        for counter in row {
            let _ = write!(text, "  {:17} {:>10}", counter.name, counter.value);
        }
        let _ = writeln!(text);
    }
    text
}

fn write_hgrm(stats: &Stats, hgrm: &Path) -> Result<(), String> {
    output::check_file(hgrm, &[])?;
    let extension = hgrm.extension().map_or_else(|| "hgrm".into(), |e| e.to_string_lossy().into_owned());
    let stem = hgrm.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    for stage in &stats.stages {
        let histogram = stage.histogram().ok_or(format!("the histogram of {} is damaged; try again", stage.name))?;
        let path: PathBuf = hgrm.with_file_name(format!("{stem}.{}.{extension}", stage.name));
        output::all(&path, report::hgrm(&histogram).as_bytes())?;
    }
    Ok(())
}
