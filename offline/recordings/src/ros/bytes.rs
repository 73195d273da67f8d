//! Reading and writing the little-endian values of a ROS 1 message.

/// Most that the pairs of a file may take up, bytes.
pub(super) const METADATA_MAX: usize = 16 << 20;

/// Why the bytes of a message do not fit its definition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// The message ends within a field.
    #[error("the message ends at byte {end}, its field {field} at byte {at} needs {needed} bytes")]
    Short {
        /// Size of the message, bytes.
        end: usize,
        /// The field.
        field: String,
        /// Where the value stands that is not all there, bytes from the start of the message.
        at: usize,
        /// Size of that value, bytes.
        needed: usize,
    },
    /// The message goes on after its last field.
    #[error("the last field ends at byte {at}, the message has {extra} bytes more")]
    Trailing {
        /// Where the last field ends, bytes from the start of the message.
        at: usize,
        /// Bytes after it.
        extra: usize,
    },
    /// More metadata than are kept in memory.
    #[error("the metadata of the file have more than {METADATA_MAX} bytes")]
    TooMuchMetadata,
    /// More values than the field has a meaning for.
    #[error("field {field} has {found} values, at most {most} have a meaning here")]
    TooMany {
        /// The field.
        field: &'static str,
        /// Values in the message.
        found: usize,
        /// Values that are known.
        most: usize,
    },
}

/// Where a reader stands in a message.
#[derive(Debug, Clone)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// The next bytes, all of them or an error.
    pub(crate) fn take(&mut self, count: usize, field: &str) -> Result<&'a [u8], MessageError> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        let Some(taken) = taken else {
            return Err(MessageError::Short { end: self.bytes.len(), field: field.to_owned(), at: self.at, needed: count });
        };
        self.at += count;
        Ok(taken)
    }

    fn array<const SIZE: usize>(&mut self, field: &str) -> Result<[u8; SIZE], MessageError> {
        let mut array = [0; SIZE];
        array.copy_from_slice(self.take(SIZE, field)?);
        Ok(array)
    }

    /// Bytes read so far.
    pub(crate) const fn at(&self) -> usize {
        self.at
    }

    /// Bytes not read yet.
    pub(crate) const fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub(crate) fn u16(&mut self, field: &str) -> Result<u16, MessageError> {
        self.array(field).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self, field: &str) -> Result<u32, MessageError> {
        self.array(field).map(u32::from_le_bytes)
    }

    pub(crate) fn i32(&mut self, field: &str) -> Result<i32, MessageError> {
        self.array(field).map(i32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, field: &str) -> Result<u64, MessageError> {
        self.array(field).map(u64::from_le_bytes)
    }

    pub(crate) fn i64(&mut self, field: &str) -> Result<i64, MessageError> {
        self.array(field).map(i64::from_le_bytes)
    }

    pub(crate) fn f64(&mut self, field: &str) -> Result<f64, MessageError> {
        self.array(field).map(f64::from_le_bytes)
    }

    /// A string: its length, then its bytes.
    pub(crate) fn string(&mut self, field: &str) -> Result<&'a [u8], MessageError> {
        let length = self.u32(field)?;
        self.take(length as usize, field)
    }

    /// `float64[]`: how many, then the values. Nothing is allocated for values that are not there.
    pub(crate) fn f64s(&mut self, field: &str) -> Result<Vec<f64>, MessageError> {
        let count = self.u32(field)? as usize;
        let bytes = self.take(count.saturating_mul(8), field)?;
        Ok(bytes.chunks_exact(8).map(|value| f64::from_le_bytes(std::array::from_fn(|i| value[i]))).collect())
    }

    /// The message must end here.
    pub(crate) fn end(&self) -> Result<(), MessageError> {
        match self.left() {
            0 => Ok(()),
            extra => Err(MessageError::Trailing { at: self.at, extra }),
        }
    }
}

pub(crate) fn put_string(out: &mut Vec<u8>, text: &str) {
    out.extend_from_slice(&(text.len() as u32).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
}

pub(crate) fn put_f64s(out: &mut Vec<u8>, values: &[f64]) {
    out.extend_from_slice(&(values.len() as u32).to_le_bytes());
    for value in values {
        out.extend_from_slice(&value.to_le_bytes());
    }
}

/// `std_msgs/Header`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// Counts up per message.
    pub seq: u32,
    /// Time stamp: whole seconds since 1970.
    pub stamp_sec: u32,
    /// Time stamp: the rest, ns.
    pub stamp_nsec: u32,
}

impl Header {
    /// Time stamp, ns since 1970.
    pub fn time_ns(&self) -> i64 {
        i64::from(self.stamp_sec) * 1_000_000_000 + i64::from(self.stamp_nsec)
    }

    /// With a time stamp of so many ns since 1970, up to the year 2106.
    pub fn at(seq: u32, time_ns: u64) -> Self {
        let (sec, nsec) = (time_ns / 1_000_000_000, time_ns % 1_000_000_000);
        Self { seq, stamp_sec: u32::try_from(sec).unwrap_or(u32::MAX), stamp_nsec: nsec as u32 }
    }

    /// Reads a header; its frame name is passed over.
    pub(crate) fn take(cursor: &mut Cursor<'_>) -> Result<Self, MessageError> {
        let header = Self {
            seq: cursor.u32("header.seq")?,
            stamp_sec: cursor.u32("header.stamp")?,
            stamp_nsec: cursor.u32("header.stamp")?,
        };
        let _frame = cursor.string("header.frame_id")?;
        Ok(header)
    }

    pub(crate) fn put(&self, out: &mut Vec<u8>, frame: &str) {
        for value in [self.seq, self.stamp_sec, self.stamp_nsec] {
            out.extend_from_slice(&value.to_le_bytes());
        }
        put_string(out, frame);
    }
}
