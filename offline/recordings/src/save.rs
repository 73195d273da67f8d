//! Recordings into files, by format.

use std::path::Path;

use crate::mcap_file::McapSink;
use crate::parquet_file::{self, StateWriter, TableWriter};
use crate::rosbag_file::{ChunkCompression, RosbagSink};
use crate::stream::{Sink, Source, StreamError};
use crate::table::{TableColumn, TableSink};
use crate::{columns235, columns252, csv, statefile, tidy};

/// Formats of full states that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StateFormat {
    /// MCAP, `.mcap`.
    Mcap,
    /// ROS 1 bag, `.bag`.
    Rosbag,
    /// File for the stand-in, `.rvs`.
    StateFile,
    /// The paper's text, `.txt`.
    Columns235,
    /// The lab's CSV, `.252.csv`.
    Columns252,
    /// Parquet, `.parquet`.
    Parquet,
}

/// Formats of tables that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Tidy CSV, `.csv` or `.csv.gz`.
    Csv,
    /// Parquet, `.parquet`.
    Parquet,
}

impl StateFormat {
    /// The format that a file's name asks for, none for another name.
    pub fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let endings = [
            (".mcap", Self::Mcap),
            (".bag", Self::Rosbag),
            (".rvs", Self::StateFile),
            (".txt", Self::Columns235),
            (".252.csv", Self::Columns252),
            (".parquet", Self::Parquet),
        ];
        endings.into_iter().find_map(|(ending, format)| name.ends_with(ending).then_some(format))
    }

    /// What states and truth lose in this format, one sentence each.
    pub fn losses(self) -> &'static [&'static str] {
        match self {
            Self::Mcap | Self::Rosbag => &[],
            Self::StateFile => &statefile::LOSSES,
            Self::Columns235 => &columns235::LOSSES,
            Self::Columns252 => &columns252::LOSSES,
            Self::Parquet => &parquet_file::LOSSES,
        }
    }
}

impl TableFormat {
    /// The format that a file's name asks for, none for another name.
    pub fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let endings = [(".csv", Self::Csv), (".csv.gz", Self::Csv), (".parquet", Self::Parquet)];
        endings.into_iter().find_map(|(ending, format)| name.ends_with(ending).then_some(format))
    }

    /// What full states lose when they become a table.
    pub fn losses_of_states(self) -> &'static [&'static str] {
        &tidy::LOSSES
    }
}

/// Begins a file of states.
///
/// # Errors
/// [`StreamError`] where the disk refuses.
pub fn create_states(path: &Path, format: StateFormat, metadata: &[(String, String)]) -> Result<Box<dyn Sink>, StreamError> {
    Ok(match format {
        StateFormat::Mcap => Box::new(McapSink::create(path, metadata)?),
        StateFormat::Rosbag => Box::new(RosbagSink::create(path, metadata, ChunkCompression::None)?),
        StateFormat::StateFile => Box::new(statefile::Writer::create(path, None)?),
        StateFormat::Columns235 => Box::new(columns235::Writer::create(path)?),
        StateFormat::Columns252 => Box::new(columns252::Writer::create(path)?),
        StateFormat::Parquet => Box::new(StateWriter::create(path, metadata)?),
    })
}

/// Begins a file of a table.
///
/// # Errors
/// [`StreamError`] where the disk refuses.
pub fn create_table(
    path: &Path,
    format: TableFormat,
    columns: &[TableColumn],
    metadata: &[(String, String)],
) -> Result<Box<dyn TableSink>, StreamError> {
    Ok(match format {
        TableFormat::Csv => Box::new(csv::Writer::create(path, columns, metadata)?),
        TableFormat::Parquet => Box::new(TableWriter::create(path, columns, metadata)?),
    })
}

/// Records between two reports of progress.
const REPORT_EVERY: u64 = 1024;

/// Passes every record on; `progress` hears bytes so far and in all now and then. Returns the number of records.
///
/// # Errors
/// [`StreamError`] of either side.
pub fn copy_states(source: &mut dyn Source, sink: &mut dyn Sink, progress: &mut dyn FnMut(u64, u64)) -> Result<u64, StreamError> {
    let mut records = 0_u64;
    while let Some(record) = source.next()? {
        sink.write(&record)?;
        records += 1;
        if records.is_multiple_of(REPORT_EVERY) {
            let (done, total) = source.progress();
            progress(done, total);
        }
    }
    Ok(records)
}
