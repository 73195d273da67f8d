//! Run level and board of what was learnt from: the card lists them, the service corrects in no other.
#![allow(missing_docs)]

mod common;

use common::{Folder, changed, runs, small};
use ravenpose::config::ModelSource;
use recordings::stream::Record;
use std::path::{Path, PathBuf};
use training::commands::{self, Wish};
use training::data::{self, Reading};

/// The same recording with other run levels: `level` of each state's number.
fn at_levels(folder: &Folder, file: &Path, level: impl Fn(usize) -> i32) -> PathBuf {
    let name = format!("levels_{}", file.file_name().expect("name").to_string_lossy());
    let mut states = 0;
    changed(folder, file, &name, |record| {
        if let Record::State(state) = record {
            state.runlevel = level(states);
            states += 1;
        }
    })
}

#[test]
fn rows_with_the_pedal_up_are_not_learnt_and_the_service_does_not_correct_there() {
    let folder = Folder::new("pedal");
    let whole = runs(&folder, 3, 4.0, ".mcap");
    let files: Vec<PathBuf> = whole.iter().map(|file| at_levels(&folder, file, |k| if k < 1000 { 2 } else { 3 })).collect();
    let (out, recipe, reading) = (folder.file("model.onnx"), small("one-state"), Reading::default());
    let done =
        commands::train(&Wish { data: &files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {}).expect("trained");
    let left_out = done.notes.iter().filter(|note| note.contains("truths outside run level 3 (pedal down) are left out"));
    assert_eq!(left_out.count(), 3, "{:?}", done.notes);
    assert_eq!(done.rows, [90; 3]);
    let allowed = ravenpose::model::load(&ModelSource::new(out)).expect("the service takes it").model.allowed;
    assert_eq!((allowed.runlevels, allowed.boards), (vec![3], vec![49]));
}

#[test]
fn a_recording_that_is_never_in_run_level_3_is_refused_and_one_that_says_none_is_used() {
    let folder = Folder::new("level");
    let whole = &runs(&folder, 1, 2.0, ".mcap")[0];
    let read = |level: fn(usize) -> i32| data::read(&[at_levels(&folder, whole, level)], &Reading::default(), &mut |_, _| {});
    let line = read(|k| if k < 100 { 1 } else { 2 }).expect_err("pedal up").to_string();
    assert!(line.contains("truths lie outside run level 3") && line.lines().count() == 1, "{line}");
    let set = read(|_| 0).expect("rows");
    assert_eq!(set.trajectories[0].rows(), 60);
    assert!(set.notes[0].contains("does not say its run levels"), "{:?}", set.notes);
    // Once it does, what came before was an e-stop.
    let set = read(|k| if k < 1000 { 0 } else { 3 }).expect("rows");
    assert_eq!(set.trajectories[0].rows(), 30);
}
