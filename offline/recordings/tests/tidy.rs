//! Full states as a tidy table: the values, the truth at its row, and the way back.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::PathBuf;

use arm::published::SLOT_OF_JOINT;
use arm::{Raven2, Side};
use common::Scratch;
use ravenpose_wire::RavenState;
use recordings::open::{Opened, open};
use recordings::save::{TableFormat, create_table};
use recordings::stream::{Record, Sink, Source};
use recordings::table::{self, TableSource};
use recordings::tidy::{Options, StateTable, to_recording};
use recordings::{Arms, csv, states};
use support::{Random, motion, record, stamp_ns, truth_of, write};

/// A file of records that keeps all of them.
fn file(scratch: &Scratch, records: &[Record]) -> PathBuf {
    let path = scratch.path().join("run.parquet");
    let sink: Box<dyn Sink> = Box::new(recordings::parquet_file::StateWriter::create(&path, &[]).expect("create"));
    write(sink, records);
    path
}

fn source(path: &std::path::Path) -> Box<dyn Source> {
    match open(path).expect("open") {
        Opened::States(source) => source,
        Opened::Table(_) => panic!("states"),
    }
}

fn with_truth(states: &[RavenState], side: Side, every: usize, late_ns: i64) -> Vec<Record> {
    let mut random = Random(11);
    let mut records = Vec::new();
    for (index, state) in states.iter().enumerate() {
        records.push(record(state));
        if index % every == 0 {
            let mut truth = truth_of(state, side, &mut random);
            truth.time_ns += late_ns;
            records.push(Record::Truth(truth));
        }
    }
    records
}

#[test]
fn one_arm_has_the_names_and_units_of_tidy_csv() {
    let scratch = Scratch::new("tidy-one");
    let states = motion(300, 1_570_000_000);
    let path = file(&scratch, &with_truth(&states, Side::Green, 1, 0));
    let out = scratch.path().join("green.csv");
    let mut table = StateTable::new(source(&path), Options { arms: Some(Arms::Green), ..Options::default() }).expect("table");
    let mut sink = create_table(&out, TableFormat::Csv, table.columns(), table.metadata()).expect("create");
    assert_eq!(table::copy(&mut table, sink.as_mut(), &mut |_, _| {}).expect("copy"), 300);
    sink.finish().expect("finish");
    // The strict reader takes it as a run.
    let run = csv::read(&out).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((run.metadata["arm"].as_str(), run.metadata["robot"].as_str()), ("green", "raven2"));
    assert_eq!(run.metadata["start_unix_ns"], stamp_ns(&states[0]).to_string());
    let arm = Raven2::nominal().arm(Side::Green);
    let column = |name: &str| run.column(name).unwrap_or_else(|| panic!("no column {name}"));
    for (row, state) in states.iter().enumerate() {
        assert!((column("t_s")[row] - row as f64 * 1e-3).abs() < 1e-9);
        for (joint, slot) in SLOT_OF_JOINT.into_iter().enumerate() {
            let (number, unit) = (joint + 1, if joint == 2 { "m" } else { "rad" });
            let as_single = |name: String| column(&name)[row].to_degrees() as f32;
            assert_eq!(as_single(format!("mpos_{number}_rad")), state.mpos[8 + slot]);
            assert_eq!(as_single(format!("mvel_{number}_rad_s")), state.mvel[8 + slot]);
            assert_eq!(as_single(format!("jpos_{number}_{unit}")), state.jpos[8 + slot]);
            assert_eq!(as_single(format!("jvel_{number}_{unit}_s")), state.jvel[8 + slot]);
            assert_eq!(as_single(format!("jpos_d_{number}_{unit}")), state.jpos_d[8 + slot]);
            assert_eq!((column(&format!("tau_{number}_nm"))[row] * arm.amplifiers.gear()[joint]) as f32, state.tau[8 + slot]);
            assert_eq!(column(&format!("dac_{number}_counts"))[row], f64::from(state.dac_val[8 + slot]));
        }
        assert_eq!((column("y_m")[row] * 1e6).round() as i32, state.pos[4]);
        assert_eq!(column("runlevel")[row], 3.0);
    }
    assert!(run.column("truth_offset_s").is_none(), "truth stands at the time of the states");
    assert!(run.column("truth_qw").is_some() && run.column("truth_cable_7_n").is_some());
}

#[test]
fn states_become_the_same_states_again_where_the_table_holds_them() {
    let scratch = Scratch::new("tidy-back");
    let original = motion(200, 0);
    let path = file(&scratch, &original.iter().map(record).collect::<Vec<_>>());
    let options = Options { arms: Some(Arms::Gold), ..Options::default() };
    let run = to_recording("run", source(&path), options).expect("recording");
    let back = states::from_recording(&run, Arms::Gold).expect("states").states;
    for (found, expected) in back.iter().zip(&original) {
        for slot in SLOT_OF_JOINT {
            assert_eq!((found.mpos[slot], found.dac_val[slot]), (expected.mpos[slot], expected.dac_val[slot]));
            assert!((found.jpos[slot] - expected.jpos[slot]).abs() < 1e-3, "{} {}", found.jpos[slot], expected.jpos[slot]);
            assert!((found.tau[slot] - expected.tau[slot]).abs() < 1e-6);
        }
        assert!(found.pos[..3].iter().zip(&expected.pos[..3]).all(|(a, b)| (a - b).abs() <= 1));
        assert_eq!((found.dt_sec, found.dt_nsec), (expected.dt_sec, expected.dt_nsec));
    }
}

#[test]
fn two_arms_stand_side_by_side() {
    let scratch = Scratch::new("tidy-two");
    let states = motion(30, 0);
    let path = file(&scratch, &with_truth(&states, Side::Gold, 10, 0));
    let run = to_recording("run", source(&path), Options::default()).expect("recording");
    for name in ["gold_mpos_1_rad", "green_jpos_3_m", "gold_truth_x_mm", "runlevel"] {
        assert!(run.column(name).is_some(), "{name}");
    }
    assert!(run.column("green_truth_x_mm").is_none() && !run.metadata.contains_key("arm"));
    let x = run.column("gold_truth_x_mm").expect("truth");
    assert_eq!(x.iter().filter(|value| !value.is_nan()).count(), 3);
    assert!(!x[10].is_nan());
}

#[test]
fn truth_at_other_times_stands_in_the_nearest_row_with_its_offset() {
    let scratch = Scratch::new("tidy-offset");
    let states = motion(100, 0);
    let path = file(&scratch, &with_truth(&states, Side::Gold, 30, 600_000));
    let run = to_recording("run", source(&path), Options { arms: Some(Arms::Gold), ..Options::default() }).expect("recording");
    let offset = run.column("truth_offset_s").expect("offset");
    let rows: Vec<usize> = (0..100).filter(|row| !offset[*row].is_nan()).collect();
    assert_eq!(rows, [1, 31, 61, 91]);
    assert!(rows.iter().all(|row| (offset[*row] + 0.0004).abs() < 1e-12));
}

#[test]
fn truth_without_a_row_is_counted_and_truth_columns_can_be_asked_for() {
    let scratch = Scratch::new("tidy-dropped");
    let states = motion(50, 0);
    let mut records: Vec<Record> = states.iter().map(record).collect();
    let mut random = Random(2);
    for _ in 0..2 {
        records.push(Record::Truth(truth_of(&states[7], Side::Gold, &mut random)));
    }
    let mut far = truth_of(&states[49], Side::Gold, &mut random);
    far.time_ns += 1_000_000_000;
    records.push(Record::Truth(far));
    let path = file(&scratch, &records);
    let mut table = StateTable::new(source(&path), Options { arms: Some(Arms::Gold), ..Options::default() }).expect("table");
    let run = table::collect("run", &mut table).expect("recording");
    assert_eq!(run.column("truth_x_m").expect("truth").iter().filter(|value| !value.is_nan()).count(), 1);
    assert_eq!(table.findings(), ["2 truth samples had no row of their own within 20 ms and were dropped"]);
    // Truth that begins late has columns if they are asked for, or if the whole file is looked at.
    let states = motion(9000, 0);
    let mut records: Vec<Record> = states.iter().map(record).collect();
    records.push(Record::Truth(truth_of(&states[8999], Side::Gold, &mut random)));
    let path = file(&scratch, &records);
    let mut table = StateTable::new(source(&path), Options { arms: Some(Arms::Gold), ..Options::default() }).expect("table");
    assert!(table::collect("run", &mut table).expect("recording").column("truth_x_m").is_none());
    assert!(table.findings()[0].contains("ask for all truth columns"), "{:?}", table.findings());
    let run = to_recording("run", source(&path), Options { arms: Some(Arms::Gold), all_truth: true, ..Options::default() })
        .expect("recording");
    assert!(!run.column("truth_x_m").expect("truth")[8999].is_nan());
    let mut table = recordings::tidy::open(&path, Options { arms: Some(Arms::Gold), ..Options::default() }).expect("table");
    let run = table::collect("run", table.as_mut()).expect("recording");
    assert!(run.column("truth_x_m").expect("truth").iter().position(|x| !x.is_nan()) == Some(8999));
    assert!(table.findings().is_empty() && run.column("truth_offset_s").is_none(), "{:?}", table.findings());
}

#[test]
fn an_arm_that_is_connected_late_has_its_columns() {
    let scratch = Scratch::new("tidy-late-arm");
    let of = |arms| recordings::synthetic::states(5, 9.0, arms).expect("states").states;
    let (gold, mut both) = (of(Arms::Gold), of(Arms::Both));
    both[..8500].copy_from_slice(&gold[..8500]);
    let path = file(&scratch, &both.iter().map(record).collect::<Vec<_>>());
    let by_the_first = StateTable::new(source(&path), Options::default()).expect("table");
    assert!(!recordings::tidy::has_both_arms(by_the_first.columns()));
    let mut table = recordings::tidy::open(&path, Options::default()).expect("table");
    assert!(recordings::tidy::has_both_arms(table.columns()));
    let run = table::collect("run", table.as_mut()).expect("recording");
    assert_eq!((run.rows(), run.column("t_s").expect("time")[0]), (9000, 0.0));
}

#[test]
fn the_connected_arm_is_shown_by_itself() {
    let scratch = Scratch::new("tidy-connected");
    let states = recordings::synthetic::states(5, 0.05, Arms::Green).expect("states").states;
    let path = file(&scratch, &states.iter().map(record).collect::<Vec<_>>());
    let run = to_recording("run", source(&path), Options::default()).expect("recording");
    assert_eq!(run.metadata["arm"], "green");
    assert!(run.column("mpos_1_rad").is_some());
}

#[test]
fn a_table_begins_with_the_first_state_however_much_truth_stands_before_it() {
    let scratch = Scratch::new("tidy-truth-first");
    let states = motion(50, 1_570_000_000);
    let mut random = Random(12);
    // More of it than is looked at where a source comes once only.
    let early = (0..10_000).map(|k| {
        let mut truth = truth_of(&states[0], Side::Gold, &mut random);
        truth.time_ns -= 20_000_000_000 - k * 1_000_000;
        Record::Truth(truth)
    });
    let records: Vec<Record> = early.chain(states.iter().map(record)).collect();
    let path = file(&scratch, &records);
    let opened = recordings::tidy::open(&path, Options::default()).expect("table");
    let start = opened.metadata().iter().find(|(key, _)| key == "start_unix_ns").map(|(_, value)| value.clone());
    assert_eq!(start, Some(stamp_ns(&states[0]).to_string()));
    for mut table in [opened, Box::new(StateTable::new(source(&path), Options::default()).expect("table"))] {
        let recording = table::collect("run", table.as_mut()).expect("rows");
        let time = recording.time_s().expect("time");
        assert_eq!(time.len(), 50);
        assert!(time[0] == 0.0 && time.windows(2).all(|pair| pair[1] > pair[0]), "{:?}", &time[..3]);
    }
}
