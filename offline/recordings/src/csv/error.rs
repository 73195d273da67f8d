//! Why a CSV file was refused: always one line with file, place, what is wrong, and what to do.

use std::fmt;

/// A refused file. Its text is `FILE: line N, column M \`NAME\`: what; remedy`.
#[derive(Debug, Clone, PartialEq)]
pub struct CsvError {
    /// The file as it was given.
    pub file: String,
    /// Line, counted from 1, comments and empty lines included.
    pub line: Option<u64>,
    /// Column, counted from 1, and its name in the file.
    pub column: Option<(usize, String)>,
    /// What is wrong; boxed, so that results stay small.
    pub problem: Box<CsvProblem>,
}

impl std::error::Error for CsvError {}

impl fmt::Display for CsvError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", shown(&self.file, usize::MAX))?;
        if let Some(line) = self.line {
            write!(f, "line {line}")?;
            if let Some((number, name)) = &self.column {
                write!(f, ", column {number} `{}`", shown(name, 40))?;
            }
            write!(f, ": ")?;
        }
        write!(f, "{}", self.problem)
    }
}

/// What is wrong with a CSV file, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CsvProblem {
    /// The file cannot be opened.
    #[error("cannot be opened ({why}); check the path and its permissions")]
    Open {
        /// What the system says.
        why: String,
    },
    /// Reading failed.
    #[error("cannot be read ({why}); check the disk or copy the file again")]
    Read {
        /// What the system says.
        why: String,
    },
    /// The gzip stream is damaged.
    #[error("the gzip stream is damaged or cut short ({why}); copy or compress the file again")]
    Gzip {
        /// What the decoder says.
        why: String,
    },
    /// The name ends in `.gz`, the content is not gzip.
    #[error("is named .gz but is not gzip; rename it to .csv or compress it")]
    NotGzip,
    /// Not UTF-8.
    #[error("is not UTF-8 text; save the file as UTF-8")]
    NotText,
    /// A line beyond the bound.
    #[error("the line is longer than {bytes} bytes; is this a CSV file?")]
    LineTooLong {
        /// The bound.
        bytes: u64,
    },
    /// A metadata key that stands twice.
    #[error("metadata key `{}` stands twice; remove one", shown(key, 40))]
    MetadataTwice {
        /// The key.
        key: String,
    },
    /// Neither header nor rows.
    #[error("is empty; write a header line and one row per sample")]
    Empty,
    /// The first line holds numbers.
    #[error("the first line holds numbers, not column names; put a header such as `t_s,jpos_1_rad` above it")]
    NoHeader,
    /// Another separator than the comma.
    #[error("the header is separated by {found}; separate the columns by commas")]
    Separator {
        /// Name of the separator.
        found: &'static str,
    },
    /// A column without a name.
    #[error("the column has no name; name it in the header")]
    NoName,
    /// Two columns of one meaning.
    #[error("means the same as column {first} (`{name}`); keep one of them")]
    Duplicate {
        /// Number of the other column.
        first: usize,
        /// Name that both have after conversion.
        name: String,
    },
    /// A known quantity in a unit that it cannot have.
    #[error("unit `{}` does not fit the quantity `{quantity}`; use {allowed}", shown(found, 20))]
    WrongUnit {
        /// The quantity.
        quantity: &'static str,
        /// The unit in the file.
        found: String,
        /// Units to use.
        allowed: &'static str,
    },
    /// A known quantity without a unit.
    #[error("the quantity `{quantity}` has no unit; end the name with {allowed}")]
    NoUnit {
        /// The quantity.
        quantity: &'static str,
        /// Units to use.
        allowed: &'static str,
    },
    /// A joint number outside 1 to 99.
    #[error("joint number {} is not in 1..99; joints count from 1", shown(found, 20))]
    JointNumber {
        /// The number in the file.
        found: String,
    },
    /// `t_s` is not the first column.
    #[error("the time is not the first column; move t_s to the front")]
    TimeNotFirst,
    /// A header without rows.
    #[error("has a header but no rows; record at least one sample")]
    NoRows,
    /// A comment below the header.
    #[error("a comment below the header; move `#` lines above it")]
    CommentInData,
    /// Another number of cells than the header has.
    #[error("has {found} cells where the header has {expected}; complete the row (decimal sign is the point)")]
    Ragged {
        /// Columns of the header.
        expected: usize,
        /// Cells of the row.
        found: usize,
    },
    /// An empty cell outside the columns of truth.
    #[error("the cell is empty, which only truth_ columns may be; fill it or remove the column")]
    EmptyCell,
    /// Not a number.
    #[error("`{}` is not a number; write it as 1.5 or 1.5e-3", shown(text, 40))]
    NotNumber {
        /// The cell.
        text: String,
    },
    /// NaN, infinite, or too large.
    #[error("`{}` is not a finite number; remove the row, or leave a truth_ cell empty", shown(text, 40))]
    NotFinite {
        /// The cell.
        text: String,
    },
    /// Time stands still or runs backward.
    #[error("time {now} s does not rise above {before} s; sort the rows and drop repeated times")]
    TimeNotRising {
        /// Time of the row before, s.
        before: f64,
        /// Time of this row, s.
        now: f64,
    },
}

/// Foreign text on one line: control characters escaped, cut after `most` characters.
fn shown(text: &str, most: usize) -> String {
    let mut out = String::new();
    for c in text.chars().take(most) {
        if c.is_control() { out.extend(c.escape_default()) } else { out.push(c) }
    }
    if text.chars().nth(most).is_some() {
        out.push_str("...");
    }
    out
}
