//! A stretch of a recording: what lies outside is passed over while the file streams by.

use crate::stream::{Channel, Damage, Record, Source, StreamError};
use crate::table::{Batch, ColumnCells, TableColumn, TableSource, time_column};

/// From when to when, s after the first record or row: `from_s <= t < to_s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Its begin, s.
    pub from_s: f64,
    /// Its end, s; infinity for that of the recording.
    pub to_s: f64,
}

impl Stretch {
    /// All of a recording.
    pub const ALL: Self = Self { from_s: 0.0, to_s: f64::INFINITY };

    /// Is this time, s after the first, within it?
    pub fn holds(self, after_s: f64) -> bool {
        self.from_s <= after_s && after_s < self.to_s
    }
}

/// States and truth of a stretch.
pub struct CutSource {
    source: Box<dyn Source>,
    stretch: Stretch,
    first_ns: Option<i64>,
}

impl CutSource {
    /// Of `source`, which stands at its first record.
    pub fn new(source: Box<dyn Source>, stretch: Stretch) -> Self {
        Self { source, stretch, first_ns: None }
    }
}

impl Source for CutSource {
    fn format(&self) -> &'static str {
        self.source.format()
    }

    fn metadata(&self) -> &[(String, String)] {
        self.source.metadata()
    }

    fn progress(&self) -> (u64, u64) {
        self.source.progress()
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        // To the end of the file, in any order of times: damage is found as without a cut.
        while let Some(record) = self.source.next()? {
            let first_ns = *self.first_ns.get_or_insert(record.time_ns());
            if self.stretch.holds(record.time_ns().saturating_sub(first_ns) as f64 * 1e-9) {
                return Ok(Some(record));
            }
        }
        Ok(None)
    }

    fn damage(&self) -> Option<&Damage> {
        self.source.damage()
    }

    fn channels(&self) -> Vec<Channel> {
        self.source.channels()
    }
}

/// Rows of a stretch of a table.
pub struct CutTable {
    source: Box<dyn TableSource>,
    stretch: Stretch,
    time: usize,
    first_s: Option<f64>,
    rows: Batch,
}

impl CutTable {
    /// Of `source`, which stands at its first row; none where the table has no column `t_s`. A row without a time is left out.
    pub fn new(source: Box<dyn TableSource>, stretch: Stretch) -> Option<Self> {
        let time = time_column(source.columns())?;
        let rows = Batch::new(source.columns());
        Some(Self { source, stretch, time, first_s: None, rows })
    }
}

impl TableSource for CutTable {
    fn format(&self) -> &'static str {
        self.source.format()
    }

    fn metadata(&self) -> &[(String, String)] {
        self.source.metadata()
    }

    fn columns(&self) -> &[TableColumn] {
        self.source.columns()
    }

    fn progress(&self) -> (u64, u64) {
        self.source.progress()
    }

    fn next(&mut self, batch: &mut Batch) -> Result<bool, StreamError> {
        batch.clear();
        if !self.source.next(&mut self.rows)? {
            return Ok(false);
        }
        let Some(ColumnCells::Numbers(times)) = self.rows.columns.get(self.time) else { return Ok(true) };
        let kept: Vec<bool> = times
            .iter()
            .map(|time| {
                if self.first_s.is_none() && time.is_finite() {
                    self.first_s = Some(*time);
                }
                self.first_s.is_some_and(|first_s| self.stretch.holds(time - first_s))
            })
            .collect();
        for (to, from) in batch.columns.iter_mut().zip(&self.rows.columns) {
            match (to, from) {
                (ColumnCells::Numbers(to), ColumnCells::Numbers(from)) => {
                    to.extend(from.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(value, _)| value));
                }
                (ColumnCells::Texts(to), ColumnCells::Texts(from)) => {
                    from.iter().zip(&kept).filter(|(_, kept)| **kept).for_each(|(text, _)| to.push(text));
                }
                // Both were made for the same columns.
                _ => debug_assert!(false, "cells of another kind"),
            }
        }
        Ok(true)
    }

    fn damage(&self) -> Option<&Damage> {
        self.source.damage()
    }

    fn findings(&self) -> Vec<String> {
        self.source.findings()
    }

    fn cells_lost(&self) -> u64 {
        self.source.cells_lost()
    }
}
