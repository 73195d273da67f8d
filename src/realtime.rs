//! What the operating system must grant: a core, FIFO priority, locked memory.
//!
//! This module contains `unsafe`: the scheduler call, which no safe wrapper in our tree offers.

use rustix::mm::MlockAllFlags;
use rustix::thread::{CpuSet, sched_setaffinity};
use std::fs::File;
use std::io::Write;

/// A guarantee that could not be had: what, and the exact remedy. One line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing {
    /// What is missing and why.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

impl std::fmt::Display for Missing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy)
    }
}

/// Locks all present and future memory of the process; locked pages are also touched.
///
/// # Errors
/// [`Missing`] with the limit to raise.
pub fn lock_memory() -> Result<(), Missing> {
    rustix::mm::mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(|cause| Missing {
        what: format!("memory cannot be locked ({cause})"),
        remedy: "set LimitMEMLOCK=infinity in the unit, or `* - memlock unlimited` in /etc/security/limits.d/ravenpose.conf"
            .to_owned(),
    })
}

/// Pins the calling thread to one core.
///
/// # Errors
/// [`Missing`] when there is no such core or it is not allowed.
pub fn pin(core: usize) -> Result<(), Missing> {
    let refused = |cause: String| Missing {
        what: format!("the loop cannot be pinned to core {core} ({cause})"),
        remedy: "choose loop.core among the cores that are online and that AllowedCPUs= of the unit and its slice leaves"
            .to_owned(),
    };
    run_on(core).map_err(|cause| refused(cause.to_string()))
}

/// [`pin`] for threads other than the loop's.
///
/// # Errors
/// The system's.
pub fn run_on(core: usize) -> std::io::Result<()> {
    if core >= CpuSet::MAX_CPU {
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "no such core"));
    }
    let mut set = CpuSet::new();
    set.set(core);
    Ok(sched_setaffinity(None, &set)?)
}

/// Keeps the calling thread, and all that it starts from now on, off the loop's core, if there is any other. What an ordinary thread
/// does in the kernel (mapping and locking memory, for one) may hold the core for hundreds of microseconds.
pub fn keep_off(core: usize) {
    let Ok(mut set) = rustix::thread::sched_getaffinity(None) else { return };
    if core < CpuSet::MAX_CPU && set.is_set(core) && set.count() > 1 {
        set.unset(core);
        // Not being allowed to changes nothing but latency.
        let _ = sched_setaffinity(None, &set);
    }
}

/// Gives the calling thread SCHED_FIFO.
///
/// # Errors
/// [`Missing`] with the limit to raise.
pub fn set_fifo(priority: i32) -> Result<(), Missing> {
    let parameter = libc::sched_param { sched_priority: priority };
    // SAFETY: `parameter` is a valid sched_param for the duration of the call; 0 names the calling thread.
    if unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameter) } == 0 {
        return Ok(());
    }
    Err(Missing {
        what: format!("SCHED_FIFO priority {priority} is refused ({})", std::io::Error::last_os_error()),
        remedy: format!(
            "set LimitRTPRIO={priority} in the unit, or `raven - rtprio {priority}` in /etc/security/limits.d/ravenpose.conf"
        ),
    })
}

/// Would real-time throttling take the core away from a FIFO thread that never sleeps?
///
/// # Errors
/// [`Missing`] when it would (measured: 50 ms of every second).
pub fn throttling() -> Result<(), Missing> {
    let read = |name: &str| std::fs::read_to_string(format!("/proc/sys/kernel/sched_rt_{name}_us")).unwrap_or_default();
    let (allowed, period) = (read("runtime"), read("period"));
    let allowed = allowed.trim();
    // The whole period is as good as no limit.
    if allowed == "-1" || (!allowed.is_empty() && allowed == period.trim()) {
        return Ok(());
    }
    Err(Missing {
        what: format!(
            "real-time throttling is on (sched_rt_runtime_us = {}): the kernel takes about 50 ms of every second from a thread that spins",
            if allowed.is_empty() { "unknown" } else { allowed }
        ),
        remedy: "run `sysctl -w kernel.sched_rt_runtime_us=-1`, or choose wait = \"sleep\"".to_owned(),
    })
}

/// Keeps the processor out of deep idle states for as long as the file is open.
///
/// # Errors
/// [`Missing`] when the device cannot be used.
pub fn hold_cpu_dma_latency() -> Result<File, Missing> {
    let path = "/dev/cpu_dma_latency";
    let mut file = File::options().write(true).open(path).map_err(|cause| Missing {
        what: format!("{path} cannot be opened ({cause})"),
        remedy: "install the drop-in ravenposed.service.d/cpu-dma-latency.conf with the udev rule that it gives, or set hold_cpu_dma_latency = false"
            .to_owned(),
    })?;
    file.write_all(&0_i32.to_ne_bytes()).map_err(|cause| Missing {
        what: format!("{path} cannot be written ({cause})"),
        remedy: "set hold_cpu_dma_latency = false".to_owned(),
    })?;
    Ok(file)
}

/// The calling thread's scheduling policy, priority and the cores that it may run on.
pub fn scheduling() -> (i32, i32, Vec<usize>) {
    let mut parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: 0 names the calling thread; `parameter` is valid for the duration of the call.
    let policy = unsafe {
        libc::sched_getparam(0, &raw mut parameter);
        libc::sched_getscheduler(0)
    };
    let cores = rustix::thread::sched_getaffinity(None)
        .map(|set| (0..CpuSet::MAX_CPU).filter(|&core| set.is_set(core)).collect())
        .unwrap_or_default();
    (policy, parameter.sched_priority, cores)
}
