//! What training takes for the memory, and what the service makes of the written file, are the same.
#![allow(missing_docs)]

mod common;

use common::{Folder, rewritten, runs, small};
use ndarray::Array2;
use ravenpose::config::ModelSource;
use ravenpose::correction::Estimator;
use ravenpose::load::{self as load_card, LoadCard};
use ravenpose::model::Estimate;
use ravenpose::network::{Format, Plan};
use ravenpose_wire::{FEATURES, features};
use recordings::open::{Opened, open};
use recordings::stream::Record;
use std::collections::BTreeMap;
use training::chain::{Chain, Dense};
use training::commands::{self, Model, Wish};
use training::data::{self, Reading, Trajectory};
use training::network::Activation;
use training::{load, onnx};

#[test]
fn the_service_gives_for_a_run_what_training_says_of_it() {
    let folder = Folder::new("service");
    let files = runs(&folder, 3, 4.0, ".mcap");
    let (out, recipe) = (folder.file("model.onnx"), small("default"));
    let reading = Reading { plays: recipe.plays(), truth_hz: 1000.0, ..Reading::default() };
    commands::train(&Wish { data: &files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {}).expect("trained");
    let set = data::read(&files[..1], &reading, &mut |_, _| {}).expect("run");
    let expected = Model::read(&out).expect("model").chain.estimate(&set.trajectories[0].inputs);
    // Weights as they are, so that what is left is the order of the sums.
    let source = ModelSource { weights: Some(Format::F32), ..ModelSource::new(out) };
    let mut model = ravenpose::model::load(&source).expect("the service takes it").model;
    assert!(model.estimator.remembers() && !model.estimator.is_settled());
    // Four seconds are too few to learn how torque goes: any numbers do here.
    let watch = LoadCard {
        expected: [0.02, 0.03, 0.01].map(|number| vec![number * 0.01; load_card::expected_len(reading.plays.len())]),
        pull: [[0.04, 1e-7, 0.0, 0.0]; 3],
        noise_nm: [1e3; 3],
        weight: [1.0, 2.0, 3.0],
        travel_deg: [2e3; 3],
        information: [1e-3; 3],
        limit_kg: 1e5,
        friction: None,
    };
    let network = ravenpose::model::network(&source.path).expect("network");
    let mut estimate = Estimate::new(&network, Plan::new(&network)).watching(Some(watch.clone()));
    let Opened::States(mut source) = open(&files[0]).expect("recording") else { panic!("states") };
    let (mut found, mut row, mut time_ns) = (Vec::new(), [0.0_f32; FEATURES], 0);
    while let Some(record) = source.next().expect("record") {
        match record {
            Record::State(state) => {
                features::extract(&state, 0, &mut row);
                time_ns += 1_000_000;
                model.estimator.follow(&row, time_ns);
                estimate.follow(&row, time_ns);
                estimate.weigh(&row, time_ns);
            }
            Record::Truth(_) => {
                let mut error_mm = [0.0; 3];
                model.estimator.run(&row, &mut error_mm);
                found.extend(error_mm);
            }
        }
    }
    assert_eq!(found.len(), expected.len());
    // What it makes of the load is the same too, places of the memory included.
    let weighed = load::weigh(&watch, reading.plays.len(), [&set.trajectories[0]], |_| true);
    let score = weighed.mass_kg.last().expect("rows").abs() / f64::from(watch.limit_kg);
    let found_score = f64::from(estimate.load_score().expect("it looks"));
    assert!(score > 0.01 && (found_score - score).abs() < 1e-4, "{found_score} {score}");
    let worst = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-4, "{worst} mm");
    // And the memory matters: without it the answers are others.
    model.estimator.forget();
    model.estimator.follow(&row, time_ns + 1);
    let mut alone = [0.0; 3];
    model.estimator.run(&row, &mut alone);
    let last = &expected[expected.len() - 3..];
    assert!(alone.iter().zip(last).any(|(a, b)| (a - b).abs() > 1e-3), "{alone:?} {last:?}");
}

#[test]
fn the_service_tells_the_network_the_friction_that_training_appended() {
    let folder = Folder::new("friction");
    let files = runs(&folder, 1, 4.0, ".mcap");
    let reading = Reading { plays: small("default").plays(), truth_hz: 1000.0, ..Reading::default() };
    let plays = reading.plays.len();
    let watch = LoadCard {
        expected: [0.02, 0.03, 0.01].map(|number| vec![number * 0.01; load_card::expected_len(plays)]),
        pull: [[0.04, 1e-7, 0.0, 0.0]; 3],
        noise_nm: [1e3; 3],
        weight: [1.0, 2.0, 3.0],
        travel_deg: [2e3; 3],
        information: [1e-3; 3],
        limit_kg: 1e5,
        friction: Some([(-1.0, 1.0); 3]),
    };
    let mut one = data::read(&files, &reading, &mut |_, _| {}).expect("run").trajectories.remove(0);
    load::append_friction(&watch, plays, &mut one);
    // A network that answers with what it is told of friction.
    let inputs = FEATURES + plays + 3;
    assert_eq!(one.inputs.len(), one.rows() * inputs);
    let mut weight = Array2::zeros((3, inputs));
    (0..3).for_each(|motor| weight[[motor, FEATURES + plays + motor]] = 1.0);
    let layers = vec![Dense { weight, bias: vec![0.0; 3], activation: Activation::Identity }];
    let chain = Chain { shift: vec![0.0; inputs], scale: vec![1.0; inputs], layers, plays: reading.plays.clone(), friction: true };
    let file = folder.file("friction.onnx");
    std::fs::write(&file, onnx::write(&chain, &BTreeMap::new())).expect("model");
    assert_eq!(onnx::read(&std::fs::read(&file).expect("model")).expect("as written").0, chain);
    let network = ravenpose::model::network(&file).expect("the service's importer takes it");
    assert_eq!((network.plays.len(), network.friction), (plays, 3));
    let mut estimate = Estimate::new(&network, Plan::new(&network)).watching(Some(watch));
    let Opened::States(mut source) = open(&files[0]).expect("recording") else { panic!("states") };
    let (mut found, mut row, mut time_ns) = (Vec::new(), [0.0_f32; FEATURES], 0);
    while let Some(record) = source.next().expect("record") {
        match record {
            Record::State(state) => {
                features::extract(&state, 0, &mut row);
                time_ns += 1_000_000;
                estimate.follow(&row, time_ns);
                estimate.weigh(&row, time_ns);
            }
            Record::Truth(_) => {
                let mut answer = [0.0; 3];
                estimate.run(&row, &mut answer);
                found.push(answer);
            }
        }
    }
    let expected: Vec<&[f32]> = one.inputs.chunks_exact(inputs).map(|row| &row[FEATURES + plays..]).collect();
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().map(|row| row[0].abs()).fold(0.0, f32::max);
    let off = |(found, expected): (&[f32; 3], &&[f32])| {
        found.iter().zip(*expected).map(|(found, expected)| (found - expected).abs()).fold(0.0, f32::max)
    };
    let worst = found.iter().zip(&expected).map(off).fold(0.0, f32::max);
    assert!(largest > 1e-3 && worst < 1e-5 * largest.max(1.0), "{worst} of {largest} N·m");
    assert_eq!(
        (estimate.has_weighed(), estimate.friction_score()),
        (false, Some(0.0)),
        "four seconds are too few to call it unseen"
    );
}

#[test]
fn truths_belong_to_the_nearer_state_and_rows_count_from_the_first_of_them() {
    let folder = Folder::new("late-truths");
    let files = runs(&folder, 1, 20.0, ".mcap");
    let rewritten = |name: &str, keep: &mut dyn FnMut(Record) -> Option<Record>| rewritten(&folder, &files[0], name, keep);
    let reading = Reading { plays: small("default").plays(), truth_hz: 1000.0, ..Reading::default() };
    let read = |file| data::read(&[file], &reading, &mut |_, _| {}).expect("run").trajectories.remove(0);
    // States of 100 Hz, and cameras 7 ms after each, 3 ms before the next.
    let (mut begun_ns, mut states) = (None, 0);
    let slow = rewritten("slow.mcap", &mut |record| {
        let ns = record.time_ns();
        let since = (ns - *begun_ns.get_or_insert(ns)) / 1_000_000 % 10;
        let keeps = matches!(&record, Record::State(_)) && since == 0 || matches!(&record, Record::Truth(_)) && since == 7;
        states += u32::from(keeps && matches!(&record, Record::State(_)));
        keeps.then_some(record)
    });
    let rows = read(slow).rows();
    assert!(states > 500 && rows + 10 > states as usize, "{rows} rows of {states} states");
    // The memory has followed for three seconds when the first truth comes.
    let whole = read(files[0].clone());
    let settled_s = whole.settled_after_s();
    let late = read(rewritten("late.mcap", &mut |record| {
        let ns = record.time_ns();
        let early = ns - *begun_ns.get_or_insert(ns) < 3_000_000_000;
        (!(early && matches!(&record, Record::Truth(_)))).then_some(record)
    }));
    match (settled_s, late.settled_after_s()) {
        (Some(of_whole), Some(of_late)) => assert!((of_late - (of_whole - 3.0).max(0.0)).abs() < 0.02, "{of_whole} {of_late}"),
        (of_whole, of_late) => panic!("twenty seconds settle no memory: {of_whole:?} {of_late:?}"),
    }
}

#[test]
fn after_a_pause_the_memory_has_to_settle_again() {
    let folder = Folder::new("pause");
    let files = runs(&folder, 1, 30.0, ".mcap");
    let reading = Reading { plays: small("default").plays(), truth_hz: 100.0, ..Reading::default() };
    let read = |file| data::read(&[file], &reading, &mut |_, _| {}).expect("run").trajectories.remove(0);
    let whole = read(files[0].clone());
    let settled_s = whole.settled_after_s().expect("settles");
    assert!(settled_s < 20.0, "{settled_s}");
    let unsettled = |one: &Trajectory, from_s: f64| {
        let row = one.time_s.iter().position(|time_s| *time_s >= from_s).expect("row");
        !one.is_settled(row)
    };
    assert!(unsettled(&whole, settled_s - 0.05) && !unsettled(&whole, settled_s + 0.05) && !unsettled(&whole, 25.1));
    let mut begun_ns = None;
    let paused = read(rewritten(&folder, &files[0], "paused.mcap", |record| {
        let since_ns = record.time_ns() - *begun_ns.get_or_insert(record.time_ns());
        (!(25_000_000_000..25_060_000_000).contains(&since_ns)).then_some(record)
    }));
    assert_eq!(paused.settled_after_s(), whole.settled_after_s());
    assert!(!unsettled(&paused, 24.9) && unsettled(&paused, 25.1));
    let mut thin = paused.clone();
    thin.thin(10);
    assert!(!unsettled(&thin, 24.9) && unsettled(&thin, 25.1));
}

#[test]
fn rows_with_a_young_memory_are_those_of_a_run_that_began_then() {
    let folder = Folder::new("young");
    let files = runs(&folder, 1, 6.0, ".mcap");
    let reading = Reading { plays: small("default").plays(), truth_hz: 1000.0, ..Reading::default() };
    let one = &data::read(&files, &reading, &mut |_, _| {}).expect("run").trajectories[0];
    let unsettled = one.unsettled(&(0.0..8.0));
    assert!(unsettled.rows() > 500 && unsettled.rows() <= one.rows(), "{} of {}", unsettled.rows(), one.rows());
    // The second memory began after a second and again after three: its first row then knows nothing.
    let places = one.young_places.len() / one.rows();
    let is_new = |row: usize| one.young_places[row * places..(row + 1) * places].iter().all(|place| *place == 0.0);
    let begun = (1..one.rows()).filter(|row| is_new(*row) && !is_new(row - 1)).map(|row| one.time_s[row]);
    // In the first moments the robot stands still, which looks the same.
    let begun: Vec<f64> = begun.filter(|time| *time > 0.5).collect();
    assert_eq!(begun.iter().map(|time| time.round() as i64).collect::<Vec<_>>(), [1, 3], "{begun:?}");
    let mut young = one.clone();
    young.make_young(8);
    let width = one.inputs.len() / one.rows();
    for row in 0..one.rows() {
        let expected = if row % 8 == 0 { &one.young_places } else { &one.inputs[FEATURES..] };
        let at = if row % 8 == 0 { row * places } else { row * width };
        assert_eq!(young.inputs[row * width + FEATURES..(row + 1) * width], expected[at..at + places], "{row}");
    }
}
