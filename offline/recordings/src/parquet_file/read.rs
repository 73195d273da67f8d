//! Row groups into batches of cells.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use parquet::basic::{Compression, ConvertedType, Type as PhysicalType};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_typed_column_reader};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ColumnChunkMetaData, FileMetaData, RowGroupMetaData};
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::schema::types::ColumnDescriptor;

use super::store::Store;
use super::write::one_line;
use super::{CHECKSUM_KEY, LAYOUT_KEY};
use crate::file::refusal;
use crate::stream::{Damage, Place, StreamError};

/// Values of a column in a batch, without the empty cells.
pub(super) enum CellValues {
    Bool(Vec<bool>),
    I32(Vec<i32>),
    I64(Vec<i64>),
    F32(Vec<f32>),
    F64(Vec<f64>),
    Text(Vec<ByteArray>),
}

/// Cells of a column in a batch.
pub(super) struct Cells {
    pub(super) values: CellValues,
    /// 1 where a cell has a value; empty if all have.
    levels: Vec<i16>,
    optional: bool,
    /// Are its whole numbers without a sign?
    pub(super) unsigned: bool,
}

/// What the numbers of a column stand for, where they are not themselves.
fn stands_for(column: &ColumnDescriptor) -> Option<&'static str> {
    match column.converted_type() {
        ConvertedType::DECIMAL => Some("decimals"),
        ConvertedType::DATE => Some("dates"),
        ConvertedType::TIME_MILLIS | ConvertedType::TIME_MICROS => Some("times of day"),
        _ => None,
    }
}

/// Codecs that this program has.
fn is_read(codec: Compression) -> bool {
    matches!(
        codec,
        Compression::UNCOMPRESSED
            | Compression::SNAPPY
            | Compression::GZIP(_)
            | Compression::LZ4
            | Compression::LZ4_RAW
            | Compression::ZSTD(_)
    )
}

impl Cells {
    fn new(column: &ColumnDescriptor) -> Result<Self, String> {
        let values = match column.physical_type() {
            PhysicalType::BOOLEAN => CellValues::Bool(Vec::new()),
            PhysicalType::INT32 => CellValues::I32(Vec::new()),
            PhysicalType::INT64 => CellValues::I64(Vec::new()),
            PhysicalType::FLOAT => CellValues::F32(Vec::new()),
            PhysicalType::DOUBLE => CellValues::F64(Vec::new()),
            PhysicalType::BYTE_ARRAY => CellValues::Text(Vec::new()),
            other => return Err(format!("column `{}` has the type {other}", column.path().string().escape_debug())),
        };
        if column.max_rep_level() > 0 || column.max_def_level() > 1 {
            return Err(format!("column `{}` holds lists or groups", column.path().string().escape_debug()));
        }
        if let Some(what) = stands_for(column) {
            return Err(format!("column `{}` holds {what}", column.path().string().escape_debug()));
        }
        let unsigned = matches!(
            column.converted_type(),
            ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64
        );
        Ok(Self { values, levels: Vec::new(), optional: column.max_def_level() > 0, unsigned })
    }

    /// For each row, does its cell have a value?
    pub(super) fn present(&self, rows: usize) -> impl Iterator<Item = bool> {
        let levels = self.levels.iter().map(|level| *level > 0);
        levels.chain(std::iter::repeat_n(true, if self.optional { 0 } else { rows }))
    }

    /// Rows to the values that they have, in order.
    pub(super) fn rows_with_value(&self, rows: usize) -> impl Iterator<Item = usize> {
        self.present(rows).enumerate().filter_map(|(row, present)| present.then_some(row))
    }

    /// Replaces the cells by the next ones of the file; an error unless there are as many as rows.
    fn read(&mut self, reader: &mut Typed, rows: usize) -> Result<(), ParquetError> {
        self.levels.clear();
        let Self { values, levels, optional, .. } = self;
        let levels = optional.then_some(levels);
        match (values, reader) {
            (CellValues::Bool(values), Typed::Bool(reader)) => fill(values, levels, reader, rows),
            (CellValues::I32(values), Typed::I32(reader)) => fill(values, levels, reader, rows),
            (CellValues::I64(values), Typed::I64(reader)) => fill(values, levels, reader, rows),
            (CellValues::F32(values), Typed::F32(reader)) => fill(values, levels, reader, rows),
            (CellValues::F64(values), Typed::F64(reader)) => fill(values, levels, reader, rows),
            (CellValues::Text(values), Typed::Text(reader)) => fill(values, levels, reader, rows),
            _ => Err(ParquetError::General("a row group has columns of other types".to_owned())),
        }
    }
}

fn fill<T: DataType>(
    values: &mut Vec<T::T>,
    levels: Option<&mut Vec<i16>>,
    reader: &mut ColumnReaderImpl<T>,
    rows: usize,
) -> Result<(), ParquetError> {
    values.clear();
    let (records, ..) = reader.read_records(rows, levels, None, values)?;
    if records == rows { Ok(()) } else { Err(ParquetError::General("a column is shorter than the others".to_owned())) }
}

enum Typed {
    Bool(ColumnReaderImpl<BoolType>),
    I32(ColumnReaderImpl<Int32Type>),
    I64(ColumnReaderImpl<Int64Type>),
    F32(ColumnReaderImpl<FloatType>),
    F64(ColumnReaderImpl<DoubleType>),
    Text(ColumnReaderImpl<ByteArrayType>),
}

impl Typed {
    fn new(reader: ColumnReader) -> Result<Self, ParquetError> {
        Ok(match reader {
            ColumnReader::BoolColumnReader(_) => Self::Bool(get_typed_column_reader(reader)),
            ColumnReader::Int32ColumnReader(_) => Self::I32(get_typed_column_reader(reader)),
            ColumnReader::Int64ColumnReader(_) => Self::I64(get_typed_column_reader(reader)),
            ColumnReader::FloatColumnReader(_) => Self::F32(get_typed_column_reader(reader)),
            ColumnReader::DoubleColumnReader(_) => Self::F64(get_typed_column_reader(reader)),
            ColumnReader::ByteArrayColumnReader(_) => Self::Text(get_typed_column_reader(reader)),
            _ => return Err(ParquetError::General("a column of a type that is not read".to_owned())),
        })
    }
}

/// A Parquet file being read, batch by batch.
pub(super) struct Groups {
    path: PathBuf,
    store: Store,
    reader: SerializedFileReader<Store>,
    /// `key = value` pairs that are not our own or another program's book-keeping.
    pub(super) metadata: Vec<(String, String)>,
    pub(super) layout: Option<String>,
    pub(super) names: Vec<String>,
    pub(super) cells: Vec<Cells>,
    checksums: Vec<(u64, u64, u32)>,
    columns: Vec<Typed>,
    next_group: usize,
    group_start: u64,
    rows_left: usize,
    damage: Option<Damage>,
}

impl Groups {
    pub(super) fn open(path: &Path, store: Store) -> Result<Self, StreamError> {
        let refused =
            |what: String| refusal(path, None, what, "a cut Parquet file cannot be read; copy or convert the recording again");
        let reader = guarded(|| SerializedFileReader::new(store.clone()))
            .map_err(|what| refused(format!("is damaged or no Parquet file ({what})")))?;
        let file = reader.metadata().file_metadata();
        let descriptors = file.schema_descr().columns();
        let names = descriptors.iter().map(|column| column.path().string()).collect();
        let cells =
            descriptors.iter().map(|column| Cells::new(column)).collect::<Result<Vec<_>, _>>().map_err(|what| {
                refusal(path, None, what, "this program reads flat tables of numbers and words; flatten it first")
            })?;
        let codecs =
            reader.metadata().row_groups().iter().flat_map(RowGroupMetaData::columns).map(ColumnChunkMetaData::compression);
        if let Some(codec) = codecs.into_iter().find(|codec| !is_read(*codec)) {
            let what = format!("is compressed by {codec}, which this program does not read");
            return Err(refusal(path, None, what, "write it with zstd, snappy, gzip, lz4 or without compression"));
        }
        let mut groups = Self {
            path: path.to_owned(),
            metadata: pairs(file),
            layout: value_of(file, LAYOUT_KEY).map(str::to_owned),
            checksums: checksums(value_of(file, CHECKSUM_KEY).unwrap_or("")),
            names,
            cells,
            store,
            columns: Vec::new(),
            next_group: 0,
            group_start: 0,
            rows_left: 0,
            damage: None,
            reader,
        };
        groups.cells.shrink_to_fit();
        Ok(groups)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn progress(&self) -> (u64, u64) {
        self.store.progress()
    }

    pub(super) fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    /// Ends the reading here.
    pub(super) fn spoil(&mut self, what: String) {
        self.damage.get_or_insert(Damage { place: Place::Byte(self.group_start), what });
    }

    /// Replaces the cells by those of the next rows, at most so many; 0 at the end or at the damage.
    pub(super) fn next(&mut self, rows_max: usize) -> usize {
        while self.rows_left == 0 {
            if self.damage.is_some() || self.next_group >= self.reader.num_row_groups() {
                return 0;
            }
            if let Err(what) = self.begin_group() {
                self.spoil(what);
                return 0;
            }
        }
        let rows = rows_max.min(self.rows_left);
        let Self { cells, columns, .. } = self;
        let read = guarded(|| cells.iter_mut().zip(columns).try_for_each(|(cells, reader)| cells.read(reader, rows)));
        match read {
            Ok(()) => {
                self.rows_left -= rows;
                rows
            }
            Err(what) => {
                self.rows_left = 0;
                self.spoil(what);
                0
            }
        }
    }

    fn begin_group(&mut self) -> Result<(), String> {
        let group = self.reader.metadata().row_group(self.next_group);
        let (start, end) = range(group).ok_or("a row group has no place in the file")?;
        self.group_start = start;
        if end > self.store.length() {
            return Err("a row group lies beyond the end of the file".to_owned());
        }
        self.check_sum()?;
        let rows = usize::try_from(group.num_rows()).map_err(|_| "a row group has a negative number of rows")?;
        let (reader, number) = (&self.reader, self.next_group);
        self.columns = guarded(|| {
            let group = reader.get_row_group(number)?;
            (0..group.num_columns()).map(|column| Typed::new(group.get_column_reader(column)?)).collect()
        })?;
        if self.columns.len() != self.cells.len() {
            return Err("a row group has another number of columns".to_owned());
        }
        self.next_group += 1;
        self.rows_left = rows;
        Ok(())
    }

    fn check_sum(&self) -> Result<(), String> {
        let Some((start, length, expected)) = self.checksums.get(self.next_group).copied() else {
            return Ok(());
        };
        let found = self.store.checksum(start, length).map_err(|error| format!("cannot be read on ({error})"))?;
        if found == Some(expected) { Ok(()) } else { Err("a row group is damaged: its checksum differs".to_owned()) }
    }
}

/// Runs the decoder: an error, or a panic on bytes that it did not foresee, is a sentence.
fn guarded<T>(run: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(result) => result.map_err(|error| one_line(&error)),
        Err(_) => Err("the decoder gave up on these bytes".to_owned()),
    }
}

/// First byte of a row group and the one after its last.
fn range(group: &RowGroupMetaData) -> Option<(u64, u64)> {
    let ends = group.columns().iter().map(|column| {
        let start = column.dictionary_page_offset().map_or(column.data_page_offset(), |at| at.min(column.data_page_offset()));
        let start = u64::try_from(start).ok()?;
        Some((start, start.checked_add(u64::try_from(column.compressed_size()).ok()?)?))
    });
    ends.reduce(|all, one| {
        let ((a, b), (c, d)) = (all?, one?);
        Some((a.min(c), b.max(d)))
    })?
}

fn value_of<'a>(file: &'a FileMetaData, key: &str) -> Option<&'a str> {
    file.key_value_metadata()?.iter().find(|pair| pair.key == key)?.value.as_deref()
}

/// Everything but our own book-keeping and that of Arrow and pandas.
fn pairs(file: &FileMetaData) -> Vec<(String, String)> {
    let own = [LAYOUT_KEY, CHECKSUM_KEY, "ARROW:schema", "pandas"];
    let all = file.key_value_metadata().map(Vec::as_slice).unwrap_or_default();
    let others = all.iter().filter(|pair| !own.contains(&pair.key.as_str()));
    others.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect()
}

fn checksums(text: &str) -> Vec<(u64, u64, u32)> {
    let one = |part: &str| {
        let mut numbers = part.split(':');
        let (start, length, sum) = (numbers.next()?, numbers.next()?, numbers.next()?);
        Some((start.parse().ok()?, length.parse().ok()?, u32::from_str_radix(sum, 16).ok()?))
    };
    // A damaged list checks nothing rather than the wrong groups.
    text.split_whitespace().map(one).collect::<Option<Vec<_>>>().unwrap_or_default()
}
