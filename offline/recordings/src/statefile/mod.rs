//! The file of states that the stand-in for RAVEN's controller replays.
//!
//! Little-endian. A header of 64 bytes, then the records, each the raw bytes of a `RavenState`:
//!
//! | offset | type | content |
//! | --- | --- | --- |
//! | 0 | 8 bytes | `RVNSTATE` |
//! | 8 | u32 | format version, 1 |
//! | 12 | u32 | size of a record, that of `RavenState` |
//! | 16 | u64 | number of records |
//! | 24 | i64 | period, ns |
//! | 32 | u64 | FNV-1a (64 bits) of all bytes after the header |
//! | 40 | 24 bytes | zero |
//!
//! Record `i` has sequence `i + 1` and a time relative to the start; whoever replays it writes the time anew.
//!
//! [`read`] and [`write()`] hold all states in memory and refuse whatever is damaged; [`Reader`] and [`Writer`] stream, and a
//! damaged file yields what stands before the damage.
//!
//! This module contains `unsafe`: records are written and read as the bytes of a repr(C) struct.

mod stream;

pub use stream::{LOSSES, Reader, Writer};

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use ravenpose_wire::{RavenState, Refusal};

use crate::file::WholeFile;

/// First eight bytes.
pub const MAGIC: [u8; 8] = *b"RVNSTATE";
/// Version of the file, not of the records.
pub const FORMAT_VERSION: u32 = 1;
/// Size of the header, bytes.
pub const HEADER_BYTES: usize = 64;
/// Period of RAVEN's controller, ns.
pub const PERIOD_NS: i64 = 1_000_000;

const RECORD_BYTES: usize = size_of::<RavenState>();

#[cfg(not(target_endian = "little"))]
compile_error!("state files and messages are little-endian");

// All bytes of a `RavenState` belong to fields, none is padding: 10 words of 8 bytes' worth of header and guards, and the
// fields of raven_state. Viewing it as bytes rests on this.
const _: () = assert!(RECORD_BYTES == FIELD_BYTES, "RavenState has padding or a new field: review the byte views below");
const FIELD_BYTES: usize = 2 * 4 // version, size
    + 3 * 8 + 8 // guard_head, source_id, sequence, source_time_ns
    + 4 * 4 // arms, hdr_seq, hdr_stamp_sec, hdr_stamp_nsec
    + 4 * (3 + 2) // runlevel, sublevel, last_seq, type_
    + 4 * (6 + 18 + 18 + 6 + 2) // pos, ori, ori_d, pos_d, dt
    + 4 * (9 * 16) // enc_vals, dac_val, tau, mpos, jpos, mvel, jvel, mpos_d, jpos_d
    + 4 * (2 + 16 + 12 + 12) // grasp_d, encoffsets, jac_vel, jac_f
    + 4 + 8; // reserved, guard_tail

/// The content of a state file.
#[derive(Debug, Clone, PartialEq)]
pub struct StateFile {
    /// Period at which to replay, ns.
    pub period_ns: i64,
    /// States with sequence 1, 2, 3, ...
    pub states: Vec<RavenState>,
}

/// Why a state file was not read or written: one line with the file, what is wrong and the remedy.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display().to_string().escape_debug())]
pub struct StateFileError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong.
    pub problem: StateFileProblem,
}

/// What is wrong with a state file.
#[derive(Debug, thiserror::Error)]
pub enum StateFileProblem {
    /// Reading failed.
    #[error("cannot be read ({0}); check the path and its permissions")]
    Read(std::io::Error),
    /// Writing failed; nothing is left under the name.
    #[error("cannot be written ({0}); check the folder, its permissions and the free space")]
    Write(std::io::Error),
    /// Shorter than a header.
    #[error("has {bytes} bytes, less than the header of {HEADER_BYTES}; write it again")]
    NoHeader {
        /// Size of the file.
        bytes: usize,
    },
    /// Another kind of file.
    #[error("does not begin with RVNSTATE; it is not a state file")]
    Magic,
    /// Another version of the file.
    #[error("has format version {found}, this program reads {FORMAT_VERSION}; write it again with this release")]
    Version {
        /// The file's version.
        found: u32,
    },
    /// Records of another layout.
    #[error("has records of {found} bytes, RavenState has {RECORD_BYTES}; write it again with this release")]
    RecordSize {
        /// The file's record size.
        found: u32,
    },
    /// A period that no replay can keep.
    #[error("has a period of {found} ns, which must be positive; write it again")]
    Period {
        /// The file's period.
        found: i64,
    },
    /// Something where zeros belong.
    #[error("has something in the reserved bytes 40..64 of its header; write it again with this release")]
    Reserved,
    /// No record.
    #[error("holds no states; write at least one")]
    Empty,
    /// Too short or too long.
    #[error("says {said} records but has {found} bytes after its header; it was cut short or appended to, write it again")]
    Count {
        /// Records according to the header.
        said: u64,
        /// Bytes after the header.
        found: u64,
    },
    /// Changed content.
    #[error("has hash {found:016x}, its header says {said:016x}; it was damaged, write it again")]
    Hash {
        /// Hash according to the header.
        said: u64,
        /// Hash of the records.
        found: u64,
    },
    /// A record that no bridge would take.
    #[error("record {index} {what}; write the states again")]
    Record {
        /// Counted from 0.
        index: usize,
        /// What is wrong with it.
        what: &'static str,
    },
}

/// Writes states: under a temporary name in the same folder, to the disk, then renamed. On failure nothing is left.
///
/// # Errors
/// [`StateFileError`]; also for states without sequence 1, 2, 3, ...
pub fn write(path: &Path, states: &[RavenState], period_ns: i64) -> Result<(), StateFileError> {
    let failed = |problem| StateFileError { file: path.to_owned(), problem };
    check_period(period_ns).and_then(|()| check_records(states)).map_err(failed)?;
    write_whole(path, states, period_ns).map_err(|error| failed(StateFileProblem::Write(error)))
}

/// Reads and checks a state file.
///
/// # Errors
/// [`StateFileError`] for anything that is not as written by [`write()`].
pub fn read(path: &Path) -> Result<StateFile, StateFileError> {
    read_checked(path).map_err(|problem| StateFileError { file: path.to_owned(), problem })
}

fn write_whole(path: &Path, states: &[RavenState], period_ns: i64) -> std::io::Result<()> {
    let records = as_bytes(states);
    let mut file = WholeFile::create(path)?;
    file.write_all(&header(states.len() as u64, period_ns, fnv1a(records)))?;
    file.write_all(records)?;
    file.finish()
}

fn header(count: u64, period_ns: i64, hash: u64) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[0..8].copy_from_slice(&MAGIC);
    header[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
    header[12..16].copy_from_slice(&(RECORD_BYTES as u32).to_le_bytes());
    header[16..24].copy_from_slice(&count.to_le_bytes());
    header[24..32].copy_from_slice(&period_ns.to_le_bytes());
    header[32..40].copy_from_slice(&hash.to_le_bytes());
    header
}

fn read_checked(path: &Path) -> Result<StateFile, StateFileProblem> {
    let mut file = File::open(path).map_err(StateFileProblem::Read)?;
    let mut header = Vec::with_capacity(HEADER_BYTES);
    Read::by_ref(&mut file).take(HEADER_BYTES as u64).read_to_end(&mut header).map_err(StateFileProblem::Read)?;
    let Ok(header) = <[u8; HEADER_BYTES]>::try_from(header.as_slice()) else {
        return Err(StateFileProblem::NoHeader { bytes: header.len() });
    };
    let (count, period_ns, hash) = check_header(&header)?;
    // The size is compared with the file's before anything of that size is allocated.
    let found = file.metadata().map_err(StateFileProblem::Read)?.len().saturating_sub(HEADER_BYTES as u64);
    if count.checked_mul(RECORD_BYTES as u64) != Some(found) {
        return Err(StateFileProblem::Count { said: count, found });
    }
    let mut states = vec![RavenState::new(); count as usize];
    file.read_exact(as_bytes_mut(&mut states)).map_err(StateFileProblem::Read)?;
    let found = fnv1a(as_bytes(&states));
    if found != hash {
        return Err(StateFileProblem::Hash { said: hash, found });
    }
    check_records(&states)?;
    Ok(StateFile { period_ns, states })
}

/// Count, period and hash of a header in which everything else is as it must be.
fn check_header(header: &[u8; HEADER_BYTES]) -> Result<(u64, i64, u64), StateFileProblem> {
    let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| header[at + i]));
    let long = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| header[at + i]));
    if header[..8] != MAGIC {
        return Err(StateFileProblem::Magic);
    }
    if word(8) != FORMAT_VERSION {
        return Err(StateFileProblem::Version { found: word(8) });
    }
    if word(12) as usize != RECORD_BYTES {
        return Err(StateFileProblem::RecordSize { found: word(12) });
    }
    if header[40..].iter().any(|byte| *byte != 0) {
        return Err(StateFileProblem::Reserved);
    }
    let period_ns = long(24) as i64;
    check_period(period_ns)?;
    Ok((long(16), period_ns, long(32)))
}

fn check_period(period_ns: i64) -> Result<(), StateFileProblem> {
    if period_ns > 0 { Ok(()) } else { Err(StateFileProblem::Period { found: period_ns }) }
}

/// Checked before writing and after reading: whole records of this layout, numbered from 1.
fn check_records(states: &[RavenState]) -> Result<(), StateFileProblem> {
    if states.is_empty() {
        return Err(StateFileProblem::Empty);
    }
    for (index, state) in states.iter().enumerate() {
        check_record(index as u64, state).map_err(|what| StateFileProblem::Record { index, what })?;
    }
    Ok(())
}

/// What is wrong with a record, counted from 0.
fn check_record(index: u64, state: &RavenState) -> Result<(), &'static str> {
    match state.admit() {
        Err(Refusal::Layout) => Err("has another layout"),
        Err(Refusal::Torn) => Err("is torn"),
        Ok(()) if state.sequence != index + 1 => Err("is out of sequence"),
        Ok(()) => Ok(()),
    }
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo; offset basis and prime of the authors' page): against damage, not against malice.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    fnv1a_on(FNV_BASIS, bytes)
}

const FNV_BASIS: u64 = 0xcbf2_9ce4_8422_2325;

/// Goes on hashing.
fn fnv1a_on(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

fn as_bytes(states: &[RavenState]) -> &[u8] {
    // SAFETY: `RavenState` is repr(C), holds numbers only and has no padding (asserted above), so all `size_of_val` bytes
    // are initialised; the view borrows `states`.
    unsafe { std::slice::from_raw_parts(states.as_ptr().cast(), size_of_val(states)) }
}

fn as_bytes_mut(states: &mut [RavenState]) -> &mut [u8] {
    // SAFETY: as above, and every bit pattern is a valid integer or float, so whatever is written leaves valid states.
    unsafe { std::slice::from_raw_parts_mut(states.as_mut_ptr().cast(), size_of_val(states)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Test vectors of the authors' page.
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
