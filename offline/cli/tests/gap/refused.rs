//! Bad input: one clear line each, exit status 2, nothing written; too little data: the same status with a report.

use crate::common::{Case, Folder, lines, made, ravenpose, refused, report, text};
use gap_report::{Level, Status};
use std::path::{Path, PathBuf};

/// A case without an effect, its first recording and simulation as lines.
struct Base {
    folder: Folder,
    case: Case,
    real: Vec<String>,
    sim: Vec<String>,
}

impl Base {
    fn new(name: &str, seconds: f64) -> Self {
        let folder = Folder::new(name);
        let (case, _) = made(&folder, "base", &[], seconds);
        let (real, sim) = (lines(&case.real[0]), lines(&case.sim[0]));
        Self { folder, case, real, sim }
    }

    fn out(&self) -> PathBuf {
        self.folder.file("out")
    }

    /// The case with another first recording.
    fn with_real(&self, name: &str, lines: &[String]) -> Case {
        let path = self.folder.write(name, lines.join("\n") + "\n");
        Case { robot: self.case.robot.clone(), real: vec![path], sim: vec![self.case.sim[0].clone()] }
    }

    fn column(&self, name: &str) -> usize {
        self.real[0].split(',').position(|column| column == name).unwrap_or_else(|| panic!("{name} in {}", self.real[0]))
    }

    /// The recording with cells of a column changed, by row from 1.
    fn changed(&self, column: &str, cell: impl Fn(usize, &str) -> String) -> Vec<String> {
        let at = self.column(column);
        let change = |(row, line): (usize, &String)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if row > 0 {
                cells[at] = cell(row, &cells[at]);
            }
            cells.join(",")
        };
        self.real.iter().enumerate().map(change).collect()
    }

    fn refuses(&self, name: &str, lines: &[String], words: &[&str]) {
        let output = self.with_real(name, lines).gap(&self.out());
        refused(&output, &self.out(), words);
    }
}

#[test]
fn a_file_that_cannot_be_read_is_named_with_the_place_and_the_remedy() {
    let base = Base::new("files", 3.0);
    let (folder, out) = (&base.folder, base.out());
    let of = |real: PathBuf, sim: Option<PathBuf>, robot: &Path| Case {
        robot: robot.to_owned(),
        real: vec![real],
        sim: sim.into_iter().collect(),
    };
    let (robot, real, sim) = (&base.case.robot, &base.case.real[0], &base.case.sim[0]);

    let missing = folder.file("missing.csv");
    refused(&of(missing.clone(), None, robot).gap(&out), &out, &["missing.csv", "cannot be opened", "check the path"]);
    refused(&of(real.clone(), Some(missing.clone()), robot).gap(&out), &out, &["missing.csv", "cannot be opened"]);
    refused(
        &of(real.clone(), Some(sim.clone()), &folder.file("missing.urdf")).gap(&out),
        &out,
        &["missing.urdf", "cannot be read", "give a robot file"],
    );
    refused(&of(folder.write("empty.csv", ""), None, robot).gap(&out), &out, &["empty.csv", "is empty"]);
    refused(
        &of(folder.write("bare.csv", "t_s,mpos_1_rad,mpos_2_rad,mpos_3_rad\n"), None, robot).gap(&out),
        &out,
        &["bare.csv", "no rows", "record at least"],
    );
    refused(&of(folder.write("noise.csv", [0xff_u8; 300]), None, robot).gap(&out), &out, &["noise.csv"]);
    refused(&of(folder.file(""), None, robot).gap(&out), &out, &["is a folder"]);
    let broken = folder.write("broken.urdf", "<robot name=\"x\"><link name=\"a\"/><joint");
    refused(&of(real.clone(), Some(sim.clone()), &broken).gap(&out), &out, &["broken.urdf", "not well-formed XML"]);
    let broken = folder.write("broken.toml", "schema = \"ravenpose-robot/1\"\nname = \n");
    refused(&of(real.clone(), Some(sim.clone()), &broken).gap(&out), &out, &["broken.toml", "line 2"]);

    // As many simulations as recordings.
    let two = Case { robot: robot.clone(), real: base.case.real.clone(), sim: vec![sim.clone()] };
    refused(&two.gap(&out), &out, &["2 recordings and 1 simulations", "one --sim for each --real"]);
    // A file where the folder should be, or above it.
    let file = folder.write("file", "keep me");
    for place in [file.clone(), file.join("deeper/out")] {
        let output = base.case.gap(&place);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.lines().count() == 1 && error.contains("is a file; give a folder with --out"), "{error}");
    }
    assert_eq!(std::fs::read_to_string(&file).expect("file"), "keep me");
    // Wrong use altogether: usage, status 2.
    assert_eq!(ravenpose(&["gap", "--out", text(&out)]).status.code(), Some(2));
}

#[test]
fn a_table_that_is_no_run_of_this_robot_is_refused_with_the_column() {
    let base = Base::new("tables", 3.0);
    let rows = |header: &str, row: fn(f64) -> String| -> Vec<String> {
        std::iter::once(header.to_owned()).chain((0..2000).map(|k| row(f64::from(k) * 1e-3))).collect()
    };
    base.refuses("table.csv", &rows("x_mm,y_mm,z_mm", |t| format!("{t},1,2")), &["table.csv", "t_s"]);
    base.refuses(
        "foreign.csv",
        &rows("t_s,volume,pitch", |t| format!("{t},{t},2")),
        &["foreign.csv", "neither mpos_1_rad nor jpos_1_rad", "--robot"],
    );
    base.refuses(
        "unit.csv",
        &rows("t_s,mpos_1_inch,mpos_2_rad,mpos_3_rad", |t| format!("{t},{t},{t},{t}")),
        &["unit.csv", "line 1, column 2", "inch", "use rad"],
    );
    base.refuses("two.csv", &rows("t_s,mpos_1_rad,mpos_2_rad", |t| format!("{t},{t},{t}")), &["two.csv", "mpos_3_rad", "3 joints"]);
    base.refuses(
        "kind.csv",
        &rows("t_s,mpos_1_rad,mpos_2_rad,mpos_3_rad,truth_jpos_1_rad,truth_jpos_2_rad,truth_jpos_3_rad", |t| {
            format!("{t},{t},{t},{t},{t},{t},{t}")
        }),
        &["kind.csv", "truth_jpos_3_rad", "joint 3", "slides", "--robot"],
    );
    // Positions alone show nothing of torque, joints or tip.
    base.refuses(
        "alone.csv",
        &rows("t_s,mpos_1_rad,mpos_2_rad,mpos_3_rad", |t| format!("{t},{t},{t},{t}")),
        &["alone.csv", "torque", "record tau"],
    );
}

#[test]
fn a_bad_cell_is_named_by_line_and_column() {
    let base = Base::new("cells", 3.0);
    let cell = |row: usize, column: &str, text: &'static str| {
        base.changed(column, |k, old| if k == row { text.to_owned() } else { old.to_owned() })
    };
    let place = |row: usize, column: &str| format!("line {}, column {} `{column}`", row + 1, base.column(column) + 1);
    base.refuses(
        "nan.csv",
        &cell(700, "tau_2_nm", "NaN"),
        &["nan.csv", &place(700, "tau_2_nm"), "not a finite number", "remove the row"],
    );
    base.refuses("inf.csv", &cell(1, "mpos_1_rad", "inf"), &["inf.csv", &place(1, "mpos_1_rad"), "not a finite number"]);
    base.refuses(
        "word.csv",
        &cell(12, "truth_jpos_1_rad", "lost"),
        &["word.csv", &place(12, "truth_jpos_1_rad"), "`lost` is not a number"],
    );
    base.refuses("untimed.csv", &cell(3, "t_s", ""), &["untimed.csv", &place(3, "t_s"), "empty"]);
    // Time stands still, or runs backward.
    let time = base.column("t_s");
    let of = |row: usize| base.real[row].split(',').nth(time).expect("time").to_owned();
    for (name, from, to) in [("twice.csv", 99, 100), ("back.csv", 40, 100)] {
        let lines = base.changed("t_s", |k, old| if k == to { of(from) } else { old.to_owned() });
        base.refuses(name, &lines, &[name, &place(to, "t_s"), "does not rise", "drop repeated times"]);
    }
    let mut ragged = base.real.clone();
    ragged[50].push_str(",1");
    base.refuses("ragged.csv", &ragged, &["ragged.csv", "line 51", "cells where the header has"]);
}

#[test]
fn a_dead_sensor_and_a_robot_that_stands_still_are_refused_with_the_column() {
    let base = Base::new("dead", 3.0);
    let held = |column: &str| base.changed(column, |_, _| "0.25".to_owned());
    base.refuses(
        "truth.csv",
        &held("truth_jpos_2_rad"),
        &["truth.csv", "truth_jpos_2_rad", "same in every row", "leave the column out"],
    );
    base.refuses("torque.csv", &held("tau_1_nm"), &["torque.csv", "torque of joint 1", "same in every row"]);
    let still: Vec<String> = std::iter::once("t_s,mpos_1_rad,mpos_2_rad,mpos_3_rad,tau_1_nm,tau_2_nm,tau_3_nm".to_owned())
        .chain((0..12_000).map(|k| format!("{:.3},1,2,3,{},0.1,0.1", f64::from(k) * 1e-3, f64::from(k % 7))))
        .collect();
    base.refuses("still.csv", &still, &["still.csv", "nothing moves", "record while all joints move"]);
}

#[test]
fn a_simulation_of_another_time_is_refused_with_both_spans() {
    let base = Base::new("span", 3.0);
    let time = base.column("t_s");
    let later: Vec<String> = base
        .sim
        .iter()
        .enumerate()
        .map(|(row, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if row > 0 {
                cells[time] = format!("{:.3}", 100.0 + cells[time].parse::<f64>().expect("time"));
            }
            cells.join(",")
        })
        .collect();
    let sim = base.folder.write("later.csv", later.join("\n") + "\n");
    let case = Case { sim: vec![sim], real: vec![base.case.real[0].clone()], robot: base.case.robot.clone() };
    refused(&case.gap(&base.out()), &base.out(), &["later.csv", "100.0", "do not overlap", "same order"]);
    // Nor is one in milliseconds another motion.
    let ms = |_: usize, old: &str| format!("{:.0}", 1e3 * old.parse::<f64>().expect("time"));
    base.refuses("ms.csv", &base.changed("t_s", ms), &["ms.csv", "1000 times", "a time in ms", "give t_s in seconds"]);
    // One time that is off by years must not ask for the memory of years.
    let last = base.real.len() - 1;
    let jump = base.changed("t_s", |k, old| if k == last { "1e9".to_owned() } else { old.to_owned() });
    base.refuses("jump.csv", &jump, &["jump.csv", "time jumps", "make two runs"]);
}

#[test]
fn two_seconds_are_too_few_and_the_report_says_how_long_to_record() {
    let folder = Folder::new("short");
    let (mut case, _) = made(&folder, "short", &[], 2.0);
    case.real.truncate(1);
    case.sim.truncate(1);
    let out = folder.file("out");
    // What an earlier analysis left must not pass for this one's.
    std::fs::create_dir_all(&out).expect("folder");
    std::fs::write(out.join("corrected.toml"), "old").expect("old model");
    let output = case.gap(&out);
    let report = report(&out, &output);
    assert_eq!(report.status, Status::InsufficientData);
    let told = report.data_quality.iter().find(|quality| quality.level == Level::Fail).expect("what is missing");
    assert!(told.message.contains("record at least 9 s") && told.message.contains("all joints moving"), "{}", told.message);
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(words.contains("record at least 9 s"), "{words}");
}
