//! How often and how long the machine itself stopped, measured beside a test, and tests that are run again because of it.
#![allow(dead_code)]

use ravenpose_transport::{now_ns, sleep_until_ns};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};

/// Above every thread of the service and of the tests.
const PRIORITY: i32 = 95;
const STEP_NS: i64 = 2_000_000;
/// A wake-up later than this is a stop.
pub(crate) const LATE_NS: i64 = 10_000_000;

/// A stop for which the service's watchdog may end it (180 ms), less what such a thread does not see.
pub(crate) const LONG_NS: i64 = 80_000_000;
/// Times that a test is run while the machine stops for so long.
const ATTEMPTS: u32 = 4;

/// Runs a test; again if it failed and the machine was seen to stop for more than [`LONG_NS`] meanwhile.
pub(crate) fn despite_stops(test: impl Fn()) {
    let stalls = Stalls::measure();
    for attempt in 1.. {
        let before = stalls.long_stops();
        let Err(failure) = std::panic::catch_unwind(std::panic::AssertUnwindSafe(&test)) else { return };
        let stops = stalls.long_stops() - before;
        if stops == 0 || attempt == ATTEMPTS {
            std::panic::resume_unwind(failure);
        }
        println!(
            "failed in attempt {attempt} of {ATTEMPTS}, while the machine stopped {stops} times for more than {} ms",
            LONG_NS / 1_000_000
        );
    }
}

/// One thread per core that sleeps in steps and adds up by how much it woke late.
#[derive(Default)]
pub(crate) struct Stalls(Arc<Seen>);

#[derive(Default)]
struct Seen {
    stops: AtomicU64,
    long_stops: AtomicU64,
    lost_ns: AtomicI64,
    end: AtomicBool,
}

impl Stalls {
    pub(crate) fn measure() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let stalls = Self::default();
        for core in 0..cores {
            let seen = Arc::clone(&stalls.0);
            std::thread::spawn(move || {
                // Without these rights the test's own load counts as well.
                let _ = ravenpose::realtime::pin(core);
                let _ = ravenpose::realtime::set_fifo(PRIORITY);
                while !seen.end.load(Ordering::Relaxed) {
                    let due = now_ns() + STEP_NS;
                    sleep_until_ns(due);
                    let late = now_ns() - due;
                    if late > LATE_NS {
                        seen.stops.fetch_add(1, Ordering::Relaxed);
                        seen.long_stops.fetch_add(u64::from(late > LONG_NS), Ordering::Relaxed);
                        seen.lost_ns.fetch_add(late, Ordering::Relaxed);
                    }
                }
            });
        }
        stalls
    }

    /// How often one core stopped for more than [`LATE_NS`] so far.
    pub(crate) fn stops(&self) -> u64 {
        self.0.stops.load(Ordering::Relaxed)
    }

    /// How often for more than [`LONG_NS`].
    pub(crate) fn long_stops(&self) -> u64 {
        self.0.long_stops.load(Ordering::Relaxed)
    }

    /// What all cores lost by that, in ns.
    pub(crate) fn lost_ns(&self) -> i64 {
        self.0.lost_ns.load(Ordering::Relaxed)
    }
}

impl Drop for Stalls {
    fn drop(&mut self) {
        self.0.end.store(true, Ordering::Relaxed);
    }
}
