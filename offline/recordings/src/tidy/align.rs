//! Truth to the rows of the nearest states, while both stream by.

use std::collections::VecDeque;

use ravenpose_wire::RavenState;

use crate::stream::{Record, Truth};

/// Rows that wait for truth that comes late, and truth that waits for its rows.
const WINDOW: usize = 2048;

/// A truth further from every row than this belongs to none, ns.
const NEAR_NS: u64 = 20_000_000;

/// A state with the truth of each arm.
pub(super) struct Row {
    pub(super) time_ns: i64,
    pub(super) state: Box<RavenState>,
    pub(super) truths: [Option<Truth>; 2],
}

/// What is on its way from the stream to the table.
#[derive(Default)]
pub(super) struct Align {
    rows: VecDeque<Row>,
    /// Truth later than every row so far.
    ahead: VecDeque<Truth>,
    /// Truth that found no row.
    pub(super) dropped: u64,
}

impl Align {
    /// Takes a record; gives the oldest row back when enough newer ones are there.
    pub(super) fn push(&mut self, record: Record) -> Option<Row> {
        match record {
            Record::Truth(truth) => self.take_truth(truth),
            Record::State(_) => {
                let time_ns = record.time_ns();
                let Record::State(state) = record else { return None };
                self.rows.push_back(Row { time_ns, state, truths: [None, None] });
                while self.ahead.front().is_some_and(|truth| truth.time_ns <= time_ns) {
                    if let Some(truth) = self.ahead.pop_front() {
                        self.attach(truth);
                    }
                }
            }
        }
        if self.rows.len() > WINDOW { self.rows.pop_front() } else { None }
    }

    /// The next row when no more records come.
    pub(super) fn rest(&mut self) -> Option<Row> {
        while let Some(truth) = self.ahead.pop_front() {
            self.attach(truth);
        }
        self.rows.pop_front()
    }

    fn take_truth(&mut self, truth: Truth) {
        if self.rows.back().is_some_and(|row| row.time_ns >= truth.time_ns) {
            self.attach(truth);
            return;
        }
        if self.ahead.len() >= WINDOW {
            self.ahead.pop_front();
            self.dropped += 1;
        }
        self.ahead.push_back(truth);
    }

    /// Puts a truth into the nearest row, unless that has a nearer one.
    fn attach(&mut self, truth: Truth) {
        let after = self.rows.partition_point(|row| row.time_ns < truth.time_ns);
        let distance = |index: usize| self.rows.get(index).map(|row| (row.time_ns.abs_diff(truth.time_ns), index));
        let before = after.checked_sub(1).and_then(distance);
        let nearest = [before, distance(after)].into_iter().flatten().min();
        let Some((off_ns, index)) = nearest.filter(|(off_ns, _)| *off_ns <= NEAR_NS) else {
            self.dropped += 1;
            return;
        };
        let Some(row) = self.rows.get_mut(index) else { return };
        let place = &mut row.truths[truth.side.index()];
        let is_nearer = place.is_none_or(|other| off_ns < other.time_ns.abs_diff(row.time_ns));
        self.dropped += u64::from(place.is_some());
        if is_nearer {
            *place = Some(truth);
        }
    }
}
