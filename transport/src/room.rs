//! Room in shared memory: asked for before anything is made, and taken at once.
//!
//! A file there is only as large as what was written of it, whatever its length. Who writes to the rest while the file system is full
//! gets SIGBUS, which ends the process: it must never come to that in a controller.

use crate::{Settings, TransportError};
use rustix::fs::{FallocateFlags, Mode, OFlags};
use rustix::io::Errno;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Where POSIX shared memory lies on Linux.
const SHARED: &str = "/dev/shm";

/// Free bytes of the file system of shared memory; as many as one likes where it has no limit or cannot be looked at.
fn free() -> u64 {
    rustix::fs::statvfs(SHARED)
        .map_or(u64::MAX, |said| if said.f_blocks == 0 { u64::MAX } else { said.f_bavail.saturating_mul(said.f_frsize) })
}

/// Is there room for so many bytes?
pub(crate) fn require(bytes: u64) -> Result<(), TransportError> {
    let free = free();
    if free < bytes { Err(missing(bytes, free)) } else { Ok(()) }
}

/// Room that was asked for and is to be taken.
pub(crate) struct Room {
    prefix: String,
    /// Files that are not ours: made earlier, perhaps by programs that leave most of theirs empty.
    others: HashSet<PathBuf>,
}

impl Room {
    /// Asks for so many bytes.
    pub(crate) fn ask(settings: &Settings, bytes: u64) -> Result<Self, TransportError> {
        require(bytes)?;
        Ok(Self { prefix: settings.prefix.clone(), others: files(&settings.prefix).collect() })
    }

    /// Takes the room of all that was made since, so that no writer meets a full file system later.
    pub(crate) fn take(self) -> Result<(), TransportError> {
        for path in files(&self.prefix).filter(|path| !self.others.contains(path)) {
            // Any other failure: another user's, or gone meanwhile.
            if take_file(&path) == Err(Errno::NOSPC) {
                return Err(missing(std::fs::metadata(path).map_or(0, |file| file.len()), free()));
            }
        }
        Ok(())
    }
}

fn files(prefix: &str) -> impl Iterator<Item = PathBuf> {
    let files = std::fs::read_dir(SHARED).into_iter().flatten().flatten();
    files.filter(move |file| file.file_name().to_string_lossy().starts_with(prefix)).map(|file| file.path())
}

fn take_file(path: &Path) -> Result<(), Errno> {
    let file = rustix::fs::open(path, OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW | OFlags::NONBLOCK, Mode::empty())?;
    let stat = rustix::fs::fstat(&file)?;
    let (length, taken) = (stat.st_size.unsigned_abs(), stat.st_blocks.unsigned_abs() * 512);
    if taken >= length {
        return Ok(());
    }
    rustix::fs::fallocate(&file, FallocateFlags::KEEP_SIZE, 0, length)
}

fn missing(bytes: u64, free: u64) -> TransportError {
    TransportError::Room { place: SHARED, needed_kib: bytes.div_ceil(1024), free_kib: free / 1024 }
}
