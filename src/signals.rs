//! Stop signals, taken synchronously by the ordinary thread: no handler runs anywhere.
//!
//! This module contains `unsafe`: the signal-mask calls, which have no safe wrapper in our tree.

use std::io;
use std::mem::MaybeUninit;
use std::time::Duration;

const STOP: [libc::c_int; 3] = [libc::SIGTERM, libc::SIGINT, libc::SIGHUP];

fn stop_set() -> libc::sigset_t {
    let mut set = MaybeUninit::<libc::sigset_t>::uninit();
    // SAFETY: `sigemptyset` initialises the whole set; the signal numbers are valid constants.
    unsafe {
        libc::sigemptyset(set.as_mut_ptr());
        for signal in STOP {
            libc::sigaddset(set.as_mut_ptr(), signal);
        }
        set.assume_init()
    }
}

/// Blocks SIGTERM, SIGINT and SIGHUP for this thread and all that it starts.
///
/// # Errors
/// The system's.
pub fn block() -> io::Result<()> {
    let set = stop_set();
    // SAFETY: `set` is valid for the duration of the call; a null old set is allowed.
    match unsafe { libc::pthread_sigmask(libc::SIG_BLOCK, &raw const set, std::ptr::null_mut()) } {
        0 => Ok(()),
        code => Err(io::Error::from_raw_os_error(code)),
    }
}

/// Waits at most `timeout` for one of the blocked stop signals; returns whether one came.
pub fn wait(timeout: Duration) -> bool {
    let set = stop_set();
    let timeout = libc::timespec { tv_sec: timeout.as_secs() as libc::time_t, tv_nsec: i64::from(timeout.subsec_nanos()) };
    // SAFETY: `set` and `timeout` are valid for the duration of the call; a null info is allowed.
    unsafe { libc::sigtimedwait(&raw const set, std::ptr::null_mut(), &raw const timeout) > 0 }
}
