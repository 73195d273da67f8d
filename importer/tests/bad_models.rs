//! The malformed and unsuitable files: each refused in one line that names what is wrong.

mod common;

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use ravenpose_importer::{Expected, import};

const EXPECTED: Expected = Expected { inputs: 118, outputs: 3 };

/// File and the words its refusal must contain; no words: it must load.
const WANTED: &[(&str, &[&str])] = &[
    ("ok_small", &[]),
    ("dynamic_batch_ok", &[]),
    ("empty", &["empty"]),
    ("random_bytes", &["not an ONNX file"]),
    ("text_not_onnx", &["not an ONNX file"]),
    ("truncated_half", &["cut off"]),
    ("truncated_last_byte", &["cut off"]),
    ("input_width_117", &["input", "117", "118"]),
    ("output_width_4", &["output", "4", "3"]),
    ("declared_120_weights_118", &["input", "120", "118"]),
    ("batch_64", &["64", "fix the batch dimension to 1 or leave it symbolic"]),
    ("float16", &["FLOAT16", "float32"]),
    ("weight_nan", &["NaN", "finite"]),
    ("bias_inf", &["inf", "finite"]),
    ("bn_negative_variance", &["variance", "-0.5"]),
    ("unsupported_op_erf", &["Erf"]),
    ("custom_domain_op", &["RavenMagic", "com.example"]),
    ("control_flow_if", &["If", "subgraph"]),
    ("two_inputs", &["2 graph inputs"]),
    ("huge_dims_header", &["1099511627776", "1048576"]),
    ("negative_dim", &["-8"]),
    ("raw_data_too_short", &["bytes of raw data"]),
    ("missing_initializer", &["is missing"]),
    ("layer_width_mismatch", &["input width"]),
    ("cycle", &["cycle"]),
    ("output_not_produced", &["not produced"]),
    ("external_data_path_escape", &["external data"]),
    ("opset_999", &["999", "export with opset 9 to 22"]),
];

#[test]
fn each_bad_file_is_refused_in_one_telling_line() {
    let Some(models) = common::shared_models() else { return };
    for (name, words) in WANTED {
        let bytes = std::fs::read(models.join(format!("bad/{name}.onnx"))).unwrap();
        let start = Instant::now();
        let outcome = import(&bytes, &EXPECTED);
        assert!(start.elapsed() < Duration::from_secs(10), "{name} took {:?}", start.elapsed());
        let Err(error) = outcome else {
            assert!(words.is_empty(), "{name} was accepted");
            continue;
        };
        let line = error.to_string();
        println!("{name}: {line}");
        assert!(!words.is_empty(), "{name} was refused: {line}");
        assert!(!line.chars().any(char::is_control), "{name}: {line:?}");
        for word in *words {
            assert!(line.contains(word), "{name}: no `{word}` in: {line}");
        }
    }
}

#[test]
fn the_table_names_every_file() {
    let Some(models) = common::shared_models() else { return };
    let files = std::fs::read_dir(models.join("bad")).unwrap().map(|f| f.unwrap().path());
    let onnx = files.filter(|p| p.extension().is_some_and(|e| e == "onnx"));
    let found: BTreeSet<String> = onnx.map(|p| p.file_stem().unwrap().to_string_lossy().into_owned()).collect();
    assert_eq!(found, WANTED.iter().map(|(name, _)| (*name).to_owned()).collect());
}

#[test]
fn accepted_small_files_compute_what_the_oracle_computes() {
    let Some(models) = common::shared_models() else { return };
    for name in ["ok_small", "dynamic_batch_ok"] {
        let bytes = std::fs::read(models.join(format!("bad/{name}.onnx"))).unwrap();
        let network = import(&bytes, &EXPECTED).unwrap();
        let mut oracle = ravenpose_importer::Oracle::new(&bytes, &EXPECTED).unwrap();
        let input = common::Random(1).vector(118);
        for (a, b) in network.evaluate_f64(&input).iter().zip(oracle.run(&input).unwrap()) {
            assert!((a - f64::from(b)).abs() < 1e-4);
        }
    }
}
