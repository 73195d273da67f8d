//! The lab's CSV of 252 columns: states and the truth of one arm come back, every column is in the table.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::{Path, PathBuf};

use arm::Side;
use common::Scratch;
use recordings::columns252::{COLUMNS, Reader, Table, Writer};
use recordings::open::{Kind, kind, open_table};
use recordings::stream::{Place, Record, Source, Truth};
use recordings::table::{self, TableSource};
use support::{Random, message_of, motion, read, record, refused, stamp_ns, states_of, truth_of, truths_of, write};

/// States with a truth of the green arm that comes every third of them.
fn records(count: usize) -> Vec<Record> {
    let mut random = Random(9);
    let mut records = Vec::new();
    for (index, state) in motion(count, 1_570_000_000).iter().enumerate() {
        records.push(record(state));
        if index % 3 == 0 {
            let mut truth = truth_of(state, Side::Green, &mut random);
            truth.time_ns += 123_457;
            records.push(Record::Truth(truth));
        }
    }
    records
}

fn written(scratch: &Scratch, records: &[Record]) -> PathBuf {
    let path = scratch.path().join("run.252.csv");
    write(Box::new(Writer::create(&path).expect("create")), records);
    path
}

#[test]
fn the_columns_are_those_of_the_lab() {
    let scratch = Scratch::new("252-columns");
    let records = records(4);
    let (states, truths) = (states_of(&records), truths_of(&records));
    let text = std::fs::read_to_string(written(&scratch, &records)).expect("text");
    let rows: Vec<Vec<&str>> = text.lines().map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 4);
    let e18 = |value: f64| {
        let text = format!("{value:.18e}");
        let (mantissa, exponent) = text.split_once('e').expect("exponent");
        let exponent: i32 = exponent.parse().expect("number");
        format!("{mantissa}e{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs())
    };
    for (row, state) in rows.iter().zip(&states) {
        assert_eq!(row.len(), COLUMNS);
        // Places of ravenstate.md, section 3.
        for (column, value) in [
            (13, f64::from(state.jpos[0])),
            (15, f64::from(state.jpos[2])),
            (29, f64::from(state.runlevel)),
            (33, f64::from(state.type_[1])),
            (34, f64::from(state.pos[0])),
            (40, f64::from(state.ori[0])),
            (58, f64::from(state.ori_d[0])),
            (76, f64::from(state.pos_d[0])),
            (82, f64::from(state.enc_vals[0])),
            (98, f64::from(state.dac_val[0])),
            (114, f64::from(state.tau[0])),
            (130, f64::from(state.mpos[0])),
            (146, f64::from(state.mvel[0])),
            (162, f64::from(state.jvel[0])),
            (178, f64::from(state.mpos_d[0])),
            (194, f64::from(state.jpos_d[0])),
            (210, f64::from(state.grasp_d[0])),
            (212, f64::from(state.encoffsets[0])),
            (228, f64::from(state.jac_vel[0])),
            (251, f64::from(state.jac_f[11])),
            // CRTK's joints are the reported ones of the arm with the encoders, in rad.
            (5, f64::from(state.jpos[8]).to_radians()),
            (7, f64::from(state.jpos[10]).to_radians()),
        ] {
            assert_eq!(row[column], e18(value), "column {column}");
        }
    }
    // The nearest sample: the first for states 0 and 1, the second (state 3) for 2 and 3.
    for (row, truth) in rows.iter().zip([0, 0, 1, 1]) {
        assert_eq!(row[3], e18(truths[truth].joints[2]), "truth {truth}");
    }
    assert_eq!(rows[0][0], "1.234570000000000000e-04");
    assert!(rows[0][12].starts_with("1.570000000") && rows[0][12].ends_with("e+09"));
}

#[test]
fn states_and_truth_come_back_without_loss() {
    let scratch = Scratch::new("252-round");
    let records = records(600);
    let path = written(&scratch, &records);
    assert_eq!(kind(&path).expect("kind"), Kind::Columns252);
    let (back, damage) = read(Box::new(Reader::open(&path, Some(Side::Green)).expect("open")));
    assert_eq!(damage, None);
    let (found, expected) = (states_of(&back), states_of(&records));
    assert_eq!(found.len(), expected.len());
    for (index, (found, expected)) in found.iter().zip(&expected).enumerate() {
        assert!(found.admit().is_ok());
        assert_eq!(message_of(found), message_of(expected), "row {index}");
        assert_eq!((stamp_ns(found), found.arms, found.sequence), (stamp_ns(expected), 3, index as u64 + 1));
    }
    let (found, expected) = (truths_of(&back), truths_of(&records));
    assert_eq!(found.len(), expected.len(), "a sample that stands in several rows is given once");
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!((found.time_ns, found.side), (expected.time_ns, Side::Green));
        assert_eq!(found.joints[..3], expected.joints[..3]);
        assert!(found.joints[3..].iter().chain(&found.position_m).all(|value| value.is_nan()));
    }
    // Once more: the same file to the letter.
    let again = scratch.path().join("again.252.csv");
    write(Box::new(Writer::create(&again).expect("create")), &back);
    assert_eq!(std::fs::read(&again).expect("file"), std::fs::read(&path).expect("file"));
}

#[test]
fn states_without_truth_have_empty_encoders() {
    let scratch = Scratch::new("252-no-truth");
    let states: Vec<Record> = motion(5000, 0).iter().map(record).collect();
    let path = written(&scratch, &states);
    let text = std::fs::read_to_string(&path).expect("text");
    assert!(text.lines().all(|row| row.starts_with("nan,nan,nan,nan,")));
    let (back, damage) = read(Box::new(Reader::open(&path, None).expect("open")));
    assert_eq!((back.len(), damage), (5000, None));
    assert!(truths_of(&back).is_empty());
}

#[test]
fn truth_of_the_other_arm_is_passed_over() {
    let scratch = Scratch::new("252-arms");
    let states = motion(10, 0);
    let mut mixed = Vec::new();
    let mut random = Random(4);
    for state in &states {
        mixed.push(record(state));
        mixed.push(Record::Truth(Truth::unknown(stamp_ns(state), Side::Green)));
        mixed.push(Record::Truth(truth_of(state, Side::Gold, &mut random)));
        mixed.push(Record::Truth(truth_of(state, Side::Green, &mut random)));
    }
    let path = written(&scratch, &mixed);
    let (back, _) = read(Box::new(Reader::open(&path, None).expect("open")));
    let gold: Vec<Truth> = truths_of(&mixed).into_iter().filter(|truth| truth.side == Side::Gold).collect();
    let found = truths_of(&back);
    assert_eq!(found.len(), gold.len());
    assert!(found.iter().zip(&gold).all(|(found, gold)| found.joints[..3] == gold.joints[..3] && found.side == Side::Gold));
}

/// A file with a force sensor.
fn with_force(scratch: &Scratch) -> PathBuf {
    let text = std::fs::read_to_string(written(scratch, &records(5))).expect("text");
    let rows: Vec<String> = text.lines().enumerate().map(|(i, row)| format!("{row},1.57e9,{i}.5,-2.5,0.25")).collect();
    scratch.file("force.csv", (rows.join("\n") + "\n").as_bytes())
}

#[test]
fn the_force_sensor_is_in_the_table_and_its_absence_from_states_is_said() {
    let scratch = Scratch::new("252-force");
    let path = with_force(&scratch);
    assert_eq!(kind(&path).expect("kind"), Kind::Columns252);
    let reader = Reader::open(&path, None).expect("open");
    let left_out = &reader.metadata().iter().find(|(key, _)| key == "left_out").expect("said").1;
    assert!(left_out.contains("252-255 (force sensor)"), "{left_out}");
    assert_eq!(states_of(&read(Box::new(reader)).0).len(), 5);
    let mut source = open_table(&path).expect("table");
    let recording = table::collect("force", source.as_mut()).expect("table");
    assert_eq!(recording.columns.len(), 257);
    assert_eq!(recording.column("force_x"), Some(&[0.5, 1.5, 2.5, 3.5, 4.5][..]));
}

#[test]
fn the_table_has_every_column_under_a_name_of_its_own() {
    let scratch = Scratch::new("252-table");
    let records = records(20);
    let states = states_of(&records);
    let path = written(&scratch, &records);
    let mut source = Table::open(&path).expect("table");
    let names: Vec<String> = source.columns().iter().map(|column| column.name.clone()).collect();
    let mut distinct = names.clone();
    distinct.sort();
    distinct.dedup();
    assert_eq!((names.len(), distinct.len()), (253, 253));
    let recording = table::collect("table", &mut source).expect("table");
    assert_eq!(recording.rows(), 20);
    assert_eq!(recording.metadata["start_unix_ns"], stamp_ns(&states[0]).to_string());
    let time = recording.time_s().expect("time");
    assert!(time.iter().enumerate().all(|(row, time)| (time - row as f64 * 1e-3).abs() < 1e-12));
    for (row, state) in states.iter().enumerate() {
        assert_eq!(recording.column("mpos_green_2_deg").expect("column")[row], f64::from(state.mpos[9]));
        assert_eq!(recording.column("jpos_gold_3_m_x57").expect("column")[row], f64::from(state.jpos[2]));
        assert_eq!(recording.column("pos_gold_z_um").expect("column")[row], f64::from(state.pos[2]));
    }
}

#[test]
fn damage_ends_the_states_and_the_table_at_the_same_row() {
    let scratch = Scratch::new("252-damage");
    let text = std::fs::read_to_string(written(&scratch, &records(9))).expect("text");
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    rows[6] = rows[6].replacen('e', "x", 30);
    let path = scratch.file("damaged.csv", (rows.join("\n") + "\n").as_bytes());
    let (records, damage) = read(Box::new(Reader::open(&path, None).expect("open")));
    assert_eq!(states_of(&records).len(), 6);
    assert_eq!(damage.expect("damage").place, Place::Line(7));
    let mut source = Table::open(&path).expect("table");
    assert_eq!(table::collect("damaged", &mut source).expect("table").rows(), 6);
    assert_eq!(source.damage().expect("damage").place, Place::Line(7));
}

#[test]
fn rows_of_another_content_are_refused() {
    let path = Path::new("other.csv");
    let row = |count: usize| (vec!["2.5"; count].join(",") + "\n").into_bytes();
    assert_eq!(
        refused(Reader::from_bytes(path, row(250), None), path),
        "line 1: has 250 columns where the layout has 252 or 256; copy the file again"
    );
    assert_eq!(
        refused(Reader::from_bytes(path, row(252), None), path),
        "line 1: column 29 (from 0) is 2.5, but runlevel holds whole numbers; copy or export the file again"
    );
}
