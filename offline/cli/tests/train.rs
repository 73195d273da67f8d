//! `ravenpose train` and `evaluate`, and that the service takes what they write.
#![allow(missing_docs)]

use ravenpose::config::ModelSource;
use ravenpose::cycle::Estimator;
use ravenpose::model;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

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
    for preset in ["default", "paper", "paper-code"] {
        let out = folder.file(&format!("{preset}.onnx"));
        let options = ["train", "--preset", preset, "--epochs", "2", "--truth-noise", "0.5", "--out", text(&out), "--data"];
        let said = good(&ravenpose(&[&options[..], &runs].concat()));
        assert!(said.contains("test (1 trajectories"), "{said}");
        let card = model::load(&source(&out)).expect("the service's own checks").card;
        assert!(!card.untrained && card.domain.is_some());
        assert!(card.bound95_mm.iter().all(|bound| *bound > 0.0));
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
fn the_shipped_model_is_trained_and_the_service_takes_it() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/raven2-worn.onnx");
    let loaded = model::load(&source(&path)).expect("the service's own checks");
    assert!(loaded.model.estimator.remembers());
    let card = loaded.card;
    for (settled, unsettled) in card.bound95_mm.iter().zip(card.bound95_unsettled_mm) {
        assert!(*settled > 0.1 && unsettled > *settled, "{settled} {unsettled}");
    }
    assert!(!card.untrained && card.trained_on.contains("140.0 minutes"), "{}", card.trained_on);
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
}
