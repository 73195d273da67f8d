//! Recordings as they come: cells that are empty, rows that were lost, other rates, other lengths, other formats.

use crate::common::{Case, Folder, done, lines, made, named, parameter, primary, ravenpose, report, text, wanted, with_effect};
use gap_report::{Report, Status};
use std::path::{Path, PathBuf};

const FRICTION: f64 = 2.0;

/// Dry friction of the second joint.
fn friction(folder: &Folder) -> Case {
    made(folder, "gaps", &[wanted("coulomb_friction", Some(2), &[("f_c", FRICTION)])], 12.0).0
}

/// A table with its rows changed: row from 1, its cells by the header's names.
fn changed(folder: &Folder, name: &str, path: &Path, change: impl Fn(usize, &[&str], &mut Vec<String>) -> bool) -> PathBuf {
    let all = lines(path);
    let header: Vec<&str> = all[0].split(',').collect();
    let mut kept = vec![all[0].clone()];
    for (row, line) in all.iter().enumerate().skip(1) {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if change(row, &header, &mut cells) {
            kept.push(cells.join(","));
        }
    }
    folder.write(name, kept.join("\n") + "\n")
}

fn at(header: &[&str], column: &str) -> usize {
    header.iter().position(|name| *name == column).unwrap_or_else(|| panic!("{column}"))
}

/// All its recordings changed.
fn recorded(case: Case, folder: &Folder, change: impl Fn(usize, &[&str], &mut Vec<String>) -> bool) -> Case {
    let of = |(k, path): (usize, &PathBuf)| changed(folder, &format!("changed_{k}.csv"), path, &change);
    Case { real: case.real.iter().enumerate().map(of).collect(), ..case }
}

/// The friction that the report names at the elbow.
fn named_friction(report: &Report) -> f64 {
    parameter(named(report, "coulomb_friction", "elbow"), "f_c").0
}

fn near_the_truth(found: f64) {
    assert!((found - FRICTION).abs() < 0.15 * FRICTION, "{found}");
}

#[test]
fn empty_cells_and_lost_rows_are_left_out_and_change_little() {
    let folder = Folder::new("holes");
    let case = friction(&folder);
    let whole = named_friction(&case.judged(&folder.file("whole")));
    near_the_truth(whole);
    // A third of a second without joint encoders, as long without torque, single cells everywhere, a stretch of lost rows; what
    // stands in them is empty, so any of it that got through would be no number.
    let holes = |row: usize, header: &[&str], cells: &mut Vec<String>| {
        let mut empty = |column: &str| cells[at(header, column)].clear();
        if (2000..2333).contains(&row) {
            (1..=2).for_each(|j| empty(&format!("truth_jpos_{j}_rad")));
            empty("truth_jpos_3_m");
        }
        if (5000..5333).contains(&row) || row % 500 == 77 {
            (1..=3).for_each(|j| empty(&format!("tau_{j}_nm")));
        }
        if row % 700 == 5 {
            empty("mpos_1_rad");
        }
        !(8000..8200).contains(&row)
    };
    let report = recorded(case, &folder, holes).judged(&folder.file("out"));
    let found = named_friction(&report);
    assert!((found - whole).abs() < 0.05 * whole, "{found} with holes, {whole} without");
    let told = report.data_quality.iter().find(|quality| quality.check == "gaps").expect("the gaps are told");
    // 333 + 333 + 200 of 12000 samples.
    assert!(told.message.contains("7.2 %"), "{}", told.message);
}

#[test]
fn a_channel_that_is_mostly_empty_is_left_out_and_the_others_stay() {
    let folder = Folder::new("mostly");
    let case = friction(&folder);
    let mostly = |row: usize, header: &[&str], cells: &mut Vec<String>| {
        if row > 4000 {
            (1..=2).for_each(|j| cells[at(header, &format!("truth_jpos_{j}_rad"))].clear());
            cells[at(header, "truth_jpos_3_m")].clear();
        }
        true
    };
    let report = recorded(case, &folder, mostly).judged(&folder.file("out"));
    near_the_truth(named_friction(&report));
    assert!(report.data_quality.iter().any(|quality| quality.message.contains("truth_jpos")), "{:?}", report.data_quality);
    assert!(!report.inputs.channels.contains(&gap_report::Channel::Transmission));
}

#[test]
fn of_unequal_lengths_rates_and_starts_the_common_stretch_counts() {
    let folder = Folder::new("stretch");
    let case = friction(&folder);
    // Each simulation begins later, ends earlier and has every other row.
    let shorter = |row: usize, _: &[&str], _: &mut Vec<String>| (700..11_000).contains(&row) && row.is_multiple_of(2);
    let sim = case.sim.iter().enumerate().map(|(k, path)| changed(&folder, &format!("short_{k}.csv"), path, shorter)).collect();
    let report = Case { sim, ..case }.judged(&folder.file("out"));
    near_the_truth(named_friction(&report));
    for run in &report.inputs.runs {
        assert!((run.duration_s - 10.3).abs() < 0.01, "{} s", run.duration_s);
    }
}

#[test]
fn a_camera_that_looks_at_other_times_than_the_simulations_is_compared_frame_by_frame() {
    let folder = Folder::new("frames");
    let case = made(&folder, "frames", &[wanted("link_geometry", Some(2), &[("d_length", 0.003)])], 12.0).0;
    let whole = primary(&case.judged(&folder.file("whole")))[0].clone();
    // A frame every 40 ms, beside every other one of the recording's camera: these must not be compared with it, and the others without.
    let sparse = |row: usize, header: &[&str], cells: &mut Vec<String>| {
        if row % 40 != 1 {
            for column in ["truth_x_mm", "truth_y_mm", "truth_z_mm"] {
                cells[at(header, column)].clear();
            }
        }
        true
    };
    let sim = case.sim.iter().enumerate().map(|(k, path)| changed(&folder, &format!("frames_{k}.csv"), path, sparse)).collect();
    let report = Case { sim, ..case }.judged(&folder.file("out"));
    let first = primary(&report)[0];
    assert_eq!(first.physics.to_string(), "link_geometry", "{}", report.summary);
    let (found, before) = (parameter(first, "d_length").0, parameter(&whole, "d_length").0);
    assert!((found - before).abs() < 0.001 * before.abs(), "{found}, {before} with all frames");
    let (left, before) = (first.fit[0].after, whole.fit[0].after);
    assert!((left - before).abs() < 0.005 * before, "{left} m left, {before} with all frames");
}

#[test]
fn states_of_a_raven_and_their_table_are_analysed_alike() {
    let folder = Folder::new("formats");
    let effect = "physics = \"coulomb_friction\"\njoint = 1\nparameters = { f_c = 1.0 }";
    let robot = folder.write("loose.toml", with_effect(effect));
    let run = folder.run("0.5", Some(&robot), &["--arm", "both"]);
    let mut verdicts = Vec::new();
    for name in ["run.mcap", "run.rvs", "run.parquet", "run.csv"] {
        let other = folder.file(name);
        let mut words = vec!["convert", text(&run), text(&other)];
        if name == "run.csv" {
            words.extend(["--arm", "gold"]);
        }
        done(&words);
        let out = folder.file(&format!("out-{name}"));
        let output = ravenpose(&["gap", "--real", text(&other), "--out", text(&out)]);
        let report = report(&out, &output);
        assert_eq!(report.status, Status::Explained, "{name}: {}", report.summary);
        let first = primary(&report)[0];
        assert_eq!((first.physics.to_string().as_str(), first.location.joint.len()), ("coulomb_friction", 1), "{name}");
        verdicts.push(first.parameters[0].value);
        let both = report.data_quality.iter().any(|quality| quality.message.contains("holds both arms; the gold one"));
        assert_eq!(both, name != "run.csv", "{name}");
    }
    for value in &verdicts {
        assert!((value - 1.0).abs() < 0.1, "{verdicts:?}");
    }
}

#[test]
fn a_cut_recording_is_used_up_to_the_cut_and_the_report_says_so() {
    let folder = Folder::new("cut");
    let whole = std::fs::read(folder.run("0.5", None, &[])).expect("run");
    let cut = folder.write("cut.mcap", &whole[..whole.len() * 2 / 3]);
    let out = folder.file("out");
    let output = ravenpose(&["gap", "--real", text(&cut), "--out", text(&out)]);
    let report = report(&out, &output);
    let told = report.data_quality.iter().find(|quality| quality.check == "file").expect("the damage is told");
    assert!(told.message.contains("cut.mcap: byte "), "{}", told.message);
    assert!((15.0..25.0).contains(&report.inputs.runs[0].duration_s), "{} s", report.inputs.runs[0].duration_s);
}
