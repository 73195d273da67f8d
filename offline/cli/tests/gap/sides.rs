//! What is not the same on both sides: columns, units, signs, the robot.

use crate::common::{Case, Folder, lines, made, near, primary, refused, report, wanted, with_columns};
use gap_report::{Channel, Level, Report, Status};
use std::path::{Path, PathBuf};

const FRICTION: f64 = 2.0;

/// Dry friction of the second joint, in two runs.
fn friction(folder: &Folder) -> Case {
    made(folder, "sides", &[wanted("coulomb_friction", Some(2), &[("f_c", FRICTION)])], 12.0).0
}

fn without(start: &str) -> impl Fn(&str, usize, f64) -> Option<f64> + '_ {
    move |column, _, value| (!column.starts_with(start)).then_some(value)
}

fn told<'r>(report: &'r Report, check: &str) -> &'r str {
    let quality = report.data_quality.iter().find(|quality| quality.check == check);
    &quality.unwrap_or_else(|| panic!("{check} is not told: {:?}", report.data_quality)).message
}

#[test]
fn a_channel_that_the_simulation_lacks_is_not_compared_and_the_report_says_so() {
    let folder = Folder::new("sides-one-side");
    let case = friction(&folder);
    let bare = |what: &str| -> Vec<PathBuf> {
        let bare = |(k, path): (usize, &PathBuf)| with_columns(&folder, &format!("bare-{what}-{k}.csv"), path, without(what));
        case.sim.iter().enumerate().map(bare).collect()
    };
    let case_with = |sim: Vec<PathBuf>| Case { sim, real: case.real.clone(), robot: case.robot.clone() };
    // Without the simulation's torque the numbers of the URDF, a tenth off, must not pass for the robot's.
    let silent = case_with(bare("tau_")).judged(&folder.file("torque"));
    assert!(!silent.inputs.channels.contains(&Channel::JointTorque), "{:?}", silent.inputs.channels);
    assert!(told(&silent, "channel").contains("tau_J") && told(&silent, "channel").contains("friction"));
    assert!(primary(&silent).iter().all(|verdict| verdict.location.channel != Channel::JointTorque), "{}", silent.summary);
    // The others go on as before.
    let still = case_with(bare("truth_jpos")).judged(&folder.file("truth"));
    assert!(!still.inputs.channels.contains(&Channel::Transmission));
    let first = primary(&still)[0];
    assert_eq!(first.physics.to_string(), "coulomb_friction", "{}", still.summary);
    near(first, "f_c", FRICTION, 0.15);
}

#[test]
fn a_channel_that_one_run_lacks_is_left_out_of_all() {
    let folder = Folder::new("sides-one-run");
    let case = friction(&folder);
    // The last run is the one that is held out.
    for (k, name) in ["first", "last"].into_iter().enumerate() {
        let mut real = case.real.clone();
        real[k] = with_columns(&folder, &format!("{name}.csv"), &real[k], without("tau_"));
        let report = Case { real, sim: case.sim.clone(), robot: case.robot.clone() }.judged(&folder.file(name));
        assert!(!report.inputs.channels.contains(&Channel::JointTorque), "{name}: {:?}", report.inputs.channels);
        assert!(told(&report, "channel").contains("tau_J"));
    }
}

#[test]
fn a_torque_that_stands_at_a_limit_is_left_out_there_and_told() {
    let folder = Folder::new("sides-limit");
    let case = friction(&folder);
    // The sensor ends at what the second joint reaches now and then, far below what its friction and weight ask of it.
    let limit = {
        let all = lines(&case.real[0]);
        let at = all[0].split(',').position(|name| name == "tau_2_nm").expect("torque");
        let mut sizes: Vec<f64> =
            all[1..].iter().map(|row| row.split(',').nth(at).expect("a cell").parse::<f64>().expect("a number").abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes[sizes.len() * 9 / 10]
    };
    let cut = |column: &str, _: usize, value: f64| Some(if column == "tau_2_nm" { value.clamp(-limit, limit) } else { value });
    let real = case.real.iter().enumerate().map(|(k, path)| with_columns(&folder, &format!("cut-{k}.csv"), path, cut)).collect();
    let report = Case { real, sim: case.sim.clone(), robot: case.robot.clone() }.judged(&folder.file("out"));
    let said = told(&report, "saturation");
    assert!(said.contains(&format!("{limit:.4}")) && said.contains("left out"), "{said}");
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "coulomb_friction", "{}", report.summary);
    near(first, "f_c", FRICTION, 0.15);
}

#[test]
fn without_a_common_channel_there_is_one_line() {
    let folder = Folder::new("sides-none");
    let case = friction(&folder);
    let only = |folder: &Folder, name: &str, path: &Path, quantity: &'static str| {
        with_columns(folder, name, path, move |column, _, value| {
            let kept = ["t_s", "mpos_", quantity].iter().any(|start| column.starts_with(start));
            kept.then_some(value)
        })
    };
    let real = vec![only(&folder, "real.csv", &case.real[0], "tau_")];
    let sim = vec![only(&folder, "sim.csv", &case.sim[0], "truth_jpos")];
    let out = folder.file("out");
    let output = Case { real, sim, robot: case.robot.clone() }.gap(&out);
    refused(&output, &out, &["nothing to compare", "sim", "lacks tau_J", "leave --sim out"]);
}

/// Recordings in which numbers of the columns that begin so are so many times what they were.
fn scaled(folder: &Folder, case: &Case, name: &str, start: &'static str, times: f64) -> Case {
    let other = |(k, path): (usize, &PathBuf)| {
        with_columns(folder, &format!("{name}-{k}.csv"), path, move |column, _, value| {
            Some(if column.starts_with(start) { times * value } else { value })
        })
    };
    Case { real: case.real.iter().enumerate().map(other).collect(), sim: case.sim.clone(), robot: case.robot.clone() }
}

#[test]
fn other_units_and_signs_are_no_physics() {
    let folder = Folder::new("sides-units");
    let case = friction(&folder);
    let refuses = |name: &str, start: &'static str, times: f64, check: &str, words: &[&str]| {
        let out = folder.file(name);
        let report = report(&out, &scaled(&folder, &case, name, start, times).gap(&out));
        assert_eq!(report.status, Status::InsufficientData, "{name}: {}", report.summary);
        let first = &report.data_quality[0];
        assert_eq!((first.check.as_str(), first.level), (check, Level::Fail), "{name}: {}", first.message);
        assert!(words.iter().all(|word| first.message.contains(word)), "{name}: {}", first.message);
        assert!(report.summary.contains("do not allow a verdict"), "{name}: {}", report.summary);
    };
    refuses("degrees", "mpos_1", 57.295_779_5, "input_scale", &["convert"]);
    refuses("millinewtons", "tau_2", 1000.0, "input_scale", &["torque of elbow", "times that of the simulation", "convert"]);
    refuses("turned", "tau_2", -1.0, "sign_convention", &["torque of elbow", "other sign"]);
}

#[test]
fn a_simulation_of_another_robot_or_of_other_commands_gives_no_verdict() {
    let folder = Folder::new("sides-another");
    let case = friction(&folder);
    let elsewhere = Folder::new("sides-elsewhere");
    // Drives, links and commands of every label are its own.
    let other = made(&elsewhere, "another", &[], 12.0).0;
    let refuses = |name: &str, sim: Vec<PathBuf>| {
        let out = folder.file(name);
        let report = report(&out, &Case { sim, real: case.real.clone(), robot: case.robot.clone() }.gap(&out));
        assert_eq!(report.status, Status::InsufficientData, "{name}: {}", report.summary);
        let first = &report.data_quality[0];
        assert_eq!((first.check.as_str(), first.level), ("same_motion", Level::Fail), "{name}: {}", first.message);
        assert!(first.message.contains("simulate the commands of this recording"), "{name}: {}", first.message);
    };
    refuses("another", other.sim.clone());
    refuses("order", case.sim.iter().rev().cloned().collect());
}

#[test]
fn joints_in_another_order_are_told_by_their_names() {
    let folder = Folder::new("sides-order");
    let case = friction(&folder);
    // Shoulder and elbow exchanged, as by a log that sorts them.
    let exchanged = |(k, path): (usize, &PathBuf)| {
        let all = lines(path);
        let head: Vec<String> = all[0]
            .split(',')
            .map(|name| match name {
                name if name.contains("_1_") => name.replace("_1_", "_2_"),
                name if name.contains("_2_") => name.replace("_2_", "_1_"),
                name => name.to_owned(),
            })
            .collect();
        folder.write(&format!("exchanged-{k}.csv"), format!("{}\n{}\n", head.join(","), all[1..].join("\n")))
    };
    let real = case.real.iter().enumerate().map(exchanged).collect();
    let out = folder.file("out");
    let report = report(&out, &Case { real, sim: case.sim.clone(), robot: case.robot.clone() }.gap(&out));
    assert_eq!(report.status, Status::InsufficientData, "{}", report.summary);
    let first = &report.data_quality[0];
    assert_eq!((first.check.as_str(), first.level), ("same_motion", Level::Fail), "{}", first.message);
    assert!(first.message.starts_with("shoulder moves as elbow does in the simulation"), "{}", first.message);
}

#[test]
fn a_simulation_that_moves_a_little_otherwise_takes_the_comparison_from_all_and_the_report_says_so() {
    let folder = Folder::new("sides-otherwise");
    let case = friction(&folder);
    let turns = lines(&case.sim[0]).len() as f64;
    // The shoulder swings half of its own travel beside what it was commanded to.
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let _ =
        with_columns(&folder, "read.csv", &case.sim[0], |column, _, value| if column == "mpos_1_rad" { Some(value) } else { None });
    for line in &lines(&folder.file("read.csv"))[1..] {
        let value: f64 = line.parse().expect("a number");
        (low, high) = (low.min(value), high.max(value));
    }
    let mut sim = case.sim.clone();
    sim[0] = with_columns(&folder, "swings.csv", &case.sim[0], |column, row, value| {
        let swing = 0.25 * (high - low) * (std::f64::consts::TAU * 3.0 * row as f64 / turns).sin();
        Some(if column == "mpos_1_rad" { value + swing } else { value })
    });
    let report = Case { sim, real: case.real.clone(), robot: case.robot.clone() }.judged(&folder.file("out"));
    let said = told(&report, "same_motion");
    assert!(said.contains("real_1.csv.gz") && said.contains("leave that run out"), "{said}");
}

#[test]
fn what_is_the_same_on_both_sides_is_not_complained_about() {
    let folder = Folder::new("sides-same");
    let case = friction(&folder);
    let report = case.judged(&folder.file("out"));
    let complaints: Vec<&str> = report
        .data_quality
        .iter()
        .filter(|quality| ["channel", "input_scale", "sign_convention", "same_motion"].contains(&quality.check.as_str()))
        .map(|quality| quality.message.as_str())
        .collect();
    assert_eq!(complaints, Vec::<&str>::new());
}
