//! `gap --watch`: a recording of a running robot, a minute at a time.

use crate::common::{Folder, errors, ravenpose, text};
use gap_report::{Report, Status};

#[test]
fn a_weight_picked_up_on_the_way_is_told_within_a_minute() {
    let folder = Folder::new("watch");
    let robot = folder.write(
        "picks.toml",
        "schema = \"ravenpose-robot/1\"\nname = \"picks\"\nbase = \"raven2-nominal\"\n[[effect]]\nphysics = \"payload\"\nfrom_s = 62.0\nparameters = { m_p = 0.3, c_z = -0.45 }\n",
    );
    let (runs, out) = (folder.file("runs"), folder.file("out"));
    let done = ravenpose(&["simulate", "--minutes", "1.75", "--seed", "3", "--robot", text(&robot), "--out", text(&runs)]);
    assert!(done.status.success(), "{}", errors(&done));
    let run = runs.join("run_0001.mcap");
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
    let runs = folder.file("runs");
    let done = ravenpose(&["simulate", "--minutes", "0.1", "--seed", "3", "--out", text(&runs)]);
    assert!(done.status.success(), "{}", errors(&done));
    let (run, out) = (runs.join("run_0001.mcap"), folder.file("out"));
    let output = ravenpose(&["gap", "--watch", "--real", text(&run), text(&run), "--out", text(&out)]);
    crate::common::refused(&output, &out, &["--watch", "one --real"]);
}
