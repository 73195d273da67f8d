//! What a model's card states is read whole, or the model is refused.

use super::*;

#[test]
fn a_trained_model_loads_with_everything_that_its_card_states() {
    let directory = TempDir::new("models-trained");
    let (model, card) = load_bytes(&directory, &small().trained().bytes()).expect("a trained model");
    assert!(!card.untrained && !model.untrained);
    assert_eq!((card.bound, card.bound95), (12.5, [1.0, 2.0, 3.0]));
    assert_eq!((model.bound, model.bound95), (12_500.0, [1000.0, 2000.0, 3000.0]));
    assert_eq!(card.golden.len(), 4);
    // Pedal down, unless it says otherwise; any board.
    assert_eq!((card.allowed.runlevels.as_slice(), card.allowed.boards.as_slice()), (&[3][..], &[][..]));
    let stated = small().trained().set("ravenpose.runlevels", "2 3").set("ravenpose.boards", "49");
    let (model, _) = load_bytes(&directory, &stated.bytes()).expect("a trained model");
    assert_eq!((model.allowed.runlevels.as_slice(), model.allowed.boards.as_slice()), (&[2, 3][..], &[49][..]));
    let domain = card.domain.expect("a domain");
    assert_eq!((domain.min[117], domain.max[0], domain.center[5], domain.weight[5], domain.limit), (-2.0, 2.0, 0.0, 0.5, 3.0));
}

#[test]
fn an_untrained_model_needs_no_card() {
    let directory = TempDir::new("models-cardless");
    let trained = small().trained();
    let cases = [
        ("no metadata", small().onnx()),
        ("trained on nothing", small().onnx().set("ravenpose.trained_on", "nothing: random weights")),
        ("blank", small().onnx().set("ravenpose.trained_on", "  ")),
        ("foreign metadata", small().onnx().set("producer", "a\nb\u{1b}")),
        ("the mark removed", trained.without("ravenpose.trained_on")),
    ];
    for (case, onnx) in cases {
        let (model, card) = load_bytes(&directory, &onnx.bytes()).unwrap_or_else(|line| panic!("{case}: {line}"));
        assert!(model.untrained && card.untrained, "{case}");
    }
    let (_, card) = load_bytes(&directory, &small().onnx().bytes()).expect("no metadata");
    assert!(card.domain.is_none() && card.golden.is_empty() && card.bound95.iter().all(|bound| bound.is_nan()));
}

#[test]
fn every_missing_property_of_a_trained_model_is_refused_by_name() {
    let directory = TempDir::new("models-missing");
    for key in [
        "ravenpose.feature_layout",
        "ravenpose.units",
        "ravenpose.feature_min",
        "ravenpose.feature_max",
        "ravenpose.domain_center",
        "ravenpose.domain_weight",
        "ravenpose.domain_limit",
        "ravenpose.golden",
    ] {
        let line = refusal(&directory, &small().trained().without(key).bytes());
        assert_eq!(line, format!("property {key} is missing; a trained model states it, see docs/models.md"));
    }
    let half = small().onnx().set("ravenpose.feature_min", words(&[0.0; FEATURES]));
    let line = refusal(&directory, &half.bytes());
    assert!(line.starts_with("property ravenpose.feature_max is missing"), "half a domain: {line}");
}

/// The card of a model that watches the load.
fn watching() -> Onnx {
    let rows = [0.1; 3 * 122];
    small()
        .trained()
        .set("ravenpose.load_expected", words(&rows))
        .set("ravenpose.load_pull", words(&[0.5; 12]))
        .set("ravenpose.load_noise_nm", "0.1 0.2 0.3")
        .set("ravenpose.load_weight", "1 2 3")
        .set("ravenpose.load_travel_deg", "10 20 30")
        .set("ravenpose.load_information", "1 2 3")
        .set("ravenpose.load_limit_kg", "0.25")
}

#[test]
fn what_a_card_says_about_load_is_read_whole_or_refused() {
    let directory = TempDir::new("models-load");
    let (_, card) = load_bytes(&directory, &small().trained().bytes()).expect("a model that does not watch");
    assert_eq!(card.load, None);
    let (model, card) = load_bytes(&directory, &watching().bytes()).expect("a model that does");
    let load = card.load.expect("load");
    assert_eq!((load.weight, load.travel_deg, load.limit_kg), ([1.0, 2.0, 3.0], [10.0, 20.0, 30.0], 0.25));
    assert!(load.expected.iter().all(|row| row.len() == 122) && load.pull == [[0.5; 4]; 3]);
    assert_eq!(ravenpose::correction::Estimator::load_score(&model.estimator), Some(0.0));
    for key in
        ["load_expected", "load_pull", "load_noise_nm", "load_weight", "load_travel_deg", "load_information", "load_limit_kg"]
    {
        let key = format!("ravenpose.{key}");
        let line = refusal(&directory, &watching().without(&key).bytes());
        assert_eq!(line, format!("property {key} is missing; a trained model states it, see docs/models.md"));
    }
    for (key, value, problem) in [
        ("load_expected", words(&[0.1; 3 * 121]), "121 numbers per motor, expected 122 for 0 plays"),
        ("load_expected", words(&[0.1; 100]), "100 numbers, expected as many for each of 3 motors"),
        ("load_expected", String::new(), "0 numbers, expected as many for each of 3 motors"),
        ("load_expected", "nan 1 2".to_owned(), "\"nan\" is not a finite number"),
        ("load_pull", words(&[0.5; 11]), "11 numbers, expected 12"),
        ("load_pull", "1 2 3 4 0 0 0 0 1 2 3 4".to_owned(), "a motor's numbers are all 0"),
        ("load_noise_nm", "1 0 1".to_owned(), "0 is not above 0"),
        ("load_weight", "1 -1 1".to_owned(), "-1 is not above 0"),
        ("load_travel_deg", "1 0 1".to_owned(), "0 is not above 0"),
        ("load_information", "1 -2 1".to_owned(), "-2 is not above 0"),
        ("load_limit_kg", "0".to_owned(), "0 is not above 0"),
    ] {
        assert_refused(&directory, watching(), key, value, problem);
    }
    let with_friction =
        |least: &str, largest: &str| watching().set("ravenpose.friction_min_nm", least).set("ravenpose.friction_max_nm", largest);
    for (model, key, problem) in [
        (with_friction("-1 -1 -1", "1 1 1"), "friction_min_nm", ": 3 numbers, the network takes the friction of 0 motors"),
        (with_friction("-1 0 -1", "1 1 1"), "friction_min_nm", ": 0 to 1 does not hold the usual friction, 0"),
        (with_friction("-1 -1 -1", "1 -0.5 1"), "friction_min_nm", ": -1 to -0.5 does not hold the usual friction, 0"),
        (with_friction("-1 -1", "1 1 1"), "friction_min_nm", ": 2 numbers, expected 3"),
        (
            watching().set("ravenpose.friction_min_nm", "-1 -1 -1"),
            "friction_max_nm",
            " is missing; a trained model states it, see docs/models.md",
        ),
        (
            small().trained().set("ravenpose.friction_max_nm", "1 1 1"),
            "load_expected",
            " is missing; a trained model states it, see docs/models.md",
        ),
    ] {
        assert_eq!(refusal(&directory, &model.bytes()), format!("property ravenpose.{key}{problem}"));
    }
}

#[test]
fn a_model_corrects_the_quantity_that_it_was_trained_for_and_no_other() {
    let directory = TempDir::new("models-quantity");
    let load = |onnx: &Onnx, quantity| {
        let bytes = onnx.bytes();
        load_as(&directory.file("model.onnx", &bytes), Some(hash(&bytes)), quantity)
    };
    let turning = || {
        small()
            .trained()
            .set("ravenpose.units", Quantity::Orientation.units())
            .set("ravenpose.correction_bound_deg", "7.5")
            .set("ravenpose.bound95_deg", "0.1 0.2 0.3")
    };
    let (model, card) = load(&turning(), Quantity::Orientation).expect("a model of the orientation");
    assert_eq!((card.quantity, card.bound, card.bound95), (Quantity::Orientation, 7.5, [0.1, 0.2, 0.3].map(|x: f32| f64::from(x))));
    assert_eq!((model.bound, model.bound95), (card.bound, card.bound95), "degrees stay degrees");
    let mixed = |onnx: &Onnx, quantity, found: &str, expected: &str| {
        let line = load(onnx, quantity).err().expect("another quantity");
        assert!(
            line.starts_with(&format!("corrects the {found}, not the {expected}; ")) && line.contains("[gold.orientation]"),
            "{line}"
        );
    };
    mixed(&turning(), Quantity::Position, "orientation", "position");
    mixed(&small().trained(), Quantity::Orientation, "position", "orientation");
    let negative = turning().set("ravenpose.bound95_deg", "1 -2 3");
    assert_eq!(
        load(&negative, Quantity::Orientation).err().expect("refused"),
        "property ravenpose.bound95_deg: -2 is not a half width"
    );
}

#[test]
fn another_layout_or_unit_is_refused_with_expected_and_found() {
    let directory = TempDir::new("models-units");
    let long = "x".repeat(5000);
    let cases = [
        ("ravenpose.feature_layout", "raven118-v2", "\"raven118-v2\"", features::LAYOUT),
        ("ravenpose.feature_layout", "", "\"\"", features::LAYOUT),
        ("ravenpose.units", "SI", "\"SI\"", Quantity::Position.units()),
        (
            "ravenpose.units",
            "raven_state as published; position error in m",
            "\"raven_state as published; position error in m\"",
            Quantity::Position.units(),
        ),
        ("ravenpose.units", "mm\n\u{1b}[2J\u{202e}", "\"mm[2J\\u{202e}\"", Quantity::Position.units()),
        ("ravenpose.units", &long, &format!("\"{}\"", &long[..60]), Quantity::Position.units()),
    ];
    for (key, value, found, expected) in cases {
        for onnx in [small().trained(), small().onnx()] {
            let line = refusal(&directory, &onnx.set(key, value).bytes());
            let wanted = format!("property {key} is {found}, expected {expected:?}; export the model again with this ravenpose");
            assert_eq!(line, wanted);
        }
    }
}

#[test]
fn unusable_numbers_are_refused_with_the_property_and_the_problem() {
    let directory = TempDir::new("models-numbers");
    let with = |index: usize, word: &str| {
        let mut list = vec!["0"; FEATURES];
        list[index] = word;
        list.join(" ")
    };
    let mut above = [-2.0; FEATURES];
    above[58] = 2.5;
    let cases = [
        ("feature_min", words(&[0.0; 117]), "117 numbers, expected 118"),
        ("feature_max", words(&[0.0; 119]), "119 numbers, expected 118"),
        ("domain_center", String::new(), "0 numbers, expected 118"),
        ("feature_min", with(3, "nan"), "\"nan\" is not a finite number"),
        ("feature_max", with(3, "inf"), "\"inf\" is not a finite number"),
        ("domain_weight", with(117, "1e39"), "\"1e39\" is not a finite number"),
        ("domain_center", with(0, "abc"), "\"abc\" is not a number"),
        ("domain_center", with(0, "1,5"), "\"1,5\" is not a number"),
        ("domain_center", with(0, "a\u{7}\u{202e}b"), "\"a\\u{202e}b\" is not a number"),
        ("feature_min", words(&above), "jpos[2] has a minimum above its maximum"),
        ("domain_limit", "0".to_owned(), "0 is not a positive distance"),
        ("domain_limit", "-1".to_owned(), "-1 is not a positive distance"),
        ("domain_limit", "1 2".to_owned(), "2 numbers, expected 1"),
        ("domain_limit", "NaN".to_owned(), "\"NaN\" is not a finite number"),
        ("correction_bound_mm", "-1".to_owned(), "-1 is not positive"),
        ("correction_bound_mm", "0".to_owned(), "0 is not positive"),
        ("correction_bound_mm", "15 mm".to_owned(), "\"mm\" is not a number"),
        ("correction_bound_mm", String::new(), "0 numbers, expected 1"),
        ("correction_bound_mm", "inf".to_owned(), "\"inf\" is not a finite number"),
        ("bound95_mm", "1 2".to_owned(), "2 numbers, expected 3"),
        ("bound95_mm", "1 2 3 4".to_owned(), "4 numbers, expected 3"),
        ("bound95_mm", "1 -2 3".to_owned(), "-2 is not a half width"),
        ("bound95_unsettled_mm", "1 2".to_owned(), "2 numbers, expected 3"),
        ("bound95_unsettled_mm", "1 -2 3".to_owned(), "-2 is not a half width"),
        ("bound95_unsettled_mm", "1 2 2.9".to_owned(), "is narrower than ravenpose.bound95_mm"),
        ("bound95_unsettled_mm", "1 2 3".to_owned(), "the network has no memory"),
        ("runlevels", "3 x".to_owned(), "\"x\" is not a whole number"),
        ("runlevels", String::new(), "no numbers, expected at least one"),
        ("boards", "49.5".to_owned(), "\"49.5\" is not a whole number"),
        ("golden", words(&[0.0; 120]), "120 numbers, expected 121"),
        ("golden", words(&[0.0; 122]), "122 numbers, expected 121"),
        ("golden", format!("{} 0 nan 0", with(0, "0")), "\"nan\" is not a finite number"),
        ("golden", format!("{} 0 0 zero", with(0, "0")), "\"zero\" is not a number"),
    ];
    for (key, value, problem) in cases {
        assert_refused(&directory, small().trained(), key, value, problem);
    }
}

#[test]
fn a_property_that_occurs_twice_is_refused() {
    let directory = TempDir::new("models-twice");
    let mut onnx = small().trained();
    onnx.metadata.push(("ravenpose.units".to_owned(), "SI".to_owned()));
    assert_eq!(refusal(&directory, &onnx.bytes()), "metadata key `ravenpose.units` occurs twice: expected each key once");
}

#[test]
fn a_trained_range_of_another_order_or_unit_is_refused() {
    let directory = TempDir::new("models-range");
    let untrained = Onnx::untrained();
    let with = |change: fn(&mut Vec<f64>)| {
        ["ravenpose.feature_min", "ravenpose.feature_max"].into_iter().fold(untrained.clone(), |onnx, key| {
            let mut numbers = onnx.get(key).split_ascii_whitespace().map(|word| word.parse().expect("a number")).collect();
            change(&mut numbers);
            onnx.set(key, words(&numbers))
        })
    };
    let cases = [
        ("positions in m", with(|list| list[..6].iter_mut().for_each(|limit| *limit /= 1e6)), "pair 1: pos[0] is "),
        (
            "angles in rad",
            with(|list| list[88..90].iter_mut().for_each(|limit| *limit = limit.to_radians())),
            "pair 0: jpos_d[0] is ",
        ),
        ("shifted by one", with(|list| list.rotate_left(1)), "pair 0: jpos[1] is "),
        ("reversed", with(|list| list.reverse()), "pair 0: encVals[3] is "),
        ("two neighbours swapped", with(|list| list.swap(57, 58)), "pair 0: jpos[1] is "),
    ];
    for (case, onnx, problem) in cases {
        let line = load_bytes(&directory, &onnx.bytes()).err().unwrap_or_else(|| panic!("{case}: accepted"));
        assert!(line.starts_with(&format!("property ravenpose.golden: {problem}")), "{case}: {line}");
        assert!(line.contains(", outside its trained range "), "{case}: {line}");
    }
}
