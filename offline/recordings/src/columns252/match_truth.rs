//! Pairs states with the nearest truth while both stream by.

use std::collections::VecDeque;

use arm::Side;
use ravenpose_wire::RavenState;

use crate::stream::{Record, Truth};

/// States that wait for a truth that is not older than they are; then the last one known is taken.
const WAITING_MAX: usize = 4096;

/// States in their order, each with the truth nearest to it in time.
#[derive(Default)]
pub(super) struct MatchTruth {
    side: Option<Side>,
    waiting: VecDeque<Box<RavenState>>,
    before: Option<Truth>,
}

impl MatchTruth {
    /// Takes a state; gives one back if too many wait.
    pub(super) fn state(&mut self, state: Box<RavenState>) -> Option<(Box<RavenState>, Option<Truth>)> {
        self.waiting.push_back(state);
        if self.waiting.len() <= WAITING_MAX {
            return None;
        }
        self.waiting.pop_front().map(|state| (state, self.before))
    }

    /// Takes a truth. The first one decides which arm's truth is kept.
    pub(super) fn truth(&mut self, truth: &Truth) -> bool {
        *self.side.get_or_insert(truth.side) == truth.side
    }

    /// The next state that is not younger than this truth, which then is its nearest or the one before.
    pub(super) fn next_until(&mut self, truth: &Truth) -> Option<(Box<RavenState>, Option<Truth>)> {
        let time_ns = time_of(self.waiting.front()?);
        if time_ns > truth.time_ns {
            return None;
        }
        let nearest = match self.before {
            Some(before) if distance(time_ns, before.time_ns) < distance(time_ns, truth.time_ns) => before,
            _ => *truth,
        };
        self.waiting.pop_front().map(|state| (state, Some(nearest)))
    }

    /// This truth is now the one before.
    pub(super) fn remember(&mut self, truth: &Truth) {
        self.before = Some(*truth);
    }

    /// The next state when no more truth will come.
    pub(super) fn rest(&mut self) -> Option<(Box<RavenState>, Option<Truth>)> {
        self.waiting.pop_front().map(|state| (state, self.before))
    }
}

fn time_of(state: &RavenState) -> i64 {
    i64::from(state.hdr_stamp_sec) * 1_000_000_000 + i64::from(state.hdr_stamp_nsec)
}

fn distance(a: i64, b: i64) -> u64 {
    a.abs_diff(b)
}

/// Is there anything of this truth that the format holds?
pub(super) fn holds_joints(record: &Record) -> bool {
    matches!(record, Record::Truth(truth) if truth.joints[..3].iter().any(|joint| !joint.is_nan()))
}
