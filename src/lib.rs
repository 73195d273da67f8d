//! ravenpose, the hard-real-time part: from `raven/state` to `raven/pose`.
//!
//! Research software, no clinical use. `ARCHITECTURE.md` has the map. [`cycle`] is one period as a pure function; [`runner`] gives it a
//! clock and shared memory; [`service`] starts it and is the ordinary thread beside it; everything else serves these three.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::todo, clippy::unimplemented))]

pub mod card;
pub mod check;
pub mod config;
pub mod correction;
pub mod cycle;
pub mod frozen;
pub mod guard;
pub mod histogram;
pub mod load;
pub mod memory;
pub mod model;
pub mod network;
pub mod phase;
pub mod realtime;
pub mod report;
pub mod runner;
pub mod service;
pub mod shared;
pub mod signals;
pub mod watch;
pub mod writer;

/// A line in the log; the loop itself never calls this.
pub(crate) fn say(message: &str) {
    use std::io::Write;
    // Not `eprintln!`: it panics when nobody reads any more.
    let _ = writeln!(std::io::stderr(), "ravenposed: {message}");
}
