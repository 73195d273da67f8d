//! The examples of ../shared/data/gap-examples, by their README.

use crate::common::{Case, Folder, done, holds, primary, shared, text};
use gap_report::{Report, Status, Verdict};
use std::path::Path;

fn example(root: &Path, letter: &str) -> Case {
    let run = |kind: &str, k: usize| root.join(letter).join(format!("{kind}_{k}.csv.gz"));
    Case {
        robot: root.join("robot.urdf"),
        real: (1..=2).map(|k| run("real", k)).collect(),
        sim: (1..=2).map(|k| run("sim", k)).collect(),
    }
}

/// Analyses an example. The corrected model, if any, is one that `ravenpose simulate` plays; it leaves nothing to be found on the run
/// that was held out; and made `wrong`, it is found out again.
fn analysed(letter: &str, wrong: Option<&str>, judge: impl FnOnce(&Report)) {
    let Some(root) = shared("data/gap-examples") else { return };
    let folder = Folder::new(&format!("example-{letter}"));
    let out = folder.file("out");
    let case = example(&root, letter);
    judge(&case.judged(&out));
    let corrected = out.join("corrected.toml");
    if !corrected.exists() {
        return;
    }
    let runs = folder.file("runs");
    let robot = ["--robot", text(&corrected)];
    done(&[&["simulate", "--minutes", "0.02", "--seed", "1", "--format", "csv", "--out", text(&runs)][..], &robot].concat());
    assert!(runs.join("run_0001.csv").is_file());
    let held_out = |robot: &Path| Case { robot: robot.to_owned(), real: vec![case.real[1].clone()], sim: Vec::new() };
    let report = held_out(&corrected).judged(&folder.file("again"));
    assert_eq!(report.status, Status::NoMismatch, "{letter}: {}", report.summary);
    if let Some(parameter) = wrong {
        let text = std::fs::read_to_string(&corrected).expect("a model");
        let at = text.rfind(&format!("{parameter} = ")).expect("the parameter") + parameter.len() + 3;
        let end = at + text[at..].find([' ', ',']).expect("an end");
        let value: f64 = text[at..end].parse().expect("a number");
        let off = folder.write("off.toml", format!("{}{:?}{}", &text[..at], 1.3 * value, &text[end..]));
        let report = held_out(&off).judged(&folder.file("off"));
        assert_ne!(report.status, Status::NoMismatch, "{letter}: {parameter} 30 % off");
    }
}

/// The one verdict, which has to be this physics and explain everything.
fn alone<'r>(report: &'r Report, physics: &str) -> &'r Verdict {
    assert_eq!(report.status, Status::Explained);
    let [verdict] = primary(report)[..] else { panic!("{:?}", report.verdicts) };
    assert_eq!(verdict.physics.to_string(), physics);
    verdict
}

#[test]
fn a_is_play_of_the_insertion() {
    analysed("a", None, |report| {
        let verdict = alone(report, "backlash");
        assert_eq!(verdict.location.joint, ["insertion"]);
        holds(verdict, "b", 0.0015, 0.15);
    });
}

#[test]
fn b_is_a_payload_picked_up_on_the_way() {
    analysed("b", None, |report| {
        let verdict = alone(report, "payload");
        holds(verdict, "m_p", 0.25, 0.1);
        assert!(!verdict.location.time_intervals.is_empty(), "it has an onset");
        for interval in &verdict.location.time_intervals {
            assert!((interval.start_s - 5.667).abs() < 0.1, "{} s", interval.start_s);
        }
    });
}

#[test]
fn c_is_nothing() {
    analysed("c", None, |report| {
        assert_eq!(report.status, Status::NoMismatch);
        assert!(!report.mismatch.detected && report.corrected_model.is_none());
        let [verdict] = primary(report)[..] else { panic!("{:?}", report.verdicts) };
        assert_eq!(verdict.physics.to_string(), "none");
    });
}

#[test]
fn d_is_dry_friction_of_the_shoulder() {
    analysed("d", Some("f_c"), |report| {
        let verdict = alone(report, "coulomb_friction");
        assert_eq!(verdict.location.joint, ["shoulder"]);
        // 0.03 N·m at the motor's shaft, told at the joint.
        holds(verdict, "f_c", 0.03 * 136.207, 0.1);
    });
}
