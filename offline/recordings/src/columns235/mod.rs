//! The paper's text of 235 columns (ravenstate.md, section 3): the time and 2 × 117 numbers, separated by blanks, six
//! decimals, no header.
//!
//! The layout is recognised by its content: tip positions are whole micrometres, rotations lie within ±1. An older layout
//! with the same number of columns but another order (tip position at columns 230 to 232) is refused by name.
//!
//! What the text cannot hold is filled in when it is read and told in the metadata; [`LOSSES`] says what writing drops.
//! Reading a file and writing it again gives the same text; states come back with floats within 0.0000005 (exactly where
//! they are beyond ±16, since a float32 has no finer steps there) and times within 0.5 µs.

mod read;
mod write;

pub use read::Reader;
pub use write::Writer;

/// Columns of a row.
pub const COLUMNS: usize = 235;

/// What a state or truth loses in this format.
pub const LOSSES: [&str; 5] = [
    "235-column text has six decimals: floats are off by up to 0.0000005 (exact beyond 16), times by up to 0.5 us",
    "235-column text holds no runlevel, sublevel, last_seq, type (board numbers) and dt",
    "235-column text holds no header but the time: hdr.seq, sequence, source id and source time are dropped",
    "235-column text holds no truth: poses, joints and cable forces of trackers, encoders or the simulator are dropped",
    "235-column text holds no metadata",
];
