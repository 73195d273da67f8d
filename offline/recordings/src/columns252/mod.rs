//! The lab's CSV of 252 columns (ravenstate.md, section 3): external joint encoders, the joints as CRTK reports them, and
//! the whole message but `dt`; no header, `%.18e`. A variant of 256 columns appends a force sensor.
//!
//! As a stream ([`Reader`], [`Writer`]) a row is a state and the truth of one arm (joints 1 to 3 of the external encoders,
//! at their own time; a sample that stands in several rows is given once). The CRTK and force columns are neither state nor
//! truth: [`Table`] reads every column of a row under a name of its own, so that conversion to tidy CSV or Parquet keeps
//! them. Times are read and written with nineteen digits: every nanosecond survives.

mod match_truth;
mod read;
mod table;
mod write;

pub use read::Reader;
pub use table::Table;
pub use write::Writer;

/// Columns of a row.
pub const COLUMNS: usize = 252;

/// Columns of a row with a force sensor.
pub const COLUMNS_WITH_FORCE: usize = 256;

/// What a state or truth loses in this format.
pub const LOSSES: [&str; 4] = [
    "252-column CSV holds no dt and no header but the time: hdr.seq, sequence, source id and source time are dropped",
    "252-column CSV holds the truth of one arm, joints 1 to 3 only: tip poses, joints 4 to 7, cable forces and the other arm's truth are dropped, and truth is paired with the nearest state",
    "252-column CSV has CRTK joints, which states do not: written as the reported joint positions in rad and m",
    "252-column CSV holds no metadata",
];
