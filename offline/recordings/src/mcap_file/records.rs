//! The contents of the MCAP records that are read (mcap.dev/spec), with the little-endian cursor of ROS, whose strings are the
//! same.

use crate::ros::{Cursor, MessageError};

/// The type of a channel's messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Schema {
    pub(super) id: u16,
    pub(super) name: String,
    pub(super) encoding: String,
    pub(super) text: String,
}

impl Schema {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let id = cursor.u16("id")?;
        let (name, encoding) = (text(cursor.string("name")?), text(cursor.string("encoding")?));
        Ok(Self { id, name, encoding, text: text(cursor.string("data")?) })
    }
}

/// A channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ChannelRecord {
    pub(super) id: u16,
    pub(super) schema_id: u16,
    pub(super) topic: String,
    pub(super) encoding: String,
}

impl ChannelRecord {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let (id, schema_id) = (cursor.u16("id")?, cursor.u16("schema_id")?);
        Ok(Self { id, schema_id, topic: text(cursor.string("topic")?), encoding: text(cursor.string("message_encoding")?) })
    }
}

/// A message.
#[derive(Debug, Clone, Copy)]
pub(super) struct MessageRecord<'a> {
    pub(super) channel: u16,
    pub(super) log_time_ns: u64,
    pub(super) data: &'a [u8],
}

impl<'a> MessageRecord<'a> {
    /// Bytes before the data.
    const HEAD_BYTES: usize = 22;

    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let channel = cursor.u16("channel_id")?;
        let _sequence = cursor.u32("sequence")?;
        let log_time_ns = cursor.u64("log_time")?;
        let _publish_time_ns = cursor.u64("publish_time")?;
        Ok(Self { channel, log_time_ns, data: bytes.get(Self::HEAD_BYTES..).unwrap_or_default() })
    }
}

/// A chunk without its records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ChunkHead {
    pub(super) uncompressed_size: u64,
    /// Of the uncompressed records; 0: none was computed.
    pub(super) uncompressed_crc: u32,
    pub(super) compression: String,
    /// Where the records begin in the chunk, bytes.
    pub(super) records_at: usize,
    /// Size of the records in the file, bytes.
    pub(super) records_size: u64,
}

impl ChunkHead {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let _times = (cursor.u64("message_start_time")?, cursor.u64("message_end_time")?);
        let (uncompressed_size, uncompressed_crc) = (cursor.u64("uncompressed_size")?, cursor.u32("uncompressed_crc")?);
        let compression = text(cursor.string("compression")?);
        let records_size = cursor.u64("records")?;
        Ok(Self { uncompressed_size, uncompressed_crc, compression, records_at: cursor.at(), records_size })
    }
}

/// Named pairs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MetadataRecord {
    pub(super) name: String,
    pub(super) pairs: Vec<(String, String)>,
}

impl MetadataRecord {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let name = text(cursor.string("name")?);
        let mut map = Cursor::new(cursor.string("metadata")?);
        let mut pairs = Vec::new();
        while map.left() > 0 {
            pairs.push((text(map.string("key")?), text(map.string("value")?)));
        }
        Ok(Self { name, pairs })
    }
}

/// The end of the data section.
pub(super) fn data_end_crc(bytes: &[u8]) -> Result<u32, MessageError> {
    Cursor::new(bytes).u32("data_section_crc")
}

/// The end of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Footer {
    /// 0: no summary.
    pub(super) summary_start: u64,
    /// 0: none was computed.
    pub(super) summary_crc: u32,
}

impl Footer {
    /// Bytes of the footer that its checksum covers.
    pub(super) const CHECKED_BYTES: usize = 16;

    pub(super) fn read(bytes: &[u8]) -> Result<Self, MessageError> {
        let mut cursor = Cursor::new(bytes);
        let summary_start = cursor.u64("summary_start")?;
        let _offsets = cursor.u64("summary_offset_start")?;
        Ok(Self { summary_start, summary_crc: cursor.u32("summary_crc")? })
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
