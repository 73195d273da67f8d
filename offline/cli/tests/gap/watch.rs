//! `gap --watch`: a recording of a running robot, a minute at a time.

use crate::common::{Folder, done, errors, holds, named, near, ravenpose, text, with_effect};
use gap_report::{Report, Status};

/// What is said, window by window, of a RAVEN-II with an effect that was watched for 105 s, and the report that is left.
fn watched(folder: &Folder, effect: &str) -> (Vec<String>, Report) {
    let robot = folder.write("robot.toml", with_effect(effect));
    let (run, out) = (folder.run("1.75", Some(&robot), &[]), folder.file("out"));
    let output = ravenpose(&["gap", "--watch", "--real", text(&run), "--out", text(&out)]);
    assert_eq!(output.status.code(), Some(1), "{}", errors(&output));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<String> = words.lines().filter(|line| line.contains(" s: ")).map(str::to_owned).collect();
    assert!(lines.len() >= 4, "{words}");
    let report = std::fs::read_to_string(out.join("report.json")).expect("a report");
    (lines, serde_json::from_str(&report).expect("JSON"))
}

#[test]
fn a_weight_picked_up_on_the_way_is_told_within_a_minute() {
    let effect = "physics = \"payload\"\nfrom_s = 62.0\nparameters = { m_p = 0.3, c_z = -0.45 }";
    let (lines, report) = watched(&Folder::new("watch"), effect);
    assert!(lines[0].contains("agrees with the recordings"), "before the weight the robot is its model: {lines:?}");
    assert!(lines[lines.len() - 1].contains("carries"), "a minute after it: {lines:?}");
    assert_ne!(report.status, Status::NoMismatch);
}

#[test]
fn a_cable_that_slips_on_the_way_is_told_within_a_minute_with_the_joint_and_how_far() {
    for (joint, name, slip) in [(2, "elbow", 0.03), (3, "insertion", 0.002)] {
        let folder = Folder::new(&format!("watch-slip-{joint}"));
        let effect = format!("physics = \"joint_offset\"\njoint = {joint}\nfrom_s = 62.0\nparameters = {{ o = {slip} }}");
        let (lines, report) = watched(&folder, &effect);
        assert!(lines[0].contains("agrees with the recordings"), "before it slips: {lines:?}");
        // The first window that it has been in for more than a moment: from 30 to 90 s.
        assert!(lines[2..].iter().all(|line| line.contains("zero") && line.contains(name)), "{lines:?}");
        let first = named(&report, "joint_offset", name);
        near(first, "o", slip, 0.02);
        let from_s = first.location.time_intervals[0].start_s;
        assert!((from_s - 62.0).abs() < 0.3, "{from_s}");
    }
}

#[test]
fn a_cable_that_creeps_is_told_in_every_minute_though_nobody_saw_it_begin() {
    let effect = "physics = \"cable_creep\"\njoint = 2\nparameters = { J_k = 0.001, T_k = 20.0 }";
    let (lines, report) = watched(&Folder::new("watch-creep"), effect);
    assert!(lines.iter().all(|line| line.contains("elbow") && line.contains("goes on stretching")), "{lines:?}");
    let first = named(&report, "cable_creep", "elbow");
    holds(first, "J_k", 0.001, 0.3);
    holds(first, "T_k", 20.0, 0.5);
}

#[test]
fn a_minute_in_which_the_arm_stands_is_no_end_of_the_watch() {
    let folder = Folder::new("watch-stands");
    let robot = folder.write("robot.toml", with_effect("physics = \"coulomb_friction\"\njoint = 1\nparameters = { f_c = 1.0 }"));
    let (run, moving) = (folder.run("0.4", Some(&robot), &[]), folder.file("moving.csv"));
    done(&["convert", text(&run), text(&moving), "--arm", "gold"]);
    let table = std::fs::read_to_string(moving).expect("a table");
    let mut rows: Vec<String> = table.lines().map(str::to_owned).collect();
    // 70 s of what the last row says, at 50 Hz.
    let (time, rest) = rows[rows.len() - 1].split_once(',').map(|(time, rest)| (time.to_owned(), rest.to_owned())).expect("cells");
    let end_s: f64 = time.parse().expect("t_s first");
    rows.extend((1..=70_000).map(|ms| format!("{:.3},{rest}", end_s + f64::from(ms) * 1e-3)));
    let (real, out) = (folder.write("stands.csv", rows.join("\n") + "\n"), folder.file("out"));
    let output = ravenpose(&["gap", "--watch", "--real", text(&real), "--out", text(&out)]);
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{words}{}", errors(&output));
    assert!(words.lines().filter(|line| line.contains("dry friction")).count() > 0, "{words}");
    assert!(words.lines().any(|line| line.contains("s: not looked at: ")), "{words}");
    let report = std::fs::read_to_string(out.join("report.json")).expect("a report");
    named(&serde_json::from_str(&report).expect("JSON"), "coulomb_friction", "shoulder");
}

#[test]
fn one_recording_is_watched_at_a_time() {
    let folder = Folder::new("watch-two");
    let (run, out) = (folder.run("0.1", None, &[]), folder.file("out"));
    let output = ravenpose(&["gap", "--watch", "--real", text(&run), text(&run), "--out", text(&out)]);
    crate::common::refused(&output, &out, &["--watch", "one --real"]);
}
