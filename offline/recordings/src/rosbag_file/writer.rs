//! Writing a bag.

use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use lz4_flex::frame::{BlockMode, BlockSize, FrameEncoder, FrameInfo};

use super::index::{CONNECTIONS, ChunkIndex, bag_header, put_connection, put_record, time};
use super::{MAGIC, op};
use crate::ros::{Emitter, METADATA_TOPIC, Message, TOPICS, Topic, Unfit, encode_pair};
use crate::stream::{Record, Sink, StreamError};
use outputs::Whole;

/// Target size of a chunk before compression, bytes: that of ROS.
const CHUNK_BYTES: usize = 768 << 10;
/// Connection of the metadata; the others are those of [`TOPICS`].
const METADATA: usize = TOPICS.len();

/// How the chunks of a bag are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ChunkCompression {
    /// Not at all, as `rosbag record` does.
    #[default]
    None,
    /// As `rosbag record --lz4` does.
    Lz4,
}

/// A bag being written; it gets its name when it is complete.
pub struct RosbagSink {
    path: PathBuf,
    whole: Whole,
    body: Body,
}

impl RosbagSink {
    /// Begins a bag, with metadata.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path, metadata: &[(String, String)], compression: ChunkCompression) -> Result<Self, StreamError> {
        let begun = Whole::create(path).map_err(Trouble::from).and_then(|(whole, file)| {
            let body = Body::new(file, metadata, compression)?;
            Ok(Self { path: path.to_owned(), whole, body })
        });
        begun.map_err(|trouble| trouble.of(path))
    }
}

impl Sink for RosbagSink {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        self.body.write(record).map_err(|trouble| trouble.of(&self.path))
    }

    fn finish(self: Box<Self>) -> Result<(), StreamError> {
        let Self { path, whole, body } = *self;
        let committed = body.finish().and_then(|_file| Ok(whole.commit()?));
        committed.map_err(|trouble| trouble.of(&path))
    }
}

/// Why something was not written.
#[derive(Debug, thiserror::Error)]
enum Trouble {
    #[error("cannot be written ({0})")]
    Io(#[from] std::io::Error),
    #[error("cannot be written ({0})")]
    Lz4(#[from] lz4_flex::frame::Error),
    #[error("{0}")]
    Unfit(#[from] Unfit),
}

impl Trouble {
    fn of(&self, path: &Path) -> StreamError {
        let remedy = match self {
            Self::Unfit(_) => "a bag cannot hold that without loss; repair or leave out the record",
            _ => "check the folder, its permissions and the free space",
        };
        StreamError { file: path.to_owned(), place: None, what: self.to_string(), remedy: remedy.to_owned() }
    }
}

/// The content of a bag, whatever its name.
struct Body {
    file: BufWriter<File>,
    /// Bytes so far.
    at: u64,
    compression: ChunkCompression,
    /// Pairs that are not written yet: they get the time of the first record.
    metadata: Vec<(String, String)>,
    emitter: Emitter,
    chunk: Vec<u8>,
    index: ChunkIndex,
    known: [bool; CONNECTIONS],
    infos: Vec<Vec<u8>>,
    scratch: Vec<u8>,
}

impl Body {
    fn new(file: File, metadata: &[(String, String)], compression: ChunkCompression) -> Result<Self, Trouble> {
        let mut body = Self {
            file: BufWriter::new(file),
            at: 0,
            compression,
            metadata: metadata.to_vec(),
            emitter: Emitter::default(),
            chunk: Vec::new(),
            index: ChunkIndex::default(),
            known: [false; CONNECTIONS],
            infos: Vec::new(),
            scratch: Vec::new(),
        };
        body.put(MAGIC)?;
        // Its numbers follow at the end.
        body.put(&bag_header(0, 0, 0))?;
        Ok(body)
    }

    fn write(&mut self, record: &Record) -> Result<(), Trouble> {
        self.write_metadata(record.time_ns().max(0) as u64)?;
        let mut emitter = std::mem::take(&mut self.emitter);
        let sent = emitter.emit(record, |message: Message<'_>| self.append(message.topic, message.time_ns, message.bytes));
        self.emitter = emitter;
        sent?
    }

    fn write_metadata(&mut self, time_ns: u64) -> Result<(), Trouble> {
        for (key, value) in std::mem::take(&mut self.metadata) {
            let mut bytes = Vec::new();
            encode_pair(&key, &value, &mut bytes);
            self.append(METADATA, time_ns, &bytes)?;
        }
        Ok(())
    }

    fn append(&mut self, connection: usize, time_ns: u64, bytes: &[u8]) -> Result<(), Trouble> {
        if self.chunk.len() >= CHUNK_BYTES {
            self.finish_chunk()?;
        }
        if !self.known[connection] {
            put_connection(&mut self.chunk, connection, topic(connection));
            self.known[connection] = true;
        }
        self.index.add(connection, time_ns, self.chunk.len());
        let fields: [(&str, &[u8]); 3] =
            [("op", &[op::MESSAGE]), ("conn", &(connection as u32).to_le_bytes()), ("time", &time(time_ns))];
        put_record(&mut self.chunk, &fields, bytes);
        Ok(())
    }

    fn finish_chunk(&mut self) -> Result<(), Trouble> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        self.infos.push(self.index.info(self.at));
        let mut out = std::mem::take(&mut self.scratch);
        out.clear();
        let size = (self.chunk.len() as u32).to_le_bytes();
        let put = |out: &mut Vec<u8>, name: &str, data: &[u8]| {
            put_record(out, &[("op", &[op::CHUNK]), ("compression", name.as_bytes()), ("size", &size)], data);
        };
        match self.compression {
            ChunkCompression::None => put(&mut out, "none", &self.chunk),
            ChunkCompression::Lz4 => put(&mut out, "lz4", &lz4(&self.chunk)?),
        }
        self.index.put(&mut out);
        self.put(&out)?;
        self.scratch = out;
        self.chunk.clear();
        self.index.clear();
        Ok(())
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), Trouble> {
        self.file.write_all(bytes)?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    /// Writes the index and the first record anew.
    fn finish(mut self) -> Result<File, Trouble> {
        self.write_metadata(0)?;
        self.finish_chunk()?;
        let index_at = self.at;
        let mut out = Vec::new();
        let mut connections = 0;
        for connection in (0..CONNECTIONS).filter(|connection| self.known[*connection]) {
            put_connection(&mut out, connection, topic(connection));
            connections += 1;
        }
        out.extend(self.infos.iter().flatten());
        self.put(&out)?;
        self.file.seek(SeekFrom::Start(MAGIC.len() as u64))?;
        self.put(&bag_header(index_at, connections, self.infos.len() as u32))?;
        Ok(self.file.into_inner().map_err(std::io::IntoInnerError::into_error)?)
    }
}

fn topic(connection: usize) -> &'static Topic {
    TOPICS.get(connection).unwrap_or(&METADATA_TOPIC)
}

/// A frame as ROS's own reader wants it (`roslz4`): blocks for themselves without a checksum, one checksum of the whole. Blocks of
/// 256 KiB: whoever reads holds one of them, packed and unpacked.
fn lz4(bytes: &[u8]) -> Result<Vec<u8>, Trouble> {
    let frame = FrameInfo::new().block_mode(BlockMode::Independent).block_size(BlockSize::Max256KB).content_checksum(true);
    let mut encoder = FrameEncoder::with_frame_info(frame, Vec::with_capacity(bytes.len() / 2));
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}
