//! The bytes of a Parquet file, in a file or in memory.

use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytes::Bytes;
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, Length};

use crate::file::InputProblem;
use crate::stream::StreamError;

/// Bytes that a checksum takes at a time.
const SUM_BYTES: usize = 1 << 18;

/// A file or memory with Parquet in it, and how much of it was read.
#[derive(Clone)]
pub(super) struct Store {
    content: Content,
    length: u64,
    read: Arc<AtomicU64>,
}

#[derive(Clone)]
enum Content {
    File(Arc<File>),
    Memory(Bytes),
}

impl Store {
    pub(super) fn open(path: &Path) -> Result<Self, StreamError> {
        let file = File::open(path).map_err(|error| InputProblem::Open(error).refusal(path))?;
        let length = file.metadata().map_err(|error| InputProblem::Read(error).refusal(path))?.len();
        Ok(Self { content: Content::File(Arc::new(file)), length, read: Arc::default() })
    }

    pub(super) fn memory(bytes: Vec<u8>) -> Self {
        Self { length: bytes.len() as u64, content: Content::Memory(bytes.into()), read: Arc::default() }
    }

    /// Size of the whole, bytes.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// Bytes so far, bytes in all.
    pub(super) fn progress(&self) -> (u64, u64) {
        (self.read.load(Ordering::Relaxed).min(self.length), self.length)
    }

    fn read_at(&self, buffer: &mut [u8], at: u64) -> io::Result<usize> {
        match &self.content {
            Content::File(file) => file.read_at(buffer, at),
            Content::Memory(bytes) => {
                let rest = usize::try_from(at).ok().and_then(|at| bytes.get(at..)).unwrap_or_default();
                let count = rest.len().min(buffer.len());
                buffer[..count].copy_from_slice(&rest[..count]);
                Ok(count)
            }
        }
    }

    /// CRC-32 of a range; none where the file is shorter.
    pub(super) fn checksum(&self, start: u64, length: u64) -> io::Result<Option<u32>> {
        let (mut sum, mut buffer) = (crc32fast::Hasher::new(), vec![0; SUM_BYTES]);
        let mut rest = StoreReader { store: self.clone(), at: start, counts: false }.take(length);
        let mut done = 0;
        loop {
            match rest.read(&mut buffer)? {
                0 => return Ok((done == length).then(|| sum.finalize())),
                count => {
                    sum.update(&buffer[..count]);
                    done += count as u64;
                }
            }
        }
    }
}

impl Length for Store {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for Store {
    type T = StoreReader;

    fn get_read(&self, start: u64) -> Result<StoreReader, ParquetError> {
        Ok(StoreReader { store: self.clone(), at: start, counts: true })
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        // Compared with the file before anything of that size is allocated.
        if start.checked_add(length as u64).is_none_or(|end| end > self.length) {
            return Err(ParquetError::EOF(format!("{length} bytes at byte {start} are beyond the end of the file")));
        }
        let mut bytes = vec![0; length];
        let mut done = 0;
        while done < length {
            match self.read_at(&mut bytes[done..], start + done as u64)? {
                0 => return Err(ParquetError::EOF("the file became shorter".to_owned())),
                count => done += count,
            }
        }
        self.read.fetch_add(length as u64, Ordering::Relaxed);
        Ok(bytes.into())
    }
}

/// Reads on from a place.
pub(super) struct StoreReader {
    store: Store,
    at: u64,
    /// Does it count as progress?
    counts: bool,
}

impl Read for StoreReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.store.read_at(buffer, self.at)?;
        self.at += count as u64;
        if self.counts {
            self.store.read.fetch_add(count as u64, Ordering::Relaxed);
        }
        Ok(count)
    }
}
