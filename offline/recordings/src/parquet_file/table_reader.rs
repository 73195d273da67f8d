//! Reading tables, ours and other programs'.

use std::path::Path;

use super::read::{CellValues, Cells, Groups};
use super::store::Store;
use crate::stream::{Damage, StreamError};
use crate::table::{Batch, ColumnCells, TableColumn, TableSource, rows_of_batch};

/// Largest whole number up to which a double holds every whole number.
const EXACT_MAX: u64 = 1 << 53;

/// A Parquet file of numbers and words being read as a table.
pub struct TableReader {
    groups: Groups,
    columns: Vec<TableColumn>,
}

impl TableReader {
    /// Opens a file.
    ///
    /// # Errors
    /// [`StreamError`] if it cannot be opened, is damaged beyond reading, or holds lists, groups or types that are neither
    /// numbers nor words.
    pub fn open(path: &Path) -> Result<Self, StreamError> {
        Self::new(path, Store::open(path)?)
    }

    /// The same from memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`TableReader::open`].
    pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<Self, StreamError> {
        Self::new(name, Store::memory(bytes))
    }

    fn new(path: &Path, store: Store) -> Result<Self, StreamError> {
        let groups = Groups::open(path, store)?;
        let columns = groups
            .names
            .iter()
            .zip(&groups.cells)
            .map(|(name, cells)| TableColumn { name: name.clone(), text: matches!(cells.values, CellValues::Text(_)) });
        Ok(Self { columns: columns.collect(), groups })
    }
}

impl TableSource for TableReader {
    fn format(&self) -> &'static str {
        "Parquet of a table"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.groups.metadata
    }

    fn columns(&self) -> &[TableColumn] {
        &self.columns
    }

    fn progress(&self) -> (u64, u64) {
        self.groups.progress()
    }

    fn next(&mut self, batch: &mut Batch) -> Result<bool, StreamError> {
        batch.clear();
        let rows = self.groups.next(rows_of_batch(self.columns.len()));
        if rows == 0 {
            return Ok(false);
        }
        let filled = batch.columns.iter_mut().zip(&self.groups.cells).zip(&self.columns);
        let problem = filled.map(|((to, from), column)| put(to, from, rows, column)).find_map(Result::err);
        if let Some(what) = problem {
            self.groups.spoil(what);
            batch.clear();
        }
        Ok(batch.rows() > 0)
    }

    fn damage(&self) -> Option<&Damage> {
        self.groups.damage()
    }
}

/// Cells of one column; an error for what a table cannot keep as it is.
fn put(to: &mut ColumnCells, from: &Cells, rows: usize, column: &TableColumn) -> Result<(), String> {
    match to {
        ColumnCells::Numbers(to) => {
            to.resize(rows, f64::NAN);
            match &from.values {
                CellValues::Bool(values) => scatter(to, from, rows, values.iter().map(|value| f64::from(u8::from(*value)))),
                CellValues::I32(values) if from.unsigned => {
                    scatter(to, from, rows, values.iter().map(|value| f64::from(*value as u32)));
                }
                CellValues::I32(values) => scatter(to, from, rows, values.iter().map(|value| f64::from(*value))),
                CellValues::I64(values)
                    if values.iter().any(|value| if from.unsigned { *value as u64 } else { value.unsigned_abs() } > EXACT_MAX) =>
                {
                    return Err(format!(
                        "column `{}` holds whole numbers beyond 2^53, which a table cannot keep exactly",
                        column.name.escape_debug()
                    ));
                }
                CellValues::I64(values) => scatter(to, from, rows, values.iter().map(|value| *value as f64)),
                CellValues::F32(values) => scatter(to, from, rows, values.iter().map(|value| f64::from(*value))),
                CellValues::F64(values) => scatter(to, from, rows, values.iter().copied()),
                CellValues::Text(_) => {}
            }
        }
        ColumnCells::Texts(to) => {
            let CellValues::Text(values) = &from.values else { return Ok(()) };
            let mut values = values.iter();
            for present in from.present(rows) {
                let text = match present.then(|| values.next()).flatten() {
                    Some(value) => std::str::from_utf8(value.data())
                        .map_err(|_| format!("column `{}` is not UTF-8 text", column.name.escape_debug()))?,
                    None => "",
                };
                to.push(text);
            }
        }
    }
    Ok(())
}

fn scatter(to: &mut [f64], from: &Cells, rows: usize, values: impl Iterator<Item = f64>) {
    for (row, value) in from.rows_with_value(rows).zip(values) {
        to[row] = value;
    }
}
