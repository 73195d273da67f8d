//! The service's own plan against the golden outputs beside each reference model, on every instruction set of this machine.

mod common;

use ravenpose::model;
use ravenpose::network::{InstructionSet, Plan};
use std::path::Path;

/// Tolerance by model, as `models/README.md` states it.
const MODELS: [(&str, &str, f64); 6] = [
    ("l654_sigmoid_bn.onnx", "golden.csv", 2e-5),
    ("l654_sigmoid_folded.onnx", "golden/l654_sigmoid_folded.csv", 2e-5),
    ("l654_sigmoid_keras_dynbatch.onnx", "golden/l654_sigmoid_keras_dynbatch.csv", 2e-5),
    ("l654_sigmoid_bn_zscore.onnx", "golden/l654_sigmoid_bn_zscore.csv", 2e-5),
    ("l654_sigmoid_postbn.onnx", "golden/l654_sigmoid_postbn.csv", 2e-5),
    ("l6654_elu_postbn.onnx", "golden/l6654_elu_postbn.csv", 3e-4),
];

struct Row {
    input: Vec<f32>,
    truth: Vec<f64>,
}

fn golden(path: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(path).expect("golden file");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("header").split(',').collect();
    let column = |name: String| header.iter().position(|h| *h == name).expect("column");
    let inputs: Vec<usize> = (0..118).map(|i| column(format!("in_{i}"))).collect();
    let outputs: Vec<usize> = (0..3).map(|i| column(format!("f64_{i}"))).collect();
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            Row {
                input: inputs.iter().map(|&i| cells[i].parse().expect("number")).collect(),
                truth: outputs.iter().map(|&i| cells[i].parse().expect("number")).collect(),
            }
        })
        .collect()
}

#[test]
fn every_reference_model_gives_its_golden_outputs_on_every_instruction_set() {
    let Some(models) = common::shared("models") else { return };
    for (file, csv, tolerance) in MODELS {
        let network = model::network(&models.join(file)).expect(file);
        let rows = golden(&models.join(csv));
        assert_eq!(rows.len(), 64);
        for set in [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512] {
            let mut plan = Plan::with(&network, set);
            let mut worst = 0.0_f64;
            for row in &rows {
                let mut output = [0.0_f32; 3];
                plan.run(&row.input, &mut output);
                for (found, truth) in output.iter().zip(&row.truth) {
                    worst = worst.max((f64::from(*found) - truth).abs() / truth.abs().max(1.0));
                }
            }
            println!("{file:36} {:9} worst {worst:.2e}", plan.instruction_set().name());
            assert!(worst <= tolerance, "{file} on {}: {worst:e}", set.name());
        }
    }
}

#[test]
fn nan_and_infinity_in_an_input_reach_the_output_of_every_kernel() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    for set in [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512] {
        let mut plan = Plan::with(&network, set);
        for position in 0..118 {
            let mut input = [0.0_f32; 118];
            input[position] = f32::NAN;
            let mut output = [0.0_f32; 3];
            plan.run(&input, &mut output);
            assert!(output.iter().all(|value| value.is_nan()), "NaN at {position} on {}", set.name());
        }
    }
}

#[test]
fn denormals_change_nothing() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    let mut plan = Plan::new(&network);
    let run = |plan: &mut Plan, value: f32| {
        let mut output = [0.0_f32; 3];
        plan.run(&[value; 118], &mut output);
        output
    };
    let zero = run(&mut plan, 0.0);
    for value in [1e-40, -1e-40, f32::MIN_POSITIVE, -0.0] {
        for (found, expected) in run(&mut plan, value).iter().zip(&zero) {
            assert!((found - expected).abs() <= 1e-6, "{value:e}");
        }
    }
}

#[test]
fn the_instruction_sets_agree() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    let mut rng = common::Rng(7);
    let mut plans: Vec<Plan> = [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512]
        .into_iter()
        .map(|set| Plan::with(&network, set))
        .collect();
    let scale = network.input_scale.as_ref().expect("the model normalises its input");
    for _ in 0..200 {
        let input: Vec<f32> = (0..118).map(|i| scale.shift[i] + (4.0 * rng.uniform() - 2.0) as f32 / scale.scale[i]).collect();
        let reference = network.evaluate_f64(&input);
        for plan in &mut plans {
            let mut output = [0.0_f32; 3];
            plan.run(&input, &mut output);
            for (found, truth) in output.iter().zip(&reference) {
                assert!((f64::from(*found) - truth).abs() <= 2e-5 * truth.abs().max(1.0), "{}", plan.instruction_set().name());
            }
        }
    }
}
