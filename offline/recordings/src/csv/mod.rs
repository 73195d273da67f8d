//! Tidy CSV (contracts.md): one run per file, `.csv` or `.csv.gz`, `# key = value` lines above the header, units in the
//! column names.
//!
//! [`read`] is for those who use a run: it converts to SI and refuses what it cannot vouch for, with one line that tells
//! the remedy. [`Table`] is for those who look at files or convert them: it streams, takes any table of numbers and words
//! as it is, and says what is odd about it. [`Writer`] writes either.

mod cells;
mod error;
mod header;
mod kinds;
mod loose;
mod write;

pub use error::{CsvError, CsvProblem};
pub use loose::Table;
pub use write::Writer;

pub(crate) use header::{is_si_name, loose_fields, unit_of_name};

use std::collections::HashMap;
use std::path::Path;

use header::Field;

use crate::file::{Input, InputProblem, LINE_BYTES_MAX, LineProblem, Lines};
use crate::{Column, Recording, text};

/// Reads a tidy CSV file, compressed or not.
///
/// # Errors
/// [`CsvError`], whose text is one line with file, place, what is wrong and the remedy.
pub fn read(path: &Path) -> Result<Recording, CsvError> {
    let name = path.display().to_string();
    match Input::open(path) {
        Ok(input) => Reader::new(&name, input).recording(),
        Err(problem) => Err(CsvError { file: name, line: None, column: None, problem: Box::new(of_input(&problem)) }),
    }
}

/// As [`read`], for those who can leave rows out: any cell but the time's may be empty, which is NaN, and columns of unknown
/// quantities may hold words, which are NaN too.
///
/// # Errors
/// As [`read`].
pub fn read_with_gaps(path: &Path) -> Result<Recording, CsvError> {
    let name = path.display().to_string();
    match Input::open(path) {
        Ok(input) => Reader { gaps: true, ..Reader::new(&name, input) }.recording(),
        Err(problem) => Err(CsvError { file: name, line: None, column: None, problem: Box::new(of_input(&problem)) }),
    }
}

/// Reads tidy CSV text; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`].
pub fn read_text(name: &str, text: &[u8]) -> Result<Recording, CsvError> {
    match Input::from_bytes(text.to_vec()) {
        Ok(input) => Reader::new(name, input).recording(),
        Err(error) => {
            let problem = Box::new(of_input(&InputProblem::Read(error)));
            Err(CsvError { file: name.to_owned(), line: None, column: None, problem })
        }
    }
}

fn of_input(problem: &InputProblem) -> CsvProblem {
    match problem {
        InputProblem::Open(error) => CsvProblem::Open { why: error.to_string() },
        InputProblem::Read(error) => CsvProblem::Read { why: error.to_string() },
        InputProblem::NotGzip => CsvProblem::NotGzip,
    }
}

/// Names of a first column that only counts the rows.
const ROW_NUMBERS: [&str; 3] = ["i", "row", "index"];

/// Is this a header of column names separated by commas?
fn check_names(names: &[&str]) -> Result<(), CsvProblem> {
    if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        return Err(CsvProblem::NoHeader);
    }
    if let [only] = names
        && let Some((_, found)) = [(';', "semicolons"), ('\t', "tabs"), (' ', "spaces")].iter().find(|(c, _)| only.contains(*c))
    {
        return Err(CsvProblem::Separator { found });
    }
    Ok(())
}

struct Reader<'a> {
    file: &'a str,
    lines: Lines,
    /// See [`read_with_gaps`].
    gaps: bool,
}

impl<'a> Reader<'a> {
    fn new(file: &'a str, input: Input) -> Self {
        Self { file, lines: Lines::new(input), gaps: false }
    }

    fn recording(mut self) -> Result<Recording, CsvError> {
        let mut recording = Recording { name: self.file.to_owned(), ..Recording::default() };
        let Some(header) = self.header(&mut recording)? else {
            return Err(self.whole_file(CsvProblem::Empty));
        };
        let names: Vec<&str> = header.split(',').map(cell).collect();
        let fields = self.fields(&names)?;
        let mut values: Vec<Vec<f64>> = fields.iter().map(|_| Vec::new()).collect();
        self.rows(&names, &fields, &mut values)?;
        if values.first().is_none_or(Vec::is_empty) {
            return Err(self.whole_file(CsvProblem::NoRows));
        }
        recording.columns = std::iter::zip(fields.into_iter().zip(&names), values)
            .map(|((field, name), values)| Column { name: field.name, known: field.known, values, original: (*name).to_owned() })
            .collect();
        if let Some(time) = recording.columns.iter().position(|column| column.name == "t_s") {
            if recording.columns[time].values.windows(2).all(|pair| pair[0] < pair[1]) {
                recording.columns[..=time].rotate_right(1);
            } else {
                "time_of_session_s".clone_into(&mut recording.columns[time].name);
                recording.columns[time].known = false;
            }
        }
        Ok(recording)
    }

    /// Reads metadata up to the header line; none at the end of the file.
    fn header(&mut self, recording: &mut Recording) -> Result<Option<String>, CsvError> {
        while self.advance()? {
            let text = self.text()?;
            let Some(comment) = text.strip_prefix('#') else {
                return Ok(Some(text.to_owned()));
            };
            let Some((key, value)) = comment.split_once('=') else { continue };
            let (key, value) = (key.trim(), value.trim());
            if key.is_empty() {
                continue;
            }
            if recording.metadata.insert(key.to_owned(), value.to_owned()).is_some() {
                return Err(self.here(CsvProblem::MetadataTwice { key: key.to_owned() }));
            }
        }
        Ok(None)
    }

    fn fields(&self, names: &[&str]) -> Result<Vec<Field>, CsvError> {
        check_names(names).map_err(|problem| self.here(problem))?;
        let origin_names = header::has_origin_names(names);
        let mut fields: Vec<Field> = Vec::with_capacity(names.len());
        let mut first_with: HashMap<String, usize> = HashMap::new();
        for (i, name) in names.iter().enumerate() {
            let field = header::field(name, origin_names).map_err(|problem| self.at(i, name, problem))?;
            if let Some(first) = first_with.insert(field.name.clone(), i) {
                let problem = CsvProblem::Duplicate { first: first + 1, name: field.name };
                return Err(self.at(i, name, problem));
            }
            // A number of the row may stand before the time.
            if field.name == "t_s" && i != 0 && !(i == 1 && ROW_NUMBERS.contains(&names[0])) {
                return Err(self.at(i, name, CsvProblem::TimeNotFirst));
            }
            fields.push(field);
        }
        Ok(fields)
    }

    fn rows(&mut self, names: &[&str], fields: &[Field], values: &mut [Vec<f64>]) -> Result<(), CsvError> {
        let time = fields.iter().position(|field| field.name == "t_s");
        while self.advance()? {
            let text = self.text()?;
            if text.starts_with('#') {
                return Err(self.here(CsvProblem::CommentInData));
            }
            let found = text.split(',').count();
            if found != fields.len() {
                return Err(self.here(CsvProblem::Ragged { expected: fields.len(), found }));
            }
            for (i, text) in text.split(',').enumerate() {
                let value = number(cell(text), &fields[i], self.gaps).map_err(|problem| self.at(i, names[i], problem))?;
                values[i].push(value);
            }
            // Behind a number of the row it may begin anew: then the rows are a table.
            if let Some(time) = time.filter(|time| *time == 0)
                && let [.., before, now] = values[time][..]
                && now <= before
            {
                return Err(self.at(time, names[time], CsvProblem::TimeNotRising { before, now }));
            }
        }
        Ok(())
    }

    /// Moves to the next line that is not empty; false at the end of the file.
    fn advance(&mut self) -> Result<bool, CsvError> {
        self.lines.advance().map_err(|problem| {
            self.here(match problem {
                LineProblem::Read(error) => CsvProblem::Read { why: error.to_string() },
                LineProblem::Gzip(error) => CsvProblem::Gzip { why: error.to_string() },
                LineProblem::TooLong => CsvProblem::LineTooLong { bytes: LINE_BYTES_MAX as u64 },
            })
        })
    }

    /// The present line, without its end and blanks round it.
    fn text(&self) -> Result<&str, CsvError> {
        match std::str::from_utf8(self.lines.line()) {
            Ok(text) => Ok(text.trim_matches(['\r', ' '])),
            Err(_) => Err(self.here(CsvProblem::NotText)),
        }
    }

    fn whole_file(&self, problem: CsvProblem) -> CsvError {
        CsvError { file: self.file.to_owned(), line: None, column: None, problem: Box::new(problem) }
    }

    fn here(&self, problem: CsvProblem) -> CsvError {
        CsvError { line: Some(self.lines.number()), ..self.whole_file(problem) }
    }

    fn at(&self, index: usize, name: &str, problem: CsvProblem) -> CsvError {
        CsvError { column: Some((index + 1, name.to_owned())), ..self.here(problem) }
    }
}

/// A cell without blanks and without the quotes that some programs put round every cell.
fn cell(text: &str) -> &str {
    let text = text.trim();
    text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).map_or(text, str::trim)
}

fn number(text: &str, field: &Field, gaps: bool) -> Result<f64, CsvProblem> {
    if text.is_empty() {
        return if field.truth || (gaps && field.name != "t_s") { Ok(f64::NAN) } else { Err(CsvProblem::EmptyCell) };
    }
    match text::number(text.as_bytes()) {
        Some(value) if value.is_finite() => Ok((field.to_si)(value)),
        None if gaps && !field.known => Ok(f64::NAN),
        Some(_) => Err(CsvProblem::NotFinite { text: text.to_owned() }),
        None => Err(CsvProblem::NotNumber { text: text.to_owned() }),
    }
}
