//! ravenpose, the hard-real-time part: from `raven/state` to `raven/pose`.
//!
//! Research software, no clinical use. `ARCHITECTURE.md` has the map. [`cycle`] is one period as a pure function; [`runner`] gives it a
//! clock and shared memory; [`service`] starts it and is the ordinary thread beside it; everything else serves these three.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::todo, clippy::unimplemented))]

use std::time::{Duration, Instant};

pub mod card;
pub mod check;
pub mod config;
pub mod correction;
pub mod cycle;
pub mod eye;
pub mod frozen;
pub mod guard;
pub mod histogram;
pub mod load;
pub mod memory;
pub mod model;
pub mod network;
pub mod notify;
pub mod phase;
pub mod realtime;
pub mod report;
pub mod runner;
pub mod service;
pub mod shared;
pub mod signals;
pub mod watch;
pub mod writer;

/// How long a log that hangs may hold up the end.
const LAST_WORDS_MAX: Duration = Duration::from_millis(50);

/// Says why, and ends the process; a log that hangs does not keep it from that.
pub(crate) fn abort(message: String) -> ! {
    let begun = Instant::now();
    if let Ok(said) = std::thread::Builder::new().spawn(move || say(&message)) {
        while !said.is_finished() && begun.elapsed() < LAST_WORDS_MAX {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    std::process::abort()
}

/// A line in the log; the loop itself never calls this.
pub(crate) fn say(message: &str) {
    use std::io::Write;
    // Not `eprintln!`: it panics when nobody reads any more.
    let _ = writeln!(std::io::stderr(), "ravenposed: {message}");
}
