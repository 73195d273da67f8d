//! The paper's text of 235 columns: what comes back, what is refused, what a cut leaves.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::Path;

use common::Scratch;
use recordings::columns235::{COLUMNS, LOSSES, Reader, Writer};
use recordings::open::{Kind, kind};
use recordings::stream::{Place, Source};
use support::{motion, read, record, refused, states_of, write};

fn written(scratch: &Scratch, count: usize) -> (std::path::PathBuf, Vec<ravenpose_wire::RavenState>) {
    let path = scratch.path().join("run.txt");
    let states = motion(count, 1_570_000_000);
    let records: Vec<_> = states.iter().map(record).collect();
    write(Box::new(Writer::create(&path).expect("create")), &records);
    (path, states)
}

#[test]
fn the_text_is_that_of_the_paper() {
    let scratch = Scratch::new("235-text");
    let (path, states) = written(&scratch, 3);
    let text = std::fs::read_to_string(&path).expect("text");
    let rows: Vec<&str> = text.lines().collect();
    assert_eq!(rows.len(), 3);
    for (row, state) in rows.iter().zip(&states) {
        assert!(row.ends_with(' '), "a trailing blank");
        let cells: Vec<&str> = row.trim_end().split(' ').collect();
        assert_eq!(cells.len(), COLUMNS);
        assert!(cells.iter().all(|cell| cell.split_once('.').is_some_and(|(_, decimals)| decimals.len() == 6)), "{row}");
        // Places of ravenstate.md, section 3.
        assert_eq!(cells[0], format!("{}.{:06}", state.hdr_stamp_sec, state.hdr_stamp_nsec / 1000));
        assert_eq!(cells[4], format!("{}.000000", state.pos[3]));
        assert_eq!(cells[7], format!("{}.000000", state.pos_d[0]));
        assert_eq!(cells[13], format!("{:.6}", state.ori[0]));
        assert_eq!(cells[31], format!("{:.6}", state.ori_d[0]));
        assert_eq!(cells[49], format!("{}.000000", state.enc_vals[0]));
        assert_eq!(cells[65], format!("{}.000000", state.dac_val[0]));
        assert_eq!(cells[81], format!("{:.6}", state.tau[0]));
        assert_eq!(cells[97], format!("{:.6}", state.mpos[0]));
        assert_eq!(cells[115], format!("{:.6}", state.jpos[2]));
        assert_eq!(cells[129], format!("{:.6}", state.mvel[0]));
        assert_eq!(cells[145], format!("{:.6}", state.jvel[0]));
        assert_eq!(cells[161], format!("{:.6}", state.mpos_d[0]));
        assert_eq!(cells[177], format!("{:.6}", state.jpos_d[0]));
        assert_eq!(cells[194], format!("{:.6}", state.grasp_d[1]));
        assert_eq!(cells[195], format!("{:.6}", state.encoffsets[0]));
        assert_eq!(cells[211], format!("{:.6}", state.jac_vel[0]));
        assert_eq!(cells[234], format!("{:.6}", state.jac_f[11]));
    }
}

#[test]
fn states_come_back_within_six_decimals_and_the_text_to_the_letter() {
    let scratch = Scratch::new("235-round");
    let (path, states) = written(&scratch, 500);
    assert_eq!(kind(&path).expect("kind"), Kind::Columns235);
    let (records, damage) = read(Box::new(Reader::open(&path).expect("open")));
    assert_eq!(damage, None);
    let back = states_of(&records);
    assert_eq!(back.len(), states.len());
    for (index, (found, expected)) in back.iter().zip(&states).enumerate() {
        assert!(found.admit().is_ok());
        assert_eq!((found.sequence, found.hdr_seq), (index as u64 + 1, index as u32));
        assert_eq!((found.arms, found.runlevel, found.type_), (3, 3, [0, 0]));
        assert_eq!(
            (found.pos, found.pos_d, found.enc_vals, found.dac_val),
            (expected.pos, expected.pos_d, expected.enc_vals, expected.dac_val)
        );
        assert_eq!((found.hdr_stamp_sec, found.hdr_stamp_nsec), (expected.hdr_stamp_sec, expected.hdr_stamp_nsec));
        assert_eq!((found.dt_sec, found.dt_nsec), (0, 1_000_000));
        assert_eq!(found.source_time_ns, index as i64 * 1_000_000);
        for (found, expected) in found.mpos.iter().zip(&expected.mpos).chain(found.ori.iter().zip(&expected.ori)) {
            assert!((found - expected).abs() <= 0.6e-6, "{found} {expected}");
            assert!(expected.abs() < 16.0 || found.to_bits() == expected.to_bits(), "{found} {expected}");
        }
    }
    let again = scratch.path().join("again.txt");
    write(Box::new(Writer::create(&again).expect("create")), &records);
    assert_eq!(std::fs::read(&again).expect("file"), std::fs::read(&path).expect("file"));
}

#[test]
fn what_the_text_does_not_hold_is_said() {
    let scratch = Scratch::new("235-said");
    let (path, _) = written(&scratch, 2);
    let reader = Reader::open(&path).expect("open");
    let keys: Vec<&str> = reader.metadata().iter().map(|(key, _)| key.as_str()).collect();
    assert_eq!(keys, ["dt", "sequence", "runlevel", "type"]);
    assert!(reader.metadata()[0].1.contains("difference of consecutive time stamps"));
    for word in ["runlevel", "truth", "six decimals", "metadata"] {
        assert!(LOSSES.iter().any(|loss| loss.contains(word)), "{word}");
    }
}

/// A row of the older layout: joints first, tip position at 230 to 232.
fn older_row() -> String {
    let mut cells: Vec<String> = (0..COLUMNS).map(|column| format!("{:.6}", column as f64 * 0.37)).collect();
    "1566000000.000000".clone_into(&mut cells[0]);
    for (column, um) in [(230, -77_925), (231, -20_268), (232, 13_113)] {
        cells[column] = format!("{um}.000000");
    }
    cells.join(" ") + " \n"
}

#[test]
fn the_older_order_is_refused_by_name() {
    let scratch = Scratch::new("235-older");
    let path = scratch.file("older.txt", older_row().repeat(3).as_bytes());
    let text = refused(Reader::open(&path), &path);
    assert_eq!(
        text,
        "line 1: has the older order of 235 columns (tip position at 230..232), which this program does not read; export the recording again from its bag"
    );
}

/// A good file with one change.
fn changed(change: impl FnOnce(&mut Vec<Vec<String>>)) -> Vec<u8> {
    static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
    let scratch = Scratch::new(&format!("235-changed-{}", COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed)));
    let (path, _) = written(&scratch, 4);
    let text = std::fs::read_to_string(path).expect("text");
    let mut rows: Vec<Vec<String>> = text.lines().map(|row| row.split_whitespace().map(str::to_owned).collect()).collect();
    change(&mut rows);
    rows.iter().map(|row| row.join(" ") + " \n").collect::<String>().into_bytes()
}

fn first_row_refusal(change: impl FnOnce(&mut Vec<Vec<String>>)) -> String {
    let path = Path::new("changed.txt");
    refused(Reader::from_bytes(path, changed(change)), path)
}

#[test]
fn a_first_row_of_another_content_is_refused() {
    assert_eq!(
        first_row_refusal(|rows| rows[0][3] = "0.5".to_owned()),
        "line 1: column 3 (from 0) is 0.5, but pos holds whole numbers; copy or export the file again"
    );
    assert_eq!(
        first_row_refusal(|rows| rows[0][14] = "1.5".to_owned()),
        "line 1: column 14 (from 0) is 1.5, but a rotation lies within -1..1; copy or export the file again"
    );
    assert_eq!(
        first_row_refusal(|rows| rows[0].truncate(100)),
        "line 1: has 100 columns where the layout has 235; copy the file again"
    );
    assert_eq!(
        first_row_refusal(|rows| rows[0][0] = "-5.000000".to_owned()),
        "line 1: column 0 (from 0) is not a time since 1970 in s; copy or export the file again"
    );
    assert_eq!(
        first_row_refusal(|rows| rows[0][200] = "\u{1b}[31m".to_owned()),
        "line 1: column 200 (from 0) is not a number but `\\u{1b}[31m`; copy or export the file again"
    );
    let path = Path::new("empty.txt");
    assert_eq!(refused(Reader::from_bytes(path, Vec::new()), path), "is empty; record at least one state");
}

#[test]
fn a_damaged_row_ends_the_recording_and_is_named() {
    for (bytes, line, what) in [
        (changed(|rows| rows[2][100] = "1.2.3".to_owned()), 3, "column 100 (from 0) is not a number but `1.2.3`"),
        (changed(|rows| rows[3].truncate(40)), 4, "has 40 columns where the layout has 235"),
        (changed(|rows| rows[1][40] = "7.0".to_owned()), 2, "column 40 (from 0) is 7, but a rotation lies within -1..1"),
    ] {
        let reader = Reader::from_bytes(Path::new("damaged.txt"), bytes).expect("open");
        let (records, damage) = read(Box::new(reader));
        let damage = damage.expect("damage");
        assert_eq!((damage.place, damage.what.as_str()), (Place::Line(line), what));
        assert_eq!(records.len(), line as usize - 1);
    }
}

#[test]
fn a_file_that_is_cut_anywhere_yields_its_whole_rows() {
    let whole = changed(|_| {});
    let (expected, _) = read(Box::new(Reader::from_bytes(Path::new("whole.txt"), whole.clone()).expect("open")));
    let ends: Vec<usize> = (0..whole.len()).filter(|at| whole[*at] == b'\n').map(|at| at + 1).collect();
    for cut in (0..whole.len()).step_by(97).chain(ends.clone()) {
        let rows = ends.iter().filter(|end| **end <= cut).count();
        let reader = Reader::from_bytes(Path::new("cut.txt"), whole[..cut].to_vec());
        if rows == 0 {
            assert!(reader.is_err(), "{cut}");
            continue;
        }
        let (records, damage) = read(Box::new(reader.expect("open")));
        assert_eq!(records, expected[..rows], "{cut}");
        assert_eq!(damage.is_some(), !ends.contains(&cut), "{cut}");
    }
}

#[test]
fn line_ends_and_marks_of_other_systems_are_taken() {
    let unix = changed(|_| {});
    let windows =
        [b"\xef\xbb\xbf".to_vec(), String::from_utf8(unix.clone()).expect("text").replace('\n', "\r\n").into_bytes()].concat();
    let (expected, _) = read(Box::new(Reader::from_bytes(Path::new("unix.txt"), unix).expect("open")));
    let (found, damage) = read(Box::new(Reader::from_bytes(Path::new("windows.txt"), windows).expect("open")));
    assert_eq!((found, damage), (expected, None));
}

#[test]
fn jumps_of_the_clock_become_steps_of_any_sign() {
    let bytes = changed(|rows| {
        rows[1][0] = "1570000005.000000".to_owned();
        rows[2][0] = "1569999999.750000".to_owned();
    });
    let (records, _) = read(Box::new(Reader::from_bytes(Path::new("jumps.txt"), bytes).expect("open")));
    let states = states_of(&records);
    assert_eq!((states[1].dt_sec, states[1].dt_nsec), (5, 0));
    assert_eq!((states[2].dt_sec, states[2].dt_nsec), (-6, 750_000_000));
}
