//! The service's own plan against the golden outputs beside each reference model, on every instruction set of this machine.

mod common;

use ravenpose::model;
use ravenpose::network::{Format, InstructionSet, Plan};
use ravenpose_importer::{Activation, Network};
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
        for set in InstructionSet::present() {
            let mut plan = Plan::with(&network, set, Format::F32);
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
fn keeping_weights_warm_changes_no_output() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    for mut plan in every_plan(&network) {
        let mut expected = [0.0_f32; 3];
        plan.run(&[0.25; 118], &mut expected);
        // More than once round: 16 KiB each time.
        for _ in 0..plan.bytes() / 8192 + 8 {
            plan.keep_warm();
        }
        let mut found = [0.0_f32; 3];
        plan.run(&[0.25; 118], &mut found);
        assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits), "{}", name(&plan));
    }
}

#[test]
fn nan_reaches_the_output_of_every_kernel_and_infinity_never_gives_another_number() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    for mut plan in every_plan(&network) {
        for position in 0..118 {
            let mut input = [0.0_f32; 118];
            input[position] = f32::NAN;
            let mut output = [0.0_f32; 3];
            plan.run(&input, &mut output);
            assert!(output.iter().all(|value| value.is_nan()), "NaN at {position}: {}", name(&plan));
            // A sigmoid makes a number of infinity, and whole numbers cannot hold it: what float64 gives, or none. The next run must not
            // remember either.
            for infinite in [f32::INFINITY, f32::NEG_INFINITY] {
                input[position] = infinite;
                plan.run(&input, &mut output);
                for (found, truth) in output.iter().zip(&network.evaluate_f64(&input)) {
                    let alike = (f64::from(*found) - truth).abs() <= bound_mm(plan.format());
                    assert!(found.is_nan() || alike, "{infinite} at {position}: {found}, not {truth}: {}", name(&plan));
                }
            }
            plan.run(&[0.0; 118], &mut output);
            assert!(output.iter().all(|value| value.is_finite()), "after infinity at {position}: {}", name(&plan));
        }
    }
}

#[test]
fn infinity_passes_through_layers_that_do_not_bound_it() {
    let network = Network::dense(&[118, 40, 3], Activation::Relu, |_, _| 0.25);
    for mut plan in every_plan(&network) {
        for infinite in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            let (mut input, mut output) = ([0.5_f32; 118], [0.0_f32; 3]);
            input[7] = infinite;
            plan.run(&input, &mut output);
            // Below nothing a rectifier gives nothing, as float64 does.
            let held = |value: &f32| !value.is_finite() || (infinite == f32::NEG_INFINITY && *value == 0.0);
            assert!(output.iter().all(held), "{infinite}: {output:?}: {}", name(&plan));
        }
    }
}

#[test]
fn nothing_of_a_run_with_nan_is_left_in_the_next_whatever_the_widths() {
    let mut rng = common::Rng(9);
    // Narrow layers whose padding lies where a wider one wrote before, in either of the two buffers.
    for widths in [&[118, 20, 40, 50, 44, 3][..], &[118, 40, 20, 44, 50, 3], &[118, 3, 40, 3, 50, 3], &[118, 200, 130, 250, 180, 3]]
    {
        let network = Network::dense(widths, Activation::Tanh, |_, inputs| (rng.uniform() - 0.5) as f32 / (inputs as f32).sqrt());
        for mut plan in every_plan(&network) {
            let run = |plan: &mut Plan, value: f32| {
                let mut output = [0.0_f32; 3];
                plan.run(&[value; 118], &mut output);
                output
            };
            let before = run(&mut plan, 0.7);
            assert!(run(&mut plan, f32::NAN).iter().all(|value| value.is_nan()), "{widths:?}: {}", name(&plan));
            assert_eq!(run(&mut plan, 0.7), before, "{widths:?}: {}", name(&plan));
        }
    }
}

#[test]
fn denormals_change_nothing() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    let run = |plan: &mut Plan, value: f32| {
        let mut output = [0.0_f32; 3];
        plan.run(&[value; 118], &mut output);
        output
    };
    for mut plan in every_plan(&network) {
        let zero = run(&mut plan, 0.0);
        for value in [1e-40, -1e-40, f32::MIN_POSITIVE, -0.0] {
            for (found, expected) in run(&mut plan, value).iter().zip(&zero) {
                assert!((found - expected).abs() <= 1e-6, "{value:e} {}", name(&plan));
            }
        }
    }
}

/// What the random inputs below may be off by in mm, by format; the untrained model gives some 3 mm.
fn bound_mm(format: Format) -> f64 {
    match format {
        Format::F32 => 2e-5,
        Format::I16 => 1e-3,
        Format::I12 => 2e-3,
        Format::F16 => 4e-3,
        Format::Bf16 => 0.04,
        Format::I8 => 0.025,
    }
}

fn every_plan(network: &Network) -> Vec<Plan> {
    let formats = |set| Format::ALL.into_iter().map(move |format| (set, format));
    InstructionSet::present().flat_map(formats).map(|(set, format)| Plan::with(network, set, format)).collect()
}

fn name(plan: &Plan) -> String {
    format!("{} on {}", plan.format(), plan.instruction_set().name())
}

#[test]
fn every_format_stays_within_its_bound_on_every_instruction_set() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    let mut rng = common::Rng(7);
    let scale = network.input_scale.as_ref().expect("the model normalises its input");
    let inputs: Vec<Vec<f32>> = (0..200)
        .map(|_| (0..118).map(|i| scale.shift[i] + (4.0 * rng.uniform() - 2.0) as f32 / scale.scale[i]).collect())
        .collect();
    for mut plan in every_plan(&network) {
        let mut worst = 0.0_f64;
        for input in &inputs {
            let mut output = [0.0_f32; 3];
            plan.run(input, &mut output);
            for (found, truth) in output.iter().zip(&network.evaluate_f64(input)) {
                worst = worst.max((f64::from(*found) - truth).abs() / truth.abs().max(1.0));
            }
        }
        println!("{:20} {} bytes, worst {worst:.1e}", name(&plan), plan.bytes());
        assert!(worst <= bound_mm(plan.format()), "{}: {worst:e}", name(&plan));
    }
}

#[test]
fn one_format_gives_the_same_on_every_instruction_set() {
    let network = model::network(&common::untrained()).expect("the repository's model");
    let mut rng = common::Rng(8);
    let scale = network.input_scale.as_ref().expect("the model normalises its input");
    for format in Format::ALL {
        let mut plans: Vec<Plan> = InstructionSet::present().map(|set| Plan::with(&network, set, format)).collect();
        for _ in 0..50 {
            let input: Vec<f32> = (0..118).map(|i| scale.shift[i] + (4.0 * rng.uniform() - 2.0) as f32 / scale.scale[i]).collect();
            let mut reference = [0.0_f32; 3];
            plans[0].run(&input, &mut reference);
            for plan in &mut plans {
                let mut output = [0.0_f32; 3];
                plan.run(&input, &mut output);
                for (found, reference) in output.iter().zip(&reference) {
                    // Rounding; in whole numbers that of the activations and the product of both low digits as well.
                    assert!((found - reference).abs() <= 1e-3, "{}: {found} {reference}", name(plan));
                }
            }
        }
    }
}

/// Every plan of a network gives what float64 gives, within `limit` of a format, in units of `size` of the true output.
fn agrees(network: &Network, input: &[f32], what: &str, size: impl Fn(f64) -> f64, limit: impl Fn(Format) -> f64) {
    let truth = network.evaluate_f64(input);
    for mut plan in every_plan(network) {
        let mut output = vec![0.0_f32; truth.len()];
        plan.run(input, &mut output);
        for (found, truth) in output.iter().zip(&truth) {
            let error = (f64::from(*found) - truth).abs() / size(*truth);
            assert!(error <= limit(plan.format()), "{what}, {}: {found} {truth}, {error:e}", name(&plan));
        }
    }
}

/// Of two layers and of three: the first keeps more bits than the others, those of up to eight outputs are float32.
#[test]
fn odd_widths_are_padded_right_in_every_format_on_every_instruction_set() {
    let mut rng = common::Rng(9);
    let activations = [Activation::Sigmoid, Activation::Tanh, Activation::Relu, Activation::Elu { alpha: 1.0 }];
    let all: [&[usize]; 9] = [
        &[1, 1, 1],
        &[3, 17, 5],
        &[118, 129, 3],
        &[16, 64, 16],
        &[65, 200, 33],
        &[118, 17, 33, 3],
        &[5, 129, 49, 2],
        &[33, 65, 97, 3],
        &[7, 200, 130, 1],
    ];
    for widths in all {
        for activation in activations {
            let mut network = Network::dense(widths, activation, |_, _| rng.uniform() as f32 - 0.5);
            for bias in network.layers.iter_mut().flat_map(|layer| &mut layer.bias) {
                *bias = rng.uniform() as f32 - 0.5;
            }
            let input: Vec<f32> = (0..widths[0]).map(|i| (i as f32 * 0.7).sin()).collect();
            let size = network.evaluate_f64(&input).iter().fold(1.0_f64, |size, y| size.max(y.abs()));
            agrees(&network, &input, &format!("{widths:?} {activation:?}"), |_| size, |format| bound_mm(format) + 1e-5);
        }
    }
}

/// The middle layer of three, behind one that makes its inputs of a number: that times what `of` says for each.
fn behind_copies(of: &dyn Fn(usize) -> f32, inputs: usize, outputs: usize, weight: &dyn Fn(usize, usize) -> f32) -> Network {
    // The number of inputs of each layer tells which it is.
    assert!(inputs != 1 && inputs != outputs && outputs != 1);
    Network::dense(&[1, inputs, outputs, 3], Activation::Identity, |place, wide| match (wide, place / wide, place % wide) {
        (1, row, _) => of(row),
        (wide, row, column) if wide == inputs => weight(row, column),
        (_, row, column) => f32::from(u8::from(row == column)),
    })
}

#[test]
fn the_largest_sums_do_not_overflow_in_any_format_on_any_instruction_set() {
    // Every weight and every input as large as its format holds, of one sign and of alternating ones, over several blocks of a sum.
    for inputs in [2, 511, 512, 513, 1301, 4000] {
        for alternating in [false, true] {
            let sign = |place: usize| if alternating && place % 2 == 1 { -1.0 } else { 1.0 };
            let alone = Network::dense(&[inputs, 17, 3], Activation::Identity, |place, wide| sign(place % wide));
            let direct: Vec<f32> = (0..inputs).map(|place| 3.0 * sign(place)).collect();
            let middle = behind_copies(&sign, inputs, 17, &|_, column| sign(column));
            for (network, input) in [(&alone, &direct[..]), (&middle, &[3.0])] {
                agrees(network, input, &format!("{inputs} inputs"), f64::abs, |_| 1e-4);
            }
        }
    }
}

#[test]
fn rows_of_zeros_and_of_one_weight_are_right_in_every_format_on_every_instruction_set() {
    for inputs in [118, 600, 4000] {
        // Output 0 has no weight, output 1 one, output 2 every seventh; as many outputs as whole numbers are taken for.
        let weight = |row: usize, column: usize| match row {
            1 if column == inputs / 2 => 0.5,
            2 if column.is_multiple_of(7) => 0.25,
            _ => 0.0,
        };
        let mut alone = Network::dense(&[inputs, 17], Activation::Identity, |place, wide| weight(place / wide, place % wide));
        let direct: Vec<f32> = (0..inputs).map(|place| (place as f32 * 0.37).sin()).collect();
        // As weights of the layer before these have to be numbers that every format holds.
        let mut middle = behind_copies(&|place| (direct[place] * 64.0).round() / 64.0, inputs, 17, &weight);
        for layer in [&mut alone.layers[0], &mut middle.layers[1]] {
            layer.bias[..3].copy_from_slice(&[1.5, -2.0, 0.25]);
        }
        for (network, input) in [(&alone, &direct[..]), (&middle, &[1.0])] {
            agrees(network, input, &format!("{inputs} inputs"), |truth| truth.abs().max(1.0), |_| 1e-4);
        }
    }
}
