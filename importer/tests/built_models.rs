//! Small models built in code, against a plain evaluation of their nodes: runs without the shared folder.

mod common;

use common::{Chain, bytes, evaluate, float, int, port};
use prost::Message;
use ravenpose_importer::{Activation, Expected, ImportError, Network, Oracle, import};
use tract_onnx::pb::tensor_shape_proto::dimension;
use tract_onnx::pb::{ModelProto, TensorProto};

fn expected(model: &ModelProto) -> Expected {
    let graph = model.graph.as_ref().unwrap();
    let width = |info: &tract_onnx::pb::ValueInfoProto| {
        let Some(tract_onnx::pb::type_proto::Value::TensorType(t)) = &info.r#type.as_ref().unwrap().value else { panic!() };
        let Some(dimension::Value::DimValue(width)) = t.shape.as_ref().unwrap().dim[1].value else { panic!() };
        usize::try_from(width).unwrap()
    };
    Expected { inputs: width(&graph.input[0]), outputs: width(&graph.output[0]) }
}

fn refusal(model: &ModelProto) -> ImportError {
    import(&bytes(model), &expected(model)).expect_err("must be refused")
}

/// Imports, and compares on inputs around `centre` with `spread`, within `tolerance` of max(1, |y|).
fn compare_near(model: &ModelProto, centre: &[f32], spread: f32, tolerance: f64) -> Network {
    let network = import(&bytes(model), &expected(model)).unwrap_or_else(|e| panic!("{e}"));
    let mut random = common::Random(99);
    for _ in 0..20 {
        let noise = random.vector(centre.len());
        let input: Vec<f32> = centre.iter().zip(noise).map(|(c, n)| c + spread * n).collect();
        for (y, reference) in network.evaluate_f64(&input).iter().zip(evaluate(model, &input)) {
            let distance = (y - reference).abs() / reference.abs().max(1.0);
            assert!(distance <= tolerance, "{y} instead of {reference}");
        }
    }
    network
}

fn compare(model: &ModelProto) -> Network {
    let width = expected(model).inputs;
    compare_near(model, &vec![0.0; width], 2.0, 3e-6)
}

#[test]
fn gemm_both_orientations_with_alpha_and_beta() {
    for transposed in [false, true] {
        for (alpha, beta) in [(1.0, 1.0), (0.5, 1.0), (1.0, -2.0), (3.0, 0.25), (-1.0, 0.0)] {
            let network = compare(
                &Chain::new(7).gemm(5, transposed, alpha, beta).activate("Tanh").gemm(2, !transposed, beta + 3.0, alpha).finish(),
            );
            assert_eq!(network.layers.len(), 2);
            assert!(network.input_scale.is_none());
        }
    }
}

#[test]
fn square_layers_keep_their_orientation() {
    for transposed in [false, true] {
        compare(&Chain::new(6).gemm(6, transposed, 1.0, 1.0).activate("Sigmoid").gemm(6, transposed, 1.0, 1.0).finish());
    }
}

#[test]
fn matmul_and_add_in_input_output_layout() {
    let model = Chain::new(4)
        .matmul(6)
        .with("Add", &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
        .activate("Relu")
        .matmul(3)
        .with("Add", &[1.0])
        .finish();
    let network = compare(&model);
    assert_eq!(network.layers[0].activation, Activation::Relu);
    assert_eq!(network.layers[1].bias, [1.0; 3]);
}

#[test]
fn widths_of_one() {
    compare(&Chain::new(1).dense(1).activate("Tanh").matmul(4).activate("Sigmoid").dense(1).finish());
    compare(&Chain::new(3).matmul(1).activate("Elu").dense(2).finish());
    compare(&Chain::new(1).matmul(1).finish());
}

#[test]
fn batch_norm_before_and_after_the_activation() {
    compare(&Chain::new(5).dense(6).norm().activate("Sigmoid").dense(3).finish());
    compare(&Chain::new(5).dense(6).activate("Sigmoid").norm().dense(4).activate("Elu").norm().dense(3).finish());
    compare(&Chain::new(5).dense(6).norm().activate("Relu").norm().dense(3).norm().finish());
}

#[test]
fn all_activations() {
    let alphas = [0.25f32, 1.0, 2.0];
    for op in ["Sigmoid", "Tanh", "Relu", "Elu"] {
        compare(&Chain::new(5).dense(6).activate(op).dense(3).finish());
        compare(&Chain::new(5).dense(6).activate(op).dense(3).activate(op).finish());
    }
    for alpha in alphas {
        let model = Chain::new(5).dense(6).node("Elu", &["@"], vec![float("alpha", alpha)]).dense(3).finish();
        let network = compare(&model);
        assert_eq!(network.layers[0].activation, Activation::Elu { alpha });
    }
}

#[test]
fn layers_without_activation_stay_apart() {
    let network = compare(&Chain::new(5).dense(6).dense(2).finish());
    assert_eq!(network.layers.iter().map(|l| l.activation).collect::<Vec<_>>(), [Activation::Identity; 2]);
}

const MEAN: [f32; 4] = [0.5, -3.0e4, 1.0e4, 2.0];
const STD: [f32; 4] = [2.0, 3.0e2, 1e-3, 1.0];

#[test]
fn z_score_of_a_constant_channel_keeps_its_mean() {
    let sub_div = || Chain::new(4).with("Sub", &MEAN).with("Div", &STD).dense(6).activate("Sigmoid").dense(3).finish();
    // A float32 near 1e4 moves in steps of one deviation here: the inputs are exact, and so must the answers be.
    let network = compare_near(&sub_div(), &MEAN, 3e-3, 3e-6);
    compare_near(&sub_div(), &MEAN, 3.0, 3e-6);
    let scale = network.input_scale.unwrap();
    assert_eq!(scale.shift, MEAN);
    assert_eq!(scale.scale, STD.map(|s| 1.0 / s));
    let inverse = STD.map(|s| 1.0 / s);
    compare_near(
        &Chain::new(4).with("Sub", &MEAN).with("Mul", &inverse).dense(6).activate("Tanh").dense(3).finish(),
        &MEAN,
        3e-3,
        3e-6,
    );
    let negated = MEAN.map(|m| -m);
    compare_near(&Chain::new(4).with("Add", &negated).with("Mul", &inverse).dense(3).finish(), &MEAN, 3e-3, 3e-6);
}

#[test]
fn input_scaling_as_product_and_sum() {
    let product = [0.5f32, 1e-4, 1000.0, -1.0];
    let sum = [1.0f32, 0.37, -1.000_000_1e7, 2.0];
    let model = Chain::new(4).with("Mul", &product).with("Add", &sum).dense(6).activate("Sigmoid").dense(3).finish();
    let network = compare_near(&model, &[0.5, -3.0e4, 1.0e4, 2.0], 3e-3, 3e-6);
    assert!(network.input_scale.is_some());
}

#[test]
fn a_channel_scaled_by_zero_becomes_bias() {
    let model =
        Chain::new(3).with("Mul", &[2.0, 0.0, 1.0]).with("Add", &[0.0, 5.0, 0.0]).dense(4).activate("Tanh").dense(2).finish();
    let network = compare(&model);
    assert_eq!(network.input_scale.unwrap().scale, [2.0, 0.0, 1.0]);
}

#[test]
fn batch_norm_of_raw_inputs_keeps_the_mean() {
    let variance = STD.map(|s| s * s);
    let model = Chain::new(4).norm_of(&MEAN, &variance).dense(6).activate("Sigmoid").dense(3).finish();
    let network = compare_near(&model, &MEAN, 3e-3, 1e-5);
    assert_eq!(network.input_scale.unwrap().shift[2], 1.0e4);
}

#[test]
fn constants_on_the_left() {
    let mut chain = Chain::new(3).dense(4);
    let c = chain.store(&[4], &[1.0, 2.0, 3.0, 4.0]);
    let model = chain.node("Sub", &[&c, "@"], vec![]).activate("Sigmoid").dense(2).finish();
    compare(&model);
    let mut chain = Chain::new(3).dense(4);
    let c = chain.store(&[4], &[1.0, 2.0, 3.0, 4.0]);
    let divided = chain.node("Div", &[&c, "@"], vec![]).dense(2).finish();
    assert!(matches!(refusal(&divided), ImportError::NotAChain { .. }));
}

#[test]
fn outputs_scaled_back_to_units() {
    let network =
        compare(&Chain::new(3).dense(4).activate("Sigmoid").dense(2).with("Mul", &[3.0, 0.5]).with("Add", &[-1.0, 2.0]).finish());
    assert_eq!(network.layers.len(), 2);
    let bounded = Chain::new(3).dense(4).activate("Sigmoid").dense(2).activate("Tanh").with("Mul", &[3.0, 0.5]).finish();
    assert_eq!(compare(&bounded).layers.len(), 3);
}

#[test]
fn shape_operators_that_only_move_unit_axes() {
    let mut chain =
        Chain::new(6).activate("Identity").node("Flatten", &["@"], vec![int("axis", 1)]).node("Cast", &["@"], vec![int("to", 1)]);
    let shape = chain.integers(&[-1, 6]);
    let mut chain = chain.node("Reshape", &["@", &shape], vec![]).dense(4);
    let axes = chain.integers(&[0]);
    let chain = chain.node("Unsqueeze", &["@", &axes], vec![]).matmul(3).with("Add", &[0.5; 3]).activate("Elu");
    compare(&chain.node("Squeeze", &["@", &axes], vec![]).dense(2).finish());
}

#[test]
fn axes_as_attributes_before_opset_13() {
    let axes =
        |value: i64| tract_onnx::pb::AttributeProto { name: "axes".into(), r#type: 7, ints: vec![value], ..Default::default() };
    let chain = Chain::new(6).dense(4).node("Unsqueeze", &["@"], vec![axes(0)]).activate("Tanh");
    let mut model = chain.node("Squeeze", &["@"], vec![axes(0)]).dense(2).finish();
    for version in 9..13 {
        model.opset_import[0].version = version;
        compare(&model);
    }
}

#[test]
fn shape_operators_in_every_later_opset() {
    for version in 13..=22 {
        let mut chain = Chain::new(6).activate("Identity").node("Cast", &["@"], vec![int("to", 1)]);
        let shape = chain.integers(&[1, -1]);
        let mut chain = chain.node("Reshape", &["@", &shape], vec![]).dense(4).node("Flatten", &["@"], vec![]).activate("Elu");
        let axes = chain.integers(&[1]);
        let chain = chain.node("Unsqueeze", &["@", &axes], vec![]).node("Squeeze", &["@", &axes], vec![]);
        let mut model = chain.dense(3).activate("Tanh").dense(2).activate("Relu").finish();
        model.opset_import[0].version = version;
        compare(&model);
    }
}

#[test]
fn constant_nodes_count_as_stored_tensors() {
    let mut model = Chain::new(3).dense(4).activate("Sigmoid").dense(2).finish();
    let network = import(&bytes(&model), &expected(&model)).unwrap();
    let graph = model.graph.as_mut().unwrap();
    let stored = std::mem::take(&mut graph.initializer);
    for (index, tensor) in stored.into_iter().enumerate() {
        let output = vec![tensor.name.clone()];
        let value = tract_onnx::pb::AttributeProto { name: "value".into(), r#type: 4, t: Some(tensor), ..Default::default() };
        let node = tract_onnx::pb::NodeProto { op_type: "Constant".into(), output, attribute: vec![value], ..Default::default() };
        graph.node.insert(index, node);
    }
    assert_eq!(import(&bytes(&model), &expected(&model)).unwrap(), network);
}

#[test]
fn symbolic_and_absent_batch() {
    for batch in [None, Some(dimension::Value::DimParam("N".into())), Some(dimension::Value::DimParam("unk__6".into()))] {
        let mut model = Chain::new(3).matmul(4).with("Add", &[0.1; 4]).activate("Sigmoid").dense(2).finish();
        let graph = model.graph.as_mut().unwrap();
        graph.input[0] = port("x", batch.clone(), 3);
        let output = graph.output[0].name.clone();
        graph.output[0] = port(&output, batch, 2);
        compare(&model);
    }
}

#[test]
fn metadata_comes_back() {
    let model = Chain::new(3).dense(2).metadata("units", "mm").metadata("x\ny", "\u{1b}[1m").finish();
    let metadata = import(&bytes(&model), &expected(&model)).unwrap().metadata;
    assert_eq!(metadata.len(), 2);
    assert_eq!(metadata["units"], "mm");
    assert_eq!(metadata["x\ny"], "\u{1b}[1m");
    let twice = Chain::new(3).dense(2).metadata("units", "mm").metadata("units", "m").finish();
    assert!(matches!(refusal(&twice), ImportError::DuplicateMetadata { .. }));
}

#[test]
fn the_oracle_runs_what_import_accepts() {
    let model = common::small();
    let network = import(&bytes(&model), &expected(&model)).unwrap();
    let mut oracle = Oracle::new(&bytes(&model), &expected(&model)).unwrap();
    let mut random = common::Random(3);
    for _ in 0..10 {
        let input = random.vector(5);
        for (y, tract) in network.evaluate_f64(&input).iter().zip(oracle.run(&input).unwrap()) {
            assert!((y - f64::from(tract)).abs() < 1e-5);
        }
    }
    assert_eq!(oracle.run(&[0.0; 4]), Err(ImportError::InputLength { found: 4, expected: 5 }));
    let wrong = Expected { inputs: 5, outputs: 2 };
    assert!(matches!(Oracle::new(&bytes(&model), &wrong), Err(ImportError::SignatureShape { .. })));
}

#[test]
fn a_model_built_here_is_what_prost_reads_back() {
    let model = common::small();
    assert_eq!(ModelProto::decode(&bytes(&model)[..]).unwrap(), model);
}

#[test]
fn listing_weights_among_the_inputs_is_allowed() {
    let mut model = Chain::new(3).dense(2).finish();
    let graph = model.graph.as_mut().unwrap();
    let weights: Vec<&TensorProto> = graph.initializer.iter().collect();
    let listed: Vec<_> = weights.iter().map(|t| port(&t.name, None, 1)).collect();
    graph.input.splice(0..0, listed);
    let network = import(&bytes(&model), &Expected { inputs: 3, outputs: 2 }).unwrap();
    assert_eq!(network.layers.len(), 1);
}

const PLAYS: [(i64, f32); 2] = [(4, 0.25), (0, 1.5)];

/// Five raw inputs and two plays in front of a network of seven inputs.
fn remembering() -> ModelProto {
    common::remember(Chain::new(7).with("Sub", &[0.5; 7]).dense(6).activate("Tanh").dense(3).finish(), 5, &PLAYS)
}

fn import_remembering(model: &ModelProto) -> Result<Network, ImportError> {
    import(&bytes(model), &Expected { inputs: 5, outputs: 3 })
}

#[test]
fn a_memory_is_cut_off_and_the_layers_behind_it_are_the_same() {
    let network = import_remembering(&remembering()).unwrap_or_else(|e| panic!("{e}"));
    let plays: Vec<(i64, f32)> = network.plays.iter().map(|play| (play.input as i64, play.half_width)).collect();
    assert_eq!(plays, PLAYS);
    let bare = Chain::new(7).with("Sub", &[0.5; 7]).dense(6).activate("Tanh").dense(3).finish();
    let bare = import(&bytes(&bare), &Expected { inputs: 7, outputs: 3 }).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((network.input_width, &network.layers, &network.input_scale), (7, &bare.layers, &bare.input_scale));
    assert!(bare.plays.is_empty());
    let mut oracle = Oracle::new(&bytes(&remembering()), &Expected { inputs: 5, outputs: 3 }).unwrap();
    let input = [0.1, -0.7, 2.0, 0.4, 1.0, 0.2, -1.1];
    for (y, tract) in network.evaluate_f64(&input).iter().zip(oracle.run(&input).unwrap()) {
        assert!((y - f64::from(tract)).abs() < 1e-5);
    }
}

#[test]
fn a_memory_of_another_form_is_refused_whatever_is_different() {
    type Change = fn(&mut tract_onnx::pb::GraphProto);
    fn stored<'a>(graph: &'a mut tract_onnx::pb::GraphProto, name: &str) -> &'a mut TensorProto {
        graph.initializer.iter_mut().find(|one| one.name == name).unwrap()
    }
    let changes: [(&str, Change); 25] = [
        ("node 3 is not the Max", |graph| graph.node[3].op_type = "Min".into()),
        ("node 1 is not the Sub", |graph| graph.node[1].input.swap(0, 1)),
        ("node 4 is not the Min", |graph| graph.node.swap(4, 5)),
        ("node 0 is not the Gather", |graph| graph.node[0].attribute[0].i = 0),
        ("node 7 is not the Concat", |graph| graph.node[7].attribute.clear()),
        ("node 6 is not the Sub", |graph| graph.node[6].attribute.push(int("axis", 1))),
        ("node 2 is not the Add", |graph| graph.node[2].domain = "other".into()),
        ("a play of half width 0", |graph| stored(graph, "memory.half_widths").raw_data[..4].fill(0)),
        ("a play of half width NaN", |graph| {
            stored(graph, "memory.half_widths").raw_data[..4].copy_from_slice(&f32::NAN.to_le_bytes());
        }),
        ("on input 5", |graph| stored(graph, "memory.features").raw_data[0] = 5),
        ("on input -1", |graph| stored(graph, "memory.features").raw_data[..8].fill(0xff)),
        ("memory.features is not", |graph| stored(graph, "memory.features").raw_data.truncate(15)),
        ("names not 1 to 64", |graph| stored(graph, "memory.features").dims = vec![i64::MAX]),
        ("memory does not begin with zeros", |graph| stored(graph, "memory").raw_data[3] = 0x3f),
        ("remembered does not begin with zeros", |graph| stored(graph, "remembered").raw_data[0] = 1),
        ("not stored exactly once", |graph| graph.initializer.retain(|one| one.name != "memory.half_widths")),
        ("remembered is no input", |graph| graph.input.retain(|one| one.name != "remembered")),
        ("node 0 is not the Gather", |graph| graph.node[0].attribute[0].r#type = 1),
        ("node 7 is not the Concat", |graph| graph.node[7].attribute[0].ref_attr_name = "axis".into()),
        ("memory.lower is defined twice", |graph| graph.initializer.push(common::tensor("memory.lower", &[1], &[0.5]))),
        ("memory.inputs is defined twice", |graph| graph.node[9].output[0] = "memory.inputs".into()),
        ("memory_out is defined twice", |graph| graph.node[9].output[0] = "memory_out".into()),
        ("memory is not declared as FLOAT [1, 2]", |graph| graph.input[1] = port("memory", None, 2)),
        ("remembered is not declared as BOOL [1, 1]", |graph| {
            graph.input[2] = port("remembered", Some(dimension::Value::DimValue(1)), 1);
        }),
        ("the graph's input is not [1, 5]", |graph| graph.input[0] = port("raw", None, 6)),
    ];
    for (what, change) in changes {
        let mut model = remembering();
        change(model.graph.as_mut().unwrap());
        match import_remembering(&model) {
            Err(ImportError::Memory { found }) => assert!(found.contains(what), "{found} for {what}"),
            other => panic!("{other:?} for {what}"),
        }
    }
}

/// Five raw inputs, two plays and three numbers of friction in front of a network of ten inputs.
fn told_friction() -> ModelProto {
    let bare = Chain::new(10).with("Sub", &[0.5; 10]).dense(6).activate("Tanh").dense(3).finish();
    common::tell_friction(common::remember(bare, 5, &PLAYS), 3)
}

#[test]
fn friction_is_what_stands_behind_the_memory_and_of_no_other_form() {
    type Change = fn(&mut tract_onnx::pb::GraphProto);
    let network = import_remembering(&told_friction()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((network.plays.len(), network.friction, network.input_width), (2, 3, 10));
    let bare = Chain::new(10).with("Sub", &[0.5; 10]).dense(6).activate("Tanh").dense(3).finish();
    let bare = import(&bytes(&bare), &Expected { inputs: 10, outputs: 3 }).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((&network.layers, &network.input_scale, bare.friction), (&bare.layers, &bare.input_scale, 0));
    let changes: [(&str, Change); 7] = [
        ("node 7 is not the Concat", |graph| drop(graph.node[7].input.pop())),
        ("node 7 is not the Concat", |graph| graph.node[7].input.swap(1, 2)),
        ("friction is not stored exactly once", |graph| graph.initializer.retain(|one| one.name != "friction")),
        ("friction is not [1, 1 to 8]", |graph| graph.initializer.last_mut().unwrap().dims = vec![3]),
        ("friction is not [1, 1 to 8]", |graph| graph.initializer.last_mut().unwrap().dims = vec![1, i64::MAX]),
        ("friction does not begin with zeros", |graph| graph.initializer.last_mut().unwrap().raw_data[3] = 0x3f),
        ("friction is not declared as FLOAT [1, 3]", |graph| {
            *graph.input.last_mut().unwrap() = port("friction", Some(dimension::Value::DimValue(1)), 4);
        }),
    ];
    for (what, change) in changes {
        let mut model = told_friction();
        change(model.graph.as_mut().unwrap());
        match import_remembering(&model) {
            Err(ImportError::Memory { found }) => assert!(found.contains(what), "{found} for {what}"),
            other => panic!("{other:?} for {what}"),
        }
    }
    // Without a memory it is an input too many.
    let mut model = Chain::new(5).dense(3).finish();
    let graph = model.graph.as_mut().unwrap();
    graph.input.push(port("friction", Some(dimension::Value::DimValue(1)), 3));
    assert!(import_remembering(&model).is_err());
}

#[test]
fn a_memory_that_the_layers_do_not_wait_for_is_refused() {
    // The first layer takes the raw features past the memory.
    let mut model = remembering();
    model.graph.as_mut().unwrap().node[8].input[0] = "raw".into();
    assert!(matches!(import_remembering(&model), Err(ImportError::Missing { .. })));
    // Only half of it is there: an input that is stored, or a second output.
    let mut model = remembering();
    let graph = model.graph.as_mut().unwrap();
    graph.output.retain(|one| one.name != "memory_out");
    assert!(import_remembering(&model).is_ok_and(|network| network.plays.len() == 2), "nobody has to read it out");
    let mut model = remembering();
    model.graph.as_mut().unwrap().node.truncate(8);
    assert!(import_remembering(&model).is_err());
}
