//! Any table of numbers and words comes in as it is, and goes out without loss.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::Path;

use common::{Scratch, data};
use recordings::csv::{self, Table};
use recordings::open::{Opened, open};
use recordings::save::{TableFormat, create_table};
use recordings::stream::Place;
use recordings::table::{self, Batch, ColumnCells, RecordingTable, TableSource};
use support::{files_below, is_table, refused};

fn table(text: &str) -> Table {
    Table::from_bytes(Path::new("table.csv"), text.as_bytes()).unwrap_or_else(|error| panic!("{error}"))
}

/// All cells as text: numbers in full, words as they are.
fn cells(source: &mut dyn TableSource) -> Vec<Vec<String>> {
    let mut columns: Vec<Vec<String>> = vec![Vec::new(); source.columns().len()];
    let mut batch = Batch::new(source.columns());
    while source.next(&mut batch).unwrap_or_else(|error| panic!("{error}")) {
        for (to, from) in columns.iter_mut().zip(&batch.columns) {
            match from {
                ColumnCells::Numbers(values) => to.extend(values.iter().map(|value| format!("{value:?}"))),
                ColumnCells::Texts(texts) => to.extend(texts.iter().map(str::to_owned)),
            }
        }
    }
    columns
}

#[test]
fn words_stay_words_and_empty_cells_are_missing() {
    let mut source = table("frame,t_s,x_mm,status\n0,0.5,1.25,ok\n1,0.6,,lost\n2,0.7,nan,\n");
    assert_eq!(table::time_column(source.columns()), Some(1));
    assert_eq!(
        cells(&mut source),
        [vec!["0.0", "1.0", "2.0"], vec!["0.5", "0.6", "0.7"], vec!["1.25", "NaN", "NaN"], vec!["ok", "lost", ""]]
    );
    assert!(source.damage().is_none() && source.findings().is_empty());
}

#[test]
fn in_memory_the_time_comes_first_and_known_quantities_are_in_si() {
    let mut source = table("frame,T_S,status,x_mm,q_1_deg\n7,0.5,ok,1.25,90\n8,0.4,\"a, b\",,91\n");
    let recording = table::collect("memory", &mut source).expect("table");
    let names: Vec<&str> = recording.columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["t_s", "frame", "x_m", "q_1_deg"]);
    let originals: Vec<&str> = recording.columns.iter().map(|column| column.original.as_str()).collect();
    assert_eq!(originals, ["T_S", "frame", "x_mm", "q_1_deg"]);
    assert_eq!(
        recording.columns.iter().map(recordings::Column::unit).collect::<Vec<_>>(),
        [Some("s"), None, Some("m"), Some("deg")]
    );
    assert_eq!(recording.column("x_m").expect("x")[0], 0.00125);
    assert_eq!(recording.text("status").expect("words"), ["ok", "a, b"]);
    assert_eq!(recording.texts[0].place, 2);
}

#[test]
fn times_may_repeat_and_jump() {
    let mut source = table("t_s,x_mm\n1,1\n1,1\n0.5,2\n9,3\n");
    assert_eq!(cells(&mut source)[0], ["1.0", "1.0", "0.5", "9.0"]);
    assert!(source.damage().is_none());
    assert!(csv::read_text("run.csv", b"t_s,x_mm\n1,1\n1,1\n").is_err(), "a run is still held to rising times");
}

#[test]
fn a_few_cells_that_are_no_numbers_are_told_and_missing() {
    let mut rows: Vec<String> = (0..40).map(|row| format!("{row},{row}.5")).collect();
    rows[20] = "20,2o.5".to_owned();
    let mut source = table(&format!("t_s,x_mm\n{}\n", rows.join("\n")));
    assert_eq!(cells(&mut source)[1][20], "NaN");
    assert_eq!(
        source.findings(),
        ["column `x_mm`: 1 cells are no numbers that can be kept (first in line 22: `2o.5`), taken as missing"]
    );
    assert_eq!(source.cells_lost(), 1);
    // What says that it is missing is no damage, and a word where there are no numbers.
    let marks: Vec<String> = (0..40).map(|row| format!("{row},{},None", if row % 2 == 0 { "NA" } else { "1.5" })).collect();
    let mut source = table(&format!("t_s,x_mm,fault\n{}\n", marks.join("\n")));
    let cells_of_marks = cells(&mut source);
    assert_eq!((&cells_of_marks[1][0][..], &cells_of_marks[1][1][..], &cells_of_marks[2][0][..]), ("NaN", "1.5", "None"));
    assert!(source.cells_lost() == 0 && source.findings().is_empty());
    // A number that no double holds is none; infinity in letters is one.
    rows[20] = "20,1e999".to_owned();
    rows[21] = "21,-inf".to_owned();
    let mut source = table(&format!("t_s,x_mm\n{}\n", rows.join("\n")));
    let cells = cells(&mut source);
    assert_eq!((cells[1][20].as_str(), cells[1][21].as_str()), ("NaN", "-inf"));
    assert_eq!(source.cells_lost(), 1);
}

#[test]
fn whole_numbers_that_a_double_would_change_stay_words() {
    let mut source = table("stamp,small\n1570000000123456789,9007199254740992\n1570000000123456790,-1\n");
    assert_eq!(cells(&mut source), [vec!["1570000000123456789", "1570000000123456790"], vec!["9007199254740992.0", "-1.0"]]);
}

#[test]
fn odd_headers_are_mended_and_told() {
    let mut source = table("t_s,,x_mm,x_mm,x_cm\n0,1,2,3,4\n");
    let names: Vec<&str> = source.columns().iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["t_s", "column_2", "x_mm", "x_mm_copy2", "x_cm"]);
    assert_eq!(source.findings(), ["column 2 `` was named `column_2`", "column 4 `x_mm` was named `x_mm_copy2`"]);
    let recording = table::collect("odd", &mut source).expect("table");
    let names: Vec<&str> = recording.columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["t_s", "column_2", "x_m", "x_mm_copy2", "x_cm"], "two columns of one meaning are not merged");
}

#[test]
fn comments_below_the_header_and_a_missing_last_line_end_are_told() {
    let mut source = table("# arm = gold\nt_s,x_mm\n0,1\n# pause\n1,2");
    assert_eq!(source.metadata(), [("arm".to_owned(), "gold".to_owned())]);
    assert_eq!(cells(&mut source)[1], ["1.0", "2.0"]);
    assert_eq!(
        source.findings(),
        [
            "1 comment lines below the header were passed over",
            "the last line has no line end: if the file was cut, its last cell may be too"
        ]
    );
}

#[test]
fn damage_ends_the_table_and_is_named() {
    for (rest, line, what) in [
        ("2,3\n4\n5,6\n", 4, "has 1 cells where the header has 2"),
        ("2,3\n4,5,6\n", 4, "has 3 cells where the header has 2"),
        ("2,3\n4,\0\n", 4, "zero bytes stand where text should be"),
        ("2,3\n4,\"5\n6,7\n", 5, "a quoted cell is not closed before the end of the file"),
    ] {
        let mut source = table(&format!("t_s,x_mm\n0,1\n{rest}"));
        assert_eq!(cells(&mut source)[0], ["0.0", "2.0"], "{rest:?}");
        let damage = source.damage().expect(rest);
        assert_eq!(damage.what, what);
        assert!(matches!(damage.place, Place::Line(found) if found >= line), "{:?}", damage.place);
    }
    let bytes = b"t_s,x_mm\n0,1\n1,\xff\n";
    let mut source = Table::from_bytes(Path::new("table.csv"), bytes).expect("open");
    assert_eq!(cells(&mut source)[0], ["0.0"]);
    assert_eq!(source.damage().expect("damage").what, "is not UTF-8 text");
    let endless = [b"t_s,x_mm\n0,1\n".to_vec(), vec![b'1'; 3 << 20]].concat();
    let mut source = Table::from_bytes(Path::new("table.csv"), &endless).expect("open");
    assert_eq!(cells(&mut source)[0], ["0.0"]);
    assert_eq!(source.damage().expect("damage").what, "the line is longer than 1048576 bytes");
}

#[test]
fn a_file_without_a_header_is_refused() {
    let path = Path::new("bad.csv");
    for (text, expected) in [
        ("", "is empty; write a header line and one row per sample"),
        ("0,1\n", "line 1: the first line holds numbers, not column names; put a header such as `t_s,jpos_1_rad` above it"),
        ("t_s;x_mm\n0;1\n", "line 1: the header is separated by semicolons; separate the columns by commas"),
        ("t_s,\0\n", "line 1: zero bytes stand where text should be; is this a CSV file? save it as UTF-8 text"),
    ] {
        assert_eq!(refused(Table::from_bytes(path, text.as_bytes()), path), expected);
    }
}

/// All cells, numbers as their bits.
fn all_bits(source: &mut dyn TableSource) -> Vec<(Vec<u64>, String)> {
    let mut columns = vec![(Vec::new(), String::new()); source.columns().len()];
    let mut batch = Batch::new(source.columns());
    while source.next(&mut batch).unwrap_or_else(|error| panic!("{error}")) {
        for ((bits, words), from) in columns.iter_mut().zip(&batch.columns) {
            match from {
                ColumnCells::Numbers(values) => bits.extend(values.iter().map(|value| value.to_bits())),
                ColumnCells::Texts(texts) => texts.iter().for_each(|text| {
                    bits.push(text.len() as u64);
                    words.push_str(text);
                }),
            }
        }
    }
    columns
}

/// Reads a table, writes it, reads that, and compares everything.
fn check_round_trip(path: &Path, scratch: &Scratch) {
    for (name, format) in
        [("copy.csv", TableFormat::Csv), ("copy.csv.gz", TableFormat::Csv), ("copy.parquet", TableFormat::Parquet)]
    {
        let copy = scratch.path().join(name);
        let Opened::Table(mut source) = open(path).unwrap_or_else(|error| panic!("{error}")) else { panic!("a table") };
        assert_eq!(TableFormat::of_name(&copy), Some(format));
        let mut sink = create_table(&copy, format, source.columns(), source.metadata()).expect("create");
        let rows = table::copy(source.as_mut(), sink.as_mut(), &mut |done, total| assert!(done <= total)).expect("copy");
        sink.finish().expect("finish");
        assert!(source.damage().is_none(), "{}: {:?}", path.display(), source.damage());
        let Opened::Table(mut original) = open(path).expect("open") else { panic!("a table") };
        let Opened::Table(mut copied) = open(&copy).expect("open") else { panic!("a table") };
        assert_eq!(original.columns(), copied.columns(), "{}", path.display());
        assert_eq!(original.metadata(), copied.metadata(), "{}", path.display());
        let (expected, found) = (all_bits(original.as_mut()), all_bits(copied.as_mut()));
        assert_eq!(expected.first().map_or(0, |column| column.0.len()) as u64, rows);
        assert!(expected == found, "{} through {name}", path.display());
    }
}

#[test]
fn every_table_of_data_goes_through_csv_and_parquet_without_loss() {
    let files: Vec<_> = files_below(&data()).into_iter().filter(|path| is_table(path)).collect();
    if files.is_empty() {
        println!("skipped: {} is absent", data().display());
        return;
    }
    let scratch = Scratch::new("tables-data");
    for file in &files {
        check_round_trip(file, &scratch);
    }
    println!("{} tables", files.len());
}

#[test]
fn words_that_look_like_csv_come_back() {
    let scratch = Scratch::new("tables-words");
    let path = scratch.file("words.csv", b"note,\"a, b\"\n\"say \"\"no\"\", twice\",1\n\" edge \",2\n\"two\nlines\",3\n#1,4\n,5\n");
    let Opened::Table(mut source) = open(&path).expect("open") else { panic!("a table") };
    let expected = cells(source.as_mut());
    assert_eq!(expected[0], ["say \"no\", twice", " edge ", "two\nlines", ""]);
    check_round_trip(&path, &scratch);
}

#[test]
fn a_recording_in_memory_goes_out_and_comes_back() {
    let scratch = Scratch::new("tables-memory");
    let path = scratch.path().join("run.csv");
    let text = b"# arm = gold\nt_s,mpos_1_deg,truth_x_mm,other\n0,180,1.5,3\n0.001,90.1,,4\n";
    let recording = csv::read_text("run", text).expect("run");
    let mut source = RecordingTable::new(&recording);
    let mut sink = create_table(&path, TableFormat::Csv, source.columns(), source.metadata()).expect("create");
    table::copy(&mut source, sink.as_mut(), &mut |_, _| {}).expect("copy");
    sink.finish().expect("finish");
    let back = csv::read(&path).expect("run");
    assert_eq!(back.metadata, recording.metadata);
    for (found, expected) in back.columns.iter().zip(&recording.columns) {
        assert_eq!((found.name.as_str(), found.known), (expected.name.as_str(), expected.known));
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found.values), bits(&expected.values));
    }
    // Words are put back in their places.
    let mut words = table("t_s,status,x_mm\n0,ok,1\n");
    let recording = table::collect("words", &mut words).expect("table");
    let source = RecordingTable::new(&recording);
    let names: Vec<&str> = source.columns().iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["t_s", "status", "x_m"]);
}

#[test]
fn very_wide_tables_and_quotes_without_end_cost_no_more_than_their_size() {
    // A megabyte of columns of one name, then of one meaning.
    let same = "a,".repeat(200_000) + "a";
    let source = table(&format!("{same}\n"));
    assert_eq!(source.columns().len(), 200_001);
    assert_eq!(source.findings().len(), 21);
    let meaning: Vec<String> = (1..60_000).map(|zeros| format!("mpos_{}1_deg", "0".repeat(zeros % 9))).collect();
    let mut source = table(&format!("{}\n", meaning.join(",")));
    assert_eq!(table::collect("wide", &mut source).expect("table").columns.len(), 59_999);
    let open = format!("note,n\n\"{}", "1\n".repeat(400_000));
    let mut source = table(&open);
    assert_eq!(cells(&mut source)[0].len(), 0);
    assert_eq!(source.damage().expect("damage").what, "a quoted cell is not closed before the end of the file");
}
