//! A file to read, compressed or not.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use flate2::bufread::MultiGzDecoder;

/// First bytes of a gzip file.
pub(crate) const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Bytes that are read from the disk at a time.
const BUFFER_BYTES: usize = 1 << 18;

/// Why a file cannot be opened.
#[derive(Debug)]
pub(crate) enum InputProblem {
    /// The system refuses to open it.
    Open(io::Error),
    /// The system refuses to read it.
    Read(io::Error),
    /// The name ends in `.gz`, the content is not gzip.
    NotGzip,
}

/// A file being read from its start to its end, gzip undone.
pub(crate) struct Input {
    reader: Box<dyn BufRead + Send>,
    compressed: bool,
    read: Arc<AtomicU64>,
    total: u64,
}

impl Input {
    /// Opens a file; what it holds decides whether it is compressed, not its name.
    pub(crate) fn open(path: &Path) -> Result<Self, InputProblem> {
        let file = File::open(path).map_err(InputProblem::Open)?;
        let total = file.metadata().map_or(0, |metadata| metadata.len());
        let named_gz = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
        let input = Self::new(file, total).map_err(InputProblem::Read)?;
        if named_gz && !input.compressed {
            return Err(InputProblem::NotGzip);
        }
        Ok(input)
    }

    /// The same from memory.
    pub(crate) fn from_bytes(bytes: Vec<u8>) -> io::Result<Self> {
        let total = bytes.len() as u64;
        Self::new(Cursor::new(bytes), total)
    }

    fn new(mut source: impl Read + Send + 'static, total: u64) -> io::Result<Self> {
        let mut magic = Vec::new();
        source.by_ref().take(GZIP_MAGIC.len() as u64).read_to_end(&mut magic)?;
        let compressed = magic == GZIP_MAGIC;
        let read = Arc::new(AtomicU64::new(0));
        let counted = Counted { source: Cursor::new(magic).chain(source), read: Arc::clone(&read) };
        let buffered = BufReader::with_capacity(BUFFER_BYTES, counted);
        let reader: Box<dyn BufRead + Send> = if compressed {
            Box::new(BufReader::with_capacity(BUFFER_BYTES, MultiGzDecoder::new(buffered)))
        } else {
            Box::new(buffered)
        };
        Ok(Self { reader, compressed, read, total })
    }

    /// Is the file gzip?
    pub(crate) fn compressed(&self) -> bool {
        self.compressed
    }

    /// Bytes of the file taken from the disk so far, and in all.
    pub(crate) fn progress(&self) -> (u64, u64) {
        let read = self.read.load(Ordering::Relaxed);
        (read, self.total.max(read))
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }
}

impl BufRead for Input {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.reader.consume(amount);
    }
}

/// Counts what passes through.
struct Counted<R> {
    source: R,
    read: Arc<AtomicU64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.read.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}
