//! Text, line by line.

use std::io::{self, BufRead, Read};

use super::Input;

/// Longest line that is read, bytes: a file without line ends must not fill the memory.
pub(crate) const LINE_BYTES_MAX: usize = 1 << 20;

/// UTF-8 byte order mark, which spreadsheets write before the first line.
const BYTE_ORDER_MARK: [u8; 3] = [0xef, 0xbb, 0xbf];

/// Why there is no next line although the file does not end properly.
#[derive(Debug)]
pub(crate) enum LineProblem {
    /// The system refuses to read on.
    Read(io::Error),
    /// The gzip stream is damaged or cut.
    Gzip(io::Error),
    /// The line is longer than [`LINE_BYTES_MAX`].
    TooLong,
}

impl LineProblem {
    /// What is wrong, in a few words.
    pub(crate) fn what(&self) -> String {
        match self {
            Self::Read(error) => format!("the file cannot be read on ({error})"),
            Self::Gzip(error) => format!("the gzip stream is damaged or cut short ({error})"),
            Self::TooLong => format!("the line is longer than {LINE_BYTES_MAX} bytes"),
        }
    }
}

/// The lines of a file.
pub(crate) struct Lines {
    input: Input,
    number: u64,
    bytes: Vec<u8>,
    /// Did the last line that was read end with a line end?
    ended: bool,
}

impl Lines {
    pub(crate) fn new(input: Input) -> Self {
        Self { input, number: 0, bytes: Vec::new(), ended: true }
    }

    /// Moves to the next line that is not blank; false at the end of the file. Blank are lines of spaces.
    pub(crate) fn advance(&mut self) -> Result<bool, LineProblem> {
        loop {
            self.bytes.clear();
            if !self.append()? {
                return Ok(false);
            }
            if !self.line().iter().all(|byte| *byte == b' ') {
                return Ok(true);
            }
        }
    }

    /// Appends the next line of the file to the present one, with its line end between them; false at the end of the file.
    pub(crate) fn append(&mut self) -> Result<bool, LineProblem> {
        let room = (LINE_BYTES_MAX + 1).saturating_sub(self.bytes.len()) as u64;
        let before = self.bytes.len();
        self.number += 1;
        let compressed = self.input.compressed();
        if let Err(error) = self.input.by_ref().take(room).read_until(b'\n', &mut self.bytes) {
            return Err(if compressed { LineProblem::Gzip(error) } else { LineProblem::Read(error) });
        }
        if self.bytes.len() == before {
            return Ok(false);
        }
        self.ended = self.bytes.last() == Some(&b'\n');
        if self.bytes.len() > LINE_BYTES_MAX {
            return Err(LineProblem::TooLong);
        }
        if self.number == 1 && self.bytes.starts_with(&BYTE_ORDER_MARK) {
            self.bytes.drain(..BYTE_ORDER_MARK.len());
        }
        Ok(true)
    }

    /// The present line without its end.
    pub(crate) fn line(&self) -> &[u8] {
        let line = self.bytes.strip_suffix(b"\n").unwrap_or(&self.bytes);
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    /// Number of the present line, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Did the last line that was read end with a line end? False for a file that may be cut in its last line.
    pub(crate) fn ended(&self) -> bool {
        self.ended
    }

    /// Bytes so far, bytes in all.
    pub(crate) fn progress(&self) -> (u64, u64) {
        self.input.progress()
    }
}
