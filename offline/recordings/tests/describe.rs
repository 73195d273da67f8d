//! What `ravenpose info` says about recordings that are known.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::Path;

use arm::Side;
use common::{Scratch, data};
use recordings::csv::Table;
use recordings::describe::{Description, describe, of_table};
use recordings::stream::Record;
use support::{Random, files_below, is_table, motion, record, truth_of, write};

fn of_text(text: &str) -> Description {
    let mut table = Table::from_bytes(Path::new("table.csv"), text.as_bytes()).expect("table");
    of_table("table.csv", &mut table, &mut |done, total| assert!(done <= total)).expect("description")
}

fn of_data(file: &str) -> Option<Description> {
    let path = data().join(file);
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    Some(describe(&path, &mut |_, _| {}).unwrap_or_else(|error| panic!("{error}")))
}

/// Every line fits a terminal of 100 columns.
fn check_shown(description: &Description) -> String {
    let text = description.to_string();
    for line in text.lines().filter(|line| !line.contains(&description.file)) {
        assert!(line.chars().count() <= 100, "{line}");
    }
    text
}

#[test]
fn the_real_recording_is_described_as_its_readme_does() {
    let Some(found) = of_data("raven2-uiuc/real_first_two_thirds.csv") else { return };
    let rows = &found.streams[0];
    let timing = rows.timing.as_ref().expect("times");
    assert_eq!((found.format.as_str(), rows.name.as_str(), rows.count), ("tidy CSV", "rows", 14_177));
    assert!((timing.rate_hz - 1000.0).abs() < 1e-6 && timing.off_share == 0.0 && timing.gaps == 0);
    assert_eq!((timing.first_s, timing.last_s, timing.resolution_s), (0.0, 14.176, 0.001));
    assert_eq!((timing.repeated_times, timing.jumps_back), (0, 0));
    let motor = found.channels.iter().find(|channel| channel.name == "mpos_1_deg").expect("motor 1");
    assert_eq!((motor.unit.as_str(), motor.first, motor.missing), ("deg", Some(4_080.510_254), 0));
    // awk: 1.051 % of the rows have all three motors below 2.8648 deg/s.
    assert!((found.standstill[0].share - 0.01051).abs() < 1e-4, "{:?}", found.standstill);
    assert_eq!(found.saturation.len(), 3);
    assert!(found.saturation.iter().all(|channel| channel.share == 0.0 && channel.limit_counts >= 2000));
    assert_eq!(found.damage, None);
    assert!(check_shown(&found).contains("rows: 14177 in 14.176 s (0 to 14.176), 1000 Hz"));
}

#[test]
fn the_circle_arrived_in_bursts_and_is_said_to() {
    let Some(found) = of_data("raven2-circle/circle_first_two_thirds.csv.gz") else { return };
    let timing = found.streams[0].timing.as_ref().expect("times");
    assert!(timing.is_irregular() && timing.mean_rate_hz > 100.0);
    assert!(check_shown(&found).contains("irregular"));
}

#[test]
fn repeated_rows_of_a_polled_recording_are_counted() {
    // README of dvrk-payload: the MTM runs repeat 11 to 13 % of the rows.
    let Some(found) = of_data("dvrk-payload/mtm_traj1.csv") else { return };
    let share = found.repeated_rows as f64 / found.streams[0].count as f64;
    assert!((0.11..0.135).contains(&share), "{share}");
}

#[test]
fn truth_has_its_coverage() {
    let Some(found) = of_data("gap-examples/a/real_1.csv.gz") else { return };
    let truth = &found.truth[0];
    assert!((truth.position_share - 0.05).abs() < 1e-9 && truth.joints_share == 1.0 && truth.rotation_share == 0.0);
    assert_eq!(found.metadata[0], ("robot".to_owned(), "raven2-like-3dof".to_owned()));
}

#[test]
fn every_table_of_data_is_described() {
    let mut count = 0;
    for path in files_below(&data()) {
        let name = path.to_string_lossy().into_owned();
        if is_table(&path) {
            let found = describe(&path, &mut |_, _| {}).unwrap_or_else(|error| panic!("{error}"));
            check_shown(&found);
            assert!(found.streams[0].count > 0 && found.damage.is_none() && found.findings.is_empty(), "{name}: {found}");
            count += 1;
        }
    }
    if count == 0 {
        println!("skipped: {} is absent", data().display());
    }
}

#[test]
fn words_gaps_and_odd_times_are_seen() {
    let found = of_text("t_s,status,x_mm\n0,ok,1\n1,ok,1\n1,lost,\n2,ok,inf\n5,ok,1\n4,ok,1\n,ok,1\n");
    let timing = found.streams[0].timing.as_ref().expect("times");
    assert_eq!((timing.repeated_times, timing.jumps_back, timing.gaps, timing.missing_samples), (1, 1, 1, 2));
    assert_eq!(timing.first_jump_back.expect("jump").row, 6);
    let status = &found.channels[1];
    assert_eq!((status.words[0].text.as_str(), status.words[0].count, status.words.len()), ("ok", 6, 2));
    let x = &found.channels[2];
    assert_eq!((x.missing, x.infinite, x.min, x.max, x.constant), (1, 1, Some(1.0), Some(1.0), false));
    assert_eq!(found.findings, ["1 rows have no time that can be used"]);
    // Rows 2 and 6 repeat all but the time of the row before; row 7 too.
    assert_eq!(found.repeated_rows, 3);
    check_shown(&found);
}

#[test]
fn dvrk_names_tell_standstill_too() {
    let found =
        of_text("t_s,q_1_rad,q_3_m,dq_1_rad_s,dq_3_m_s\n0,1,2,0.5,0\n1,1,2,0.005,0.0005\n2,1,2,0.005,0.0005\n3,1,2,0,0.1\n");
    assert_eq!((found.standstill[0].share, found.standstill[0].longest_rows), (0.5, 2));
    let by_positions = of_text("t_s,q_act_1_rad\n0,1\n1,1\n2,2\n3,2\n");
    assert_eq!(by_positions.standstill[0].share, 0.5);
    assert!(of_text("t_s,force_N\n0,1\n").standstill.is_empty());
}

#[test]
fn states_are_described_by_arm() {
    let scratch = Scratch::new("describe-states");
    let path = scratch.path().join("run.parquet");
    let mut random = Random(3);
    let mut states = motion(1000, 1_570_000_000);
    for (index, state) in states.iter_mut().enumerate() {
        state.runlevel = if index < 250 { 2 } else { 3 };
        if index % 10 == 0 {
            state.dac_val[0] = 2500;
        }
        if (100..150).contains(&index) {
            state.mvel = [0.0; 16];
        }
    }
    states.remove(500);
    let mut records = Vec::new();
    for (index, state) in states.iter().enumerate() {
        records.push(record(state));
        if index % 4 == 0 {
            records.push(Record::Truth(truth_of(state, Side::Gold, &mut random)));
        }
    }
    write(Box::new(recordings::parquet_file::StateWriter::create(&path, &[]).expect("create")), &records);
    let found = describe(&path, &mut |done, total| assert!(done <= total)).expect("description");
    let names: Vec<(&str, u64)> = found.streams.iter().map(|stream| (stream.name.as_str(), stream.count)).collect();
    assert_eq!(names, [("states", 999), ("truth gold", 250)]);
    let timing = found.streams[0].timing.as_ref().expect("times");
    assert_eq!((timing.gaps, timing.missing_samples, timing.rate_hz), (1, 1, 1000.0));
    let levels: Vec<Option<i64>> = found.runlevels.iter().map(|level| level.runlevel).collect();
    assert_eq!(levels, [Some(2), Some(3)]);
    assert!((found.runlevels[0].share - 250.0 / 999.0).abs() < 1e-12);
    let dac = found.saturation.iter().find(|channel| channel.channel == "dac_val_gold_1").expect("dac");
    assert_eq!(dac.limit_counts, 2500);
    assert!((dac.share - 99.0 / 999.0).abs() < 1e-12, "{dac:?}");
    assert!(found.standstill.iter().all(|still| still.longest_rows >= 50 && still.share >= 0.05));
    assert!((found.truth[0].position_share - 250.0 / 999.0).abs() < 1e-12);
    let joint_3 = found.channels.iter().find(|channel| channel.name == "jpos_gold_3").expect("joint 3");
    assert_eq!(joint_3.unit, "m x 57.29578");
    let offsets = found.channels.iter().find(|channel| channel.name == "encoffsets_green_2").expect("offset");
    assert!(offsets.constant);
    let text = check_shown(&found);
    assert!(text.contains("runlevel: 2 25.0 %, 3 75.0 %") && text.contains("constant ("), "{text}");
}

#[test]
fn a_description_is_json_too() {
    let found = of_text("t_s,status,x_mm\n0,ok,1\n1,ok,\n");
    let json = serde_json::to_value(&found).expect("JSON");
    assert_eq!(json["streams"][0]["count"], 2);
    assert_eq!(json["channels"][2]["missing"], 1);
    assert_eq!(json["channels"][1]["words"][0]["text"], "ok");
}

#[test]
fn damage_is_at_the_end_of_what_is_said() {
    let found = of_text("t_s,x_mm\n0,1\n1,2\n2\n");
    assert_eq!(found.damage.as_ref().expect("damage").place, "line 4");
    assert!(
        check_shown(&found).ends_with("DAMAGED at line 4: has 1 cells where the header has 2; what is told above stands before\n")
    );
}
