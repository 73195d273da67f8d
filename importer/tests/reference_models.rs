//! The good reference networks against their golden data, and the oracle beside them.

mod common;

use std::path::Path;

use ravenpose_importer::{Expected, Oracle, import};

const EXPECTED: Expected = Expected { inputs: 118, outputs: 3 };
const SIGMOID: f64 = 2e-5;
const ELU: f64 = 3e-4;

/// 118 inputs, ONNX Runtime's three outputs, three outputs in float64.
fn golden(path: &Path) -> Vec<(Vec<f32>, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert!(lines.next().unwrap().starts_with("in_0,"));
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields.len(), 124);
        let input = fields[..118].iter().map(|f| f.parse().unwrap()).collect();
        (input, fields[121..].iter().map(|f| f.parse().unwrap()).collect())
    };
    lines.map(row).collect()
}

fn distance(y: &[f64], reference: &[f64]) -> f64 {
    y.iter().zip(reference).map(|(y, r)| (y - r).abs() / r.abs().max(1.0)).fold(0.0, f64::max)
}

fn check(name: &str, golden_file: &str, tolerance: f64, parameters: usize) {
    let Some(models) = common::shared_models() else { return };
    let bytes = std::fs::read(models.join(name)).unwrap();
    let network = import(&bytes, &EXPECTED).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(network.parameter_count(), parameters, "{name}");
    let mut oracle = Oracle::new(&bytes, &EXPECTED).unwrap();
    let rows = golden(&models.join(golden_file));
    assert_eq!(rows.len(), 64);
    let (mut worst, mut worst_oracle) = (0f64, 0f64);
    for (input, reference) in &rows {
        worst = worst.max(distance(&network.evaluate_f64(input), reference));
        let tract: Vec<f64> = oracle.run(input).unwrap().into_iter().map(f64::from).collect();
        worst_oracle = worst_oracle.max(distance(&tract, reference));
    }
    println!("{name}: imported {worst:.1e}, tract {worst_oracle:.1e}");
    assert!(worst <= tolerance, "{name}: {worst:e}");
    assert!(worst_oracle <= tolerance, "{name}, tract: {worst_oracle:e}");
}

/// Weights and biases of 118-600-500-400-3.
const PAPER: usize = 118 * 600 + 600 * 500 + 500 * 400 + 400 * 3 + 1503;

#[test]
fn sigmoid_bn() {
    check("l654_sigmoid_bn.onnx", "golden.csv", SIGMOID, PAPER);
}

#[test]
fn sigmoid_folded() {
    check("l654_sigmoid_folded.onnx", "golden/l654_sigmoid_folded.csv", SIGMOID, PAPER);
}

#[test]
fn sigmoid_keras_dynbatch() {
    check("l654_sigmoid_keras_dynbatch.onnx", "golden/l654_sigmoid_keras_dynbatch.csv", SIGMOID, PAPER);
}

#[test]
fn sigmoid_bn_zscore() {
    check("l654_sigmoid_bn_zscore.onnx", "golden/l654_sigmoid_bn_zscore.csv", SIGMOID, PAPER + 2 * 118);
}

#[test]
fn sigmoid_postbn() {
    check("l654_sigmoid_postbn.onnx", "golden/l654_sigmoid_postbn.csv", SIGMOID, PAPER);
}

#[test]
fn elu_postbn() {
    check("l6654_elu_postbn.onnx", "golden/l6654_elu_postbn.csv", ELU, PAPER + 600 * 600 + 600);
}
