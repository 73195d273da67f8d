//! A file that appears whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use outputs::Whole;

const BUFFER_BYTES: usize = 1 << 18;

/// A file being written; [`WholeFile::finish`] gives it its name, nothing is left of one that is dropped before.
#[derive(Debug)]
pub(crate) struct WholeFile {
    file: BufWriter<File>,
    whole: Whole,
}

impl WholeFile {
    /// Begins the file.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let (whole, file) = Whole::create(path)?;
        Ok(Self { file: BufWriter::with_capacity(BUFFER_BYTES, file), whole })
    }

    /// Brings everything to the disk and gives the file its name.
    pub(crate) fn finish(self) -> io::Result<()> {
        let _file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        self.whole.commit()
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for WholeFile {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}
