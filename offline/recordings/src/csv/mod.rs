//! Tidy CSV (contracts.md): one run per file, `.csv` or `.csv.gz`, `# key = value` lines above the header, units in the
//! column names. The reader converts to SI and refuses what it cannot vouch for, with one line that tells the remedy.

mod error;
mod header;

pub use error::{CsvError, CsvProblem};

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use header::Field;

use crate::{Column, Recording};

/// Longest line that is read, bytes: a file without line ends must not fill the memory.
const LINE_BYTES_MAX: u64 = 1 << 20;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Reads a tidy CSV file, compressed or not.
///
/// # Errors
/// [`CsvError`], whose text is one line with file, place, what is wrong and the remedy.
pub fn read(path: &Path) -> Result<Recording, CsvError> {
    let name = path.display().to_string();
    let failed = |problem| CsvError { file: name.clone(), line: None, column: None, problem: Box::new(problem) };
    let mut file = File::open(path).map_err(|error| failed(CsvProblem::Open { why: error.to_string() }))?;
    let mut magic = Vec::new();
    let _ = file
        .by_ref()
        .take(GZIP_MAGIC.len() as u64)
        .read_to_end(&mut magic)
        .map_err(|error| failed(CsvProblem::Read { why: error.to_string() }))?;
    let compressed = magic == GZIP_MAGIC;
    if !compressed && name.to_ascii_lowercase().ends_with(".gz") {
        return Err(failed(CsvProblem::NotGzip));
    }
    let whole = BufReader::new(Cursor::new(magic).chain(file));
    if compressed {
        Reader::new(&name, BufReader::new(MultiGzDecoder::new(whole)), true).recording()
    } else {
        Reader::new(&name, whole, false).recording()
    }
}

/// Reads tidy CSV text; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`].
pub fn read_text(name: &str, text: &[u8]) -> Result<Recording, CsvError> {
    Reader::new(name, text, false).recording()
}

struct Reader<'a, R> {
    file: &'a str,
    source: R,
    compressed: bool,
    line: u64,
    bytes: Vec<u8>,
}

impl<'a, R: BufRead> Reader<'a, R> {
    fn new(file: &'a str, source: R, compressed: bool) -> Self {
        Self { file, source, compressed, line: 0, bytes: Vec::new() }
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
        recording.columns =
            fields.into_iter().zip(values).map(|(field, values)| Column { name: field.name, known: field.known, values }).collect();
        Ok(recording)
    }

    /// Reads metadata up to the header line; none at the end of the file.
    fn header(&mut self, recording: &mut Recording) -> Result<Option<String>, CsvError> {
        while let Some(text) = self.next_line()? {
            let Some(comment) = text.strip_prefix('#') else {
                return Ok(Some(text));
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
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            return Err(self.here(CsvProblem::NoHeader));
        }
        if let [only] = names
            && let Some((_, found)) = [(';', "semicolons"), ('\t', "tabs"), (' ', "spaces")].iter().find(|(c, _)| only.contains(*c))
        {
            return Err(self.here(CsvProblem::Separator { found }));
        }
        let origin_names = header::has_origin_names(names);
        let mut fields: Vec<Field> = Vec::with_capacity(names.len());
        for (i, name) in names.iter().enumerate() {
            let field = header::field(name, origin_names).map_err(|problem| self.at(i, name, problem))?;
            if let Some(first) = fields.iter().position(|other| other.name == field.name) {
                let problem = CsvProblem::Duplicate { first: first + 1, name: field.name };
                return Err(self.at(i, name, problem));
            }
            if field.name == "t_s" && i != 0 {
                return Err(self.at(i, name, CsvProblem::TimeNotFirst));
            }
            fields.push(field);
        }
        Ok(fields)
    }

    fn rows(&mut self, names: &[&str], fields: &[Field], values: &mut [Vec<f64>]) -> Result<(), CsvError> {
        let is_run = fields.first().is_some_and(|field| field.name == "t_s");
        while let Some(text) = self.next_line()? {
            if text.starts_with('#') {
                return Err(self.here(CsvProblem::CommentInData));
            }
            let found = text.split(',').count();
            if found != fields.len() {
                return Err(self.here(CsvProblem::Ragged { expected: fields.len(), found }));
            }
            for (i, text) in text.split(',').enumerate() {
                let value = number(cell(text), &fields[i]).map_err(|problem| self.at(i, names[i], problem))?;
                values[i].push(value);
            }
            if is_run
                && let [.., before, now] = values[0][..]
                && now <= before
            {
                return Err(self.at(0, names[0], CsvProblem::TimeNotRising { before, now }));
            }
        }
        Ok(())
    }

    /// The next line that is not empty, without its end.
    fn next_line(&mut self) -> Result<Option<String>, CsvError> {
        loop {
            self.bytes.clear();
            self.line += 1;
            let mut bounded = self.source.by_ref().take(LINE_BYTES_MAX + 1);
            if let Err(error) = bounded.read_until(b'\n', &mut self.bytes) {
                let why = error.to_string();
                return Err(self.here(if self.compressed { CsvProblem::Gzip { why } } else { CsvProblem::Read { why } }));
            }
            if self.bytes.is_empty() {
                return Ok(None);
            }
            if self.bytes.len() as u64 > LINE_BYTES_MAX {
                return Err(self.here(CsvProblem::LineTooLong { bytes: LINE_BYTES_MAX }));
            }
            let Ok(text) = std::str::from_utf8(&self.bytes) else {
                return Err(self.here(CsvProblem::NotText));
            };
            // Spreadsheets write a byte order mark before the first line.
            let text = if self.line == 1 { text.trim_start_matches('\u{feff}') } else { text };
            let text = text.trim_matches(['\r', '\n', ' ']);
            if !text.is_empty() {
                return Ok(Some(text.to_owned()));
            }
        }
    }

    fn whole_file(&self, problem: CsvProblem) -> CsvError {
        CsvError { file: self.file.to_owned(), line: None, column: None, problem: Box::new(problem) }
    }

    fn here(&self, problem: CsvProblem) -> CsvError {
        CsvError { line: Some(self.line), ..self.whole_file(problem) }
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

fn number(text: &str, field: &Field) -> Result<f64, CsvProblem> {
    if text.is_empty() {
        return if field.truth { Ok(f64::NAN) } else { Err(CsvProblem::EmptyCell) };
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((field.to_si)(value)),
        Ok(_) => Err(CsvProblem::NotFinite { text: text.to_owned() }),
        Err(_) => Err(CsvProblem::NotNumber { text: text.to_owned() }),
    }
}
