//! Writing tidy CSV.

use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;

use super::cells::push_text;
use crate::file::{WholeFile, cannot_write};
use crate::stream::StreamError;
use crate::table::{Batch, ColumnCells, TableColumn, TableSink};
use crate::text;

/// Level of gzip: the fastest, since numbers gain little from more.
const LEVEL: u32 = 1;

/// A tidy CSV file being written, compressed if its name ends in `.gz`. Numbers come back bit for bit; a missing cell (NaN)
/// is empty.
pub struct Writer {
    path: PathBuf,
    out: Out,
    rows: Vec<u8>,
}

enum Out {
    Plain(WholeFile),
    Gzip(Box<GzEncoder<WholeFile>>),
}

impl Writer {
    /// Begins a file with its metadata and header.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path, columns: &[TableColumn], metadata: &[(String, String)]) -> Result<Self, StreamError> {
        let file = WholeFile::create(path).map_err(|error| cannot_write(path, &error))?;
        let compressed = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
        let out = if compressed { Out::Gzip(Box::new(GzEncoder::new(file, Compression::new(LEVEL)))) } else { Out::Plain(file) };
        let mut writer = Self { path: path.to_owned(), out, rows: Vec::new() };
        push_head(&mut writer.rows, columns, metadata);
        writer.flush_rows()?;
        Ok(writer)
    }

    fn flush_rows(&mut self) -> Result<(), StreamError> {
        let written = match &mut self.out {
            Out::Plain(file) => file.write_all(&self.rows),
            Out::Gzip(encoder) => encoder.write_all(&self.rows),
        };
        self.rows.clear();
        written.map_err(|error| cannot_write(&self.path, &error))
    }
}

impl TableSink for Writer {
    fn write(&mut self, batch: &Batch) -> Result<(), StreamError> {
        push_rows(&mut self.rows, batch);
        self.flush_rows()
    }

    fn finish(self: Box<Self>) -> Result<(), StreamError> {
        let Self { path, out, .. } = *self;
        let file = match out {
            Out::Plain(file) => Ok(file),
            Out::Gzip(encoder) => encoder.finish(),
        };
        file.and_then(WholeFile::finish).map_err(|error| cannot_write(&path, &error))
    }
}

/// Metadata, one line each, and the header.
fn push_head(out: &mut Vec<u8>, columns: &[TableColumn], metadata: &[(String, String)]) {
    for (key, value) in metadata {
        // A key ends at the first `=` and a value at the end of its line.
        let (key, value) = (key.replace('=', ":"), value.replace(['\n', '\r'], " "));
        out.extend_from_slice(format!("# {} = {}\n", key.replace(['\n', '\r'], " ").trim(), value.trim()).as_bytes());
    }
    for (place, column) in columns.iter().enumerate() {
        if place > 0 {
            out.push(b',');
        }
        push_text(out, &column.name);
    }
    out.push(b'\n');
}

/// Cells of one column, as they come row by row.
enum Column<'a> {
    Numbers(&'a [f64]),
    Texts(Vec<&'a str>),
}

fn push_rows(out: &mut Vec<u8>, batch: &Batch) {
    let columns: Vec<Column<'_>> = batch
        .columns
        .iter()
        .map(|cells| match cells {
            ColumnCells::Numbers(values) => Column::Numbers(values),
            ColumnCells::Texts(texts) => Column::Texts(texts.iter().collect()),
        })
        .collect();
    for row in 0..batch.rows() {
        let start = out.len();
        for (place, column) in columns.iter().enumerate() {
            if place > 0 {
                out.push(b',');
            }
            match column {
                Column::Numbers(values) if values[row].is_nan() => {}
                Column::Numbers(values) => text::shortest(out, values[row]),
                Column::Texts(words) => push_text(out, words[row]),
            }
        }
        // A row of one empty cell would be a blank line, which readers pass over.
        if out.len() == start {
            out.extend_from_slice(b"\"\"");
        }
        out.push(b'\n');
    }
}
