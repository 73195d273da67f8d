//! The outermost layer of an MCAP file: magic, then records of an opcode, a length and that many bytes. A length is believed
//! only as far as the file goes and memory is granted.

use std::io::Read;

use crc32fast::Hasher;

use crate::ros::{HELD_MAX, Stop, fill};

/// First and last bytes of a file.
pub(super) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Opcode and length of a record.
pub(super) const HEAD_BYTES: usize = 9;

/// Opcodes (mcap.dev/spec).
pub(super) mod opcode {
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const METADATA: u8 = 0x0c;
    pub(crate) const DATA_END: u8 = 0x0f;
}

/// Opcode and length of a record.
#[derive(Debug, Clone, Copy)]
pub(super) struct Head {
    /// Where the record begins, bytes.
    pub(super) at: u64,
    pub(super) opcode: u8,
    /// Bytes after the head, as the file says.
    pub(super) length: u64,
    pub(super) bytes: [u8; HEAD_BYTES],
}

/// Takes a file apart.
#[derive(Debug)]
pub(super) struct Framing<R> {
    input: R,
    at: u64,
    /// Size of the file, bytes.
    size: u64,
    /// Over everything so far but the last head.
    crc: Hasher,
}

impl<R: Read> Framing<R> {
    pub(super) fn new(input: R, size: u64) -> Self {
        Self { input, at: 0, size, crc: Hasher::new() }
    }

    /// Bytes so far, bytes in all.
    pub(super) fn progress(&self) -> (u64, u64) {
        (self.at, self.size.max(self.at))
    }

    /// Checksum of everything since the start or the last [`Framing::restart_checksum`], without the last head.
    pub(super) fn checksum(&self) -> u32 {
        self.crc.clone().finalize()
    }

    pub(super) fn restart_checksum(&mut self) {
        self.crc = Hasher::new();
    }

    /// The checksum's state, to go on with.
    pub(super) fn hasher(&self) -> Hasher {
        self.crc.clone()
    }

    /// Reads the magic; are these its bytes?
    pub(super) fn magic(&mut self) -> std::io::Result<bool> {
        let mut bytes = [0; MAGIC.len()];
        let whole = self.fill(&mut bytes)? == MAGIC.len();
        self.crc.update(&bytes);
        Ok(whole && bytes == MAGIC)
    }

    /// Is there a byte more?
    pub(super) fn goes_on(&mut self) -> std::io::Result<bool> {
        Ok(self.fill(&mut [0; 1])? > 0)
    }

    /// The next record's head; none at the very end.
    pub(super) fn head(&mut self) -> Result<Option<Head>, Stop> {
        let at = self.at;
        let mut bytes = [0; HEAD_BYTES];
        match self.fill(&mut bytes)? {
            0 => return Ok(None),
            HEAD_BYTES => {}
            _ => return Err(Stop::damage(at, "the file is cut off in the first bytes of a record")),
        }
        let [opcode, length @ ..] = bytes;
        Ok(Some(Head { at, opcode, length: u64::from_le_bytes(length), bytes }))
    }

    /// Reads a record into memory; false where the file ends before it: then all that there is.
    pub(super) fn load(&mut self, head: &Head, into: &mut Vec<u8>) -> Result<bool, Stop> {
        into.clear();
        let there = self.size.saturating_sub(self.at);
        let is_cut = head.length > there;
        if head.length.min(there) > HELD_MAX {
            let what = format!("a record of {} bytes, more than the {HELD_MAX} that are read at once", head.length);
            return Err(Stop::damage(head.at, what));
        }
        self.crc.update(&head.bytes);
        // A file that grows meanwhile ends where it ended when it was opened.
        let read = Read::by_ref(&mut self.input).take(head.length.min(there)).read_to_end(into)?;
        self.at += read as u64;
        self.crc.update(into);
        Ok(!is_cut && read as u64 == head.length)
    }

    /// Passes over a record; false where the file ends before it.
    pub(super) fn skip(&mut self, head: &Head) -> std::io::Result<bool> {
        self.crc.update(&head.bytes);
        let mut left = head.length;
        let mut piece = [0; 16 << 10];
        while left > 0 {
            let wanted = left.min(piece.len() as u64) as usize;
            let read = self.fill(&mut piece[..wanted])?;
            self.crc.update(&piece[..read]);
            left -= read as u64;
            if read < wanted {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Fills as much as the file has.
    fn fill(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let filled = fill(&mut self.input, bytes)?;
        self.at += filled as u64;
        Ok(filled)
    }
}
