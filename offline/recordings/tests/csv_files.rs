//! Good files come in whole, compressed or not; damaged ones are refused.
#![allow(missing_docs)]

mod common;

use std::io::Write;
use std::path::Path;

use common::{Scratch, data};
use recordings::csv;

const GOOD: &str = "\u{feff}# robot = raven2\r\n# just words\r\n#arm=gold\r\nT_S, sim_mpos_1_DEG ,\"TRUTH_x_mm\",x_d_um,jpos_3_mm\r\n0.000,180,1.5,7,400\r\n\r\n0.001,90,,8,401\r\n";

fn gzip(text: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(text).expect("memory");
    encoder.finish().expect("memory")
}

fn check_good(path: &Path) {
    let recording = csv::read(path).expect("good");
    assert_eq!(recording.rows(), 2);
    assert_eq!(recording.metadata.get("robot").map(String::as_str), Some("raven2"));
    assert_eq!(recording.metadata.get("arm").map(String::as_str), Some("gold"));
    assert_eq!(recording.metadata.len(), 2);
    let names: Vec<&str> = recording.columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["t_s", "mpos_1_rad", "truth_x_m", "x_d_um", "jpos_3_m"]);
    assert_eq!(recording.time_s(), Some(&[0.0, 0.001][..]));
    assert_eq!(recording.column("mpos_1_rad").expect("column")[0], std::f64::consts::PI);
    let truth = recording.column("truth_x_m").expect("column");
    assert!(truth[0] == 1.5e-3 && truth[1].is_nan());
    assert_eq!(recording.column("x_d_um"), Some(&[7.0, 8.0][..]));
    assert_eq!(recording.column("jpos_3_m"), Some(&[0.4, 0.401][..]));
    assert_eq!(recording.unknown().collect::<Vec<_>>(), ["x_d_um"]);
}

#[test]
fn plain_and_compressed_files_come_in_the_same() {
    let scratch = Scratch::new("csv-good");
    check_good(&scratch.file("good.csv", GOOD.as_bytes()));
    check_good(&scratch.file("good.csv.gz", &gzip(GOOD.as_bytes())));
    check_good(&scratch.file("compressed-under-another-name.csv", &gzip(GOOD.as_bytes())));
    let (head, tail) = GOOD.split_at(60);
    let two_members = [gzip(head.as_bytes()), gzip(tail.as_bytes())].concat();
    check_good(&scratch.file("members.csv.gz", &two_members));
}

#[test]
fn a_file_without_time_is_a_table() {
    let recording = csv::read_text("table.csv", b"object,x_mm\n1,2\n1,3\n").expect("table");
    assert!(recording.time_s().is_none());
    assert_eq!(recording.column("x_m"), Some(&[0.002, 0.003][..]));
}

#[test]
fn damaged_and_missing_files_are_refused_in_one_line() {
    let scratch = Scratch::new("csv-bad");
    let mut cut = gzip(&GOOD.as_bytes().repeat(50));
    cut.truncate(cut.len() / 2);
    let cut = scratch.file("cut.csv.gz", &cut);
    let plain = scratch.file("plain.csv.gz", GOOD.as_bytes());
    let missing = scratch.path().join("missing.csv");
    for (path, what) in [
        (cut, "the gzip stream is damaged or cut short"),
        (plain, "is named .gz but is not gzip; rename it to .csv or compress it"),
        (missing, "cannot be opened (No such file or directory (os error 2)); check the path and its permissions"),
        (scratch.path().to_owned(), "cannot be read (Is a directory (os error 21)); check the disk or copy the file again"),
    ] {
        let found = csv::read(&path).expect_err(what).to_string();
        assert!(found.starts_with(&format!("{}: ", path.display())) && found.contains(what), "{found}");
        assert!(!found.contains('\n'), "{found}");
    }
}

#[test]
fn the_folders_of_data_come_in() {
    for (file, rows, unknown) in [
        ("raven2-uiuc/real_first_two_thirds.csv", 14_177, 0),
        ("raven2-uiuc/uiuc_simulator_freerun_first_two_thirds.csv", 14_176, 0),
        ("raven2-circle/circle_first_two_thirds.csv.gz", 9726, 3),
        ("gap-examples/a/real_1.csv.gz", 0, 0),
        ("dvrk-friction/fourier_psm1_1.csv", 0, 9),
        ("boucwen-benchmark/multisine.csv", 0, 2),
    ] {
        let path = data().join(file);
        if !path.exists() {
            println!("skipped: {} is absent", path.display());
            continue;
        }
        let recording = csv::read(&path).unwrap_or_else(|error| panic!("{error}"));
        println!("{file}: {} rows, {} columns", recording.rows(), recording.columns.len());
        assert!(recording.rows() == rows || (rows == 0 && recording.rows() > 100), "{file}");
        assert_eq!(recording.unknown().count(), unknown, "{file}");
    }
}
