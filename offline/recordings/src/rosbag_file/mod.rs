//! ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): [`crate::ros`] has the topics.
//!
//! Read is from the start to the end, one chunk in memory at a time (none, bz2 or lz4), never by the index: a bag that was cut
//! off (`.bag.active`) reads as well, up to where it ends. A bag has no checksum of its own: flipped bytes are noticed where
//! they break the structure, or a chunk's compression.
//!
//! Written are chunks of 768 KiB before compression, none or lz4, with the index that ROS's own tools want.

mod chunk;
mod connections;
mod framing;
mod index;
mod reader;
mod writer;

pub use reader::RosbagSource;
pub use writer::{ChunkCompression, RosbagSink};

/// First bytes of a file.
const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Operation codes of records.
mod op {
    pub(super) const MESSAGE: u8 = 0x02;
    pub(super) const BAG: u8 = 0x03;
    pub(super) const INDEX: u8 = 0x04;
    pub(super) const CHUNK: u8 = 0x05;
    pub(super) const CHUNK_INFO: u8 = 0x06;
    pub(super) const CONNECTION: u8 = 0x07;
}
