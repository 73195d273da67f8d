//! Room in shared memory: asked for before anything is made, and taken at once.
//!
//! A file there is only as large as what was written of it, whatever its length. Who writes to the rest while the file system is full
//! gets SIGBUS, which ends the process: it must never come to that in a controller.

use crate::{Settings, TransportError};
use rustix::fs::{FallocateFlags, Mode, OFlags};
use rustix::io::Errno;

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

/// Takes the room of every shared file that this process writes to, so that it never meets a full file system later.
pub(crate) fn take(settings: &Settings) -> Result<(), TransportError> {
    let Ok(maps) = std::fs::read_to_string("/proc/self/maps") else { return Ok(()) };
    let ours = format!("{SHARED}/{}", settings.prefix);
    let paths =
        maps.lines().filter(|line| line.split(' ').nth(1).is_some_and(|rights| rights.starts_with("rw") && rights.ends_with('s')));
    let mut paths: Vec<&str> = paths.filter_map(|line| line.find(&ours).map(|at| &line[at..])).collect();
    paths.dedup();
    for path in paths {
        // Any other failure: removed meanwhile, or a file system that has nothing to give.
        if let Err(Errno::NOSPC | Errno::DQUOT | Errno::NOMEM | Errno::INTR) = take_file(path) {
            return Err(missing(std::fs::metadata(path).map_or(0, |file| file.len()), free()));
        }
    }
    Ok(())
}

fn take_file(path: &str) -> Result<(), Errno> {
    /// Signals that may come meanwhile: each undoes what was taken.
    const INTERRUPTIONS: usize = 100;
    let file = rustix::fs::open(path, OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW | OFlags::NONBLOCK, Mode::empty())?;
    let stat = rustix::fs::fstat(&file)?;
    let (length, taken) = (stat.st_size.unsigned_abs(), stat.st_blocks.unsigned_abs() * 512);
    if taken >= length {
        return Ok(());
    }
    let take = || rustix::fs::fallocate(&file, FallocateFlags::KEEP_SIZE, 0, length);
    (0..INTERRUPTIONS).map(|_| take()).find(|done| *done != Err(Errno::INTR)).unwrap_or(Err(Errno::INTR))
}

fn missing(bytes: u64, free: u64) -> TransportError {
    TransportError::Room { place: SHARED, needed_kib: bytes.div_ceil(1024), free_kib: free / 1024 }
}
