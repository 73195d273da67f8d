//! What reading both containers needs: limits, why reading stops, reading as much as there is.

use std::io::Read;
use std::path::Path;

use crate::stream::{Damage, Place, StreamError};

/// Largest record that is held in memory, and largest chunk after decompression, bytes. Chunks of the usual writers have
/// 0.7 to 4 MiB.
pub(crate) const HELD_MAX: u64 = 64 << 20;
/// Channels that a file may have; recordings of robots have tens.
pub(crate) const CHANNELS_MAX: usize = 1024;
/// Text of definitions that is kept, bytes.
pub(crate) const TEXT_MAX: usize = 16 << 20;

/// Why reading stops.
#[derive(Debug)]
pub(crate) enum Stop {
    /// The file is damaged from there on; everything before it was read.
    Damage(Damage),
    /// The file is whole, but not what can be read.
    Refused {
        /// Where that shows.
        byte: u64,
        what: String,
        remedy: &'static str,
    },
    /// The disk refused.
    Io(std::io::Error),
}

impl From<std::io::Error> for Stop {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

impl Stop {
    /// Damage at a byte.
    pub(crate) fn damage(byte: u64, what: impl Into<String>) -> Self {
        Self::Damage(damage(byte, what))
    }
}

/// What a stop is to who reads: damage that ends the stream, or an error.
pub(crate) fn settle(path: &Path, stop: Stop) -> Result<Damage, StreamError> {
    match stop {
        Stop::Damage(damage) => Ok(damage),
        Stop::Refused { byte, what, remedy } => Err(refused(path, byte, what, remedy)),
        Stop::Io(error) => Err(unreadable(path, &error)),
    }
}

/// The error of a file that is not what can be read.
pub(crate) fn refused(path: &Path, byte: u64, what: String, remedy: &str) -> StreamError {
    StreamError { file: path.to_owned(), place: Some(Place::Byte(byte)), what, remedy: remedy.to_owned() }
}

/// Damage at a byte.
pub(crate) fn damage(byte: u64, what: impl Into<String>) -> Damage {
    Damage { place: Place::Byte(byte), what: what.into() }
}

/// The error of a file that the disk does not give.
pub(crate) fn unreadable(path: &Path, error: &std::io::Error) -> StreamError {
    StreamError {
        file: path.to_owned(),
        place: None,
        what: format!("cannot be read ({error})"),
        remedy: "check the path, its permissions and the disk".to_owned(),
    }
}

/// Reads until the buffer is full or the input ends; how many bytes.
pub(crate) fn fill(input: &mut impl Read, bytes: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < bytes.len() {
        match input.read(&mut bytes[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}
