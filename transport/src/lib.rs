//! Latest-value links over iceoryx2 shared memory.
//!
//! One place for what every party must set alike: service names, queue depths, the number of peers, and where the shared files
//! live. The settings are made here, in code, so that no configuration file in some working directory can change them.
//! After `open`, [`Writer::prepare`], [`Writer::loan`], [`Writer::send`], [`Reader::drain`] and [`Reader::latest`] allocate nothing, lock nothing and make
//! no system call, but for the one call in which a new peer appears (it is mapped then).
//!
//! This module contains `unsafe`: reading the clock and sleeping until a time.

mod error;
mod event;
mod link;
#[cfg(test)]
mod own;
mod room;
mod settings;

pub use error::TransportError;
pub use event::{Bell, Listener};
pub use link::{DEPTH_MAX, Loan, Message, Probe, ROOM, Reader, Writer};
pub use settings::Settings;

/// `CLOCK_MONOTONIC` in nanoseconds: the one clock of all messages.
pub fn now_ns() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a valid timespec for the duration of the call, and CLOCK_MONOTONIC exists on every Linux.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// Sleeps until `CLOCK_MONOTONIC` reads `deadline_ns`; returns at once when that has passed, and early on a signal.
pub fn sleep_until_ns(deadline_ns: i64) {
    let deadline_ns = deadline_ns.max(0);
    let time = libc::timespec { tv_sec: deadline_ns / 1_000_000_000, tv_nsec: deadline_ns % 1_000_000_000 };
    // SAFETY: `time` is a valid timespec; a null remainder is allowed with TIMER_ABSTIME.
    unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &raw const time, std::ptr::null_mut()) };
}
