//! The examples of ../shared/data/gap-examples, by their README.

use crate::common::{Case, Folder, errors, holds, primary, ravenpose, report, text};
use gap_report::Status;
use std::path::{Path, PathBuf};

fn shared() -> Option<PathBuf> {
    let root = std::env::var_os("RAVENPOSE_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join("data/gap-examples");
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: {} is absent", path.display());
    None
}

fn example(root: &Path, letter: &str) -> Case {
    let run = |kind: &str, k: usize| root.join(letter).join(format!("{kind}_{k}.csv.gz"));
    Case {
        robot: root.join("robot.urdf"),
        real: (1..=2).map(|k| run("real", k)).collect(),
        sim: (1..=2).map(|k| run("sim", k)).collect(),
    }
}

/// Analyses an example; the corrected model, if any, is one that `ravenpose simulate` plays.
fn analysed(letter: &str, judge: impl FnOnce(&gap_report::Report)) {
    let Some(root) = shared() else { return };
    let folder = Folder::new(&format!("example-{letter}"));
    let out = folder.file("out");
    let output = example(&root, letter).gap(&out);
    let report = report(&out, &output);
    judge(&report);
    let corrected = out.join("corrected.toml");
    if corrected.exists() {
        let runs = folder.file("runs");
        let done = ravenpose(&[
            "simulate",
            "--minutes",
            "0.02",
            "--seed",
            "1",
            "--robot",
            text(&corrected),
            "--format",
            "csv",
            "--out",
            text(&runs),
        ]);
        assert!(done.status.success(), "{}", errors(&done));
        assert!(runs.join("run_0001.csv").is_file());
    }
}

#[test]
fn a_is_play_of_the_insertion() {
    analysed("a", |report| {
        assert_eq!(report.status, Status::Explained);
        let [verdict] = primary(report)[..] else { panic!("{:?}", report.verdicts) };
        assert_eq!(verdict.physics.to_string(), "backlash");
        assert_eq!(verdict.location.joint, ["insertion"]);
        holds(verdict, "b", 0.0015, 0.15);
    });
}

#[test]
fn b_is_a_payload_picked_up_on_the_way() {
    analysed("b", |report| {
        assert_eq!(report.status, Status::Explained);
        let [verdict] = primary(report)[..] else { panic!("{:?}", report.verdicts) };
        assert_eq!(verdict.physics.to_string(), "payload");
        holds(verdict, "m_p", 0.25, 0.1);
        assert!(!verdict.location.time_intervals.is_empty(), "it has an onset");
        for interval in &verdict.location.time_intervals {
            assert!((interval.start_s - 5.667).abs() < 0.1, "{} s", interval.start_s);
        }
    });
}

#[test]
fn c_is_nothing() {
    analysed("c", |report| {
        assert_eq!(report.status, Status::NoMismatch);
        assert!(!report.mismatch.detected && report.corrected_model.is_none());
        let [verdict] = primary(report)[..] else { panic!("{:?}", report.verdicts) };
        assert_eq!(verdict.physics.to_string(), "none");
    });
}

#[test]
fn d_is_dry_friction_of_the_shoulder() {
    analysed("d", |report| {
        assert_eq!(report.status, Status::Explained);
        let [verdict] = primary(report)[..] else { panic!("{:?}", report.verdicts) };
        assert_eq!(verdict.physics.to_string(), "coulomb_friction");
        assert_eq!(verdict.location.joint, ["shoulder"]);
        // 0.03 N·m at the motor's shaft, told at the joint.
        holds(verdict, "f_c", 0.03 * 136.207, 0.1);
    });
}
