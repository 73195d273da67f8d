//! Writing an MCAP file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};

use super::METADATA_NAME;
use crate::ros::{Emitter, MessageType, TOPICS, Unfit};
use crate::stream::{Record, Sink, StreamError};
use outputs::Whole;

/// Target size of a chunk before compression, bytes: some 0.9 s of states.
const CHUNK_BYTES: u64 = 1 << 20;

/// Chunks are made in memory and written at once, so the file always ends with a whole one.
type Output = NoSeek<BufWriter<File>>;

/// An MCAP file being written; it gets its name when it is complete.
pub struct McapSink {
    path: PathBuf,
    body: Body,
    whole: Whole,
}

impl McapSink {
    /// Begins a file, with metadata; of several pairs with one key the last one counts.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path, metadata: &[(String, String)]) -> Result<Self, StreamError> {
        let failed = |trouble: Trouble| trouble.of(path);
        let (whole, file) = Whole::create(path).map_err(|error| failed(error.into()))?;
        let body = Body::new(file, metadata).map_err(failed)?;
        Ok(Self { path: path.to_owned(), body, whole })
    }
}

impl Sink for McapSink {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        self.body.write(record).map_err(|trouble| trouble.of(&self.path))
    }

    fn finish(self: Box<Self>) -> Result<(), StreamError> {
        let Self { path, body, whole } = *self;
        let committed = body.finish().and_then(|_file| whole.commit().map_err(Trouble::from));
        committed.map_err(|trouble| trouble.of(&path))
    }
}

/// Why something was not written.
#[derive(Debug, thiserror::Error)]
pub(super) enum Trouble {
    #[error("cannot be written ({0})")]
    Mcap(#[from] McapError),
    #[error("cannot be written ({0})")]
    Io(#[from] std::io::Error),
    #[error("{0}")]
    Unfit(#[from] Unfit),
}

impl Trouble {
    pub(super) fn of(&self, path: &Path) -> StreamError {
        let remedy = match self {
            Self::Unfit(_) => "MCAP with ROS messages cannot hold that without loss; repair or leave out the record",
            _ => "check the folder, its permissions and the free space",
        };
        StreamError { file: path.to_owned(), place: None, what: self.to_string(), remedy: remedy.to_owned() }
    }
}

/// The content of a file, whatever its name.
pub(super) struct Body {
    writer: Writer<Output>,
    channels: [Option<u16>; TOPICS.len()],
    emitter: Emitter,
}

impl Body {
    pub(super) fn new(file: File, metadata: &[(String, String)]) -> Result<Self, Trouble> {
        let mut writer = WriteOptions::new()
            .profile("ros1")
            .library(concat!("ravenpose ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_BYTES))
            .compression(Some(mcap::Compression::Zstd))
            // The fastest: these messages come out no larger than at the default level.
            .compression_level(1)
            // In this thread: a chunk takes some milliseconds.
            .compression_threads(0)
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(file)))?;
        if !metadata.is_empty() {
            let metadata = metadata.iter().cloned().collect();
            writer.write_metadata(&Metadata { name: METADATA_NAME.to_owned(), metadata })?;
        }
        Ok(Self { writer, channels: [None; TOPICS.len()], emitter: Emitter::default() })
    }

    pub(super) fn write(&mut self, record: &Record) -> Result<(), Trouble> {
        self.write_at(record, None)
    }

    /// As `write`, with another log time than the record's own, ns since 1970.
    pub(super) fn write_at(&mut self, record: &Record, time_ns: Option<u64>) -> Result<(), Trouble> {
        let (writer, channels) = (&mut self.writer, &mut self.channels);
        self.emitter.emit(record, |message| {
            let channel = match channels[message.topic] {
                Some(channel) => channel,
                None => *channels[message.topic].insert(add_channel(
                    writer,
                    TOPICS[message.topic].name,
                    &TOPICS[message.topic].message,
                )?),
            };
            write_message(writer, channel, time_ns.unwrap_or(message.time_ns), message.sequence, message.bytes)
        })?
    }

    pub(super) fn add_channel(&mut self, topic: &str, message: &MessageType) -> Result<u16, Trouble> {
        add_channel(&mut self.writer, topic, message)
    }

    pub(super) fn write_message(&mut self, channel: u16, time_ns: u64, sequence: u32, bytes: &[u8]) -> Result<(), Trouble> {
        write_message(&mut self.writer, channel, time_ns, sequence, bytes)
    }

    /// Closes the chunk and hands it to the operating system.
    pub(super) fn flush(&mut self) -> Result<(), Trouble> {
        Ok(self.writer.flush()?)
    }

    /// Writes the index and the end.
    pub(super) fn finish(mut self) -> Result<File, Trouble> {
        let _summary = self.writer.finish()?;
        let file = self.writer.into_inner().into_inner().into_inner();
        Ok(file.map_err(std::io::IntoInnerError::into_error)?)
    }
}

fn add_channel(writer: &mut Writer<Output>, topic: &str, message: &MessageType) -> Result<u16, Trouble> {
    let schema = writer.add_schema(message.name, "ros1msg", message.definition.as_bytes())?;
    // What the converters of MCAP keep of a bag's connection.
    let connection = BTreeMap::from([("md5sum".to_owned(), message.md5.to_owned()), ("topic".to_owned(), topic.to_owned())]);
    Ok(writer.add_channel(schema, topic, "ros1", &connection)?)
}

fn write_message(writer: &mut Writer<Output>, channel_id: u16, time_ns: u64, sequence: u32, bytes: &[u8]) -> Result<(), Trouble> {
    let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
    Ok(writer.write_to_known_channel(&header, bytes)?)
}
