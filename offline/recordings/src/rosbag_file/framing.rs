//! The outermost layer of a bag: records of a header (named fields) and data, both with a length before them. A length is
//! believed only as far as the file goes and memory is granted.

use std::io::Read;

use crate::ros::{HELD_MAX, Stop, fill};

/// Largest header of a record, bytes; the usual ones have below 200.
const HEADER_MAX: u32 = 1 << 16;

/// The named fields of a header.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    /// The value of a field.
    pub(super) fn get(&self, name: &str) -> Option<&'a [u8]> {
        self.iter().find_map(|(key, value)| (key == name.as_bytes()).then_some(value))
    }

    /// Is the whole header made of fields?
    pub(super) fn is_whole(&self) -> bool {
        self.iter().map(|(key, value)| 5 + key.len() + value.len()).sum::<usize>() == self.0.len()
    }

    pub(super) fn text(&self, name: &str) -> Option<String> {
        self.get(name).map(|value| String::from_utf8_lossy(value).into_owned())
    }

    pub(super) fn u8(&self, name: &str) -> Option<u8> {
        match self.get(name)? {
            [value] => Some(*value),
            _ => None,
        }
    }

    pub(super) fn u32(&self, name: &str) -> Option<u32> {
        self.get(name)?.try_into().ok().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&self, name: &str) -> Option<u64> {
        self.get(name)?.try_into().ok().map(u64::from_le_bytes)
    }

    /// Seconds, then ns: together ns since 1970.
    pub(super) fn time_ns(&self, name: &str) -> Option<u64> {
        let both = self.u64(name)?;
        Some((both & 0xffff_ffff) * 1_000_000_000 + (both >> 32))
    }

    /// Name and value of each field, as far as they fit.
    fn iter(&self) -> impl Iterator<Item = (&'a [u8], &'a [u8])> {
        let mut rest = self.0;
        std::iter::from_fn(move || {
            let (length, after) = rest.split_first_chunk()?;
            let (field, after) = after.split_at_checked(u32::from_le_bytes(*length) as usize)?;
            let equals = field.iter().position(|byte| *byte == b'=')?;
            rest = after;
            Some((&field[..equals], &field[equals + 1..]))
        })
    }
}

/// A record within a chunk that is in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inner<'a> {
    pub(super) fields: Fields<'a>,
    pub(super) data: &'a [u8],
    /// Bytes of the whole record.
    pub(super) size: usize,
}

impl<'a> Inner<'a> {
    /// The record at the start of these bytes, where it is all there.
    pub(super) fn split(bytes: &'a [u8]) -> Option<Self> {
        let (length, rest) = bytes.split_first_chunk()?;
        let (header, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        let (length, rest) = rest.split_first_chunk()?;
        let (data, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        Some(Self { fields: Fields(header), data, size: bytes.len() - rest.len() })
    }
}

/// Where a record begins and how long its data are, as the file says.
#[derive(Debug, Clone, Copy)]
pub(super) struct Head {
    pub(super) at: u64,
    pub(super) length: u64,
}

/// Takes a file apart.
#[derive(Debug)]
pub(super) struct Framing<R> {
    input: R,
    at: u64,
    /// Size of the file, bytes.
    size: u64,
    /// Header of the last record.
    header: Vec<u8>,
}

impl<R: Read> Framing<R> {
    pub(super) fn new(input: R, size: u64) -> Self {
        Self { input, at: 0, size, header: Vec::new() }
    }

    /// Bytes so far, bytes in all.
    pub(super) fn progress(&self) -> (u64, u64) {
        (self.at, self.size.max(self.at))
    }

    /// The first bytes, as many of them as there are.
    pub(super) fn first(&mut self, count: usize) -> std::io::Result<Vec<u8>> {
        let mut bytes = vec![0; count];
        let filled = self.fill(&mut bytes)?;
        bytes.truncate(filled);
        Ok(bytes)
    }

    /// Fields of the last record.
    pub(super) fn fields(&self) -> Fields<'_> {
        Fields(&self.header)
    }

    /// The next record's header and the length of its data; none at the very end.
    pub(super) fn head(&mut self) -> Result<Option<Head>, Stop> {
        let at = self.at;
        let refused = |what: String| Err(Stop::damage(at, what));
        let cut = || refused("the file is cut off in the header of a record".into());
        let mut length = [0; 4];
        match self.fill(&mut length)? {
            0 => return Ok(None),
            4 => {}
            _ => return cut(),
        }
        let header_length = u32::from_le_bytes(length);
        if u64::from(header_length) > self.size.saturating_sub(self.at) {
            return cut();
        }
        if header_length > HEADER_MAX {
            return refused(format!("the header of a record has {header_length} bytes, more than {HEADER_MAX}"));
        }
        let mut header = std::mem::take(&mut self.header);
        header.resize(header_length as usize, 0);
        let filled = self.fill(&mut header);
        self.header = header;
        if filled? < self.header.len() || self.fill(&mut length)? < 4 {
            return cut();
        }
        if !self.fields().is_whole() {
            return refused("the header of a record is not made of fields".into());
        }
        Ok(Some(Head { at, length: u64::from(u32::from_le_bytes(length)) }))
    }

    /// Reads a record's data into memory; false where the file ends before: then all that there is.
    pub(super) fn load(&mut self, head: &Head, into: &mut Vec<u8>) -> Result<bool, Stop> {
        let there = self.size.saturating_sub(self.at);
        if head.length.min(there) > HELD_MAX {
            let what = format!("a record of {} bytes, more than the {HELD_MAX} that are read at once", head.length);
            return Err(Stop::damage(head.at, what));
        }
        let read = self.load_up_to(head.length.min(there), into)?;
        Ok(read == head.length)
    }

    /// Reads so many bytes, or as many as there are.
    pub(super) fn load_up_to(&mut self, count: u64, into: &mut Vec<u8>) -> std::io::Result<u64> {
        into.clear();
        let read = Read::by_ref(&mut self.input).take(count).read_to_end(into)? as u64;
        self.at += read;
        Ok(read)
    }

    /// Passes over a record's data; false where the file ends before.
    pub(super) fn skip(&mut self, head: &Head) -> std::io::Result<bool> {
        let mut left = head.length;
        let mut piece = [0; 16 << 10];
        while left > 0 {
            let wanted = left.min(piece.len() as u64) as usize;
            let read = self.fill(&mut piece[..wanted])?;
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
