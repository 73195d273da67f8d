//! Which columns hold words, and what stands in columns of numbers that is none.

use super::cells::{self, Split};
use crate::file::Lines;
use crate::table::TableColumn;
use crate::text;

/// Text that is looked at to tell words from numbers, bytes.
const PROBE_BYTES: usize = 4 << 20;

/// A column is one of words if at least one in so many of its cells is no number; fewer are damage.
const WORDS_ONE_IN: u64 = 10;

/// Largest whole number up to which a double holds every whole number.
const EXACT_MAX: f64 = 9_007_199_254_740_992.0;

/// A number that a double holds as it is written, none for anything else. A long whole number (nanoseconds since 1970) that
/// would be changed is no number here, nor is one too large for a double (`1e999`); `inf` in letters is.
fn exact(cell: &str) -> Option<f64> {
    text::number(cell.as_bytes()).and_then(|value| unchanged(cell, value))
}

fn unchanged(cell: &str, value: f64) -> Option<f64> {
    if value.abs() >= EXACT_MAX
        && value.is_finite()
        && cell.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-' || byte == b'+')
    {
        let same = cell.parse::<i128>().is_ok_and(|whole| whole as f64 == value && value as i128 == whole);
        return same.then_some(value);
    }
    (value.is_finite() || !cell.bytes().any(|byte| byte.is_ascii_digit())).then_some(value)
}

/// Is nothing in a cell, or one of the usual marks for that?
fn is_missing(cell: &str) -> bool {
    matches!(cell, "" | "NA" | "N/A" | "n/a" | "null" | "NULL" | "None" | "-")
}

/// Reads on as far as the probe goes; true for each column of words.
pub(super) fn columns_of_words(lines: &mut Lines, columns: &[TableColumn]) -> Vec<bool> {
    let mut filled = vec![0_u64; columns.len()];
    let mut marked = vec![0_u64; columns.len()];
    let mut words = vec![0_u64; columns.len()];
    let mut bytes = 0;
    while bytes < PROBE_BYTES && lines.advance().unwrap_or(false) {
        if lines.line().first() == Some(&b'#') {
            continue;
        }
        if cells::complete_row(lines).is_err() {
            break;
        }
        let Ok(row) = cells::row_text(lines) else { break };
        bytes += row.len();
        let Ok(split) = Split::of(row, columns.len()) else { break };
        for (((cell, filled), words), marked) in split.zip(&mut filled).zip(&mut words).zip(&mut marked) {
            let missing = is_missing(&cell);
            *filled += u64::from(!missing);
            *words += u64::from(!missing && exact(&cell).is_none());
            *marked += u64::from(missing && !cell.is_empty());
        }
    }
    // Marks of what is missing are words where there is nothing else.
    let of_marks = |filled: u64, marked: u64| filled == 0 && marked > 0;
    let is_text = |((filled, words), marked): ((&u64, &u64), &u64)| {
        of_marks(*filled, *marked) || (*words > 0 && *words >= filled / WORDS_ONE_IN)
    };
    filled.iter().zip(&words).zip(&marked).map(is_text).collect()
}

/// Cells in columns of numbers that are none.
#[derive(Debug, Default)]
pub(super) struct Kinds {
    line: u64,
    bad: Vec<Option<BadCells>>,
}

#[derive(Debug)]
struct BadCells {
    count: u64,
    line: u64,
    text: String,
}

impl Kinds {
    pub(super) fn new(columns: usize) -> Self {
        Self { line: 0, bad: std::iter::repeat_with(|| None).take(columns).collect() }
    }

    /// The row that follows stands on this line.
    pub(super) fn row(&mut self, line: u64) {
        self.line = line;
    }

    /// The number in the cell that the text begins with, and where the cell ends, as [`Kinds::number`].
    pub(super) fn number_of_cell(&mut self, place: usize, text: &str) -> (f64, usize) {
        match text::number_of_cell(text.as_bytes(), |byte| byte == b',') {
            (Some(value), end) if value.abs() < EXACT_MAX => (value, end),
            (_, end) => (self.number(place, text[..end].trim()), end),
        }
    }

    /// The number in a cell; NaN for an empty one and for what is no number.
    pub(super) fn number(&mut self, place: usize, cell: &str) -> f64 {
        if is_missing(cell) {
            return f64::NAN;
        }
        if let Some(value) = exact(cell) {
            return value;
        }
        let (line, text) = (self.line, || cell.chars().take(24).collect());
        if let Some(bad) = self.bad.get_mut(place) {
            bad.get_or_insert_with(|| BadCells { count: 0, line, text: text() }).count += 1;
        }
        f64::NAN
    }

    /// How many cells were no numbers.
    pub(super) fn lost(&self) -> u64 {
        self.bad.iter().flatten().map(|bad| bad.count).sum()
    }

    /// One sentence for each column with such cells.
    pub(super) fn findings(&self, columns: &[TableColumn]) -> impl Iterator<Item = String> {
        self.bad.iter().zip(columns).filter_map(|(bad, column)| {
            let bad = bad.as_ref()?;
            Some(format!(
                "column `{}`: {} cells are no numbers that can be kept (first in line {}: `{}`), taken as missing",
                column.name.escape_debug(),
                bad.count,
                bad.line,
                bad.text.escape_debug()
            ))
        })
    }
}
