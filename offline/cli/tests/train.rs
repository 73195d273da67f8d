//! `ravenpose train` and `evaluate`, and that the service takes what they write.
#![allow(missing_docs)]

use ravenpose::config::ModelSource;
use ravenpose::correction::{Estimator, Quantity};
use ravenpose::model;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use training::data::{self, Reading};

fn ravenpose(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ravenpose")).args(arguments).output().expect("ravenpose runs")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn good(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A folder of our own, gone at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ravenpose-train-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("folder");
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Four runs of two seconds after one homing.
    fn runs(&self) -> Vec<String> {
        let out = self.file("runs");
        let plan = ["--minutes", "0.1333333", "--run-minutes", "0.0333334", "--seed", "3", "--homing-seed", "4"];
        good(&ravenpose(&[&["simulate", "--robot", "raven2-worn", "--out", text(&out)], &plan[..]].concat()));
        (1..=4).map(|run| text(&out.join(format!("run_{run:04}.mcap"))).to_owned()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn source(path: &Path) -> ModelSource {
    ModelSource::new(path.to_owned())
}

#[test]
fn the_service_loads_what_was_trained_and_infer_gives_the_golden_outputs() {
    let folder = Folder::new("service");
    let runs = folder.runs();
    let runs: Vec<&str> = runs.iter().map(String::as_str).collect();
    for preset in ["default", "one-state", "paper", "paper-code"] {
        let out = folder.file(&format!("{preset}.onnx"));
        let options = ["train", "--preset", preset, "--epochs", "2", "--truth-noise", "0.5", "--out", text(&out), "--data"];
        let said = good(&ravenpose(&[&options[..], &runs].concat()));
        assert!(said.contains("test (1 trajectories"), "{said}");
        let card = model::load(&source(&out)).expect("the service's own checks").card;
        assert!(!card.untrained && card.domain.is_some());
        assert!(card.bound95.iter().all(|bound| *bound > 0.0));
        let header: Vec<String> = (0..118).map(|input| format!("in_{input}")).collect();
        let rows: Vec<String> =
            card.golden.iter().map(|pair| pair.input.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")).collect();
        let (table, inferred) = (folder.file("in.csv"), folder.file("out.csv"));
        std::fs::write(&table, format!("{}\n{}\n", header.join(","), rows.join("\n"))).expect("rows");
        good(&ravenpose(&["infer", "--model", text(&out), text(&table), "--out", text(&inferred)]));
        let found = std::fs::read_to_string(&inferred).expect("outputs");
        for (line, pair) in found.lines().skip(1).zip(&card.golden) {
            for (found, expected) in line.split(',').zip(pair.output) {
                let off = (found.parse::<f64>().expect("number") - expected).abs();
                assert!(off <= 2e-5 * expected.abs().max(1.0), "{preset}: {found} {expected}");
            }
        }
    }
}

#[test]
fn runs_after_one_homing_have_its_offset_and_different_motions() {
    let folder = Folder::new("homing");
    let _ = folder.runs();
    let summary = std::fs::read_to_string(folder.file("runs").join("simulation.txt")).expect("summary");
    let mut offsets: Vec<&str> =
        summary.lines().filter_map(|line| line.split_once("homing offset")).map(|(_, rest)| rest).collect();
    assert_eq!(offsets.len(), 4, "{summary}");
    offsets.dedup();
    assert_eq!(offsets.len(), 1, "{summary}");
    let length = |run: usize| std::fs::metadata(folder.file("runs").join(format!("run_{run:04}.mcap"))).expect("run").len();
    assert_ne!(length(1), length(2));
}

#[test]
fn infer_remembers_from_row_to_row_where_it_is_told_that_they_are_in_order() {
    let folder = Folder::new("in-order");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/raven2-worn.onnx");
    let mut model = model::load(&source(&path)).expect("the shipped model");
    // Joint 1 goes there and back; everything else stands as in a golden input.
    let mut states = vec![model.card.golden[0].input; 400];
    for (k, state) in states.iter_mut().enumerate() {
        state[56] += 0.05 * k.min(400 - k) as f32;
    }
    let header: Vec<String> = (0..118).map(|input| format!("in_{input}")).collect();
    let rows: Vec<String> = states.iter().map(|row| row.map(|x| x.to_string()).join(",")).collect();
    let (table, out) = (folder.file("in.csv"), folder.file("out.csv"));
    std::fs::write(&table, format!("{}\n{}\n", header.join(","), rows.join("\n"))).expect("rows");
    let run = |more: &[&str]| -> Vec<Vec<f32>> {
        let arguments = ["infer", "--model", text(&path), text(&table), "--out", text(&out)];
        good(&ravenpose(&[&arguments[..], more].concat()));
        let found = std::fs::read_to_string(&out).expect("outputs");
        found.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().expect("number")).collect()).collect()
    };
    let (alone, in_order) = (run(&[]), run(&["--in-order"]));
    let mut worst = 0.0_f32;
    for (k, state) in states.iter().enumerate() {
        let mut expected = [0.0; 3];
        model.model.estimator.follow(state, k as i64 * 1_000_000);
        model.model.estimator.run(state, &mut expected);
        for (found, expected) in in_order[k].iter().zip(expected) {
            // The service has weights of 16 bits.
            assert!((found - expected).abs() < 0.01, "{k}: {found} {expected}");
        }
        worst = in_order[k].iter().zip(&alone[k]).map(|(a, b)| (a - b).abs()).fold(worst, f32::max);
    }
    assert_eq!(in_order[0], alone[0]);
    assert!(worst > 0.02, "the memory makes a difference: {worst} mm");
}

/// The cameras' world against frame 0: x0 = -y + 0.1, y0 = x - 0.2, z0 = z + 0.3 (m).
const REGISTRATION: &str =
    "[registration]\nrotation = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]\ntranslation_mm = [100.0, -200.0, 300.0]\n";
const CAMERAS: &str = "# as calibrated\nresolution = [640, 480]\n";

/// What `ravenpose vision track` would have written of a run: 15 frames/s in the cameras' world, on a clock of its own.
fn seen_by_cameras(run: &str, folder: &Folder) -> PathBuf {
    let (table, out) = (folder.file("run.csv"), folder.file("truth.csv"));
    good(&ravenpose(&["convert", run, text(&table)]));
    let table = std::fs::read_to_string(table).expect("table");
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("header").split(',').collect();
    let at = ["t_s", "truth_x_mm", "truth_y_mm", "truth_z_mm", "truth_qw", "truth_qx", "truth_qy", "truth_qz"]
        .map(|name| header.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name} in {header:?}")));
    let mut frames = String::from("frame,t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz,status\n");
    for (row, line) in lines.enumerate().filter(|(row, _)| row % 66 == 0) {
        let cells: Vec<&str> = line.split(',').collect();
        let [t_s, x, y, z, q @ ..] = at.map(|column| cells[column].parse::<f64>().unwrap_or(f64::NAN));
        if row >= 660 && x.is_finite() {
            // A quarter turn back about z.
            let half = std::f64::consts::FRAC_1_SQRT_2;
            let [qw, qx, qy, qz] = [q[0] + q[3], q[1] + q[2], q[2] - q[1], q[3] - q[0]].map(|sum| half * sum);
            let place = format!("{},{},{},{qw},{qx},{qy},{qz}", y + 200.0, 100.0 - x, z - 300.0);
            let _ = writeln!(frames, "{},{:.6},{place},ok", row / 66, t_s - 0.4);
        }
    }
    std::fs::write(&out, frames).expect("truth");
    out
}

#[test]
fn a_lab_with_cameras_pairs_its_runs_and_trains_on_them() {
    let folder = Folder::new("cameras");
    let out = folder.file("runs");
    let plan = ["--minutes", "2.4", "--run-minutes", "0.6", "--seed", "3", "--homing-seed", "4"];
    good(&ravenpose(&[&["simulate", "--robot", "raven2-worn", "--out", text(&out)], &plan[..]].concat()));
    let runs: Vec<PathBuf> = (1..=4).map(|run| out.join(format!("run_{run:04}.mcap"))).collect();
    let (cameras, known) = (folder.file("cameras.toml"), folder.file("known.toml"));
    std::fs::write(&cameras, CAMERAS).expect("cameras");
    std::fs::write(&known, format!("{CAMERAS}{REGISTRATION}")).expect("cameras");

    // Registered to the run itself: near the true frame, with what the worn arm is off by on the whole.
    let truth = seen_by_cameras(text(&runs[0]), &folder);
    let pairs = folder.file("pairs.csv");
    let line = ravenpose(&["pair", text(&runs[0]), "--truth", text(&truth), "--cameras", text(&cameras), "--out", text(&pairs)]);
    assert!(String::from_utf8_lossy(&line.stderr).contains("has no [registration]") && !pairs.exists());
    good(&ravenpose(&["pair", text(&runs[0]), "--truth", text(&truth), "--register", text(&cameras), "--out", text(&pairs)]));
    let written = std::fs::read_to_string(&cameras).expect("cameras");
    assert!(written.starts_with(CAMERAS) && written.contains("from = \"run_0001.mcap\""), "{written}");
    let table: toml::Table = written.parse().expect("TOML");
    let rotation = &table["registration"]["rotation"];
    assert!((rotation[0][1].as_float().expect("number") + 1.0).abs() < 0.01, "{written}");

    // With the frame known the recordings hold the whole error, as if the truth had been in them.
    let mut seen = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let truth = seen_by_cameras(text(run), &folder);
        let file = folder.file(&format!("seen_{index}.mcap"));
        good(&ravenpose(&["pair", text(run), "--truth", text(&truth), "--cameras", text(&known), "--out", text(&file)]));
        seen.push(file);
    }
    let read = |files: &[PathBuf], target| {
        let reading = Reading { truth_hz: 14.0, target, ..Reading::default() };
        data::read(files, &reading, &mut |_, _| {})
    };
    let labels_of = |files: &[PathBuf], target| {
        let set = read(files, target).expect("runs");
        let squares: f64 = set.trajectories.iter().flat_map(|one| &one.exact).map(|mm| f64::from(*mm).powi(2)).sum();
        (set.rows(), (squares / set.rows() as f64).sqrt())
    };
    let labels = |files: &[PathBuf]| labels_of(files, Quantity::Position);
    let ((rows, found), (_, expected)) = (labels(&seen), labels(&runs));
    assert!(rows > 300 && expected > 1.0, "{rows} {expected}");
    // But for frames at standstill, which are left out, and for what of a lag the fitted clock takes.
    assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
    // With the clock known as well nothing of the arm's own lag is taken for one.
    let exact = folder.file("exact.mcap");
    let truth = seen_by_cameras(text(&runs[0]), &folder);
    // A fitted mounting of the balls holds a part of the arm's error: such orientations are not learnt from.
    let line = read(&seen, Quantity::Orientation).expect_err("no true orientation").to_string();
    assert!(line.contains("no true orientation of the tip"), "{line}");
    let clock = ["--clock-known", "--offset-s", "0.4", "--mounting-known"];
    good(&ravenpose(
        &[&["pair", text(&runs[0]), "--truth", text(&truth), "--cameras", text(&known), "--out", text(&exact)], &clock[..]]
            .concat(),
    ));
    let ((rows, found), (_, expected)) = (labels(std::slice::from_ref(&exact)), labels(&runs[..1]));
    assert!(rows > 100 && (found / expected - 1.0).abs() < 0.01, "{rows}: {found} {expected}");
    let turned = |file: &PathBuf| labels_of(std::slice::from_ref(file), Quantity::Orientation);
    let ((rows, found), (_, expected)) = (turned(&exact), turned(&runs[0]));
    assert!(rows > 100 && expected > 1.0 && (found / expected - 1.0).abs() < 0.01, "{rows}: {found} {expected} deg");
    let (model, seen) = (folder.file("model.onnx"), seen.iter().map(|file| text(file)).collect::<Vec<_>>());
    let options = ["train", "--epochs", "2", "--truth-noise", "0.5", "--out", text(&model), "--data"];
    let done = ravenpose(&[&options[..], &seen].concat());
    good(&done);
    // What cameras measured is noisy enough.
    assert_eq!(String::from_utf8_lossy(&done.stderr).matches("its truth was measured: no noise is added").count(), 4);
    let card = training::commands::Model::read(&model).expect("model").card;
    assert!(card["ravenpose.trained_on"].contains("whose truth was measured"), "{}", card["ravenpose.trained_on"]);

    // What cannot be written is one line, and nothing is left.
    let table = folder.file("run.csv");
    for (input, output, words) in [
        (&table, "made.mcap", "is a table, not a recording of states"),
        (&runs[3], "made.rvs", "holds no true tip"),
        (&runs[3], "made.252.csv", "holds no true tip"),
        (&runs[3], "runs/run_0004.mcap", "both input and output"),
    ] {
        let refused = ravenpose(&[
            "pair",
            text(input),
            "--truth",
            text(&truth),
            "--cameras",
            text(&known),
            "--out",
            text(&folder.file(output)),
        ]);
        let error = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!((refused.status.code(), error.lines().count()), (Some(2), 1), "{error}");
        assert!(error.contains(words), "{error}");
    }
    assert!(!folder.file("made.mcap").exists());
}

#[test]
fn the_shipped_models_are_trained_and_the_service_takes_them() {
    for (file, quantity) in [("raven2-worn.onnx", Quantity::Position), ("raven2-worn-orientation.onnx", Quantity::Orientation)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(file);
        let loaded = model::load(&ModelSource { quantity, ..source(&path) }).expect("the service's own checks");
        assert!(loaded.model.estimator.remembers());
        let card = loaded.card;
        for (settled, unsettled) in card.bound95.iter().zip(card.bound95_unsettled) {
            assert!(*settled > 0.1 && unsettled > *settled, "{settled} {unsettled}");
        }
        assert!(!card.untrained && card.trained_on.contains("136.0 minutes"), "{}", card.trained_on);
        // A part of it by cameras, as a lab has all of it.
        assert!(
            card.trained_on.contains("none to 1 of the 22") && card.trained_on.contains("truth was measured"),
            "{}",
            card.trained_on
        );
    }
}

#[test]
fn evaluate_judges_on_unseen_runs_and_says_so() {
    let folder = Folder::new("evaluate");
    let runs = folder.runs();
    let runs: Vec<&str> = runs.iter().map(String::as_str).collect();
    let (out, report) = (folder.file("model.onnx"), folder.file("report"));
    good(&ravenpose(&[&["train", "--preset", "default", "--epochs", "2", "--out", text(&out), "--data"][..], &runs].concat()));
    let said = good(&ravenpose(&[&["evaluate", "--model", text(&out), "--out", text(&report), "--data"][..], &runs].concat()));
    assert!(said.contains("1 runs") && said.contains("3 of its training and validation"), "{said}");
    for rival in ["raw", "fixed offset per run", "rigid + random forest", "Gaussian process", "2nd-order polynomial"] {
        assert!(said.contains(rival), "{said}");
    }
    let json = std::fs::read(report.join("report.json")).expect("report");
    let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    assert_eq!(json["format"], "ravenpose-evaluation/1");
    // The same run twice would count as two.
    let copy = folder.file("copy.mcap");
    std::fs::copy(runs[3], &copy).expect("copied");
    let twice = ravenpose(&["evaluate", "--alone", "--model", text(&out), "--out", text(&report), "--data", runs[3], text(&copy)]);
    let error = String::from_utf8_lossy(&twice.stderr).into_owned();
    assert!(twice.status.code() == Some(2) && error.contains("the same run twice"), "{error}");
}

#[test]
fn what_cannot_be_trained_on_is_one_line_and_status_2() {
    let folder = Folder::new("refused");
    let (csv, out) = (folder.file("a.csv"), folder.file("model.onnx"));
    std::fs::write(&csv, "t_s,jpos_1_rad\n0,1\n1,2\n").expect("table");
    let refused = |more: &[&str], words: &str| {
        let output = ravenpose(&[&["train", "--out", text(&out), "--data", text(&csv)][..], more].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), error.lines().count()), (Some(2), 1), "{error}");
        assert!(error.contains(words) && !out.exists(), "{error}");
    };
    refused(&[], "name its columns with --inputs and --truth");
    refused(&["--inputs", "jpos_1_rad", "--truth", "truth_jpos_1_rad"], "no column truth_jpos_1_rad");
    refused(&["--inputs", "jpos_1_rad", "--truth", "jpos_1_rad"], "at least 3 are needed");
    refused(&["--truth-hz", "0"], "--truth-hz 0");
    refused(&["--epochs", "0"], "--epochs 0: must be 1 or more");
}
