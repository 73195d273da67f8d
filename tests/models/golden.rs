//! Golden pairs: a card and a network that do not belong together are told apart.

use super::*;

/// A change of the card's golden pairs or of the network, and where the first difference is seen, if that is known.
type Disagreement = (&'static str, Onnx, Option<(usize, usize)>);

fn disagreements(onnx: &Onnx) -> Vec<Disagreement> {
    let golden = |name, change: fn(&mut Vec<Vec<f64>>), place| (name, onnx.clone().with_golden(change), place);
    vec![
        golden("an output is 1 um off", |rows| rows[3][119] += 0.001, Some((3, 1))),
        golden("the last output of the last pair", |rows| rows.last_mut().expect("a pair")[120] -= 0.0005, None),
        golden("outputs in m", |rows| rows.iter_mut().for_each(|row| row[118..].iter_mut().for_each(|y| *y /= 1000.0)), None),
        golden("the other sign", |rows| rows.iter_mut().for_each(|row| row[118..].iter_mut().for_each(|y| *y = -*y)), None),
        golden("outputs permuted", |rows| rows.iter_mut().for_each(|row| row.swap(118, 120)), None),
        golden("the output of another pair", |rows| (118..121).for_each(|i| rows[2][i] = rows[1][i]), Some((2, 0))),
        golden("two neighbouring features swapped", |rows| rows.iter_mut().for_each(|row| row.swap(1, 2)), None),
        golden("pos and pos_d swapped", |rows| rows.iter_mut().for_each(|row| (0..3).for_each(|i| row.swap(i, i + 3))), None),
        golden("mpos and mpos_d swapped", |rows| rows.iter_mut().for_each(|row| (48..56).for_each(|i| row.swap(i, i + 32))), None),
        golden("features reversed", |rows| rows.iter_mut().for_each(|row| row[..FEATURES].reverse()), None),
        golden("features shifted by one", |rows| rows.iter_mut().for_each(|row| row[..FEATURES].rotate_left(1)), None),
        golden("positions in mm", |rows| rows.iter_mut().for_each(|row| row[..6].iter_mut().for_each(|x| *x /= 1000.0)), None),
        golden("angles in rad", |rows| rows.iter_mut().for_each(|row| row[48..96].iter_mut().for_each(|x| *x *= 0.0175)), None),
    ]
}

fn golden_fails(directory: &TempDir, (name, onnx, place): &Disagreement) {
    let line = load_bytes(directory, &onnx.bytes()).err().unwrap_or_else(|| panic!("{name}: accepted"));
    assert!(line.starts_with("golden pair ") && line.contains(" mm, the card says "), "{name}: {line}");
    assert!(line.ends_with("; card and network do not belong together, export the model again"), "{name}: {line}");
    if let Some((pair, axis)) = place {
        assert!(line.starts_with(&format!("golden pair {pair}: output {axis} is ")), "{name}: {line}");
    }
}

#[test]
fn a_card_that_disagrees_with_its_network_is_refused() {
    let directory = TempDir::new("models-golden");
    let untrained = Onnx::untrained();
    assert!(load_bytes(&directory, &untrained.bytes()).is_ok(), "split and joined it is the same model");
    for case in disagreements(&small().trained()).iter().chain(&disagreements(&untrained)) {
        golden_fails(&directory, case);
    }
}

#[test]
fn a_network_that_disagrees_with_its_card_is_refused() {
    let directory = TempDir::new("models-weights");
    let card = small().trained().metadata;
    let changed = |name, change: fn(&mut Small)| {
        let mut network = small();
        change(&mut network);
        (name, Onnx { metadata: card.clone(), ..network.onnx() }, None)
    };
    let mut cases: Vec<Disagreement> = vec![
        changed("the output doubled", |network| network.last_weights.iter_mut().for_each(|w| *w *= 2.0)),
        changed("one weight of the last layer scaled", |network| network.last_weights[5] *= 1.01),
        changed("one weight of the first layer negated", |network| network.hidden_weights[500] *= -1.0),
        changed("one input in other units", |network| {
            network.hidden_weights.iter_mut().step_by(FEATURES).for_each(|w| *w *= 1000.0);
        }),
        changed("another bias", |network| network.last_bias.swap(0, 1)),
        changed("another activation", |network| network.activation = "Tanh"),
    ];
    let mut untrained = Onnx::untrained();
    swap_last_biases(&mut untrained.rest);
    cases.push(("the last biases swapped", untrained, None));
    for case in &cases {
        golden_fails(&directory, case);
    }
}

/// Swaps the x and y bias of the last layer in the bytes of `untrained.onnx`: name, then raw data of 12 bytes.
fn swap_last_biases(bytes: &mut [u8]) {
    let pattern = b"\x42\x0blayer3.bias\x4a\x0c";
    let at = bytes.windows(pattern.len()).position(|window| window == pattern).expect("the last bias") + pattern.len();
    let (x, y) = bytes[at..at + 8].split_at_mut(4);
    assert_ne!(x, y);
    x.swap_with_slice(y);
}

#[test]
fn more_golden_pairs_than_can_be_evaluated_before_the_start_are_refused() {
    let directory = TempDir::new("models-many");
    let with = |count: usize| {
        let many = small().trained().with_golden(|rows| {
            let first = rows[0].clone();
            rows.resize(count, first);
        });
        load_bytes(&directory, &many.bytes())
    };
    assert!(with(1000).is_ok());
    let line = with(1001).err().expect("refused");
    assert!(line.contains("property ravenpose.golden: 1001 pairs, expected at most 1000"), "{line}");
}

#[test]
fn a_golden_pair_as_exact_as_float32_is_accepted() {
    let directory = TempDir::new("models-float32");
    for onnx in [small().trained(), Onnx::untrained()] {
        let rounded =
            onnx.with_golden(|rows| rows.iter_mut().flat_map(|row| &mut row[118..]).for_each(|y| *y = f64::from(*y as f32)));
        assert!(load_bytes(&directory, &rounded.bytes()).is_ok());
    }
}
