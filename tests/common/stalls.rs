//! How long the machine itself stopped, measured beside a test that has limits in time.

use ravenpose_transport::{now_ns, sleep_until_ns};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};

/// Above every thread of the service and of the tests.
const PRIORITY: i32 = 95;
const STEP_NS: i64 = 2_000_000;
/// A wake-up later than this is a stop.
const LATE_NS: i64 = 10_000_000;

/// One thread per core that sleeps in steps and adds up by how much it woke late.
pub(crate) struct Stalls {
    lost_ns: Arc<Vec<AtomicI64>>,
    end: Arc<AtomicBool>,
}

impl Stalls {
    pub(crate) fn measure() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let lost_ns: Arc<Vec<AtomicI64>> = Arc::new((0..cores).map(|_| AtomicI64::new(0)).collect());
        let end = Arc::new(AtomicBool::new(false));
        for core in 0..cores {
            let (lost_ns, end) = (Arc::clone(&lost_ns), Arc::clone(&end));
            std::thread::spawn(move || {
                // Without these rights the test's own load counts as well.
                let _ = ravenpose::realtime::pin(core);
                let _ = ravenpose::realtime::set_fifo(PRIORITY);
                while !end.load(Ordering::Relaxed) {
                    let due = now_ns() + STEP_NS;
                    sleep_until_ns(due);
                    let late = now_ns() - due;
                    if late > LATE_NS {
                        lost_ns[core].fetch_add(late, Ordering::Relaxed);
                    }
                }
            });
        }
        Self { lost_ns, end }
    }

    /// What all cores lost so far, in ns: every process that a test waits for may run on any of them.
    pub(crate) fn lost_ns(&self) -> i64 {
        self.lost_ns.iter().map(|lost| lost.load(Ordering::Relaxed)).sum()
    }
}

impl Drop for Stalls {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
    }
}
