//! What the engine says of recordings, with its trace: `look ROBOT REAL... [--sim SIM...]`; for development only.
use gap::analysis::{Given, Options, analyse};
use gap::search::Thresholds;
use simulator::RobotModel;
use std::path::Path;

fn main() {
    let mut words = std::env::args().skip(1);
    let model = RobotModel::load(&words.next().expect("robot")).expect("model");
    let all: Vec<String> = words.collect();
    let mut parts = all.split(|word| word == "--sim");
    let real = parts.next().unwrap_or_default();
    let sim = parts.next().unwrap_or_default();
    let read = |path: &str| recordings::csv::read(Path::new(path)).unwrap_or_else(|error| panic!("{error}"));
    let given: Vec<Given> = real
        .iter()
        .enumerate()
        .map(|(k, path)| Given { id: path.clone(), real: read(path), real_sha256: String::new(), sim: sim.get(k).map(|path| (read(path), String::new())) })
        .collect();
    let options = Options { thresholds: Thresholds::default(), seed: 0, config_sha256: "0".repeat(64), trace: std::env::var("TRACE").is_ok(), urdf_sha256: None };
    match analyse(&model, &given, &options, &mut |_| {}) {
        Err(error) => println!("error: {error}"),
        Ok(outcome) => {
            let report = &outcome.report;
            println!("{}", gap_report::words(report));
            for quality in &report.data_quality {
                println!("  {} {:?}: {}", quality.check, quality.level, quality.message);
            }
            for excess in &report.mismatch.excess_rms {
                println!("  {:?} {} excess {:.3e} floor {:.3e}", excess.channel, excess.joint.as_deref().unwrap_or(""), excess.value, excess.noise_floor);
            }
            for verdict in &report.verdicts {
                let told: Vec<String> = verdict.parameters.iter().map(|p| format!("{} {:.4} [{:.4}, {:.4}]", p.name, p.value, p.ci95[0], p.ci95[1])).collect();
                println!("  {:?} {:?} {:?} p {:.3} {}", verdict.role, verdict.physics, verdict.location.joint, verdict.probability, told.join(", "));
                for fit in &verdict.fit {
                    println!("      {} before {:.4e} after {:.4e}", fit.quantity, fit.before, fit.after);
                }
            }
        }
    }
}
