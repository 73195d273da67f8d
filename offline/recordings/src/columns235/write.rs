//! Writing.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::columns;
use crate::fields::COLUMNS_235;
use crate::file::{WholeFile, cannot_write};
use crate::stream::{Record, Sink, StreamError};
use crate::text;

/// A 235-column text being written. Truth is not in the format and passed over: see [`super::LOSSES`].
pub struct Writer {
    path: PathBuf,
    file: WholeFile,
    row: Vec<u8>,
}

impl Writer {
    /// Begins a file.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path) -> Result<Self, StreamError> {
        let file = WholeFile::create(path).map_err(|error| cannot_write(path, &error))?;
        Ok(Self { path: path.to_owned(), file, row: Vec::new() })
    }
}

impl Sink for Writer {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        let Record::State(state) = record else {
            return Ok(());
        };
        self.row.clear();
        text::microseconds_as_seconds(&mut self.row, record.time_ns());
        columns::splice(&COLUMNS_235, state, &mut self.row, b' ', whole, text::fixed6);
        self.row.extend_from_slice(b" \n");
        self.file.write_all(&self.row).map_err(|error| cannot_write(&self.path, &error))
    }

    fn finish(self: Box<Self>) -> Result<(), StreamError> {
        let Self { path, file, .. } = *self;
        file.finish().map_err(|error| cannot_write(&path, &error))
    }
}

/// Whole numbers are printed as floats too.
fn whole(out: &mut Vec<u8>, value: i32) {
    text::integer(out, i64::from(value));
    out.extend_from_slice(b".000000");
}
