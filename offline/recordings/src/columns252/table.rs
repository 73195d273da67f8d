//! Every column of a row, as a table.

use std::path::Path;

use super::read::row_of;
use super::{COLUMNS, COLUMNS_WITH_FORCE};
use crate::columns::{Bad, Cells, Rows, Timeline};
use crate::fields::COLUMNS_252;
use crate::file::{Input, InputProblem};
use crate::stream::{Damage, StreamError};
use crate::table::{BATCH_ROWS, Batch, ColumnCells, TableColumn, TableSource};
use crate::text;

/// A 252- or 256-column CSV as a table: `t_s` since the first state, the external encoders (`ext_`), CRTK's joints
/// (`crtk_`), all of the message as published, the force sensor (`force_`, in the unit of the sensor). `start_unix_ns` in the
/// metadata tells when the first state was, to the nanosecond.
pub struct Table {
    rows: Rows,
    columns: Vec<TableColumn>,
    metadata: Vec<(String, String)>,
    first: Option<Vec<f64>>,
    start_ns: Option<i64>,
}

impl Table {
    /// Opens a file, compressed or not, and reads its first row.
    ///
    /// # Errors
    /// [`StreamError`] if it cannot be opened, is empty, or its first row is not one of this layout.
    pub fn open(path: &Path) -> Result<Self, StreamError> {
        Self::new(path, Input::open(path).map_err(|problem| problem.refusal(path))?)
    }

    /// The same from memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Table::open`].
    pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<Self, StreamError> {
        Self::new(name, Input::from_bytes(bytes).map_err(|error| InputProblem::Read(error).refusal(name))?)
    }

    fn new(path: &Path, input: Input) -> Result<Self, StreamError> {
        let mut table =
            Self { rows: Rows::new(path, input), columns: Vec::new(), metadata: Vec::new(), first: None, start_ns: None };
        let mut count = COLUMNS;
        let Self { rows, start_ns, .. } = &mut table;
        table.first = rows.next(|line| {
            count = Cells::count_of(line);
            // What is not a row of this layout is refused as the stream of states refuses it.
            row_of(line, &mut Timeline::default())?;
            numbers(line, count, start_ns)
        })?;
        table.columns = names(count).into_iter().map(TableColumn::number).collect();
        table.metadata.push(("start_unix_ns".to_owned(), table.start_ns.unwrap_or(0).to_string()));
        Ok(table)
    }
}

impl TableSource for Table {
    fn format(&self) -> &'static str {
        "252-column CSV"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    fn columns(&self) -> &[TableColumn] {
        &self.columns
    }

    fn progress(&self) -> (u64, u64) {
        self.rows.progress()
    }

    fn next(&mut self, batch: &mut Batch) -> Result<bool, StreamError> {
        batch.clear();
        while batch.rows() < BATCH_ROWS {
            let count = self.columns.len() - 1;
            let row = if let Some(first) = self.first.take() {
                Some(first)
            } else {
                let Self { rows, start_ns, .. } = self;
                rows.next(|line| numbers(line, count, start_ns))?
            };
            let Some(row) = row else { break };
            for (cells, value) in batch.columns.iter_mut().zip(row) {
                if let ColumnCells::Numbers(values) = cells {
                    values.push(value);
                }
            }
        }
        Ok(batch.rows() > 0)
    }

    fn damage(&self) -> Option<&Damage> {
        self.rows.damage()
    }
}

/// Names of the table's columns for a row of so many.
fn names(count: usize) -> Vec<String> {
    let joint = |prefix: &str, joint: usize| format!("{prefix}_jpos_{joint}_{}", if joint == 3 { "m" } else { "rad" });
    let mut names = vec!["t_s".to_owned(), "ext_t_s".to_owned()];
    names.extend((1..=3).map(|number| joint("ext", number)));
    names.push("crtk_unix_s".to_owned());
    names.extend((1..=7).map(|number| joint("crtk", number)));
    names.push("unix_s".to_owned());
    names.extend(COLUMNS_252.iter().flat_map(|field| (0..field.count()).map(|place| field.column_name(place))));
    if count == COLUMNS_WITH_FORCE {
        names.extend(["force_unix_s", "force_x", "force_y", "force_z"].map(str::to_owned));
    }
    names
}

/// The numbers of a row, after the time since the first state.
fn numbers(line: &[u8], count: usize, start_ns: &mut Option<i64>) -> Result<Vec<f64>, Bad> {
    let mut row = Vec::with_capacity(count + 1);
    row.push(f64::NAN);
    let mut stamp_ns = None;
    for (column, cell) in Cells::new(line).enumerate() {
        let value = text::number(cell).ok_or_else(|| Bad::column(column, "is not a number"))?;
        if column == 12 {
            stamp_ns = text::decimal_nanoseconds(cell);
        }
        row.push(value);
    }
    if row.len() != count + 1 {
        return Err(Bad { what: format!("has {} columns, the rows before {count}", row.len() - 1), remedy: "copy the file again" });
    }
    let stamp_ns = stamp_ns.ok_or_else(|| Bad::column(12, "is no time"))?;
    let start_ns = *start_ns.get_or_insert(stamp_ns);
    row[0] = stamp_ns.saturating_sub(start_ns) as f64 / 1e9;
    Ok(row)
}
