//! Reading an MCAP file from its start to its end, one chunk in memory at a time.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use super::channels::Channels;
use super::chunk::{Chunk, Inner};
use super::framing::{Framing, Head, opcode};
use super::records::{ChannelRecord, Footer, MessageRecord, MetadataRecord, Schema, data_end_crc};
use crate::ros::{Assembler, Stop, damage, refused, settle, unreadable};
use crate::stream::{Channel, Damage, Record, Source, StreamError};

/// An MCAP file being read. Memory: one chunk as it stands in the file and as it is after decompression.
pub struct McapSource<R = BufReader<File>> {
    path: PathBuf,
    framing: Framing<R>,
    chunk: Chunk,
    /// The record at hand, when it is not a chunk.
    buffer: Vec<u8>,
    channels: Channels,
    assembler: Assembler,
    part: Part,
    damage: Option<Damage>,
}

/// Which part of the file is being read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Data,
    /// From this byte on.
    Summary(u64),
    End,
}

impl McapSource {
    /// Opens a file and reads up to its first chunk.
    ///
    /// # Errors
    /// [`StreamError`] where it cannot be read, is no MCAP file, or has states in an encoding other than ROS 1.
    pub fn open(path: &Path) -> Result<Self, StreamError> {
        let opened = File::open(path).and_then(|file| file.metadata().map(|metadata| (file, metadata.len())));
        let (file, size) = opened.map_err(|error| unreadable(path, &error))?;
        McapSource::new(path, BufReader::with_capacity(1 << 16, file), size)
    }
}

impl<R: Read> McapSource<R> {
    /// Reads from anything; `path` is for messages, `size` the number of bytes to come.
    ///
    /// # Errors
    /// As [`McapSource::open`].
    pub fn new(path: &Path, input: R, size: u64) -> Result<Self, StreamError> {
        let mut source = Self {
            path: path.to_owned(),
            framing: Framing::new(input, size),
            chunk: Chunk::default(),
            buffer: Vec::new(),
            channels: Channels::default(),
            assembler: Assembler::default(),
            part: Part::Data,
            damage: None,
        };
        if !source.framing.magic().map_err(|error| unreadable(path, &error))? {
            return Err(refused(path, 0, "does not begin as an MCAP file does".into(), "check the file and its kind"));
        }
        // The metadata of our own files stand before the first chunk.
        while source.part == Part::Data && source.chunk.is_empty() && source.channels.is_empty() {
            source.advance()?;
        }
        Ok(source)
    }

    /// From here on the images of this camera are kept.
    pub(super) fn want_images(&mut self, camera: &str) {
        self.assembler.want_images(camera);
    }

    /// The next image of that camera; records on the way are passed over.
    pub(super) fn next_image(&mut self) -> Result<Option<(i64, Vec<u8>)>, StreamError> {
        loop {
            while self.assembler.next().is_some() {}
            if let Some(image) = self.assembler.next_image() {
                return Ok(Some(image));
            }
            if self.part == Part::End {
                return Ok(None);
            }
            self.advance()?;
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Reads one record, of the file or of the chunk at hand. Damage and errors end the stream here.
    fn advance(&mut self) -> Result<(), StreamError> {
        let stopped = if self.chunk.is_empty() { self.outer() } else { self.inner() };
        let Err(stop) = stopped else { return Ok(()) };
        self.chunk.clear();
        self.end();
        self.damage = Some(settle(&self.path, stop)?);
        Ok(())
    }

    fn end(&mut self) {
        self.part = Part::End;
        self.assembler.end();
    }

    fn outer(&mut self) -> Result<(), Stop> {
        let Some(head) = self.framing.head()? else {
            let (at, _) = self.framing.progress();
            let what = match self.part {
                Part::Data => "the file ends here without an end mark: the recording was cut off",
                _ => "the file ends within its index; all records before it were read",
            };
            return Err(Stop::damage(at, what));
        };
        match (self.part, head.opcode) {
            (Part::Data, opcode::CHUNK) => Ok(self.chunk.load(&mut self.framing, &head)?),
            (Part::Data, opcode::DATA_END) => self.data_end(&head),
            (Part::Data, opcode::FOOTER) => Err(Stop::damage(head.at, "the footer stands where the data have not ended")),
            (Part::Data, opcode::SCHEMA | opcode::CHANNEL | opcode::MESSAGE | opcode::METADATA) => {
                self.load(&head)?;
                let bytes = std::mem::take(&mut self.buffer);
                let taken = self.record(head.opcode, &bytes, head.at);
                self.buffer = bytes;
                taken
            }
            // Unknown kinds are passed over, as the format wants; 0 is none, but what a hole in a file is made of.
            (_, 0) => Err(Stop::damage(head.at, "a record of kind 0, which there is not")),
            (Part::Summary(start), opcode::FOOTER) => self.footer(&head, start),
            _ if self.framing.skip(&head)? => Ok(()),
            _ => Err(Stop::Damage(cut(&head))),
        }
    }

    fn load(&mut self, head: &Head) -> Result<(), Stop> {
        if self.framing.load(head, &mut self.buffer)? { Ok(()) } else { Err(Stop::Damage(cut(head))) }
    }

    /// A record of the data section, from the file or from a chunk that begins at this byte.
    fn record(&mut self, opcode: u8, bytes: &[u8], at: u64) -> Result<(), Stop> {
        let unfit = |what: &'static str| move |error| Stop::damage(at, format!("a {what} record does not fit the format: {error}"));
        match opcode {
            opcode::SCHEMA => self.channels.add_schema(Schema::read(bytes).map_err(unfit("schema"))?, at),
            opcode::CHANNEL => self.channels.add_channel(ChannelRecord::read(bytes).map_err(unfit("channel"))?, at),
            opcode::MESSAGE => {
                let message = MessageRecord::read(bytes).map_err(unfit("message"))?;
                self.channels.take(&message, at, &mut self.assembler)
            }
            opcode::METADATA => self.take_metadata(MetadataRecord::read(bytes).map_err(unfit("metadata"))?, at),
            0 => Err(Stop::damage(at, "a record of kind 0, which there is not")),
            _ => Ok(()),
        }
    }

    /// Our own pairs have their name, others' that of their record before it.
    fn take_metadata(&mut self, record: MetadataRecord, at: u64) -> Result<(), Stop> {
        let own = record.name == super::METADATA_NAME;
        for (key, value) in record.pairs {
            let key = if own { key } else { format!("{}.{key}", record.name) };
            self.assembler.take_pair(key, value).map_err(|error| Stop::damage(at, error.to_string()))?;
        }
        Ok(())
    }

    fn inner(&mut self) -> Result<(), Stop> {
        let at = self.chunk.at();
        let mut chunk = std::mem::take(&mut self.chunk);
        let taken = match chunk.next() {
            Inner::Record(opcode, bytes) => self.record(opcode, bytes, at),
            Inner::End => Ok(()),
            Inner::Damage(damage) => Err(Stop::Damage(damage)),
        };
        self.chunk = chunk;
        taken
    }

    fn data_end(&mut self, head: &Head) -> Result<(), Stop> {
        let computed = self.framing.checksum();
        self.load(head)?;
        let said = data_end_crc(&self.buffer).map_err(|error| Stop::damage(head.at, error.to_string()))?;
        if said != 0 && said != computed {
            let what =
                "the data before it have another checksum than the file says; all records were read, one of them may be damaged";
            return Err(Stop::damage(head.at, what));
        }
        self.framing.restart_checksum();
        self.part = Part::Summary(self.framing.progress().0);
        Ok(())
    }

    fn footer(&mut self, head: &Head, start: u64) -> Result<(), Stop> {
        let end = |what| Err(Stop::damage(head.at, format!("{what}; all records were read")));
        // The footer is part of the summary's checksum, but for its own last field.
        let mut checksum = self.framing.hasher();
        self.load(head)?;
        let Ok(footer) = Footer::read(&self.buffer) else { return end("the footer does not fit the format") };
        checksum.update(&head.bytes);
        checksum.update(&self.buffer[..Footer::CHECKED_BYTES]);
        if footer.summary_start != 0 && footer.summary_start != start {
            return end("the index is elsewhere than the footer says");
        }
        if footer.summary_crc != 0 && footer.summary_crc != checksum.finalize() {
            return end("the index has another checksum than the footer says");
        }
        if !self.framing.magic()? {
            return end("the end mark after it is missing or wrong");
        }
        if self.framing.goes_on()? {
            return end("the file goes on after its end mark");
        }
        self.end();
        Ok(())
    }
}

impl<R: Read> Source for McapSource<R> {
    fn format(&self) -> &'static str {
        "MCAP"
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
            if self.part == Part::End {
                return Ok(None);
            }
            self.advance()?;
        }
    }

    fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    fn channels(&self) -> Vec<Channel> {
        self.channels.shown()
    }
}

fn cut(head: &Head) -> Damage {
    damage(head.at, format!("the file is cut off within a record that says it has {} bytes", head.length))
}
