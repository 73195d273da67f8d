//! Any file by its path: every format is found by its content, everything else is named.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::{Path, PathBuf};

use arm::Side;
use common::{Scratch, data};
use recordings::describe::describe;
use recordings::open::{Kind, Opened, kind, open, open_table};
use recordings::save::{StateFormat, TableFormat, copy_states, create_states};
use recordings::stream::{Record, Source};
use support::{Random, files_below, is_table, motion, read, record, refused, same_truth, states_of, truth_of, truths_of, write};

const FORMATS: [(&str, StateFormat, Kind); 6] = [
    ("run.mcap", StateFormat::Mcap, Kind::Mcap),
    ("run.bag", StateFormat::Rosbag, Kind::Rosbag),
    ("run.rvs", StateFormat::StateFile, Kind::StateFile),
    ("run.txt", StateFormat::Columns235, Kind::Columns235),
    ("run.252.csv", StateFormat::Columns252, Kind::Columns252),
    ("run.parquet", StateFormat::Parquet, Kind::Parquet),
];

fn records() -> Vec<Record> {
    let mut random = Random(30);
    let mut records = Vec::new();
    for state in motion(60, 1_570_000_000) {
        records.push(record(&state));
        records.push(Record::Truth(truth_of(&state, Side::Gold, &mut random)));
    }
    records
}

fn states(path: &Path) -> Box<dyn Source> {
    match open(path).unwrap_or_else(|error| panic!("{error}")) {
        Opened::States(source) => source,
        Opened::Table(_) => panic!("{}: states", path.display()),
    }
}

#[test]
fn every_format_of_states_is_found_by_its_content() {
    let scratch = Scratch::new("open-states");
    let records = records();
    for (name, format, expected) in FORMATS {
        let path = scratch.path().join(name);
        assert_eq!(StateFormat::of_name(&path), Some(format));
        write(create_states(&path, format, &[]).expect("create"), &records);
        // The name does not matter: content goes first.
        let renamed = scratch.path().join("renamed.data");
        std::fs::rename(&path, &renamed).expect("rename");
        assert_eq!(kind(&renamed).expect("kind"), expected, "{name}");
        let (found, damage) = read(states(&renamed));
        assert_eq!((states_of(&found).len(), damage), (60, None), "{name}");
        let description = describe(&renamed, &mut |_, _| {}).expect("description");
        assert_eq!(description.streams[0].count, 60, "{name}");
        assert!(!format.losses().is_empty() || truths_of(&found).len() == 60, "{name} loses nothing");
    }
}

#[test]
fn states_go_from_format_to_format_without_loss_where_none_is_announced() {
    let scratch = Scratch::new("open-chain");
    let records = records();
    let first = scratch.path().join("first.parquet");
    write(create_states(&first, StateFormat::Parquet, &[]).expect("create"), &records);
    let mut before = first;
    for (name, format) in [("a.mcap", StateFormat::Mcap), ("b.bag", StateFormat::Rosbag), ("c.parquet", StateFormat::Parquet)] {
        let path = scratch.path().join(name);
        let mut source = states(&before);
        let mut sink = create_states(&path, format, source.metadata()).expect("create");
        let mut told = 0;
        let count = copy_states(source.as_mut(), sink.as_mut(), &mut |done, total| {
            assert!(done <= total);
            told += 1;
        });
        assert_eq!(count.expect("copy"), 120);
        sink.finish().expect("finish");
        before = path;
    }
    let (found, _) = read(states(&before));
    assert_eq!(states_of(&found), states_of(&records));
    let (found, expected) = (truths_of(&found), truths_of(&records));
    assert_eq!(found.len(), expected.len());
    assert!(found.iter().zip(&expected).all(|(found, expected)| same_truth(found, expected)));
}

#[test]
fn every_file_of_data_is_opened_or_named() {
    let mut tables = 0;
    for path in files_below(&data()) {
        if is_table(&path) {
            assert!(matches!(open(&path), Ok(Opened::Table(_))), "{}", path.display());
            assert_eq!(open_table(&path).expect("table").format(), "tidy CSV");
            tables += 1;
        } else {
            let text = refused(open(&path).map(|_| ()), &path);
            let known = [
                "looks like a JPEG image",
                "is a .md document",
                "is a .json document",
                "is a .toml document",
                "looks like an XML document",
            ];
            assert!(known.iter().any(|known| text.starts_with(known)), "{}: {text}", path.display());
        }
    }
    if tables == 0 {
        println!("skipped: {} is absent", data().display());
    }
}

#[test]
fn names_ask_for_formats() {
    let of = |name: &str| (StateFormat::of_name(Path::new(name)), TableFormat::of_name(Path::new(name)));
    assert_eq!(of("a.CSV.gz"), (None, Some(TableFormat::Csv)));
    assert_eq!(of("a.252.csv").0, Some(StateFormat::Columns252));
    assert_eq!(of("a.parquet"), (Some(StateFormat::Parquet), Some(TableFormat::Parquet)));
    assert_eq!(of("a.xlsx"), (None, None));
}

#[test]
fn what_is_compressed_or_missing_is_said() {
    let scratch = Scratch::new("open-compressed");
    let gzip = |bytes: &[u8]| -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut encoder, bytes).expect("memory");
        encoder.finish().expect("memory")
    };
    let refusal = |name: &str, bytes: &[u8]| -> String {
        let path: PathBuf = scratch.file(name, bytes);
        refused(open(&path).map(|_| ()), &path)
    };
    assert_eq!(refusal("a.mcap.gz", &gzip(b"\x89MCAP0\r\n")), "is compressed as a whole; decompress it first (gunzip)");
    assert_eq!(refusal("a.csv.gz", b"t_s,x_mm\n"), "is named .gz but is not gzip; rename it without .gz or compress it");
    let cut = refusal("a.csv.gz", &gzip(b"t_s")[..12]);
    assert!(cut.contains("the gzip stream is damaged or cut short"), "{cut}");
    assert_eq!(refusal("empty.csv", b""), "is empty; record at least one sample");
    assert_eq!(
        refusal("a.npz", b"PK\x03\x04...."),
        "looks like a ZIP archive (also .npz and .xlsx are); unpack it, or export it to CSV"
    );
    assert_eq!(
        refusal("a.bag", b"garbage"),
        "is named .bag but does not begin like a ROS 1 bag of version 2.0; copy it again, or name it after what it is"
    );
    // State files and the two text layouts are read compressed too.
    let three: Vec<Record> = motion(3, 0).iter().map(record).collect();
    for (name, format, _) in FORMATS.into_iter().skip(2).take(3) {
        let path = scratch.path().join(name);
        write(create_states(&path, format, &[]).expect("create"), &three);
        let compressed = scratch.file(&format!("{name}.gz"), &gzip(&std::fs::read(&path).expect("file")));
        assert_eq!(states_of(&read(states(&compressed)).0).len(), 3, "{name}");
    }
}
