//! Any CSV as a table, in bounded memory: for `info` and `convert`, which have to say what is in a file rather than refuse it.
//!
//! Times may repeat or jump, the time may stand in any column, cells may be empty, columns may hold words. Where a row
//! cannot be understood the table ends, and [`Table::damage`](TableSource::damage) says where; what could be mended is told
//! by [`Table::findings`](TableSource::findings). A file without a header is still refused.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::cells::{self, Split};
use super::error::CsvProblem;
use super::kinds::{self, Kinds};
use crate::file::{Input, InputProblem, LineProblem, Lines, refusal};
use crate::stream::{Damage, Place, StreamError};
use crate::table::{Batch, ColumnCells, TableColumn, TableSource, rows_of_batch};

/// A CSV file being read as a table.
pub struct Table {
    lines: Lines,
    columns: Vec<TableColumn>,
    metadata: Vec<(String, String)>,
    findings: Vec<String>,
    damage: Option<Damage>,
    done: bool,
    comments: u64,
    kinds: Kinds,
}

impl Table {
    /// Opens a file, compressed or not. Its first 4 MiB of text are read twice: what they hold decides which columns are
    /// words.
    ///
    /// # Errors
    /// [`StreamError`] where the file cannot be opened or has no header of column names.
    pub fn open(path: &Path) -> Result<Self, StreamError> {
        Self::new(path, &mut || Input::open(path))
    }

    /// The same from memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Table::open`].
    pub fn from_bytes(name: &Path, bytes: &[u8]) -> Result<Self, StreamError> {
        Self::new(name, &mut || Input::from_bytes(bytes.to_vec()).map_err(InputProblem::Read))
    }

    fn new(path: &Path, open: &mut dyn FnMut() -> Result<Input, InputProblem>) -> Result<Self, StreamError> {
        let mut probe = Self::at_first_row(path, open)?;
        let is_text = kinds::columns_of_words(&mut probe.lines, &probe.columns);
        let mut table = Self::at_first_row(path, open)?;
        for (column, is_text) in table.columns.iter_mut().zip(is_text) {
            column.text = is_text;
        }
        table.kinds = Kinds::new(table.columns.len());
        Ok(table)
    }

    /// Reads metadata and header.
    fn at_first_row(path: &Path, open: &mut dyn FnMut() -> Result<Input, InputProblem>) -> Result<Self, StreamError> {
        let mut lines = Lines::new(open().map_err(|problem| problem.refusal(path))?);
        let mut head = Head { path: path.to_owned(), metadata: Vec::new() };
        let names = head.names(&mut lines)?;
        let (columns, findings) = distinct(names);
        Ok(Self { lines, columns, metadata: head.metadata, findings, damage: None, done: false, comments: 0, kinds: Kinds::new(0) })
    }

    /// Appends a row to the batch; false at the end or at the damage.
    fn row(&mut self, batch: &mut Batch) -> Result<bool, String> {
        loop {
            if !self.lines.advance().map_err(|problem| problem.what())? {
                return Ok(false);
            }
            if self.lines.line().first() != Some(&b'#') {
                break;
            }
            self.comments += 1;
        }
        cells::complete_row(&mut self.lines)?;
        let row = cells::row_text(&self.lines)?;
        let split = Split::of(row, self.columns.len())?;
        self.kinds.row(self.lines.number());
        if split.is_quoted() {
            for (place, (cell, to)) in split.zip(&mut batch.columns).enumerate() {
                match to {
                    ColumnCells::Numbers(values) => values.push(self.kinds.number(place, &cell)),
                    ColumnCells::Texts(texts) => texts.push(&cell),
                }
            }
        } else {
            plain_row(row, &mut self.kinds, batch);
        }
        Ok(true)
    }
}

/// Cells of a row without quotes, which has as many as there are columns.
fn plain_row(row: &str, kinds: &mut Kinds, batch: &mut Batch) {
    let mut rest = row;
    for (place, to) in batch.columns.iter_mut().enumerate() {
        let end = match to {
            ColumnCells::Numbers(values) => {
                let (value, end) = kinds.number_of_cell(place, rest);
                values.push(value);
                end
            }
            ColumnCells::Texts(texts) => {
                let end = rest.bytes().position(|byte| byte == b',').unwrap_or(rest.len());
                texts.push(rest[..end].trim());
                end
            }
        };
        rest = rest.get(end + 1..).unwrap_or("");
    }
}

impl TableSource for Table {
    fn format(&self) -> &'static str {
        "tidy CSV"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    fn columns(&self) -> &[TableColumn] {
        &self.columns
    }

    fn progress(&self) -> (u64, u64) {
        self.lines.progress()
    }

    fn next(&mut self, batch: &mut Batch) -> Result<bool, StreamError> {
        batch.clear();
        let rows = rows_of_batch(self.columns.len());
        while !self.done && batch.rows() < rows {
            match self.row(batch) {
                Ok(true) => {}
                Ok(false) => self.done = true,
                Err(what) => {
                    self.damage = Some(Damage { place: Place::Line(self.lines.number()), what });
                    self.done = true;
                }
            }
        }
        Ok(batch.rows() > 0)
    }

    fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    fn findings(&self) -> Vec<String> {
        let mut findings = self.findings.clone();
        findings.extend(self.kinds.findings(&self.columns));
        if self.comments > 0 {
            findings.push(format!("{} comment lines below the header were passed over", self.comments));
        }
        if self.done && self.damage.is_none() && !self.lines.ended() {
            findings.push("the last line has no line end: if the file was cut, its last cell may be too".to_owned());
        }
        findings
    }

    fn cells_lost(&self) -> u64 {
        self.kinds.lost()
    }
}

/// Pairs of metadata that are kept: more is no metadata.
const METADATA_MAX: usize = 10_000;

/// What stands above the rows.
struct Head {
    path: PathBuf,
    metadata: Vec<(String, String)>,
}

impl Head {
    /// Reads metadata lines up to the header; returns its names.
    fn names(&mut self, lines: &mut Lines) -> Result<Vec<String>, StreamError> {
        loop {
            match lines.advance() {
                Ok(true) => {}
                Ok(false) => return Err(self.problem(None, &CsvProblem::Empty)),
                Err(LineProblem::TooLong) => {
                    let bytes = crate::file::LINE_BYTES_MAX as u64;
                    return Err(self.problem(Some(lines.number()), &CsvProblem::LineTooLong { bytes }));
                }
                Err(LineProblem::Gzip(error)) => {
                    return Err(self.problem(Some(lines.number()), &CsvProblem::Gzip { why: error.to_string() }));
                }
                Err(LineProblem::Read(error)) => {
                    return Err(self.problem(Some(lines.number()), &CsvProblem::Read { why: error.to_string() }));
                }
            }
            let Some(comment) = lines.line().strip_prefix(b"#") else { break };
            let comment = String::from_utf8_lossy(comment);
            if let Some((key, value)) = comment.split_once('=').map(|(key, value)| (key.trim(), value.trim()))
                && !key.is_empty()
                && self.metadata.len() < METADATA_MAX
            {
                self.metadata.push((key.to_owned(), value.to_owned()));
            }
        }
        let number = lines.number();
        let names = cells::complete_row(lines).and_then(|()| cells::row_text(lines));
        let names = names
            .map_err(|what| refusal(&self.path, Some(Place::Line(number)), what, "is this a CSV file? save it as UTF-8 text"))?;
        let names: Vec<String> = Split::all(names).map(Cow::into_owned).collect();
        let names_as_text: Vec<&str> = names.iter().map(String::as_str).collect();
        super::check_names(&names_as_text).map_err(|problem| self.problem(Some(lines.number()), &problem))?;
        Ok(names)
    }

    fn problem(&self, line: Option<u64>, problem: &CsvProblem) -> StreamError {
        let text = problem.to_string();
        let (what, remedy) = text.split_once("; ").unwrap_or((&text, "write a CSV file with a header"));
        refusal(&self.path, line.map(Place::Line), what, remedy)
    }
}

/// Mended names that are told one by one.
const MENDED_TOLD: usize = 20;

/// Columns with a name each that no other has, and what had to be done for it.
fn distinct(names: Vec<String>) -> (Vec<TableColumn>, Vec<String>) {
    let mut taken: HashSet<String> = names.iter().cloned().collect();
    let mut seen = HashSet::new();
    let mut copies: HashMap<String, u64> = HashMap::new();
    let (mut findings, mut mended) = (Vec::new(), 0);
    let mut columns = Vec::with_capacity(names.len());
    for (place, name) in names.into_iter().enumerate() {
        let wanted = if name.is_empty() { format!("column_{}", place + 1) } else { name.clone() };
        let mut unique = wanted.clone();
        while seen.contains(&unique) || (unique != name && taken.contains(&unique)) {
            let copy = copies.entry(wanted.clone()).or_insert(1);
            *copy += 1;
            unique = format!("{wanted}_copy{copy}");
        }
        if unique != name {
            mended += 1;
            if mended <= MENDED_TOLD {
                findings.push(format!("column {} `{}` was named `{}`", place + 1, name.escape_debug(), unique.escape_debug()));
            }
            taken.insert(unique.clone());
        }
        seen.insert(unique.clone());
        columns.push(TableColumn::number(unique));
    }
    if mended > MENDED_TOLD {
        findings.push(format!("{} more columns were named anew", mended - MENDED_TOLD));
    }
    (columns, findings)
}
