//! Tables as a stream: rows in batches, columns under the names and in the units of their file. What is not a full state
//! passes through here from file to file without loss and in bounded memory; [`collect`] makes a [`Recording`] in SI of it.

use std::collections::BTreeMap;

use crate::csv;
use crate::stream::{Channel, Damage, StreamError};
use crate::{Column, Recording, TextColumn};

/// Rows of a full batch of a table of usual width.
pub const BATCH_ROWS: usize = 1024;

/// Cells of a batch at most, but for one row.
const BATCH_CELLS: usize = 1 << 20;

/// Rows of a full batch: fewer for a very wide table, so that memory stays bounded whatever the file says.
pub fn rows_of_batch(columns: usize) -> usize {
    (BATCH_CELLS / columns.max(1)).clamp(1, BATCH_ROWS)
}

/// A column's name and kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableColumn {
    /// Name as in the file, unit included.
    pub name: String,
    /// Words instead of numbers?
    pub text: bool,
}

impl TableColumn {
    /// A column of numbers.
    pub fn number(name: impl Into<String>) -> Self {
        Self { name: name.into(), text: false }
    }

    /// Unit at the end of the name, as tidy CSV spells it in lower case; none where the name ends in no unit.
    pub fn unit(&self) -> Option<&'static str> {
        if self.text { None } else { csv::unit_of_name(&self.name) }
    }
}

/// Where the time stands: the column `t_s`, in any case, wherever it is.
pub fn time_column(columns: &[TableColumn]) -> Option<usize> {
    columns.iter().position(|column| !column.text && column.name.eq_ignore_ascii_case("t_s"))
}

/// Words of a column, kept end to end.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Texts {
    bytes: String,
    ends: Vec<usize>,
}

impl Texts {
    /// Appends a word; an empty one is a missing cell.
    pub fn push(&mut self, text: &str) {
        self.bytes.push_str(text);
        self.ends.push(self.bytes.len());
    }

    /// Number of words.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Is there none?
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The words.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| &self.bytes[start..*end])
    }

    /// Drops all words.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.ends.clear();
    }
}

/// Cells of one column in a batch.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnCells {
    /// Numbers; NaN where the cell is missing.
    Numbers(Vec<f64>),
    /// Words; empty where the cell is missing.
    Texts(Texts),
}

impl ColumnCells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Texts(texts) => texts.len(),
        }
    }

    /// Is there none?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn clear(&mut self) {
        match self {
            Self::Numbers(values) => values.clear(),
            Self::Texts(texts) => texts.clear(),
        }
    }
}

/// Some rows of a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Batch {
    /// One per column, all of the same length.
    pub columns: Vec<ColumnCells>,
}

impl Batch {
    /// An empty batch for these columns.
    pub fn new(columns: &[TableColumn]) -> Self {
        let cells = |column: &TableColumn| {
            if column.text { ColumnCells::Texts(Texts::default()) } else { ColumnCells::Numbers(Vec::new()) }
        };
        Self { columns: columns.iter().map(cells).collect() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, ColumnCells::len)
    }

    /// Drops all rows, keeps the memory.
    pub fn clear(&mut self) {
        self.columns.iter_mut().for_each(ColumnCells::clear);
    }
}

/// A table being read.
pub trait TableSource {
    /// Name of the format, for people.
    fn format(&self) -> &'static str;

    /// `key = value` pairs that the file carries.
    fn metadata(&self) -> &[(String, String)];

    /// The columns, in the order of the file.
    fn columns(&self) -> &[TableColumn];

    /// How much of the file has been read: bytes so far, bytes in all.
    fn progress(&self) -> (u64, u64);

    /// Replaces the rows of `batch`, which was made for these columns, by the next ones; false at the end. A damaged file
    /// yields everything before the damage, then ends.
    ///
    /// # Errors
    /// [`StreamError`] where the file cannot be read at all.
    fn next(&mut self, batch: &mut Batch) -> Result<bool, StreamError>;

    /// After the end: where and how the file is damaged or cut off, none for a whole one.
    fn damage(&self) -> Option<&Damage>;

    /// After the end: what else a reader should know, one sentence each.
    fn findings(&self) -> Vec<String> {
        Vec::new()
    }

    /// After the end: cells whose content could not be kept and that are taken as missing; a finding tells which.
    fn cells_lost(&self) -> u64 {
        0
    }

    /// After the end: the channels of the recording that the table is made from. Empty where it is a table itself.
    fn channels(&self) -> Vec<Channel> {
        Vec::new()
    }
}

/// A table being written. It stands under its final name only after [`TableSink::finish`].
pub trait TableSink {
    /// Appends rows of the columns that the sink was made for.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    fn write(&mut self, batch: &Batch) -> Result<(), StreamError>;

    /// Completes the file.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    fn finish(self: Box<Self>) -> Result<(), StreamError>;
}

/// Passes every row of a table on; `progress` hears bytes so far and in all after each batch. Returns the number of rows.
///
/// # Errors
/// [`StreamError`] of either side.
pub fn copy(
    source: &mut dyn TableSource,
    sink: &mut dyn TableSink,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<u64, StreamError> {
    let mut batch = Batch::new(source.columns());
    let mut rows = 0;
    while source.next(&mut batch)? {
        sink.write(&batch)?;
        rows += batch.rows() as u64;
        let (done, total) = source.progress();
        progress(done, total);
    }
    Ok(rows)
}

/// The whole table in memory, known quantities in SI under their tidy names, `t_s` first. Damage and findings stay with the
/// source.
///
/// # Errors
/// [`StreamError`] where the file cannot be read at all.
pub fn collect(name: &str, source: &mut dyn TableSource) -> Result<Recording, StreamError> {
    let mut cells = Batch::new(source.columns()).columns;
    let mut batch = Batch::new(source.columns());
    while source.next(&mut batch)? {
        cells.iter_mut().zip(&batch.columns).for_each(|(to, from)| append(to, from));
    }
    let metadata: BTreeMap<String, String> = source.metadata().iter().cloned().collect();
    let mut recording = Recording { name: name.to_owned(), metadata, ..Recording::default() };
    let names: Vec<&str> = source.columns().iter().map(|column| column.name.as_str()).collect();
    let fields = csv::loose_fields(&names);
    for (place, ((cells, column), field)) in cells.into_iter().zip(source.columns()).zip(fields).enumerate() {
        match cells {
            ColumnCells::Numbers(mut values) => {
                for value in &mut values {
                    *value = (field.to_si)(*value);
                }
                recording.columns.push(Column { name: field.name, known: field.known, values, original: column.name.clone() });
            }
            ColumnCells::Texts(texts) => {
                let values = texts.iter().map(str::to_owned).collect();
                recording.texts.push(TextColumn { name: column.name.clone(), place, values });
            }
        }
    }
    if let Some(time) = recording.columns.iter().position(|column| column.name == "t_s") {
        recording.columns[..=time].rotate_right(1);
    }
    Ok(recording)
}

fn append(to: &mut ColumnCells, from: &ColumnCells) {
    match (to, from) {
        (ColumnCells::Numbers(to), ColumnCells::Numbers(from)) => to.extend_from_slice(from),
        (ColumnCells::Texts(to), ColumnCells::Texts(from)) => from.iter().for_each(|text| to.push(text)),
        // Both were made for the same columns.
        _ => debug_assert!(false, "cells of another kind"),
    }
}

/// A recording in memory as a table, in SI.
pub struct RecordingTable<'a> {
    recording: &'a Recording,
    columns: Vec<TableColumn>,
    metadata: Vec<(String, String)>,
    given: usize,
}

impl<'a> RecordingTable<'a> {
    /// The columns under their SI names; columns of words at their old places.
    pub fn new(recording: &'a Recording) -> Self {
        let metadata = recording.metadata.iter().map(|(key, value)| (key.clone(), value.clone())).collect();
        let mut columns: Vec<TableColumn> =
            recording.columns.iter().map(|column| TableColumn::number(column.name.clone())).collect();
        for text in &recording.texts {
            columns.insert(text.place.min(columns.len()), TableColumn { name: text.name.clone(), text: true });
        }
        Self { recording, columns, metadata, given: 0 }
    }
}

impl TableSource for RecordingTable<'_> {
    fn format(&self) -> &'static str {
        "recording in memory"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    fn columns(&self) -> &[TableColumn] {
        &self.columns
    }

    fn progress(&self) -> (u64, u64) {
        (self.given as u64, self.recording.rows() as u64)
    }

    fn next(&mut self, batch: &mut Batch) -> Result<bool, StreamError> {
        batch.clear();
        let end = (self.given + BATCH_ROWS).min(self.recording.rows());
        let (mut numbers, mut texts) = (self.recording.columns.iter(), self.recording.texts.iter());
        for cells in &mut batch.columns {
            match cells {
                ColumnCells::Numbers(values) => {
                    values.extend(numbers.next().iter().flat_map(|column| &column.values[self.given..end]));
                }
                ColumnCells::Texts(words) => {
                    texts.next().iter().flat_map(|column| &column.values[self.given..end]).for_each(|text| words.push(text));
                }
            }
        }
        self.given = end;
        Ok(batch.rows() > 0)
    }

    fn damage(&self) -> Option<&Damage> {
        None
    }
}
