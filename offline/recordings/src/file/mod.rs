//! Files as the readers and writers see them: [`Input`] undoes gzip and counts how far it is, [`Lines`] cuts text into lines
//! of bounded length, [`WholeFile`] appears under its name only when it is complete.

mod input;
mod lines;
mod whole;

pub(crate) use input::{Input, InputProblem};
pub(crate) use lines::{LINE_BYTES_MAX, LineProblem, Lines};
pub(crate) use whole::WholeFile;

use std::path::Path;

use crate::stream::{Place, StreamError};

/// One line about a file.
pub(crate) fn refusal(file: &Path, place: Option<Place>, what: impl Into<String>, remedy: impl Into<String>) -> StreamError {
    StreamError { file: file.to_owned(), place, what: what.into(), remedy: remedy.into() }
}

/// The disk refuses to take a file.
pub(crate) fn cannot_write(file: &Path, error: &std::io::Error) -> StreamError {
    refusal(file, None, format!("cannot be written ({error})"), "check the folder, its permissions and the free space")
}

impl InputProblem {
    /// The same as a line about a file.
    pub(crate) fn refusal(&self, file: &Path) -> StreamError {
        match self {
            Self::Open(error) => refusal(file, None, format!("cannot be opened ({error})"), "check the path and its permissions"),
            Self::Read(error) => refusal(file, None, format!("cannot be read ({error})"), "check the disk or copy the file again"),
            Self::NotGzip => refusal(file, None, "is named .gz but is not gzip", "rename it without .gz or compress it"),
        }
    }
}
