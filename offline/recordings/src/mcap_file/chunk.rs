//! A chunk: records, compressed together, with a checksum. Nothing of a chunk is believed before its checksum is right, except
//! where the file is cut off within it: then what can be decompressed is all there is.

use std::io::Read;
use std::ops::Range;

use super::framing::{Framing, HEAD_BYTES, Head};
use super::records::ChunkHead;
use crate::ros::{Compression, Decompressor, HELD_MAX, Stop, damage, salvage};
use crate::stream::Damage;

/// The chunk at hand; its buffers are used again for the next one.
#[derive(Default)]
pub(super) struct Chunk {
    /// Where it begins in the file, bytes.
    begin: u64,
    /// As it stands in the file.
    raw: Vec<u8>,
    records: Vec<u8>,
    at: usize,
    is_open: bool,
    /// Why the chunk does not go on after what is in `records`.
    cut: Option<Damage>,
    decompressor: Decompressor,
}

/// What comes next in a chunk.
pub(super) enum Inner<'a> {
    /// Opcode and content.
    Record(u8, &'a [u8]),
    End,
    Damage(Damage),
}

impl Chunk {
    /// Is no chunk at hand?
    pub(super) const fn is_empty(&self) -> bool {
        !self.is_open
    }

    /// Where it begins in the file, bytes.
    pub(super) const fn at(&self) -> u64 {
        self.begin
    }

    pub(super) fn clear(&mut self) {
        self.is_open = false;
        self.cut = None;
        self.records.clear();
        self.at = 0;
    }

    /// Reads and decompresses a chunk, and checks it.
    pub(super) fn load<R: Read>(&mut self, framing: &mut Framing<R>, head: &Head) -> Result<(), Stop> {
        self.clear();
        self.begin = head.at;
        let is_whole = framing.load(head, &mut self.raw)?;
        let opened = if is_whole { self.open() } else { self.open_cut(head.length) };
        opened.map_err(|what| Stop::damage(head.at, what))?;
        self.is_open = true;
        Ok(())
    }

    fn open(&mut self) -> Result<(), String> {
        let head = ChunkHead::read(&self.raw).map_err(|error| format!("a chunk does not fit the format: {error}"))?;
        let compression = compression(&head.compression)?;
        let input = self.raw.get(head.records_at..).unwrap_or_default();
        if head.records_size != input.len() as u64 {
            return Err(format!("a chunk says {} bytes of records and has {}", head.records_size, input.len()));
        }
        if head.uncompressed_size > HELD_MAX {
            return Err(format!("a chunk says {} bytes, more than the {HELD_MAX} that are read at once", head.uncompressed_size));
        }
        let whole = self.decompressor.whole(compression, input, head.uncompressed_size as usize, &mut self.records);
        whole.map_err(|what| format!("a chunk {what}"))?;
        if head.uncompressed_crc != 0 && head.uncompressed_crc != crc32fast::hash(&self.records) {
            return Err("a chunk has another checksum than it says".into());
        }
        Ok(())
    }

    fn open_cut(&mut self, length: u64) -> Result<(), String> {
        let what =
            format!("the file is cut off within a chunk that says it has {length} bytes, of which {} are there", self.raw.len());
        let Ok(head) = ChunkHead::read(&self.raw) else { return Err(what) };
        let input = self.raw.get(head.records_at..).unwrap_or_default();
        salvage(compression(&head.compression)?, input, HELD_MAX, &mut self.records);
        self.cut = Some(damage(self.begin, what));
        Ok(())
    }

    /// The next record; an end or a damage closes the chunk.
    pub(super) fn next(&mut self) -> Inner<'_> {
        if let Some((opcode, content)) = self.split() {
            self.at = content.end;
            return Inner::Record(opcode, &self.records[content]);
        }
        let is_whole = self.at >= self.records.len();
        let (cut, begin) = (self.cut.take(), self.begin);
        self.clear();
        match cut {
            Some(damage) => Inner::Damage(damage),
            None if is_whole => Inner::End,
            None => Inner::Damage(damage(begin, "a record in a chunk is longer than the rest of the chunk")),
        }
    }

    /// Opcode and place of the content of the next record, where it is all there.
    fn split(&self) -> Option<(u8, Range<usize>)> {
        let (head, _) = self.records.get(self.at..)?.split_first_chunk::<HEAD_BYTES>()?;
        let [opcode, length @ ..] = *head;
        let start = self.at + HEAD_BYTES;
        let end = start.checked_add(usize::try_from(u64::from_le_bytes(length)).ok()?)?;
        (end <= self.records.len()).then_some((opcode, start..end))
    }
}

/// Compression by its name in MCAP.
fn compression(name: &str) -> Result<Compression, String> {
    match name {
        "" => Ok(Compression::None),
        "zstd" => Ok(Compression::Zstd),
        "lz4" => Ok(Compression::Lz4),
        other => Err(format!("a chunk is compressed as {other:?}; zstd, lz4 and none are read")),
    }
}
