//! A chunk of a bag: records, decompressed.

use super::framing::Inner;
use crate::ros::damage;
use crate::stream::Damage;

/// The chunk at hand.
#[derive(Default)]
pub(super) struct Chunk {
    /// Where it begins in the file, bytes.
    pub(super) begin: u64,
    pub(super) records: Vec<u8>,
    pub(super) at: usize,
    /// Where `records` stand in the file, where they stand there as they are.
    pub(super) records_at: Option<u64>,
    /// Why there is nothing after `records`.
    pub(super) cut: Option<Damage>,
}

impl Chunk {
    /// Where the record at hand begins in the file, or else the chunk that it is in.
    pub(super) fn place(&self) -> u64 {
        self.records_at.map_or(self.begin, |records_at| records_at + self.at as u64)
    }

    /// Is there something left of it?
    pub(super) const fn is_open(&self) -> bool {
        self.at < self.records.len() || self.cut.is_some()
    }

    /// The next record, or why there is none.
    pub(super) fn record(&self) -> Result<Inner<'_>, Damage> {
        let rest = self.records.get(self.at..).unwrap_or_default();
        Inner::split(rest).ok_or_else(|| match &self.cut {
            Some(cut) => cut.clone(),
            None => damage(self.place(), "a record in a chunk is longer than the rest of the chunk"),
        })
    }
}
