//! Models that are broken on purpose: truncated, flipped, or asking for what the service cannot give.

mod common;

use std::time::{Duration, Instant};

use common::{Chain, Random, bytes, float, int, small};
use ravenpose_importer::{Expected, ImportError, Network, import};
use tract_onnx::pb::{ModelProto, OperatorSetIdProto};

const SMALL: Expected = Expected { inputs: 5, outputs: 3 };

fn is_finite(network: &Network) -> bool {
    let scale = network.input_scale.iter().flat_map(|s| s.shift.iter().chain(&s.scale));
    network.layers.iter().flat_map(|l| l.weights.iter().chain(&l.bias)).chain(scale).all(|v| v.is_finite())
}

fn assert_one_line(error: &ImportError) {
    let line = error.to_string();
    assert!(!line.chars().any(char::is_control), "{line:?}");
    assert!(line.chars().count() < 600, "{line}");
}

fn refusal_of(model: &ModelProto, expected: Expected) -> ImportError {
    let error = import(&bytes(model), &expected).expect_err("must be refused");
    assert_one_line(&error);
    error
}

fn refused_small(change: impl FnOnce(&mut ModelProto)) -> ImportError {
    let mut model = small();
    change(&mut model);
    refusal_of(&model, SMALL)
}

/// Of the same width, with two plays in front.
fn remembering() -> ModelProto {
    common::remember(
        Chain::new(7).with("Sub", &[1.0; 7]).dense(4).norm().activate("Sigmoid").dense(3).finish(),
        5,
        &[(0, 0.5), (3, 2.0)],
    )
}

/// With three numbers of friction behind them.
fn told_friction() -> ModelProto {
    let bare = Chain::new(10).with("Sub", &[1.0; 10]).dense(4).norm().activate("Sigmoid").dense(3).finish();
    common::tell_friction(common::remember(bare, 5, &[(0, 0.5), (3, 2.0)]), 3)
}

#[test]
fn every_truncation_is_refused_or_still_whole() {
    for model in [small(), remembering(), told_friction()] {
        let whole = bytes(&model);
        let network = import(&whole, &SMALL).unwrap();
        for length in 0..whole.len() {
            match import(&whole[..length], &SMALL) {
                Err(error) => assert_one_line(&error),
                // Only the last top-level fields, which come after graph and operator set, can go unnoticed: the metadata.
                Ok(cut) => assert_eq!(Network { metadata: network.metadata.clone(), ..cut }, network),
            }
        }
    }
}

#[test]
fn ten_thousand_bit_flips_never_panic_or_give_a_number_that_is_not_finite() {
    let models = [bytes(&small()), bytes(&remembering())];
    let seed = 2026;
    let mut random = Random(seed);
    let (mut accepted, start) = (0, Instant::now());
    for round in 0..10_000 {
        let mut flipped = models[round % 2].clone();
        let bit = random.next() as usize % (flipped.len() * 8);
        flipped[bit / 8] ^= 1 << (bit % 8);
        match import(&flipped, &SMALL) {
            Ok(network) => {
                accepted += 1;
                assert!(
                    network.plays.iter().all(|play| play.input < 5 && play.half_width > 0.0),
                    "seed {seed}, round {round}, bit {bit}"
                );
                assert!(is_finite(&network), "seed {seed}, round {round}, bit {bit}");
            }
            Err(error) => assert_one_line(&error),
        }
    }
    println!("{accepted} of 10000 flips still give a network (the checksum catches those), {:?}", start.elapsed());
    assert!(accepted < 10_000);
}

#[test]
fn many_flips_at_once_never_panic() {
    let models = [bytes(&small()), bytes(&remembering())];
    let mut random = Random(77);
    for round in 0..2_000 {
        let mut flipped = models[round % 2].clone();
        for _ in 0..=random.next() % 8 {
            let at = random.next() as usize % flipped.len();
            flipped[at] = random.next() as u8;
        }
        if let Ok(network) = import(&flipped, &SMALL) {
            assert!(is_finite(&network));
        }
    }
}

#[test]
fn operator_sets_out_of_range() {
    for version in [i64::MIN, 0, 8, 23, i64::MAX] {
        let error = refused_small(|m| m.opset_import[0].version = version);
        assert!(matches!(error, ImportError::Opset { .. }));
    }
    assert!(matches!(refused_small(|m| m.opset_import.clear()), ImportError::Opset { .. }));
    let second = OperatorSetIdProto { domain: "ai.onnx".into(), version: 17 };
    assert!(matches!(refused_small(|m| m.opset_import.push(second)), ImportError::Opset { .. }));
}

#[test]
fn every_supported_operator_set_is_read() {
    for version in 9..=22 {
        let mut model = small();
        model.opset_import[0].version = version;
        import(&bytes(&model), &SMALL).unwrap_or_else(|e| panic!("opset {version}: {e}"));
    }
}

#[test]
fn a_foreign_operator_set_that_no_node_uses_is_harmless() {
    let mut model = small();
    model.opset_import.push(OperatorSetIdProto { domain: "ai.onnx.ml".into(), version: 3 });
    assert!(import(&bytes(&model), &SMALL).is_ok());
}

#[test]
fn residual_and_disconnected_graphs_are_no_chains() {
    let residual = |m: &mut ModelProto| {
        let graph = m.graph.as_mut().unwrap();
        let (last, before) = (graph.node.len() - 1, graph.node.len() - 2);
        let both = graph.node[before].output[0].clone();
        graph.node[last].input = vec![both.clone(), both];
    };
    assert!(matches!(refused_small(residual), ImportError::NotAChain { .. }));
    let zeroed = Chain::new(5).with("Mul", &[0.0]).dense(3).finish();
    refusal_of(&zeroed, SMALL);
}

#[test]
fn an_activation_needs_a_dense_layer_before_it() {
    for model in [
        Chain::new(5).activate("Sigmoid").dense(3).finish(),
        Chain::new(5).dense(3).activate("Relu").activate("Sigmoid").finish(),
        Chain::new(3).with("Mul", &[2.0]).finish(),
    ] {
        let inputs = if model.graph.as_ref().unwrap().node[0].op_type == "Mul" { 3 } else { 5 };
        let error = refusal_of(&model, Expected { inputs, outputs: 3 });
        assert!(matches!(error, ImportError::NotAChain { .. }), "{error}");
    }
}

#[test]
fn folding_beyond_float32_is_refused() {
    let model = Chain::new(5).dense(3).with("Mul", &[1e30; 3]).with("Mul", &[1.1e30, 1e30, 1e30]).finish();
    let error = refusal_of(&model, SMALL);
    assert!(matches!(error, ImportError::NotFinite { .. }), "{error}");
    let zero = Chain::new(5).with("Div", &[1.0, 1.0, 0.0, 1.0, 1.0]).dense(3).finish();
    let error = refusal_of(&zero, SMALL);
    assert!(matches!(error, ImportError::NotFinite { .. }), "{error}");
}

#[test]
fn constants_may_not_spread_a_value_out() {
    let mut chain = Chain::new(5);
    let column = chain.store(&[100_000, 1], &vec![1.0; 100_000]);
    let model = chain.node("Add", &["@", &column], vec![]).dense(3).finish();
    refusal_of(&model, SMALL);
    // A column plus a row of constants would be a matrix of 10^10 numbers.
    let mut chain = Chain::new(5);
    let column = chain.store(&[100_000, 1], &vec![1.0; 100_000]);
    let row = chain.store(&[100_000], &vec![1.0; 100_000]);
    let model = chain.node("Add", &[&column, &row], vec![]).finish();
    assert!(matches!(refusal_of(&model, Expected { inputs: 5, outputs: 5 }), ImportError::ComputedConstant { .. }));
}

#[test]
fn attributes_outside_their_range() {
    let gemm = |a| Chain::new(5).gemm(3, true, 1.0, 1.0).node("Gemm", &["@", "t2"], vec![a]).finish();
    for attribute in [int("transA", 1), int("transB", 2), float("alpha", f32::NAN), int("alpha", 1), float("gain", 1.0)] {
        let error = refusal_of(&gemm(attribute), SMALL);
        assert!(matches!(error, ImportError::Attribute { .. }), "{error}");
    }
    for alpha in [0.0, -1.0, f32::INFINITY] {
        let model = Chain::new(5).dense(3).node("Elu", &["@"], vec![float("alpha", alpha)]).finish();
        assert!(matches!(refusal_of(&model, SMALL), ImportError::Attribute { .. }));
    }
    let cast = Chain::new(5).dense(3).node("Cast", &["@"], vec![int("to", 11)]).finish();
    assert!(matches!(refusal_of(&cast, SMALL), ImportError::Attribute { .. }));
}

#[test]
fn integers_are_no_weights_and_weights_no_shapes() {
    let mut chain = Chain::new(5).dense(3);
    let numbers = chain.integers(&[1, 2, 3]);
    let model = chain.node("Add", &["@", &numbers], vec![]).finish();
    assert!(matches!(refusal_of(&model, SMALL), ImportError::Operand { .. }));
    let mut chain = Chain::new(5).dense(3);
    let shape = chain.store(&[2], &[1.0, 3.0]);
    let model = chain.node("Reshape", &["@", &shape], vec![]).finish();
    assert!(matches!(refusal_of(&model, SMALL), ImportError::Operand { .. }));
}

#[test]
fn names_from_the_file_stay_printable() {
    let hostile = "\u{1b}[2J\nok\r\u{202e}".to_owned() + &"x".repeat(10_000);
    let error = refused_small(|m| m.graph.as_mut().unwrap().node[2].op_type.clone_from(&hostile));
    assert!(matches!(error, ImportError::Operator { .. }));
    // A width mismatch under a hostile name: here the message is tract's.
    let error = refused_small(|m| {
        let graph = m.graph.as_mut().unwrap();
        graph.node[1].name.clone_from(&hostile);
        graph.initializer[1].dims = vec![5, 4];
    });
    assert!(matches!(error, ImportError::Tract { .. }), "{error}");
}

#[test]
fn the_largest_accepted_number_of_nodes_takes_no_time() {
    let mut chain = Chain::new(5).dense(3);
    for _ in 0..999 {
        chain = chain.with("Add", &[0.001, 0.002, 0.003]);
    }
    let start = Instant::now();
    let outcome = import(&bytes(&chain.finish()), &SMALL);
    println!("1000 nodes: {:?}", start.elapsed());
    assert!(outcome.is_ok());
    assert!(start.elapsed() < Duration::from_mins(1));
    let mut chain = Chain::new(5).dense(3);
    for _ in 0..1000 {
        chain = chain.with("Add", &[0.001, 0.002, 0.003]);
    }
    assert!(matches!(refusal_of(&chain.finish(), SMALL), ImportError::Limit { what: "nodes", .. }));
}

#[test]
fn a_file_beyond_the_limit_is_not_even_scanned() {
    let zeros = vec![0u8; 81 << 20];
    assert!(matches!(import(&zeros, &SMALL), Err(ImportError::Limit { what: "bytes", .. })));
}
