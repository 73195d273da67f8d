//! What the two text layouts of full states share: rows of numbers without a header, and the header fields that neither
//! holds.

mod rows;
mod timeline;

pub(crate) use rows::{Bad, Cells, Rows, put, splice};
pub(crate) use timeline::Timeline;

/// What is filled in for `dt`, for the metadata (ravenstate.md, section 2).
pub(crate) const DT_NOTE: &str = "not in the file; difference of consecutive time stamps, first 0.001 s (at 100 Hz it is 0.01 s, out of a 1 kHz network's range)";

/// What is filled in for the counters of the header.
pub(crate) const COUNTERS_NOTE: &str = "not in the file; counted row by row";
