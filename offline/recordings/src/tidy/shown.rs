//! What a recording of states holds, which decides on the columns of its table.

use arm::Side;

use super::align::{Align, Row};
use super::columns::TruthShown;
use crate::fields;
use crate::stream::{Record, Source, StreamError};

/// The connected arms, and what the truth of each knows.
#[derive(Default)]
pub struct Shown {
    arms: u32,
    /// Time of the first state, which truth may stand before, ns.
    pub(super) first_state_ns: Option<i64>,
    truths: [TruthShown; 2],
    align: Align,
}

impl Shown {
    /// Of all that a source gives, from its first record to its last: its whole file is read for that.
    ///
    /// # Errors
    /// [`StreamError`] of the source.
    pub fn in_all_of(source: &mut dyn Source) -> Result<Self, StreamError> {
        let mut shown = Self::default();
        while let Some(record) = source.next()? {
            shown.include(record);
        }
        Ok(shown.ended())
    }

    /// Also what this record holds, which comes after all the others.
    pub(super) fn include(&mut self, record: Record) {
        self.arms |= match &record {
            Record::State(state) => {
                self.first_state_ns.get_or_insert(record.time_ns());
                match state.connected() {
                    0 => fields::arms_by_content(state),
                    connected => connected,
                }
            }
            Record::Truth(truth) => 1 << truth.side.index(),
        };
        if let Some(row) = self.align.push(record) {
            self.include_row(&row);
        }
    }

    /// No more records come.
    pub(super) fn ended(mut self) -> Self {
        while let Some(row) = self.align.rest() {
            self.include_row(&row);
        }
        self
    }

    fn include_row(&mut self, row: &Row) {
        for (shown, truth) in self.truths.iter_mut().zip(&row.truths) {
            if let Some(truth) = truth {
                shown.include(truth);
                shown.offset |= truth.time_ns != row.time_ns;
            }
        }
    }

    /// Gold where no record shows an arm.
    pub(super) fn arms(&self) -> Vec<Side> {
        match self.arms & 3 {
            2 => vec![Side::Green],
            3 => Side::ALL.to_vec(),
            _ => vec![Side::Gold],
        }
    }

    pub(super) fn truth(&self, side: Side, all: bool) -> TruthShown {
        if all { TruthShown::ALL } else { self.truths[side.index()] }
    }
}
