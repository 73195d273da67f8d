//! How often and how long the machine itself stopped, measured beside a test.
#![allow(dead_code)]

use ravenpose_transport::{now_ns, sleep_until_ns};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};

/// Above every thread of the service and of the tests.
const PRIORITY: i32 = 95;
const STEP_NS: i64 = 2_000_000;
/// A wake-up later than this is a stop.
pub(crate) const LATE_NS: i64 = 10_000_000;

/// One thread per core that sleeps in steps and adds up by how much it woke late.
#[derive(Default)]
pub(crate) struct Stalls(Arc<Seen>);

#[derive(Default)]
struct Seen {
    stops: AtomicU64,
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
