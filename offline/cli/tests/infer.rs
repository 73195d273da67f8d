//! `ravenpose infer` as a user runs it: golden outputs of every reference model, hostile files, bad tables.

mod common;

use common::{Folder, errors, shared};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn untrained() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/untrained.onnx")
}

/// Runs under a limit of 1 GiB of memory and 5 s of processor time.
fn infer(model: &Path, input: &Path, out: &Path) -> Output {
    Command::new("sh")
        .args(["-c", "ulimit -v 1048576; ulimit -t 5; exec timeout -s KILL 120 \"$0\" \"$@\""])
        .arg(env!("CARGO_BIN_EXE_ravenpose"))
        .args(["infer", "--model"])
        .arg(model)
        .arg(input)
        .arg("--out")
        .arg(out)
        .output()
        .expect("ravenpose runs")
}

fn columns(path: &Path, names: [&str; 3]) -> Vec<[f64; 3]> {
    let text = std::fs::read_to_string(path).expect("table");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("header").split(',').collect();
    let at = names.map(|name| header.iter().position(|column| *column == name).expect("column"));
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            at.map(|column| cells[column].parse().expect("number"))
        })
        .collect()
}

#[test]
fn golden_outputs_of_every_reference_model() {
    let Some(models) = shared("models") else { return };
    let folder = Folder::new("golden");
    for (model, golden, tolerance) in [
        ("l654_sigmoid_bn", "golden.csv", 2e-5),
        ("l654_sigmoid_folded", "golden/l654_sigmoid_folded.csv", 2e-5),
        ("l654_sigmoid_keras_dynbatch", "golden/l654_sigmoid_keras_dynbatch.csv", 2e-5),
        ("l654_sigmoid_bn_zscore", "golden/l654_sigmoid_bn_zscore.csv", 2e-5),
        ("l654_sigmoid_postbn", "golden/l654_sigmoid_postbn.csv", 2e-5),
        ("l6654_elu_postbn", "golden/l6654_elu_postbn.csv", 3e-4),
    ] {
        let out = folder.file("out.csv");
        let done = infer(&models.join(format!("{model}.onnx")), &models.join(golden), &out);
        assert_eq!(done.status.code(), Some(0), "{}", errors(&done));
        let truth = columns(&models.join(golden), ["f64_0", "f64_1", "f64_2"]);
        let found = columns(&out, ["out_0", "out_1", "out_2"]);
        assert_eq!(found.len(), truth.len());
        for (found, truth) in found.iter().flatten().zip(truth.iter().flatten()) {
            assert!((found - truth).abs() <= tolerance * truth.abs().max(1.0), "{model}: {found} for {truth}");
        }
    }
}

#[test]
fn hostile_models_are_refused_in_one_line_within_five_seconds_and_a_gibibyte() {
    let Some(bad) = shared("models/bad") else { return };
    let folder = Folder::new("bad");
    let row: Vec<String> = (0..118).map(|_| "0.5".to_owned()).collect();
    let header: Vec<String> = (0..118).map(|input| format!("in_{input}")).collect();
    let input = folder.file("in.csv");
    std::fs::write(&input, format!("{}\n{}\n", header.join(","), row.join(","))).expect("table");
    let mut seen = 0;
    for entry in std::fs::read_dir(bad).expect("folder") {
        let model = entry.expect("entry").path();
        if model.extension().is_none_or(|extension| extension != "onnx") {
            continue;
        }
        seen += 1;
        let name = model.file_name().expect("name").to_string_lossy().into_owned();
        let out = folder.file("out.csv");
        let done = infer(&model, &input, &out);
        let words = errors(&done);
        if ["ok_small.onnx", "dynamic_batch_ok.onnx"].contains(&name.as_str()) {
            assert_eq!(done.status.code(), Some(0), "{name}: {words}");
            std::fs::remove_file(&out).expect("output");
        } else {
            assert_eq!(done.status.code(), Some(2), "{name}: {words}");
            assert_eq!(words.lines().count(), 1, "{name}: {words}");
            assert!(words.contains(&name), "the line names the file: {words}");
            assert!(!out.exists(), "{name}: nothing is left under the final name");
        }
    }
    assert!(seen > 20);
}

#[test]
fn bad_tables_are_refused_by_line_and_column_and_leave_nothing() {
    let header: Vec<String> = (0..118).map(|input| format!("in_{input}")).collect();
    let row = vec!["1"; 118];
    let with = |at: usize, text: &str| {
        let mut row = row.clone();
        row[at] = text;
        format!("{}\n{}\n{}\n", header.join(","), vec!["1"; 118].join(","), row.join(","))
    };
    let folder = Folder::new("tables");
    let input = folder.file("in.csv");
    let out = folder.file("out.csv");
    for (text, expected) in [
        (with(7, "NaN"), "in.csv:3: in_7 is NaN"),
        (with(117, "inf"), "in.csv:3: in_117 is inf"),
        (with(0, "abc"), "in.csv:3: in_0 is \"abc\", not a number"),
        (with(3, ""), "in.csv:3: in_3 is \"\", not a number"),
        (header.join(",") + "\n", "no rows after the header"),
        (header[..117].join(",") + "\n1\n", "in.csv:1: column in_117 is missing"),
        (format!("{},in_5\n", header.join(",")), "in.csv:1: column in_5 is there twice"),
        (format!("{}\n1,2,3\n", header.join(",")), "make all rows alike"),
        (String::new(), "column in_0 is missing"),
    ] {
        std::fs::write(&input, text).expect("table");
        let done = infer(&untrained(), &input, &out);
        let words = errors(&done);
        assert_eq!(done.status.code(), Some(2), "{words}");
        assert!(words.contains(expected) && words.lines().count() == 1, "wanted {expected}, got {words}");
        assert_eq!(std::fs::read_dir(folder.file("")).expect("folder").count(), 1, "nothing but the input is left");
    }
    std::fs::write(&input, with(0, "1")).expect("table");
    let done = infer(&untrained(), &input, &input);
    assert!(done.status.code() == Some(2) && errors(&done).contains("is both input and output"), "{}", errors(&done));
    assert_eq!(std::fs::read_to_string(&input).expect("table"), with(0, "1"));
    let done = infer(&untrained(), &folder.file("absent.csv"), &out);
    assert_eq!(done.status.code(), Some(2));
}

#[test]
fn other_columns_are_ignored_and_the_order_of_columns_does_not_matter() {
    let folder = Folder::new("order");
    let value = |input: usize| format!("{}", (input as f64 * 0.37).sin() * 0.5);
    let plain = folder.file("plain.csv");
    let mixed = folder.file("mixed.csv");
    let names: Vec<String> = (0..118).map(|input| format!("in_{input}")).collect();
    let values: Vec<String> = (0..118).map(value).collect();
    std::fs::write(&plain, format!("{}\n{}\n", names.join(","), values.join(","))).expect("table");
    let back = |list: &[String]| list.iter().rev().cloned().collect::<Vec<_>>().join(",");
    std::fs::write(&mixed, format!("# a note\ntext,{},ort_0\nx y,{},nan\n", back(&names), back(&values))).expect("table");
    let outputs: Vec<String> = [&plain, &mixed]
        .into_iter()
        .map(|input| {
            let out = folder.file("out.csv");
            let done = infer(&untrained(), input, &out);
            assert_eq!(done.status.code(), Some(0), "{}", errors(&done));
            std::fs::read_to_string(&out).expect("output")
        })
        .collect();
    assert_eq!(outputs[0], outputs[1]);
    assert_eq!(outputs[0].lines().count(), 2);
}
