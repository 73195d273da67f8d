//! From recordings to a model file.
#![allow(missing_docs)]

mod common;

use common::{Folder, runs, small};
use training::commands::{self, Event, Model, Wish};
use training::data::{self, Reading};
use training::evaluate;

#[test]
fn a_model_stopped_by_a_kill_ends_as_one_that_ran_through() {
    let folder = Folder::new("kill");
    let files = runs(&folder, 3, 3.0, ".mcap");
    let (out, recipe, reading) = (folder.file("model.onnx"), small("paper"), Reading::default());
    let wish = Wish { data: &files, reading: &reading, recipe: &recipe, out: &out };
    let (checkpoint, kept) = (folder.file("model.onnx.checkpoint"), folder.file("kept"));
    commands::train(&wish, &mut |event| {
        if matches!(event, Event::Epoch(progress) if progress.point.epoch == 2) {
            std::fs::copy(&checkpoint, &kept).expect("checkpoint");
        }
    })
    .expect("trained");
    let through = std::fs::read(&out).expect("model");
    assert!(!checkpoint.exists(), "a finished run leaves no checkpoint");
    std::fs::rename(&kept, &checkpoint).expect("checkpoint");
    let mut epochs = Vec::new();
    commands::train(&wish, &mut |event| {
        if let Event::Epoch(progress) = event {
            epochs.push(progress.point.epoch);
        }
    })
    .expect("trained");
    assert_eq!(epochs, [3, 4]);
    assert_eq!(std::fs::read(&out).expect("model"), through);
    assert!(std::fs::read_to_string(folder.file("model.onnx.curves.svg")).expect("curves").starts_with("<svg"));
}

#[test]
fn a_checkpoint_of_other_data_is_refused() {
    let folder = Folder::new("other");
    let files = runs(&folder, 4, 2.0, ".mcap");
    let (out, recipe, reading) = (folder.file("model.onnx"), small("paper"), Reading::default());
    let kept = folder.file("kept");
    commands::train(&Wish { data: &files[..3], reading: &reading, recipe: &recipe, out: &out }, &mut |event| {
        if matches!(event, Event::Epoch(_)) {
            std::fs::copy(folder.file("model.onnx.checkpoint"), &kept).expect("checkpoint");
        }
    })
    .expect("trained");
    std::fs::rename(&kept, folder.file("model.onnx.checkpoint")).expect("checkpoint");
    let error = commands::train(&Wish { data: &files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {});
    let line = error.expect_err("another run").to_string();
    assert!(line.contains("belongs to another run") && line.lines().count() == 1, "{line}");
}

#[test]
fn the_card_says_what_the_service_wants_and_which_runs_it_has_seen() {
    let folder = Folder::new("card");
    let files = runs(&folder, 4, 3.0, ".mcap");
    for preset in ["default", "one-state"] {
        let (out, recipe) = (folder.file("model.onnx"), small(preset));
        let reading = Reading { truth_noise_mm: 0.5, plays: recipe.plays(), ..Reading::default() };
        let done =
            commands::train(&Wish { data: &files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {}).expect("trained");
        assert_eq!(done.trajectories, [2, 1, 1]);
        let model = Model::read(&out).expect("model");
        assert_eq!(model.chain.plays.len(), if preset == "default" { 21 } else { 0 });
        assert_eq!(model.words("ravenpose.bound95_unsettled_mm").len(), if preset == "default" { 3 } else { 0 });
        for (key, count) in [
            ("feature_min", 118),
            ("feature_max", 118),
            ("domain_center", 118),
            ("domain_weight", 118),
            ("domain_limit", 1),
            ("bound95_mm", 3),
            ("golden", 8 * 121),
            ("correction_bound_mm", 1),
        ] {
            assert_eq!(model.words(&format!("ravenpose.{key}")).len(), count, "{key}");
        }
        assert_eq!(model.card["ravenpose.feature_layout"], "raven118-v1");
        let report = evaluate::Wish {
            model: &out,
            data: &files,
            reading: &Reading::default(),
            rivals: preset == "default",
            out: &folder.file("report"),
            seed: 1,
        };
        let report = evaluate::evaluate(&report, &mut |_| {}).expect("report");
        assert_eq!((report.runs.len(), report.runs_of_training), (1, 3));
        assert!(report.methods.iter().all(|method| method.exact.vector.rms.is_finite()));
        assert_eq!(!report.trust.unsettled.is_empty(), preset == "default");
        // Too short for every joint to move through its widest play.
        assert_eq!(report.trust.settled().as_deref(), (preset == "default").then_some("the memory settled after: never"));
        let page = std::fs::read_to_string(folder.file("report/report.html")).expect("page");
        assert!(page.contains("Methods side by side") && !page.contains("src=\"http") && !page.contains("<script"));
        let known: Vec<_> = files.iter().filter(|file| !report.runs.iter().any(|run| file.ends_with(run))).cloned().collect();
        let again = evaluate::Wish {
            model: &out,
            data: &known,
            reading: &Reading::default(),
            rivals: false,
            out: &folder.file("again"),
            seed: 1,
        };
        let line = evaluate::evaluate(&again, &mut |_| {}).expect_err("all known").to_string();
        assert!(line.contains("took part in its training"), "{line}");
    }
}

#[test]
fn the_lab_s_252_columns_train_by_their_joint_encoders() {
    let folder = Folder::new("columns");
    let files = runs(&folder, 3, 2.0, ".252.csv");
    let reading = Reading::default();
    let tables = data::read(&files, &reading, &mut |_, _| {}).expect("252 columns");
    assert!(tables.rows() > 100, "{}", tables.rows());
    let (out, recipe) = (folder.file("model.onnx"), small("paper-code"));
    commands::train(&Wish { data: &files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {}).expect("trained");
    // Joints 1 to 3 carry almost all of the tip's error: the wrist's play and the bent link are not in these columns.
    let folder = Folder::new("columns-mcap");
    let states = data::read(&runs(&folder, 3, 2.0, ".mcap"), &reading, &mut |_, _| {}).expect("MCAP");
    let rms = |set: &data::DataSet| {
        let labels = set.trajectories.iter().flat_map(|one| &one.exact);
        (labels.map(|label| f64::from(*label).powi(2)).sum::<f64>() / set.rows() as f64).sqrt()
    };
    let (by_joints, by_tip) = (rms(&tables), rms(&states));
    assert!((by_joints / by_tip - 1.0).abs() < 0.5, "{by_joints} {by_tip}");
}

#[test]
fn the_same_run_twice_is_refused() {
    let folder = Folder::new("twins");
    let mut files = runs(&folder, 3, 2.0, ".mcap");
    let copy = folder.file("copy.mcap");
    std::fs::copy(&files[0], &copy).expect("copy");
    files.push(copy);
    let (out, recipe, reading) = (folder.file("model.onnx"), small("default"), Reading::default());
    let line = commands::train(&Wish { data: &files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {})
        .expect_err("twins")
        .to_string();
    assert!(line.contains("the same run twice") && !out.exists(), "{line}");
}
