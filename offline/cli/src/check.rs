//! `ravenpose check`: is this machine ready for hard real time, and what to do if not.

use ravenpose::check::{Level, Question, examine, measure_wakeup};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// Exit status when a requirement is not met (as `diff` has it: 1 found something, 2 trouble).
const NOT_READY: u8 = 1;

pub(crate) fn run(core: Option<usize>, priority: i32, spins: bool, seconds: u64) -> Result<ExitCode, String> {
    if !(1..=95).contains(&priority) {
        return Err(format!("--priority {priority} is outside 1 to 95 (RAVEN's controller runs at 96)"));
    }
    let findings = examine(&Question { sysroot: Path::new("/"), core, priority, spins });
    let mut worst = 0;
    for finding in &findings {
        let mark = match finding.level {
            Level::Ok => "ok  ",
            Level::Warn => "warn",
            Level::Fail => "FAIL",
        };
        worst = worst.max(finding.level as u8);
        println!("{mark}  {:20} {}", finding.id, finding.found);
        if let Some(remedy) = &finding.remedy {
            println!("      {:20} -> {remedy}", "");
        }
    }
    if seconds > 0 {
        match measure_wakeup(Duration::from_secs(seconds), core, priority) {
            Ok(wakeup) => println!("\n{wakeup}"),
            Err(cause) => println!("\nwake-up latency could not be measured: {cause}"),
        }
    }
    let fails = findings.iter().filter(|finding| matches!(finding.level, Level::Fail)).count();
    let warns = findings.iter().filter(|finding| matches!(finding.level, Level::Warn)).count();
    println!("\n{fails} requirements not met, {warns} warnings, {} checks", findings.len());
    Ok(if fails == 0 { ExitCode::SUCCESS } else { ExitCode::from(NOT_READY) })
}
