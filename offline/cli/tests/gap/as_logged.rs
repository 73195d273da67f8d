//! Recordings that are what labs log: a joint that stands, rows that are repeated, columns that are missing, clocks that begin anywhere.

use crate::common::{Case, Folder, lines, made, named, parameter, primary, refused, text, wanted};
use gap_report::{Level, Report, Status};
use simulator::RobotModel;
use std::path::{Path, PathBuf};

/// A table in memory.
struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn at(&self, column: &str) -> usize {
        self.header.iter().position(|name| name == column).unwrap_or_else(|| panic!("no column {column}"))
    }

    fn set(&mut self, column: &str, value: impl Fn(&[String]) -> f64) {
        let place = self.at(column);
        for row in &mut self.rows {
            row[place] = value(row).to_string();
        }
    }

    fn drop_column(&mut self, column: &str) {
        let place = self.at(column);
        self.header.remove(place);
        for row in &mut self.rows {
            row.remove(place);
        }
    }
}

fn number(cell: &str) -> f64 {
    cell.parse().expect("a number")
}

/// A table rewritten.
fn rewritten(folder: &Folder, name: &str, path: &Path, change: &dyn Fn(&mut Table)) -> PathBuf {
    let all = lines(path);
    let cells = |line: &String| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let mut table = Table { header: cells(&all[0]), rows: all[1..].iter().map(cells).collect() };
    change(&mut table);
    let rows: Vec<String> = std::iter::once(&table.header).chain(&table.rows).map(|row| row.join(",")).collect();
    folder.write(name, rows.join("\n") + "\n")
}

/// The same of all recordings of a case, or of all simulations.
fn all(folder: &Folder, kind: &str, paths: &[PathBuf], change: &dyn Fn(&mut Table)) -> Vec<PathBuf> {
    paths.iter().enumerate().map(|(k, path)| rewritten(folder, &format!("{kind}-{k}.csv"), path, change)).collect()
}

fn nothing(folder: &Folder) -> Case {
    made(folder, "as logged", &[], 12.0).0
}

fn ratio(case: &Case, joint: usize) -> f64 {
    RobotModel::load(text(&case.robot)).expect("a robot").motor_from_joint()[joint][joint]
}

/// What is said of the data, by check.
fn told<'r>(report: &'r Report, check: &str) -> Vec<&'r str> {
    report.data_quality.iter().filter(|told| told.check == check).map(|told| told.message.as_str()).collect()
}

#[test]
fn a_joint_that_stands_has_no_sign_and_is_where_it_hangs() {
    // Its series is one number but for rounding, which goes like anything; and a cable gives by some tenths of a millimetre.
    let folder = Folder::new("stands-there");
    let case = nothing(&folder);
    let ratio = ratio(&case, 2);
    for off in [-135e-6, 485e-6] {
        let at = |place: f64| {
            move |table: &mut Table| {
                let (motor, truth) = (table.at("mpos_3_rad"), table.at("truth_jpos_3_m"));
                let behind = move |row: &[String]| number(&row[truth]) - number(&row[motor]) / ratio;
                table.set("truth_jpos_3_m", move |row| place + behind(row));
                table.set("mpos_3_rad", move |_| place * ratio);
                table.set("jpos_d_3_m", |_| -0.2);
                for axis in ["x", "y", "z"] {
                    table.drop_column(&format!("truth_{axis}_mm"));
                }
            }
        };
        let (real, sim) = (all(&folder, "real", &case.real, &at(-0.2)), all(&folder, "sim", &case.sim, &at(-0.2 + off)));
        let report = Case { robot: case.robot.clone(), real, sim }.judged(&folder.file("out"));
        assert_eq!(report.status, Status::NoMismatch, "{off}: {}", report.summary);
        assert!(told(&report, "excitation").iter().any(|told| told.contains("insertion does not move")));
        assert!(report.data_quality.iter().all(|told| told.level != Level::Fail));
    }
}

#[test]
fn rows_that_are_repeated_make_nothing_late() {
    // Places were taken as they were read, and a torque that was held beside them came late.
    let folder = Folder::new("repeated");
    let case = nothing(&folder);
    let repeated = |every: usize| {
        move |table: &mut Table| {
            // The camera has frames of its own.
            let goes_on = ["t_s", "truth_x_mm", "truth_y_mm", "truth_z_mm"];
            let held: Vec<usize> = (0..table.header.len()).filter(|k| !goes_on.contains(&&*table.header[*k])).collect();
            for row in 0..table.rows.len() {
                for column in &held {
                    table.rows[row][*column] = table.rows[row / every * every][*column].clone();
                }
            }
        }
    };
    for every in [2, 4] {
        let case =
            Case { robot: case.robot.clone(), real: all(&folder, "real", &case.real, &repeated(every)), sim: case.sim.clone() };
        let report = case.judged(&folder.file("out"));
        assert_eq!(report.status, Status::NoMismatch, "{every}: {}", report.summary);
        assert!(told(&report, "duplicates").iter().any(|told| told.contains(&format!("every {every} rows"))), "{report:?}");
    }
    // Further apart than what is bridged: which rows would do is said.
    let case = Case { real: all(&folder, "real", &case.real, &repeated(10)), ..case };
    let report = case.judged(&folder.file("seldom"));
    assert_eq!(report.status, Status::InsufficientData);
    assert!(told(&report, "gaps")[0].contains("give every 10th row alone"), "{:?}", report.data_quality);
}

#[test]
fn a_channel_that_was_not_recorded_is_told() {
    let folder = Folder::new("not-recorded");
    let case = made(&folder, "as logged, friction", &[wanted("coulomb_friction", Some(1), &[("f_c", 2.0)])], 12.0).0;
    let real = all(&folder, "real", &case.real, &|table| table.drop_column("tau_2_nm"));
    let report = Case { real, ..case }.judged(&folder.file("out"));
    assert_eq!(report.status, Status::NoMismatch, "{}", report.summary);
    let told = told(&report, "channel");
    assert!(told.iter().any(|told| told.starts_with("tau_2_nm is missing, though other joints have it")), "{told:?}");
    assert!(told.iter().any(|told| told.contains("no recording has tau_J") && told.contains("friction")), "{told:?}");
}

#[test]
fn the_stretch_that_is_held_out_is_told_on_the_runs_own_clock() {
    let folder = Folder::new("own-clock");
    let case = made(&folder, "as logged, friction", &[wanted("coulomb_friction", Some(1), &[("f_c", 2.0)])], 12.0).0;
    for (zero, first) in [(0.0, 0.0), (1000.0, 1000.0), (-100.0, 0.0)] {
        let later = |table: &mut Table| {
            let time = table.at("t_s");
            table.set("t_s", |row| number(&row[time]) + zero);
        };
        // The simulation has the last ten seconds only.
        let from_2_s = |table: &mut Table| {
            later(table);
            table.rows.drain(..2000);
        };
        let one = Case {
            robot: case.robot.clone(),
            real: all(&folder, "real", &case.real[..1], &later),
            sim: all(&folder, "sim", &case.sim[..1], &from_2_s),
        };
        let report = one.judged(&folder.file("out"));
        let held = report.inputs.runs[0].held_out_interval.as_ref().expect("a split run");
        // Two thirds of ten seconds, and one between.
        assert!((held.start_s - first - 9.666).abs() < 2e-3 && (held.end_s - first - 12.0).abs() < 2e-3, "{zero}: {held:?}");
        named(&report, "coulomb_friction", "shoulder");
    }
}

#[test]
fn a_robot_that_lies_where_the_report_goes_is_not_overwritten() {
    let folder = Folder::new("own-robot");
    let case = nothing(&folder);
    let out = folder.file("out");
    std::fs::create_dir_all(&out).expect("a folder");
    let robot = out.join("corrected.toml");
    let model = "schema = \"ravenpose-robot/1\"\nname = \"own\"\nbase = \"raven2-nominal\"\n";
    std::fs::write(&robot, model).expect("written");
    let output = Case { robot: robot.clone(), ..case }.gap(&out);
    assert_eq!(output.status.code(), Some(2));
    assert!(crate::common::errors(&output).contains("is both input and output; choose another output"));
    assert_eq!(std::fs::read_to_string(&robot).expect("still there"), model);
    assert!(!out.join("report.json").exists());
}

#[test]
fn a_joint_that_a_slide_drags_along_turns_by_so_much_per_metre() {
    let folder = Folder::new("dragged");
    let case = nothing(&folder);
    let ratio = ratio(&case, 0);
    let dragged = |table: &mut Table| {
        let (motor, slide) = (table.at("mpos_1_rad"), table.at("truth_jpos_3_m"));
        let before: Vec<f64> = table.rows.iter().map(|row| number(&row[motor])).collect();
        for (row, before) in table.rows.iter_mut().zip(before) {
            if let Ok(place) = row[slide].parse::<f64>() {
                row[motor] = (before + 0.2 * ratio * place).to_string();
            }
        }
    };
    let report = Case { real: all(&folder, "real", &case.real, &dragged), ..case }.judged(&folder.file("out"));
    let coupling = primary(&report)[0];
    assert_eq!(
        (coupling.physics.name().as_ref(), coupling.location.joint.join(" ")),
        ("joint_coupling", "shoulder insertion".to_owned())
    );
    assert!((parameter(coupling, "c_ij").0.abs() - 0.2).abs() < 0.01, "{}", report.summary);
    assert_eq!(coupling.parameters[0].true_unit(), "rad/m");
    assert!(report.summary.contains("rad/m"), "{}", report.summary);
}

#[test]
fn a_run_that_is_only_a_moment_is_named() {
    let folder = Folder::new("moment");
    let case = nothing(&folder);
    let moment = |table: &mut Table| table.rows.truncate(800);
    let mut short = Case { robot: case.robot.clone(), real: case.real.clone(), sim: case.sim.clone() };
    short.real[1] = rewritten(&folder, "moment.csv", &case.real[1], &moment);
    let report = short.judged(&folder.file("out"));
    assert_eq!(report.status, Status::InsufficientData);
    assert!(told(&report, "too_short")[0].starts_with("moment.csv has 0.8 s that can be compared"), "{:?}", report.data_quality);
    // The joint that is named as missing is one that is.
    let without = |table: &mut Table| ["mpos_2_rad", "jpos_2_rad"].into_iter().for_each(|column| table.drop_column(column));
    let real = all(&folder, "real", &case.real, &without);
    let out = folder.file("refused");
    refused(&Case { real, ..case }.gap(&out), &out, &["has neither mpos_2_rad nor jpos_2_rad"]);
}
