//! Records as bytes, and the index of a chunk.

use super::op;
use crate::ros::Topic;

/// Connections that are written: those of [`crate::ros`] and the metadata.
pub(super) const CONNECTIONS: usize = crate::ros::TOPICS.len() + 1;

/// Size of the bag's first record but for its two lengths, bytes: padded, since it is written anew at the end.
const BAG_HEADER_BYTES: usize = 4096;

/// Appends a record.
pub(super) fn put_record(out: &mut Vec<u8>, fields: &[(&str, &[u8])], data: &[u8]) {
    let header: usize = fields.iter().map(|(name, value)| 5 + name.len() + value.len()).sum();
    out.reserve(8 + header + data.len());
    put_length(out, header);
    for (name, value) in fields {
        put_field(out, name, value);
    }
    put_length(out, data.len());
    out.extend_from_slice(data);
}

fn put_field(out: &mut Vec<u8>, name: &str, value: &[u8]) {
    put_length(out, name.len() + 1 + value.len());
    out.extend_from_slice(name.as_bytes());
    out.push(b'=');
    out.extend_from_slice(value);
}

fn put_length(out: &mut Vec<u8>, length: usize) {
    out.extend_from_slice(&(length as u32).to_le_bytes());
}

/// The bag's first record.
pub(super) fn bag_header(index_at: u64, connections: u32, chunks: u32) -> Vec<u8> {
    let (index_at, connections, chunks) = (index_at.to_le_bytes(), connections.to_le_bytes(), chunks.to_le_bytes());
    let fields: [(&str, &[u8]); 4] =
        [("op", &[op::BAG]), ("index_pos", &index_at), ("conn_count", &connections), ("chunk_count", &chunks)];
    let mut out = Vec::with_capacity(8 + BAG_HEADER_BYTES);
    put_record(&mut out, &fields, &[]);
    let padding = BAG_HEADER_BYTES - (out.len() - 8);
    out.truncate(out.len() - 4);
    put_length(&mut out, padding);
    out.resize(out.len() + padding, b' ');
    out
}

/// A connection.
pub(super) fn put_connection(out: &mut Vec<u8>, id: usize, topic: &Topic) {
    let mut data = Vec::new();
    for (name, value) in [
        ("topic", topic.name),
        ("type", topic.message.name),
        ("md5sum", topic.message.md5),
        ("message_definition", topic.message.definition),
    ] {
        put_field(&mut data, name, value.as_bytes());
    }
    put_record(out, &[("op", &[op::CONNECTION]), ("conn", &(id as u32).to_le_bytes()), ("topic", topic.name.as_bytes())], &data);
}

/// Seconds and ns of a time; what is after 2106 stands at the end of time.
pub(super) fn time(time_ns: u64) -> [u8; 8] {
    let (seconds, rest) = (time_ns / 1_000_000_000, time_ns % 1_000_000_000);
    let seconds = u32::try_from(seconds).unwrap_or(u32::MAX);
    (u64::from(seconds) | (rest << 32)).to_le_bytes()
}

/// What the index says of a chunk: where each message stands, and what there is in all.
#[derive(Debug, Clone, Default)]
pub(super) struct ChunkIndex {
    /// Per connection: time and place of each message.
    messages: [Vec<u8>; CONNECTIONS],
    times_ns: Option<(u64, u64)>,
}

/// Bytes per message in an index.
const ENTRY_BYTES: usize = 12;

impl ChunkIndex {
    pub(super) fn add(&mut self, connection: usize, time_ns: u64, at: usize) {
        let entries = &mut self.messages[connection];
        entries.extend_from_slice(&time(time_ns));
        put_length(entries, at);
        let (first, last) = self.times_ns.get_or_insert((time_ns, time_ns));
        (*first, *last) = ((*first).min(time_ns), (*last).max(time_ns));
    }

    /// The index records that follow the chunk.
    pub(super) fn put(&self, out: &mut Vec<u8>) {
        for (connection, entries) in self.used() {
            let (connection, count) = ((connection as u32).to_le_bytes(), ((entries.len() / ENTRY_BYTES) as u32).to_le_bytes());
            let fields: [(&str, &[u8]); 4] =
                [("op", &[op::INDEX]), ("ver", &1_u32.to_le_bytes()), ("conn", &connection), ("count", &count)];
            put_record(out, &fields, entries);
        }
    }

    /// What stands of the chunk at the end of the bag.
    pub(super) fn info(&self, chunk_at: u64) -> Vec<u8> {
        let mut counts = Vec::new();
        for (connection, entries) in self.used() {
            put_length(&mut counts, connection);
            put_length(&mut counts, entries.len() / ENTRY_BYTES);
        }
        let (first, last) = self.times_ns.unwrap_or_default();
        let mut out = Vec::new();
        let fields: [(&str, &[u8]); 6] = [
            ("op", &[op::CHUNK_INFO]),
            ("ver", &1_u32.to_le_bytes()),
            ("chunk_pos", &chunk_at.to_le_bytes()),
            ("start_time", &time(first)),
            ("end_time", &time(last)),
            ("count", &((counts.len() / 8) as u32).to_le_bytes()),
        ];
        put_record(&mut out, &fields, &counts);
        out
    }

    pub(super) fn clear(&mut self) {
        self.messages.iter_mut().for_each(Vec::clear);
        self.times_ns = None;
    }

    fn used(&self) -> impl Iterator<Item = (usize, &Vec<u8>)> {
        self.messages.iter().enumerate().filter(|(_, entries)| !entries.is_empty())
    }
}
