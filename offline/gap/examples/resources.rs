//! Seconds and memory of each stage of an analysis: `resources REAL [SIM]`, recordings of the built-in arm. For development.
use gap::analysis::analyse;
use gap::given::{Given, Options};
use gap::needed::keep_needed;
use recordings::tidy;
use recordings::{Recording, table};
use simulator::model::RobotModel;
use std::path::Path;
use std::time::Instant;

fn read(path: &str, model: &RobotModel) -> Recording {
    let mut source = tidy::open(Path::new(path), tidy::Options::default()).expect("a recording");
    let mut recording = table::collect(path, source.as_mut()).expect("a table");
    keep_needed(&mut recording, model);
    recording
}

/// Resident memory now and at its peak, MiB; of Linux.
fn memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let of = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        Some(line.trim().trim_end_matches(" kB").parse::<f64>().ok()? / 1024.0)
    };
    format!("{:6.0} MiB, peak {:6.0} MiB", of("VmRSS:").unwrap_or(f64::NAN), of("VmHWM:").unwrap_or(f64::NAN))
}

fn main() {
    let begun = Instant::now();
    let say = |what: &str| println!("{:7.1} s  {}  {what}", begun.elapsed().as_secs_f64(), memory());
    let model = RobotModel::load("raven2-nominal").expect("it ships");
    let real = std::env::args().nth(1).expect("a recording");
    let sim = std::env::args().nth(2);
    let given = Given {
        id: "run".to_owned(),
        real: read(&real, &model),
        real_sha256: "0".repeat(64),
        notes: Vec::new(),
        sim: sim.map(|sim| (read(&sim, &model), "0".repeat(64))),
    };
    say("read");
    let options = Options { trace: std::env::var_os("TRACE").is_some(), ..Options::default() };
    let outcome = analyse(&model, &[given], &options, &mut |what| say(what)).expect("a report");
    say("done");
    for verdict in &outcome.report.verdicts {
        println!("{:?} {} {:?} {:?}", verdict.role, verdict.physics, verdict.location.joint, verdict.parameters.first());
    }
}
