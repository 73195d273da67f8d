//! Rows into row groups.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, Encoding, Repetition, Type as PhysicalType, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, Type};

use super::{CHECKSUM_KEY, LAYOUT_KEY, ROW_GROUP_ROWS};
use crate::file::{WholeFile, cannot_write, refusal};
use crate::stream::StreamError;

/// Values of a column that wait to be written.
#[derive(Debug)]
pub(super) enum Values {
    I32(Vec<i32>),
    I64(Vec<i64>),
    F32(Vec<f32>),
    F64(Vec<f64>),
    Text(Vec<ByteArray>),
}

/// A column: its name and the cells that wait to be written.
#[derive(Debug)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) values: Values,
    cells: usize,
    /// 1 for a cell with a value, 0 for an empty one; nothing as long as none is empty.
    levels: Vec<i16>,
}

impl Column {
    pub(super) fn new(name: String, values: Values) -> Self {
        Self { name, values, cells: 0, levels: Vec::new() }
    }

    /// A cell is added: its value, if it has one, goes to `values`.
    pub(super) fn cell(&mut self, has_value: bool) {
        if !has_value && self.levels.is_empty() {
            self.levels.resize(self.cells, 1);
        }
        if !has_value || !self.levels.is_empty() {
            self.levels.push(i16::from(has_value));
        }
        self.cells += 1;
    }

    fn schema(&self) -> Result<Type, ParquetError> {
        let physical = match self.values {
            Values::I32(_) => PhysicalType::INT32,
            Values::I64(_) => PhysicalType::INT64,
            Values::F32(_) => PhysicalType::FLOAT,
            Values::F64(_) => PhysicalType::DOUBLE,
            Values::Text(_) => PhysicalType::BYTE_ARRAY,
        };
        let builder = Type::primitive_type_builder(&self.name, physical).with_repetition(Repetition::OPTIONAL);
        if matches!(self.values, Values::Text(_)) {
            builder.with_converted_type(ConvertedType::UTF8).build()
        } else {
            builder.build()
        }
    }

    /// How values without a dictionary are laid out: bytes of equal weight together for floats, differences for whole
    /// numbers.
    fn encoding(&self) -> Encoding {
        match self.values {
            Values::F32(_) | Values::F64(_) => Encoding::BYTE_STREAM_SPLIT,
            Values::I32(_) | Values::I64(_) => Encoding::DELTA_BINARY_PACKED,
            Values::Text(_) => Encoding::PLAIN,
        }
    }

    /// Writes the cells; `ones` are the levels of a column without empty cells.
    fn write(&mut self, writer: &mut SerializedColumnWriter<'_>, ones: &mut Vec<i16>) -> Result<(), ParquetError> {
        ones.resize(self.cells, 1);
        let levels = Some(if self.levels.is_empty() { ones.as_slice() } else { self.levels.as_slice() });
        match &mut self.values {
            Values::I32(values) => {
                writer.typed::<Int32Type>().write_batch(values, levels, None)?;
                values.clear();
            }
            Values::I64(values) => {
                writer.typed::<Int64Type>().write_batch(values, levels, None)?;
                values.clear();
            }
            Values::F32(values) => {
                writer.typed::<FloatType>().write_batch(values, levels, None)?;
                values.clear();
            }
            Values::F64(values) => {
                writer.typed::<DoubleType>().write_batch(values, levels, None)?;
                values.clear();
            }
            Values::Text(values) => {
                writer.typed::<ByteArrayType>().write_batch(values, levels, None)?;
                values.clear();
            }
        }
        self.levels.clear();
        self.cells = 0;
        Ok(())
    }
}

/// A Parquet file being written.
pub(super) struct Groups {
    path: PathBuf,
    writer: SerializedFileWriter<Summed>,
    pub(super) columns: Vec<Column>,
    checksums: Vec<String>,
}

impl Groups {
    pub(super) fn create(
        path: &Path,
        columns: Vec<Column>,
        layout: &str,
        metadata: &[(String, String)],
    ) -> Result<Self, StreamError> {
        let file = WholeFile::create(path).map_err(|error| cannot_write(path, &error))?;
        let pairs = metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone()));
        let pairs = pairs.chain([KeyValue::new(LAYOUT_KEY.to_owned(), layout.to_owned())]).collect();
        let begun = begin(file, &columns, pairs).map_err(|error| failed(path, &error))?;
        Ok(Self { path: path.to_owned(), writer: begun, columns, checksums: Vec::new() })
    }

    /// Rows are complete: all columns have as many cells as the first.
    pub(super) fn rows_done(&mut self) -> Result<(), StreamError> {
        if self.columns.first().is_some_and(|column| column.cells >= ROW_GROUP_ROWS) { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), StreamError> {
        let Self { path, writer, columns, checksums } = self;
        flush(writer, columns, checksums).map_err(|error| failed(path, &error))
    }

    pub(super) fn finish(mut self) -> Result<(), StreamError> {
        if self.columns.first().is_some_and(|column| column.cells > 0) {
            self.flush()?;
        }
        let Self { path, mut writer, checksums, .. } = self;
        writer.append_key_value_metadata(KeyValue::new(CHECKSUM_KEY.to_owned(), checksums.join(" ")));
        let summed = writer.into_inner().map_err(|error| failed(&path, &error))?;
        summed.file.finish().map_err(|error| cannot_write(&path, &error))
    }
}

fn begin(file: WholeFile, columns: &[Column], pairs: Vec<KeyValue>) -> Result<SerializedFileWriter<Summed>, ParquetError> {
    let fields = columns.iter().map(|column| column.schema().map(Arc::new)).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("recording").with_fields(fields).build()?;
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_statistics_enabled(EnabledStatistics::None)
        .set_offset_index_disabled(true)
        .set_created_by("ravenpose".to_owned())
        .set_key_value_metadata(Some(pairs));
    for column in columns {
        let path = ColumnPath::new(vec![column.name.clone()]);
        // Numbers rarely repeat: looking for those that do takes longer than writing them.
        properties = properties
            .set_column_dictionary_enabled(path.clone(), matches!(column.values, Values::Text(_)))
            .set_column_encoding(path, column.encoding());
    }
    let summed = Summed { file, sum: crc32fast::Hasher::new(), start: 0, end: 0 };
    let mut writer = SerializedFileWriter::new(summed, Arc::new(schema), Arc::new(properties.build()))?;
    writer.flush()?;
    writer.inner_mut().take();
    Ok(writer)
}

fn flush(
    writer: &mut SerializedFileWriter<Summed>,
    columns: &mut [Column],
    checksums: &mut Vec<String>,
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    let mut ones = Vec::new();
    for column in columns {
        // One writer per column of the schema, which was made of the same columns.
        let Some(mut chunk) = group.next_column()? else { break };
        column.write(&mut chunk, &mut ones)?;
        chunk.close()?;
    }
    group.close()?;
    writer.flush()?;
    checksums.push(writer.inner_mut().take());
    Ok(())
}

fn failed(path: &Path, error: &ParquetError) -> StreamError {
    refusal(path, None, format!("cannot be written ({})", one_line(error)), "check the folder, its permissions and the free space")
}

/// Text of the crate on one line.
pub(super) fn one_line(error: &ParquetError) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ").escape_debug().to_string()
}

/// A file that sums up what goes into it.
struct Summed {
    file: WholeFile,
    sum: crc32fast::Hasher,
    start: u64,
    end: u64,
}

impl Summed {
    /// Place, length and sum of what was written since the last time.
    fn take(&mut self) -> String {
        let sum = std::mem::replace(&mut self.sum, crc32fast::Hasher::new()).finalize();
        let (start, length) = (self.start, self.end - self.start);
        self.start = self.end;
        format!("{start}:{length}:{sum:08x}")
    }
}

impl Write for Summed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.write(bytes)?;
        self.sum.update(&bytes[..count]);
        self.end += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
