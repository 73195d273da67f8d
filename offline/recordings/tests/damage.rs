//! Copies of real and made files, cut and flipped at random places: never a panic, always one line or the undamaged part.
#![allow(missing_docs)]

mod common;
mod support;

use std::io::Write;
use std::path::{Path, PathBuf};

use arm::Side;
use common::{Scratch, data};
use recordings::columns235;
use recordings::columns252;
use recordings::describe::describe;
use recordings::open::{Opened, open};
use recordings::parquet_file::StateWriter;
use recordings::statefile;
use recordings::stream::{Record, Sink};
use recordings::table::{Batch, ColumnCells};
use support::{Random, files_below, motion, one_line, record, truth_of, write};

/// Bytes of a file that are damaged at most, so that a debug build stays fast.
const BYTES_MAX: usize = 100_000;

/// One way to damage a file.
fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    match random.below(6) {
        0 => bytes.truncate(random.below(bytes.len())),
        1 => {
            for _ in 0..=random.below(8) {
                let at = random.below(bytes.len());
                bytes[at] = random.bits() as u8;
            }
        }
        2 => {
            let at = random.below(bytes.len().min(64));
            bytes[at] ^= 1 << random.below(8);
        }
        3 => {
            let (at, length) = (random.below(bytes.len()), random.below(2000));
            bytes[at..].iter_mut().take(length).for_each(|byte| *byte = 0);
        }
        4 => {
            let at = random.below(bytes.len());
            let end = (at + random.below(500)).min(bytes.len());
            drop(bytes.drain(at..end));
        }
        _ => {
            let at = random.below(bytes.len());
            let garbage: Vec<u8> = (0..random.below(300)).map(|_| random.bits() as u8).collect();
            drop(bytes.splice(at..at, garbage));
        }
    }
    bytes
}

/// Whatever is in the file: a refusal in one line, or records and a description.
fn check(path: &Path) -> bool {
    match describe(path, &mut |_, _| {}) {
        Ok(description) => {
            assert!(!description.to_string().is_empty());
            true
        }
        Err(error) => {
            one_line(&error, path);
            false
        }
    }
}

#[test]
fn damaged_copies_of_every_file_of_data_are_refused_or_read_up_to_the_damage() {
    let scratch = Scratch::new("damage-data");
    let mut random = Random(20);
    let (mut read, mut refused) = (0, 0);
    for original in files_below(&data()) {
        let mut bytes = std::fs::read(&original).expect("file");
        bytes.truncate(BYTES_MAX);
        let name = original.file_name().expect("name").to_string_lossy().into_owned();
        for _ in 0..4 {
            let path = scratch.file(&name, &damaged(&bytes, &mut random));
            if check(&path) { read += 1 } else { refused += 1 }
        }
        std::fs::remove_file(scratch.path().join(&name)).expect("temporary file");
    }
    if read + refused == 0 {
        println!("skipped: {} is absent", data().display());
        return;
    }
    println!("{read} read, {refused} refused");
    assert!(read > 100);
}

/// One file of each format of states.
fn of_each_format(scratch: &Scratch) -> Vec<PathBuf> {
    let mut random = Random(6);
    let mut records: Vec<Record> = Vec::new();
    for state in motion(40, 1_570_000_000) {
        records.push(record(&state));
        records.push(Record::Truth(truth_of(&state, Side::Gold, &mut random)));
    }
    let make = |name: &str, create: &dyn Fn(&Path) -> Box<dyn Sink>| {
        let path = scratch.path().join(name);
        write(create(&path), &records);
        path
    };
    vec![
        make("run.txt", &|path| Box::new(columns235::Writer::create(path).expect("create"))),
        make("run.252.csv", &|path| Box::new(columns252::Writer::create(path).expect("create"))),
        make("run.rvs", &|path| Box::new(statefile::Writer::create(path, None).expect("create"))),
        make("run.parquet", &|path| Box::new(StateWriter::create(path, &[]).expect("create"))),
    ]
}

#[test]
fn damaged_states_are_refused_or_read_up_to_the_damage() {
    let scratch = Scratch::new("damage-states");
    let mut random = Random(21);
    for original in of_each_format(&scratch) {
        let bytes = std::fs::read(&original).expect("file");
        let mut read = 0;
        for _ in 0..80 {
            std::fs::write(&original, damaged(&bytes, &mut random)).expect("file");
            read += usize::from(check(&original));
        }
        println!("{}: {read} of 80 read", original.display());
        assert!(read > 0, "{}", original.display());
    }
}

/// Numbers of the first column of a table.
fn first_column(path: &Path) -> Option<Vec<f64>> {
    let Opened::Table(mut source) = open(path).ok()? else { return None };
    let mut batch = Batch::new(source.columns());
    let mut found = Vec::new();
    while source.next(&mut batch).ok()? {
        if let ColumnCells::Numbers(values) = &batch.columns[0] {
            found.extend_from_slice(values);
        }
    }
    Some(found)
}

#[test]
fn a_cut_table_yields_its_first_rows_as_they_were() {
    let scratch = Scratch::new("damage-cut");
    let rows: Vec<String> = (0..500).map(|row| format!("{:.3},{}\n", f64::from(row) * 1e-3, row * 7)).collect();
    let text = format!("# arm = gold\nt_s,x_mm\n{}", rows.concat());
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(text.as_bytes()).expect("memory");
    for (name, bytes) in [("cut.csv", text.clone().into_bytes()), ("cut.csv.gz", encoder.finish().expect("memory"))] {
        let whole = first_column(&scratch.file(name, &bytes)).expect("whole");
        assert_eq!(whole.len(), 500);
        let mut longest = 0;
        for cut in (0..bytes.len()).step_by(bytes.len() / 60) {
            let path = scratch.file(name, &bytes[..cut]);
            let Some(found) = first_column(&path) else { continue };
            // The last row may be cut in its last cell, which its missing line end tells.
            assert_eq!(found, whole[..found.len()], "{name} cut at {cut}");
            longest = longest.max(found.len());
        }
        assert!(longest > 300, "{name}: {longest}");
    }
}

#[test]
fn binary_garbage_and_odd_names_are_refused_in_one_line() {
    let scratch = Scratch::new("damage-garbage");
    let mut random = Random(8);
    for name in ["a.csv", "a.csv.gz", "a.mcap", "a.bag", "a.rvs", "a.parquet", "a.txt", "a", "line\nend.csv"] {
        for length in [0, 1, 2, 7, 64, 5000] {
            let bytes: Vec<u8> = (0..length).map(|_| random.bits() as u8).collect();
            let path = scratch.file(name, &bytes);
            if let Err(error) = describe(&path, &mut |_, _| {}) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
    assert!(describe(scratch.path(), &mut |_, _| {}).expect_err("folder").to_string().contains("is a folder"));
    let absent = scratch.path().join("absent.csv");
    assert!(describe(&absent, &mut |_, _| {}).expect_err("absent").to_string().contains("cannot be opened"));
}
