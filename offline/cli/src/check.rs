//! `ravenpose check`: is this machine ready for hard real time, and what to do if not.

use ravenpose::check::{Finding, Level, Question, examine, measure_wakeup};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// Exit status when a requirement is not met (as `diff` has it: 1 found something, 2 trouble).
const NOT_READY: u8 = 1;

pub(crate) fn run(core: Option<usize>, priority: i32, spins: bool, seconds: u64) -> Result<ExitCode, String> {
    if !(1..=95).contains(&priority) {
        return Err(format!("--priority {priority} is outside 1 to 95 (RAVEN's controller runs at 96)"));
    }
    let mut findings = examine(&Question { sysroot: Path::new("/"), core, priority, spins });
    findings.iter().for_each(show);
    if seconds > 0 {
        let measured = measure_wakeup(Duration::from_secs(seconds), core, priority);
        let wakeup = measured.map_or_else(
            |cause| Finding {
                id: "wakeup",
                level: Level::Fail,
                found: format!("cannot be measured: {cause}"),
                remedy: Some("mend what stands above; --seconds 0 leaves it out".to_owned()),
            },
            |measured| measured.finding(),
        );
        show(&wakeup);
        findings.push(wakeup);
    }
    let count = |level: Level| findings.iter().filter(|finding| finding.level == level).count();
    say!("\n{} requirements not met, {} warnings, {} checks", count(Level::Fail), count(Level::Warn), findings.len());
    Ok(if count(Level::Fail) == 0 { ExitCode::SUCCESS } else { ExitCode::from(NOT_READY) })
}

fn show(finding: &Finding) {
    say!("{:4}  {:18} {}", finding.level.to_string(), finding.id, finding.found);
    if let Some(remedy) = &finding.remedy {
        say!("      {:18} -> {remedy}", "");
    }
}
