//! Cases that the generator makes, so that something is asserted where ../shared is absent.

use crate::common::{Case, Folder, errors, made, near, primary, ravenpose, report, text};
use gap_report::{Report, Status};
use generator::order::Wanted;
use std::path::Path;

fn wanted(physics: &str, joint: Option<usize>, parameters: &[(&str, f64)]) -> Wanted {
    let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    Wanted { physics: physics.to_owned(), joint, parameters, ..Wanted::default() }
}

#[test]
fn of_nothing_nothing_is_said() {
    let folder = Folder::new("null");
    let (case, truth) = made(&folder, "null", &[], 12.0);
    assert!(truth.is_empty());
    let out = folder.file("out");
    let output = case.gap(&out);
    let report = report(&out, &output);
    assert_eq!(report.status, Status::NoMismatch, "{}", report.summary);
    assert!(!out.join("corrected.toml").exists());
}

#[test]
fn dry_friction_is_named_at_its_joint_and_measured() {
    let folder = Folder::new("coulomb");
    let (case, truth) = made(&folder, "coulomb", &[wanted("coulomb_friction", Some(2), &[("f_c", 2.0)])], 12.0);
    let out = folder.file("out");
    let output = case.gap(&out);
    let report = report(&out, &output);
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "coulomb_friction", "{}", report.summary);
    assert_eq!(first.location.joint, [truth[0].joint_name.clone().expect("a joint")]);
    near(first, "f_c", truth[0].effect.parameters["f_c"], 0.15);
}

#[test]
fn a_payload_is_named_and_weighed_the_same_each_time() {
    let folder = Folder::new("payload");
    let (case, truth) = made(&folder, "payload", &[wanted("payload", None, &[("m_p", 0.3)])], 12.0);
    let (first, second) = (folder.file("first"), folder.file("second"));
    let reports = [&first, &second].map(|out| {
        let output = case.gap_with(out, &["--seed", "9"]);
        report(out, &output)
    });
    let verdict = primary(&reports[0])[0];
    assert_eq!(verdict.physics.to_string(), "payload", "{}", reports[0].summary);
    let m = truth[0].effect.parameters["m_p"];
    near(verdict, "m_p", m, 0.2);
    assert_eq!(reports[0].tool.seed, 9);
    assert_eq!(timeless(&reports[0]), timeless(&reports[1]));
    let corrected = |out: &Path| std::fs::read_to_string(out.join("corrected.toml")).expect("a model");
    assert_eq!(corrected(&first), corrected(&second));
}

/// The report but for when it was made and how long that took.
fn timeless(report: &Report) -> serde_json::Value {
    let mut value = serde_json::to_value(report).expect("JSON");
    for key in ["created", "timing"] {
        value.as_object_mut().expect("an object").remove(key);
    }
    value
}

#[test]
fn a_corrected_model_leaves_nothing_to_be_found() {
    // What was found, put into the model, and the recordings compared with that.
    let folder = Folder::new("again");
    let robot = folder.write(
        "stiff.toml",
        "schema = \"ravenpose-robot/1\"\nname = \"heavy\"\nbase = \"raven2-nominal\"\n[[effect]]\nphysics = \"payload\"\nparameters = { m_p = 0.2, c_z = -0.45 }\n",
    );
    let runs = folder.file("runs");
    let done = ravenpose(&["simulate", "--minutes", "0.5", "--seed", "3", "--robot", text(&robot), "--out", text(&runs)]);
    assert!(done.status.success(), "{}", errors(&done));
    let case = |robot: &Path| Case { robot: robot.to_owned(), real: vec![runs.join("run_0001.mcap")], sim: Vec::new() };
    let out = folder.file("same");
    let output = case(&robot).gap(&out);
    assert_eq!(report(&out, &output).status, Status::NoMismatch, "a robot agrees with its own simulation");
}
