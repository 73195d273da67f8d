//! Every unsuitable input is one line with file, place, what is wrong and the remedy.
#![allow(missing_docs)]

mod common;

use common::{Folder, changed, runs, small};
use ravenpose::correction::Quantity;
use recordings::stream::Record;
use std::fmt::Write;
use std::path::PathBuf;
use training::commands::{self, Wish};
use training::data::{Columns, Reading};

/// The line that training on these files ends with.
fn line(folder: &Folder, files: &[PathBuf], columns: Option<Columns>) -> String {
    let recipe = if columns.is_some() { small("default").for_tables() } else { small("default") };
    let reading = Reading { columns, ..Reading::default() };
    let out = folder.file("model.onnx");
    let error = commands::train(&Wish { data: files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {});
    let line = error.expect_err("bad input").to_string();
    assert_eq!(line.lines().count(), 1, "{line}");
    assert!(!out.exists());
    line
}

fn columns(inputs: &[&str], truth: &[&str]) -> Columns {
    let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    Columns { inputs: owned(inputs), truth: owned(truth), ..Columns::default() }
}

fn table(header: &str, row: impl Fn(usize) -> String) -> String {
    let mut text = format!("{header}\n");
    for k in 0..50 {
        let _ = writeln!(text, "{},{}", k as f64 * 0.1, row(k));
    }
    text
}

#[test]
fn a_recording_without_truth_is_named() {
    let folder = Folder::new("no-truth");
    let files = runs(&folder, 3, 1.0, ".txt");
    let found = line(&folder, &files, None);
    assert!(found.contains("run_0.txt") && found.contains("has no truth"), "{found}");
    let csv = folder.text("a.csv", &table("t_s,jpos_1_rad", |k| format!("{k}")));
    let found = line(&folder, &[csv], Some(columns(&["jpos_1_rad"], &["truth_jpos_1_rad"])));
    assert!(found.contains("no column truth_jpos_1_rad"), "{found}");
}

#[test]
fn a_table_whose_time_begins_anew_is_read_to_its_end() {
    let folder = Folder::new("sessions");
    let mut text = "u,t_s,y\n".to_owned();
    for k in 0..200 {
        let _ = writeln!(text, "{k},{},{}", 0.1 * f64::from(k % 50), 2 * k);
    }
    let reading = Reading { columns: Some(columns(&["u"], &["y"])), truth_hz: 10.0, ..Reading::default() };
    let set = training::data::read(&[folder.text("sessions.csv", &text)], &reading, &mut |_, _| {}).expect("a table");
    assert_eq!(set.trajectories.iter().map(training::data::Trajectory::rows).sum::<usize>(), 200);
}

#[test]
fn one_trajectory_is_too_few() {
    let folder = Folder::new("one");
    let found = line(&folder, &runs(&folder, 1, 1.0, ".mcap"), None);
    assert!(found.contains("at least 3 are needed"), "{found}");
}

#[test]
fn inputs_that_never_change_are_refused() {
    let folder = Folder::new("constant");
    let files: Vec<PathBuf> = (0..3)
        .map(|n| folder.text(&format!("{n}.csv"), &table("t_s,jpos_1_rad,truth_jpos_1_rad", |k| format!("0.5,{}", k + 1000 * n))))
        .collect();
    let found = line(&folder, &files, Some(columns(&["jpos_1_rad"], &["truth_jpos_1_rad"])));
    assert!(found.contains("all 1 inputs are constant"), "{found}");
}

#[test]
fn a_cell_that_is_no_number_is_named_with_its_row() {
    let folder = Folder::new("nan");
    let header = "t_s,jpos_1_rad,truth_jpos_1_rad";
    let csv = folder.text("nan.csv", &table(header, |k| if k == 7 { ",0.1".to_owned() } else { format!("{k},0.1") }));
    let found = line(&folder, &[csv], Some(columns(&["jpos_1_rad"], &["truth_jpos_1_rad"])));
    assert!(found.contains("nan.csv") && found.contains("row 8"), "{found}");
}

#[test]
fn units_that_contradict_the_header_are_refused() {
    let folder = Folder::new("units");
    let csv = folder.text("kg.csv", &table("t_s,jpos_1_kg,truth_jpos_1_rad", |k| format!("{k},0.1")));
    let found = line(&folder, &[csv], Some(columns(&["jpos_1_kg"], &["truth_jpos_1_rad"])));
    assert!(found.contains("kg.csv") && found.contains("kg"), "{found}");
}

#[test]
fn states_that_no_robot_can_have_are_no_rows() {
    let folder = Folder::new("impossible");
    let run = runs(&folder, 1, 2.0, ".mcap").remove(0);
    let reading = Reading::default();
    let whole = training::data::read(std::slice::from_ref(&run), &reading, &mut |_, _| {}).expect("a run");
    // A motor at a billion degrees for a twentieth of a second: several truths stand beside it.
    let mut number = 0;
    let glitch = changed(&folder, &run, "glitch.mcap", |record| {
        if let (Record::State(state), true) = (record, (1000..1100).contains(&number)) {
            state.mpos[0] = 1e9;
        }
        number += 1;
    });
    let read = training::data::read(&[glitch], &reading, &mut |_, _| {}).expect("a run");
    let rows = |set: &training::data::DataSet| set.trajectories[0].rows();
    assert!(rows(&read) < rows(&whole) && rows(&read) > rows(&whole) / 2, "{} of {}", rows(&read), rows(&whole));
    assert!(read.trajectories[0].inputs.iter().all(|value| value.abs() < 1e8));
    assert!(read.notes.iter().any(|note| note.contains("states that no robot can have")), "{:?}", read.notes);
}

#[test]
fn a_quaternion_of_zeros_is_no_orientation() {
    let folder = Folder::new("zeros");
    let run = runs(&folder, 1, 1.0, ".mcap").remove(0);
    let zeros = changed(&folder, &run, "zeros.mcap", |record| {
        if let Record::Truth(truth) = record {
            truth.quaternion_wxyz = [0.0; 4];
            truth.joints = [f64::NAN; 7];
        }
    });
    let reading = Reading { target: Quantity::Orientation, ..Reading::default() };
    assert!(training::data::read(&[run], &reading, &mut |_, _| {}).is_ok());
    let error = training::data::read(&[zeros], &reading, &mut |_, _| {}).expect_err("no orientation").to_string();
    assert!(error.contains("no true orientation"), "{error}");
}

#[test]
fn numbers_beyond_float32_are_refused_where_they_stand() {
    let folder = Folder::new("beyond");
    let table =
        folder.text("far.csv", &table("t_s,u_mm,y_mm", |k| format!("{},{k}", if k == 7 { 1e39 } else { f64::from(k as u32) })));
    let found = line(&folder, &[table], Some(columns(&["u_mm"], &["y_mm"])));
    assert!(found.contains("u_mm is empty, not a number or beyond float32 in row 8"), "{found}");
}

#[test]
fn the_plays_of_a_table_begin_anew_with_a_session() {
    let folder = Folder::new("plays-anew");
    let session = |from: f64| -> String {
        (0..40).fold(String::new(), |text, k| text + &format!("{},{},0\n", from + f64::from(k % 9), 0.1 * f64::from(k)))
    };
    let reading =
        Reading { columns: Some(Columns { plays: vec![2.0], ..columns(&["u"], &["y"]) }), truth_hz: 10.0, ..Reading::default() };
    let inputs = |name: &str, text: String| {
        let file = folder.text(name, &format!("u,t_s,y\n{text}"));
        training::data::read(&[file], &reading, &mut |_, _| {}).expect("a table").trajectories[0].inputs.clone()
    };
    let (first, second) = (inputs("one.csv", session(0.0)), inputs("two.csv", session(50.0)));
    assert_eq!(inputs("both.csv", session(0.0) + &session(50.0)), [first, second].concat());
}
