//! Parquet: states and tables come back bit for bit; damage is noticed before it is decoded.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::Path;
use std::sync::Arc;

use arm::Side;
use common::Scratch;
use parquet::basic::{Compression, ConvertedType, GzipLevel, Repetition, Type as PhysicalType};
use parquet::data_type::{BoolType, ByteArrayType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use ravenpose_wire::RavenState;
use recordings::open::{Opened, open};
use recordings::parquet_file::{ROW_GROUP_ROWS, StateReader, StateWriter, TableReader, TableWriter};
use recordings::stream::{Place, Record, Source, Truth};
use recordings::table::{Batch, ColumnCells, TableColumn, TableSink, TableSource, Texts};
use support::{Random, motion, read, record, refused, same_truth, stamp_ns, truth_of, write};

/// A state with any bits in any field, but a whole message.
fn wild_state(random: &mut Random, sequence: u64) -> RavenState {
    let mut state = RavenState::new();
    state.seal(sequence);
    state.source_id = random.bits();
    state.source_time_ns = random.bits() as i64;
    state.arms = random.bits() as u32;
    state.hdr_seq = random.bits() as u32;
    state.hdr_stamp_sec = random.bits() as u32;
    state.hdr_stamp_nsec = random.bits() as u32;
    state.dt_sec = random.bits() as i32;
    state.dt_nsec = random.bits() as i32;
    state.runlevel = random.bits() as i32;
    state.last_seq = random.bits() as i32;
    let floats = |random: &mut Random| f32::from_bits(random.bits() as u32);
    state.pos = std::array::from_fn(|_| random.bits() as i32);
    state.enc_vals = std::array::from_fn(|_| random.bits() as i32);
    state.tau = std::array::from_fn(|_| floats(random));
    state.mpos = std::array::from_fn(|_| floats(random));
    state.jac_f = std::array::from_fn(|_| floats(random));
    state
}

/// All bits of a state; a float that is no number equals itself.
fn bits(state: &RavenState) -> String {
    format!("{:?}", {
        let mut plain = *state;
        let floats: Vec<u32> = plain.tau.iter().chain(&plain.mpos).chain(&plain.jac_f).map(|value| value.to_bits()).collect();
        plain.tau = [0.0; 16];
        plain.mpos = [0.0; 16];
        plain.jac_f = [0.0; 12];
        (plain, floats)
    })
}

fn assert_same(found: &[Record], expected: &[Record]) {
    assert_eq!(found.len(), expected.len());
    for (index, pair) in found.iter().zip(expected).enumerate() {
        match pair {
            (Record::State(found), Record::State(expected)) => assert_eq!(bits(found), bits(expected), "record {index}"),
            (Record::Truth(found), Record::Truth(expected)) => assert!(same_truth(found, expected), "record {index}"),
            _ => panic!("record {index} is of another kind"),
        }
    }
}

#[test]
fn states_and_truth_come_back_bit_for_bit() {
    let scratch = Scratch::new("parquet-states");
    let path = scratch.path().join("run.parquet");
    let mut random = Random(1);
    let mut records = vec![Record::Truth(Truth::unknown(-5, Side::Green))];
    for sequence in 1..=3000 {
        let state = wild_state(&mut random, sequence);
        records.push(record(&state));
        let gold = random.below(3) == 0;
        if gold {
            records.push(Record::Truth(truth_of(&state, Side::Gold, &mut random)));
        }
        if random.below(3) == 0 {
            records.push(Record::Truth(truth_of(&state, Side::Green, &mut random)));
        }
        if gold && random.below(50) == 0 {
            // Truth faster than the states, with holes.
            let mut truth = Truth::unknown(stamp_ns(&state) + 7, Side::Gold);
            truth.joints[2] = random.unit();
            records.push(Record::Truth(truth));
            records.push(Record::Truth(truth));
        }
    }
    let metadata = vec![("robot".to_owned(), "raven2".to_owned()), ("note".to_owned(), "zwölf = 12\nlines".to_owned())];
    write(Box::new(StateWriter::create(&path, &metadata).expect("create")), &records);
    let reader = StateReader::open(&path).expect("open").expect("states");
    assert_eq!(reader.metadata(), metadata);
    let (found, damage) = read(Box::new(reader));
    assert_eq!(damage, None);
    assert_same(&found, &records);
}

#[test]
fn recordings_of_several_row_groups_come_back() {
    let scratch = Scratch::new("parquet-groups");
    let path = scratch.path().join("run.parquet");
    let states = motion(1000, 0);
    let count = ROW_GROUP_ROWS + 1500;
    let records: Vec<Record> = (0..count)
        .map(|index| {
            let mut state = states[index % 1000];
            state.seal(index as u64 + 1);
            record(&state)
        })
        .collect();
    write(Box::new(StateWriter::create(&path, &[]).expect("create")), &records);
    let (found, damage) = read(Box::new(StateReader::open(&path).expect("open").expect("states")));
    assert_eq!(damage, None);
    assert_eq!(found, records);
}

#[test]
fn a_flipped_byte_ends_the_states_before_its_row_group() {
    let scratch = Scratch::new("parquet-flip");
    let path = scratch.path().join("run.parquet");
    let states = motion(1000, 0);
    let records: Vec<Record> = (0..2 * ROW_GROUP_ROWS + 10).map(|index| record(&states[index % 1000])).collect();
    write(Box::new(StateWriter::create(&path, &[]).expect("create")), &records);
    let good = std::fs::read(&path).expect("file");
    let mut flipped = good.clone();
    // Four bytes of magic, then the row groups: somewhere in the second.
    let reader = parquet::file::serialized_reader::SerializedFileReader::new(bytes::Bytes::from(good.clone())).expect("parquet");
    let group = parquet::file::reader::FileReader::metadata(&reader).row_group(1);
    let start = group.column(0).byte_range().0;
    flipped[start as usize + 5000] ^= 4;
    let reader = StateReader::from_bytes(Path::new("flipped"), flipped).expect("open").expect("states");
    let (found, damage) = read(Box::new(reader));
    assert_eq!(found, records[..ROW_GROUP_ROWS]);
    let damage = damage.expect("damage");
    assert_eq!((damage.place, damage.what.as_str()), (Place::Byte(start), "a row group is damaged: its checksum differs"));
}

#[test]
fn a_cut_file_is_refused() {
    let scratch = Scratch::new("parquet-cut");
    let path = scratch.path().join("run.parquet");
    let records: Vec<Record> = motion(50, 0).iter().map(record).collect();
    write(Box::new(StateWriter::create(&path, &[]).expect("create")), &records);
    let good = std::fs::read(&path).expect("file");
    for cut in [4, 5, 100, good.len() / 2, good.len() - 9, good.len() - 1] {
        let name = Path::new("cut.parquet");
        let text = refused(StateReader::from_bytes(name, good[..cut].to_vec()), name);
        assert!(text.ends_with("; a cut Parquet file cannot be read; copy or convert the recording again"), "{text}");
    }
}

#[test]
fn nothing_is_left_of_a_file_that_was_not_finished() {
    let scratch = Scratch::new("parquet-left");
    let path = scratch.path().join("run.parquet");
    drop(StateWriter::create(&path, &[]).expect("create"));
    assert_eq!(std::fs::read_dir(scratch.path()).expect("folder").count(), 0);
    let nowhere = scratch.path().join("absent/run.parquet");
    assert!(refused(StateWriter::create(&nowhere, &[]).map(|_| ()), &nowhere).starts_with("cannot be written (No such file"));
}

fn columns() -> Vec<TableColumn> {
    vec![
        TableColumn::number("t_s"),
        TableColumn { name: "status".to_owned(), text: true },
        TableColumn::number("weird name, with = and \"quotes\""),
    ]
}

fn texts<'a>(words: impl IntoIterator<Item = &'a str>) -> Texts {
    let mut texts = Texts::default();
    words.into_iter().for_each(|word| texts.push(word));
    texts
}

#[test]
fn tables_come_back_with_words_and_missing_cells() {
    let scratch = Scratch::new("parquet-table");
    let path = scratch.path().join("table.parquet");
    let metadata = vec![("arm".to_owned(), "gold".to_owned())];
    let batch = Batch {
        columns: vec![
            ColumnCells::Numbers(vec![0.1, 0.2, f64::MAX, -0.0]),
            ColumnCells::Texts(texts(["ok", "", "lost, \"again\"\n", "zwölf"])),
            ColumnCells::Numbers(vec![f64::NAN, 1e-308, f64::INFINITY, f64::NAN]),
        ],
    };
    let mut writer = Box::new(TableWriter::create(&path, &columns(), &metadata).expect("create"));
    writer.write(&batch).expect("write");
    writer.write(&batch).expect("write");
    writer.finish().expect("finish");
    let Opened::Table(mut source) = open(&path).expect("open") else { panic!("a table") };
    assert_eq!((source.columns(), source.metadata()), (&columns()[..], &metadata[..]));
    let mut found = Batch::new(source.columns());
    assert!(source.next(&mut found).expect("rows"));
    assert_eq!(found.rows(), 8);
    for (found, expected) in found.columns.iter().zip(&batch.columns) {
        match (found, expected) {
            (ColumnCells::Numbers(found), ColumnCells::Numbers(expected)) => {
                let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(found), bits(&[expected.as_slice(), expected].concat()));
            }
            (ColumnCells::Texts(found), ColumnCells::Texts(expected)) => {
                assert_eq!(found.iter().collect::<Vec<_>>(), expected.iter().chain(expected.iter()).collect::<Vec<_>>());
            }
            _ => panic!("kinds"),
        }
    }
    assert!(!source.next(&mut found).expect("end"));
    assert!(source.damage().is_none());
}

/// A file as another program writes it, one row group, no nulls but in the last column.
fn foreign(path: &Path, big: i64) {
    let fields = [
        Type::primitive_type_builder("flag", PhysicalType::BOOLEAN).with_repetition(Repetition::REQUIRED).build(),
        Type::primitive_type_builder("count", PhysicalType::INT32).with_repetition(Repetition::REQUIRED).build(),
        Type::primitive_type_builder("stamp", PhysicalType::INT64).with_repetition(Repetition::REQUIRED).build(),
        Type::primitive_type_builder("x_mm", PhysicalType::FLOAT).with_repetition(Repetition::OPTIONAL).build(),
        Type::primitive_type_builder("t_s", PhysicalType::DOUBLE).with_repetition(Repetition::REQUIRED).build(),
        Type::primitive_type_builder("word", PhysicalType::BYTE_ARRAY)
            .with_repetition(Repetition::OPTIONAL)
            .with_converted_type(ConvertedType::UTF8)
            .build(),
    ];
    let fields = fields.into_iter().map(|field| Arc::new(field.expect("field"))).collect();
    let schema = Type::group_type_builder("schema").with_fields(fields).build().expect("schema");
    let file = std::fs::File::create(path).expect("file");
    let mut writer =
        SerializedFileWriter::new(file, Arc::new(schema), Arc::new(WriterProperties::builder().build())).expect("writer");
    let mut group = writer.next_row_group().expect("group");
    macro_rules! column {
        ($kind:ty, $values:expr, $levels:expr) => {
            let mut column = group.next_column().expect("column").expect("column");
            column.typed::<$kind>().write_batch($values, $levels, None).expect("values");
            column.close().expect("close");
        };
    }
    column!(BoolType, &[true, false, true], None);
    column!(Int32Type, &[1, -2, i32::MAX], None);
    column!(Int64Type, &[0, -7, big], None);
    column!(FloatType, &[0.5, 0.1], Some(&[1, 0, 1]));
    column!(DoubleType, &[0.0, 0.5, 1.0], None);
    column!(ByteArrayType, &["a".into()], Some(&[0, 1, 0]));
    group.close().expect("group");
    writer.close().expect("file");
}

#[test]
fn files_of_other_programs_are_tables_too() {
    let scratch = Scratch::new("parquet-foreign");
    let path = scratch.path().join("foreign.parquet");
    foreign(&path, 1 << 53);
    let mut source = TableReader::open(&path).expect("open");
    let names: Vec<&str> = source.columns().iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["flag", "count", "stamp", "x_mm", "t_s", "word"]);
    let recording = recordings::table::collect("foreign", &mut source).expect("table");
    assert_eq!(recording.columns[0].name, "t_s", "the time comes first");
    assert_eq!(recording.column("flag"), Some(&[1.0, 0.0, 1.0][..]));
    assert_eq!(recording.column("stamp"), Some(&[0.0, -7.0, 9_007_199_254_740_992.0][..]));
    let x = recording.column("x_m").expect("x in SI");
    assert!(x[0] == 0.0005 && x[1].is_nan());
    assert_eq!(recording.text("word").expect("words"), ["", "a", ""]);
    assert_eq!(source.damage(), None);
}

/// A column of whole numbers that stand for something, compressed.
fn of_kind(path: &Path, codec: Compression, kind: ConvertedType) {
    let mut field =
        Type::primitive_type_builder("count", PhysicalType::INT32).with_repetition(Repetition::REQUIRED).with_converted_type(kind);
    if kind == ConvertedType::DECIMAL {
        field = field.with_precision(9).with_scale(2);
    }
    let fields = vec![Arc::new(field.build().expect("field"))];
    let schema = Type::group_type_builder("schema").with_fields(fields).build().expect("schema");
    let properties = WriterProperties::builder().set_compression(codec).build();
    let file = std::fs::File::create(path).expect("file");
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).expect("writer");
    let mut group = writer.next_row_group().expect("group");
    let mut column = group.next_column().expect("column").expect("column");
    column.typed::<Int32Type>().write_batch(&[1, -294_967_296, 7], None, None).expect("values");
    column.close().expect("close");
    group.close().expect("group");
    writer.close().expect("file");
}

#[test]
fn what_pandas_writes_by_default_is_read_and_numbers_without_a_sign_have_none() {
    let scratch = Scratch::new("parquet-codecs");
    let path = scratch.path().join("foreign.parquet");
    let codecs = [Compression::SNAPPY, Compression::GZIP(GzipLevel::default()), Compression::LZ4_RAW, Compression::UNCOMPRESSED];
    for (codec, kind, second) in codecs
        .into_iter()
        .flat_map(|codec| [(codec, ConvertedType::INT_32, -294_967_296.0), (codec, ConvertedType::UINT_32, 4_000_000_000.0)])
    {
        of_kind(&path, codec, kind);
        let mut source = TableReader::open(&path).expect("open");
        let recording = recordings::table::collect("foreign", &mut source).expect("table");
        assert_eq!(recording.column("count"), Some(&[1.0, second, 7.0][..]), "{codec}");
        assert_eq!(source.damage(), None, "{codec}");
    }
    for (kind, word) in [(ConvertedType::DECIMAL, "decimals"), (ConvertedType::DATE, "dates")] {
        of_kind(&path, Compression::SNAPPY, kind);
        let error = TableReader::open(&path).err().expect("refused").to_string();
        assert!(error.contains("column `count` holds") && error.contains(word), "{error}");
    }
}

#[test]
fn whole_numbers_that_a_table_would_change_end_it() {
    let scratch = Scratch::new("parquet-big");
    let path = scratch.path().join("foreign.parquet");
    foreign(&path, (1 << 53) + 1);
    let mut source = TableReader::open(&path).expect("open");
    assert_eq!(recordings::table::collect("foreign", &mut source).expect("table").rows(), 0);
    let damage = source.damage().expect("damage");
    assert_eq!(damage.what, "column `stamp` holds whole numbers beyond 2^53, which a table cannot keep exactly");
}

#[test]
fn a_file_that_only_says_that_it_holds_states_is_refused() {
    let scratch = Scratch::new("parquet-liar");
    let path = scratch.path().join("liar.parquet");
    let metadata = vec![("ravenpose.layout".to_owned(), "raven_state.v1".to_owned())];
    let writer = Box::new(TableWriter::create(&path, &columns(), &metadata).expect("create"));
    writer.finish().expect("finish");
    let text = refused(StateReader::open(&path).map(|_| ()), &path);
    assert_eq!(text, "says that it holds raven_state.v1 but has other columns; write it again with this release");
}
