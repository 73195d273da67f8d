//! The one clock of a recording.

use std::time::{SystemTime, UNIX_EPOCH};

/// The one clock: the wall's as it was at the start plus the monotonic time since.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock {
    offset_ns: i64,
}

impl Clock {
    pub(crate) fn start() -> Self {
        let wall_ns = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64);
        Self { offset_ns: wall_ns - ravenpose_transport::now_ns() }
    }

    /// A time of `CLOCK_MONOTONIC` as ns since 1970.
    pub(crate) fn stamp(self, monotonic_ns: i64) -> u64 {
        (monotonic_ns + self.offset_ns).max(0) as u64
    }
}
