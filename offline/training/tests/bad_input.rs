//! Every unsuitable input is one line with file, place, what is wrong and the remedy.
#![allow(missing_docs)]

mod common;

use common::{Folder, runs, small};
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
