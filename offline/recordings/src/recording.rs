//! A recording in memory: named columns of equal length.

use std::collections::BTreeMap;

use crate::csv;

/// One column; a known quantity is in SI units, an unknown one as it stood in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// `QUANTITY[_INDEX]_UNIT` with the SI unit for a known quantity, as `jpos_1_rad`; otherwise the file's own name.
    pub name: String,
    /// Is the quantity one of the table of tidy CSV?
    pub known: bool,
    /// One value per row; NaN where a cell is empty, finite otherwise.
    pub values: Vec<f64>,
    /// Name in the file that it came from, with the unit that the file has.
    pub original: String,
}

impl Column {
    /// A column under its own name, in the unit that the name says; known if the quantity is one of tidy CSV in its SI unit.
    pub fn new(name: impl Into<String>, values: Vec<f64>) -> Self {
        let name = name.into();
        Self { known: csv::is_si_name(&name), original: name.clone(), name, values }
    }

    /// Unit at the end of the name (`rad`, `m_s`, `counts`, ...), none for a name without a unit that tidy CSV knows.
    pub fn unit(&self) -> Option<&'static str> {
        csv::unit_of_name(&self.name)
    }
}

/// A column of words, such as the `status` of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextColumn {
    /// The file's name for it.
    pub name: String,
    /// Its place among all columns of the file, counted from 0.
    pub place: usize,
    /// One per row; empty where the cell is.
    pub values: Vec<String>,
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
    /// Columns that hold words.
    pub texts: Vec<TextColumn>,
}

impl Recording {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        let numbers = self.columns.first().map(|column| column.values.len());
        numbers.or_else(|| self.texts.first().map(|column| column.values.len())).unwrap_or(0)
    }

    /// Values of a column.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice())
    }

    /// Words of a column.
    pub fn text(&self, name: &str) -> Option<&[String]> {
        self.texts.iter().find(|column| column.name == name).map(|column| column.values.as_slice())
    }

    /// Time of every row, s; none for a table. Strictly rising in what [`csv::read`] returns.
    pub fn time_s(&self) -> Option<&[f64]> {
        self.column("t_s")
    }

    /// Names of the columns whose quantity the table of tidy CSV does not have; their values are as in the file.
    pub fn unknown(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().filter(|column| !column.known).map(|column| column.name.as_str())
    }
}
