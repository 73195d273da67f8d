//! Rows of numbers, one state each.

use std::path::{Path, PathBuf};

use ravenpose_wire::RavenState;

use crate::fields::{Field, Values, ValuesMut};
use crate::file::{Input, LineProblem, Lines, refusal};
use crate::stream::{Damage, Place, StreamError};
use crate::text;

/// What is wrong with a row, and what to do if it is the first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bad {
    pub(crate) what: String,
    pub(crate) remedy: &'static str,
}

impl Bad {
    /// Something wrong with a column, counted from 0 as ravenstate.md does.
    pub(crate) fn column(column: usize, what: impl std::fmt::Display) -> Self {
        Self { what: format!("column {column} (from 0) {what}"), remedy: "copy or export the file again" }
    }
}

/// The rows of a file, up to the end or the damage.
pub(crate) struct Rows {
    path: PathBuf,
    lines: Lines,
    count: u64,
    damage: Option<Damage>,
    done: bool,
}

impl Rows {
    pub(crate) fn new(path: &Path, input: Input) -> Self {
        Self { path: path.to_owned(), lines: Lines::new(input), count: 0, damage: None, done: false }
    }

    pub(crate) fn progress(&self) -> (u64, u64) {
        self.lines.progress()
    }

    pub(crate) fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    /// The next row as `parse` understands it; none at the end or at the damage. A first row that cannot be understood is
    /// a refusal: then the file is something else.
    pub(crate) fn next<T>(&mut self, parse: impl FnOnce(&[u8]) -> Result<T, Bad>) -> Result<Option<T>, StreamError> {
        if self.done {
            return Ok(None);
        }
        let bad = match self.lines.advance() {
            Ok(true) if self.lines.ended() => match parse(self.lines.line()) {
                Ok(row) => {
                    self.count += 1;
                    return Ok(Some(row));
                }
                Err(bad) => bad,
            },
            Ok(true) => Bad { what: "the line has no end, so it may be cut".to_owned(), remedy: "copy the file again" },
            Ok(false) if self.count == 0 => {
                return Err(refusal(&self.path, None, "is empty", "record at least one state"));
            }
            Ok(false) => {
                self.done = true;
                return Ok(None);
            }
            Err(LineProblem::Read(error)) => {
                let what = format!("cannot be read on ({error})");
                return Err(refusal(&self.path, Some(Place::Line(self.lines.number())), what, "check the disk"));
            }
            Err(problem) => Bad { what: problem.what(), remedy: "copy or compress the file again" },
        };
        self.done = true;
        let place = Place::Line(self.lines.number());
        if self.count == 0 {
            return Err(refusal(&self.path, Some(place), bad.what, bad.remedy));
        }
        self.damage = Some(Damage { place, what: bad.what });
        Ok(None)
    }
}

/// The cells of a row: separated by commas, or by blanks where there is no comma.
pub(crate) struct Cells<'a> {
    rest: Option<&'a [u8]>,
    commas: bool,
    /// Cells taken so far.
    taken: usize,
}

impl<'a> Cells<'a> {
    pub(crate) fn new(line: &'a [u8]) -> Self {
        let commas = line.contains(&b',');
        Self { rest: Some(if commas { line } else { line.trim_ascii() }), commas, taken: 0 }
    }

    /// How many cells a line has.
    pub(crate) fn count_of(line: &[u8]) -> usize {
        Cells::new(line).count()
    }

    /// A number, or the column that is not one.
    pub(crate) fn number(&mut self) -> Result<f64, Bad> {
        let rest = self.rest.unwrap_or_default();
        self.taken(if self.commas { text::number_of_cell(rest, is_comma) } else { text::number_of_cell(rest, is_blank) })
    }

    /// A number, rounded once to a single.
    fn single(&mut self) -> Result<f32, Bad> {
        let rest = self.rest.unwrap_or_default();
        self.taken(if self.commas { text::single_of_cell(rest, is_comma) } else { text::single_of_cell(rest, is_blank) })
    }

    /// Goes on behind a number.
    fn taken<T>(&mut self, (number, end): (Option<T>, usize)) -> Result<T, Bad> {
        let Some(rest) = self.rest else {
            return Err(Bad::column(self.taken, "is missing"));
        };
        let Some(number) = number else {
            return Err(Bad::column(self.taken, format_args!("is not a number but {}", shown(rest[..end].trim_ascii()))));
        };
        self.pass(rest, end);
        Ok(number)
    }

    /// Goes on behind a cell.
    fn pass(&mut self, rest: &'a [u8], end: usize) {
        self.taken += 1;
        self.rest = rest.get(end + 1..);
        if !self.commas {
            self.rest = self.rest.map(<[u8]>::trim_ascii_start);
        }
    }

    /// Is there another cell?
    pub(crate) fn more(&self) -> bool {
        self.rest.is_some()
    }

    /// The cell of a time stamp, ns; none for NaN.
    pub(crate) fn nanoseconds(&mut self) -> Result<Option<i64>, Bad> {
        let column = self.taken;
        let cell = self.next().ok_or_else(|| Bad::column(column, "is missing"))?;
        if cell.eq_ignore_ascii_case(b"nan") {
            return Ok(None);
        }
        let time = text::decimal_nanoseconds(cell);
        time.map(Some).ok_or_else(|| Bad::column(column, format_args!("is not a time in s but {}", shown(cell))))
    }

    /// Nothing may be left.
    pub(crate) fn end(&mut self) -> Result<(), Bad> {
        let column = self.taken;
        match self.next() {
            None => Ok(()),
            Some(_) => Err(Bad { what: format!("has more than {column} columns"), remedy: "copy or export the file again" }),
        }
    }
}

impl<'a> Iterator for Cells<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest?;
        let end = rest.iter().position(|byte| if self.commas { is_comma(*byte) } else { is_blank(*byte) }).unwrap_or(rest.len());
        self.pass(rest, end);
        let cell = &rest[..end];
        Some(cell.trim_ascii())
    }
}

fn is_comma(byte: u8) -> bool {
    byte == b','
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t')
}

/// Foreign bytes in a message: short, and harmless to a terminal.
fn shown(cell: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(&cell[..cell.len().min(40)]).escape_debug().collect();
    format!("`{text}`")
}

/// Reads the fields of a layout from the cells of a row.
pub(crate) fn put(fields: &[&Field], cells: &mut Cells<'_>, state: &mut RavenState) -> Result<(), Bad> {
    for field in fields {
        match (field.get_mut)(state) {
            ValuesMut::Int(values) => {
                for value in values {
                    let column = cells.taken;
                    let number = cells.number()?;
                    *value = number as i32;
                    if f64::from(*value) != number {
                        return Err(Bad::column(column, format_args!("is {number}, but {} holds whole numbers", field.name)));
                    }
                }
            }
            ValuesMut::Float(values) => {
                for value in values {
                    *value = cells.single()?;
                }
            }
        }
    }
    Ok(())
}

/// Prints the fields of a layout with a separator before each number.
pub(crate) fn splice(
    fields: &[&Field],
    state: &RavenState,
    out: &mut Vec<u8>,
    separator: u8,
    int: impl Fn(&mut Vec<u8>, i32),
    float: impl Fn(&mut Vec<u8>, f32),
) {
    for field in fields {
        match (field.get)(state) {
            Values::Int(values) => {
                for value in values {
                    out.push(separator);
                    int(out, *value);
                }
            }
            Values::Float(values) => {
                for value in values {
                    out.push(separator);
                    float(out, *value);
                }
            }
        }
    }
}
