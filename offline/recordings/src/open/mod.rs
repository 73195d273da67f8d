//! Any recording by its path: what a file is, its content tells first, its name second.

mod sniff;

use std::path::Path;

use crate::file::refusal;
use crate::mcap_file::McapSource;
use crate::parquet_file::{StateReader, TableReader};
use crate::rosbag_file::RosbagSource;
use crate::stream::{Source, StreamError};
use crate::table::TableSource;
use crate::{columns235, columns252, csv, statefile};

pub use sniff::{Kind, kind};

/// A recording being read.
pub enum Opened {
    /// Full states, with truth where there is any: MCAP, bag, the two text layouts, state file, Parquet of states.
    States(Box<dyn Source>),
    /// Rows and columns: tidy CSV, other tables, Parquet of tables.
    Table(Box<dyn TableSource>),
}

/// Opens a recording, whatever its format.
///
/// # Errors
/// [`StreamError`] for a file that cannot be opened, is damaged from its start on, or is something else; then it says what
/// it looks like.
pub fn open(path: &Path) -> Result<Opened, StreamError> {
    Ok(match kind(path)? {
        Kind::Mcap => Opened::States(Box::new(McapSource::open(path)?)),
        Kind::Rosbag => Opened::States(Box::new(RosbagSource::open(path)?)),
        Kind::StateFile => Opened::States(Box::new(statefile::Reader::open(path)?)),
        Kind::Columns235 => Opened::States(Box::new(columns235::Reader::open(path)?)),
        Kind::Columns252 => Opened::States(Box::new(columns252::Reader::open(path, None)?)),
        Kind::Parquet => match StateReader::open(path)? {
            Some(states) => Opened::States(Box::new(states)),
            None => Opened::Table(Box::new(TableReader::open(path)?)),
        },
        Kind::Csv => Opened::Table(Box::new(csv::Table::open(path)?)),
    })
}

/// Opens a recording as a table with every column that its file has, where the file has columns: tidy CSV, other tables,
/// Parquet of tables, and the lab's CSV with the CRTK and force columns that states do not have.
///
/// # Errors
/// As [`open`]; also for the other formats of states, which have messages and no columns: see [`crate::tidy`].
pub fn open_table(path: &Path) -> Result<Box<dyn TableSource>, StreamError> {
    if kind(path)? == Kind::Columns252 {
        return Ok(Box::new(columns252::Table::open(path)?));
    }
    match open(path)? {
        Opened::Table(table) => Ok(table),
        Opened::States(source) => {
            let what = format!("is a {} of states, not a table", source.format());
            Err(refusal(path, None, what, "convert it to a tidy table first"))
        }
    }
}
