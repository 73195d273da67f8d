//! `gap --watch`: a recording of a running robot, a minute at a time.

use crate::common::{Folder, errors, ravenpose, text, with_effect};
use gap_report::{Report, Status};

#[test]
fn a_weight_picked_up_on_the_way_is_told_within_a_minute() {
    let folder = Folder::new("watch");
    let effect = "physics = \"payload\"\nfrom_s = 62.0\nparameters = { m_p = 0.3, c_z = -0.45 }";
    let robot = folder.write("picks.toml", with_effect(effect));
    let (run, out) = (folder.run("1.75", Some(&robot), &[]), folder.file("out"));
    let output = ravenpose(&["gap", "--watch", "--real", text(&run), "--out", text(&out)]);
    assert_eq!(output.status.code(), Some(1), "{}", errors(&output));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<&str> = words.lines().filter(|line| line.contains(" s: ")).collect();
    assert!(lines.len() >= 4, "{words}");
    assert!(lines[0].contains("agrees with the recordings"), "before the weight the robot is its model: {words}");
    assert!(lines[lines.len() - 1].contains("carries"), "a minute after it: {words}");
    let report = std::fs::read_to_string(out.join("report.json")).expect("a report");
    let report: Report = serde_json::from_str(&report).expect("JSON");
    assert_ne!(report.status, Status::NoMismatch);
}

#[test]
fn one_recording_is_watched_at_a_time() {
    let folder = Folder::new("watch-two");
    let (run, out) = (folder.run("0.1", None, &[]), folder.file("out"));
    let output = ravenpose(&["gap", "--watch", "--real", text(&run), text(&run), "--out", text(&out)]);
    crate::common::refused(&output, &out, &["--watch", "one --real"]);
}
