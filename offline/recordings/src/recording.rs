//! A recording in memory: named columns of equal length.

use std::collections::BTreeMap;

/// One column; a known quantity is in SI units, an unknown one as it stood in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// `QUANTITY[_INDEX]_UNIT` with the SI unit for a known quantity, as `jpos_1_rad`; otherwise the file's own name.
    pub name: String,
    /// Is the quantity one of the table of tidy CSV?
    pub known: bool,
    /// One value per row; NaN where a column of truth has an empty cell, finite otherwise.
    pub values: Vec<f64>,
}

/// A recording: metadata and columns. With a time it is a run, without it a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Where it came from, for messages.
    pub name: String,
    /// `# key = value` lines.
    pub metadata: BTreeMap<String, String>,
    /// Columns in the file's order; `t_s` is the first of a run.
    pub columns: Vec<Column>,
}

impl Recording {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Values of a column.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice())
    }

    /// Time of every row, s, strictly rising; none for a table.
    pub fn time_s(&self) -> Option<&[f64]> {
        self.column("t_s")
    }

    /// Names of the columns whose quantity the table of tidy CSV does not have; their values are as in the file.
    pub fn unknown(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().filter(|column| !column.known).map(|column| column.name.as_str())
    }
}
