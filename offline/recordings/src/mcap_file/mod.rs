//! MCAP (mcap.dev/spec) with ROS 1 messages, as Foxglove and PlotJuggler open it: [`crate::ros`] has the topics.
//!
//! Written are chunks of 1 MiB before compression, compressed with zstd, each with a checksum, and an index at the end.
//! Read is from the start to the end, one chunk in memory at a time, never by the index: a file without an end reads as well,
//! up to where it ends. Metadata are `key = value` pairs in a record named `ravenpose`.
//!
//! # After a kill
//! [`McapLog`] writes under `NAME.part` and closes a chunk at least every half second, so after a kill the file has everything
//! but the last half second. [`McapSource`] reads it as it is, and so does every reader of MCAP that starts at the beginning
//! (`mcap cat`, `mcap recover`, the Python package); readers that start with the index need it written anew:
//! `ravenpose convert RUN.mcap.part RUN.mcap`, or `mcap recover`. The file is in the hands of the operating system after each
//! chunk and safe from the end of the process; a loss of power may cost what the system has not yet written, usually 30 s.

mod channels;
mod chunk;
mod framing;
mod images;
mod log;
mod reader;
mod records;
mod writer;

pub use images::{ImageSource, StampedImage};
pub use log::{LogChannel, McapLog};
pub use reader::McapSource;
pub use writer::McapSink;

/// Name of the metadata record with our own pairs.
const METADATA_NAME: &str = "ravenpose";
