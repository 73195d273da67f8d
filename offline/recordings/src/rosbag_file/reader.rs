//! Reading a bag from its start to its end, one chunk in memory at a time.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use super::chunk::Chunk;
use super::connections::Connections;
use super::framing::{Fields, Framing, Head};
use super::{MAGIC, op};
use crate::ros::{Assembler, Compression, Decompressor, HELD_MAX, Stop, damage, refused, salvage, settle, unreadable};
use crate::stream::{Channel, Damage, Record, Source, StreamError};

/// A bag being read. Memory: one chunk as it stands in the file and as it is after decompression.
pub struct RosbagSource<R = BufReader<File>> {
    path: PathBuf,
    framing: Framing<R>,
    bag: BagHeader,
    chunk: Chunk,
    connections: Connections,
    assembler: Assembler,
    decompressor: Decompressor,
    /// The data of the record at hand, as they stand in the file.
    buffer: Vec<u8>,
    seen: Seen,
    is_over: bool,
    damage: Option<Damage>,
}

/// What the bag's first record says; 0 where the bag was never closed.
#[derive(Debug, Clone, Copy, Default)]
struct BagHeader {
    index_at: u64,
    connections: u32,
    chunks: u32,
}

/// What was met so far.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    chunks: u32,
    index_connections: u32,
    chunk_infos: u32,
    /// A message that is no metadata.
    message: bool,
}

impl RosbagSource {
    /// Opens a bag and reads up to its first message.
    ///
    /// # Errors
    /// [`StreamError`] where it cannot be read, is no bag of format 2.0, or has states that lack a field.
    pub fn open(path: &Path) -> Result<Self, StreamError> {
        let opened = File::open(path).and_then(|file| file.metadata().map(|metadata| (file, metadata.len())));
        let (file, size) = opened.map_err(|error| unreadable(path, &error))?;
        RosbagSource::new(path, BufReader::with_capacity(1 << 16, file), size)
    }
}

impl<R: Read> RosbagSource<R> {
    /// Reads from anything; `path` is for messages, `size` the number of bytes to come.
    ///
    /// # Errors
    /// As [`RosbagSource::open`].
    pub fn new(path: &Path, input: R, size: u64) -> Result<Self, StreamError> {
        let mut source = Self {
            path: path.to_owned(),
            framing: Framing::new(input, size),
            bag: BagHeader::default(),
            chunk: Chunk::default(),
            connections: Connections::default(),
            assembler: Assembler::default(),
            decompressor: Decompressor::default(),
            buffer: Vec::new(),
            seen: Seen::default(),
            is_over: false,
            damage: None,
        };
        let first = source.framing.first(MAGIC.len()).map_err(|error| unreadable(path, &error))?;
        if first != MAGIC {
            return Err(wrong_start(path, &first));
        }
        // Our own metadata are the first messages.
        while !source.is_over && !source.seen.message {
            source.advance()?;
        }
        Ok(source)
    }

    /// Reads one record, of the file or of the chunk at hand. Damage and errors end the stream here.
    fn advance(&mut self) -> Result<(), StreamError> {
        let stopped = if self.chunk.is_open() { self.inner() } else { self.outer() };
        let Err(stop) = stopped else { return Ok(()) };
        self.chunk = Chunk::default();
        self.end();
        self.damage = Some(settle(&self.path, stop)?);
        Ok(())
    }

    fn end(&mut self) {
        self.is_over = true;
        self.assembler.end();
    }

    fn outer(&mut self) -> Result<(), Stop> {
        let Some(head) = self.framing.head()? else { return self.end_of_file() };
        let code = self.framing.fields().u8("op");
        match code {
            Some(op::CHUNK) => self.load_chunk(&head),
            // Beside a connection of the index: what stands in a chunk that was never closed.
            Some(op::CONNECTION | op::MESSAGE) => {
                self.load(&head)?;
                if head.at >= self.bag.index_at && self.bag.index_at > 0 {
                    self.seen.index_connections = self.seen.index_connections.saturating_add(1);
                }
                let (header, data) = (self.framing.fields().0.to_vec(), std::mem::take(&mut self.buffer));
                let taken = self.record(Fields(&header), &data, head.at);
                self.buffer = data;
                taken
            }
            Some(op::BAG) => self.bag_header(&head),
            Some(op::CHUNK_INFO | op::INDEX) => {
                self.seen.chunk_infos = self.seen.chunk_infos.saturating_add(u32::from(code == Some(op::CHUNK_INFO)));
                self.skip(&head)
            }
            _ => Err(Stop::damage(head.at, "a record of an unknown kind")),
        }
    }

    /// Is everything there that the bag's first record promised?
    fn end_of_file(&mut self) -> Result<(), Stop> {
        let (at, _) = self.framing.progress();
        if self.bag.index_at == 0 {
            return Err(Stop::damage(at, "the file ends here without an index: the recording was cut off"));
        }
        let (seen, bag) = (&self.seen, &self.bag);
        if (seen.chunks, seen.index_connections, seen.chunk_infos) != (bag.chunks, bag.connections, bag.chunks) {
            let what = format!(
                "the file ends here with {} chunks, {} connections and {} chunks in the index; it should have {}, {} and {}",
                seen.chunks, seen.index_connections, seen.chunk_infos, bag.chunks, bag.connections, bag.chunks
            );
            return Err(Stop::damage(at, what));
        }
        self.end();
        Ok(())
    }

    fn bag_header(&mut self, head: &Head) -> Result<(), Stop> {
        let fields = self.framing.fields();
        let read = (fields.u64("index_pos"), fields.u32("conn_count"), fields.u32("chunk_count"));
        let (Some(index_at), Some(connections), Some(chunks)) = read else {
            return Err(Stop::damage(head.at, "the first record of the bag does not fit the format"));
        };
        self.bag = BagHeader { index_at, connections, chunks };
        self.skip(head)
    }

    fn load(&mut self, head: &Head) -> Result<(), Stop> {
        if self.framing.load(head, &mut self.buffer)? { Ok(()) } else { Err(Stop::Damage(cut(head))) }
    }

    fn skip(&mut self, head: &Head) -> Result<(), Stop> {
        if self.framing.skip(head)? { Ok(()) } else { Err(Stop::Damage(cut(head))) }
    }

    fn load_chunk(&mut self, head: &Head) -> Result<(), Stop> {
        let fields = self.framing.fields();
        let (Some(name), Some(size)) = (fields.text("compression"), fields.u32("size")) else {
            return Err(Stop::damage(head.at, "a chunk does not fit the format"));
        };
        let how = match name.as_str() {
            "none" => Compression::None,
            "bz2" => Compression::Bzip2,
            "lz4" => Compression::Lz4,
            _ => return Err(Stop::damage(head.at, format!("a chunk is compressed as {name:?}; none, bz2 and lz4 are read"))),
        };
        self.seen.chunks = self.seen.chunks.saturating_add(1);
        self.chunk.begin = head.at;
        self.chunk.at = 0;
        self.chunk.records.clear();
        self.chunk.records_at = (how == Compression::None).then(|| self.framing.progress().0);
        // The last chunk of a bag that was never closed says 0 bytes; uncompressed, its records simply follow.
        if head.length == 0 && size == 0 {
            return if how == Compression::None { Ok(()) } else { self.open_rest(how) };
        }
        if u64::from(size) > HELD_MAX {
            return Err(Stop::damage(
                head.at,
                format!("a chunk says {size} bytes, more than the {HELD_MAX} that are read at once"),
            ));
        }
        if !self.framing.load(head, &mut self.buffer)? {
            salvage(how, &self.buffer, HELD_MAX, &mut self.chunk.records);
            self.chunk.cut = Some(cut(head));
            return Ok(());
        }
        if how == Compression::None && u64::from(size) != head.length {
            return Err(Stop::damage(head.at, format!("a chunk says {size} bytes and has {}", head.length)));
        }
        let whole = self.decompressor.whole(how, &self.buffer, size as usize, &mut self.chunk.records);
        whole.map_err(|what| Stop::damage(head.at, format!("a chunk {what}")))
    }

    /// Everything from here to the end of the file is one compressed stream without an end.
    fn open_rest(&mut self, how: Compression) -> Result<(), Stop> {
        let _ = self.framing.load_up_to(HELD_MAX, &mut self.buffer)?;
        salvage(how, &self.buffer, HELD_MAX, &mut self.chunk.records);
        self.chunk.cut = Some(damage(self.chunk.begin, "the recording was cut off within this chunk"));
        Ok(())
    }

    fn inner(&mut self) -> Result<(), Stop> {
        let mut chunk = std::mem::take(&mut self.chunk);
        let taken = chunk.record().map_err(Stop::Damage).and_then(|inner| {
            self.record(inner.fields, inner.data, chunk.place())?;
            Ok(inner.size)
        });
        chunk.at += *taken.as_ref().unwrap_or(&0);
        self.chunk = chunk;
        taken.map(|_| ())
    }

    /// A connection or a message, from the file or from a chunk that begins at this byte.
    fn record(&mut self, fields: Fields<'_>, data: &[u8], at: u64) -> Result<(), Stop> {
        if !fields.is_whole() {
            return Err(Stop::damage(at, "the header of a record is not made of fields"));
        }
        match fields.u8("op") {
            Some(op::CONNECTION) => self.connections.add(fields, data, at),
            Some(op::MESSAGE) => {
                self.seen.message |= self.connections.take(fields, data, at, &mut self.assembler)?;
                Ok(())
            }
            // An index may stand in a chunk; nothing else may.
            Some(op::INDEX) => Ok(()),
            _ => Err(Stop::damage(at, "a record of an unknown kind")),
        }
    }
}

impl<R: Read> Source for RosbagSource<R> {
    fn format(&self) -> &'static str {
        "rosbag v1"
    }

    fn metadata(&self) -> &[(String, String)] {
        self.assembler.metadata()
    }

    fn progress(&self) -> (u64, u64) {
        self.framing.progress()
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        loop {
            if let Some(record) = self.assembler.next() {
                return Ok(Some(record));
            }
            if self.is_over {
                return Ok(None);
            }
            self.advance()?;
        }
    }

    fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    fn channels(&self) -> Vec<Channel> {
        self.connections.shown()
    }
}

fn cut(head: &Head) -> Damage {
    damage(head.at, format!("the file is cut off within a record that says it has {} bytes", head.length))
}

fn wrong_start(path: &Path, first: &[u8]) -> StreamError {
    match first.strip_prefix(b"#ROSBAG V").or_else(|| first.strip_prefix(b"#ROSRECORD V")) {
        Some(version) if !version.starts_with(b"2.0") => {
            let version = String::from_utf8_lossy(version).trim().to_owned();
            let what = format!("is a bag of format {version}, not of 2.0");
            refused(path, 0, what, "bring it up to date with `rosbag fix` of ROS 1")
        }
        _ => refused(path, 0, "does not begin as a bag of ROS 1 does".into(), "check the file and its kind"),
    }
}
