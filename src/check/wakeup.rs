//! How late does this machine wake a thread? Measured as cyclictest does.

use super::{Finding, Level};
use crate::realtime;
use ravenpose_transport::now_ns;
use rustix::thread::{ClockId, clock_nanosleep_absolute};
use rustix::time::Timespec;
use std::time::Duration;

const PERIOD_NS: i64 = 1_000_000;
const SECOND_NS: i64 = 1_000_000_000;
/// Longest measurement: one hour, 3.6 million samples, 29 MB.
const DURATION_MAX: Duration = Duration::from_hours(1);
/// Limits of the verdict: the budget of one cycle.
const P999_MAX_NS: u64 = 150_000;
const WORST_MAX_NS: u64 = 500_000;

/// Lateness of wake-ups at 1 kHz.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Wakeup {
    /// Half of the wake-ups are not later than this.
    pub p50_ns: u64,
    /// 99 % are not later than this.
    pub p99_ns: u64,
    /// 99.9 % are not later than this; the maximum when there are fewer than 1000 samples.
    pub p999_ns: u64,
    /// The latest.
    pub max_ns: u64,
    /// Number of wake-ups.
    pub samples: usize,
    /// Was SCHED_FIFO granted? If not, the figures are those of an ordinary thread.
    pub fifo: bool,
}

/// Why there is no measurement.
#[derive(Debug)]
pub enum WakeupError {
    /// The duration is below one period or above an hour.
    Duration(Duration),
    /// The thread cannot run on the wanted core.
    Core(usize, std::io::Error),
    /// The thread could not be started.
    Thread(std::io::Error),
    /// The kernel refused to sleep until a given time.
    Sleep(std::io::Error),
    /// The thread ended by a panic.
    Panicked,
}

impl std::fmt::Display for WakeupError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Duration(wanted) => write!(f, "{wanted:?} is no time to measure wake-ups; give 1 ms to 1 h"),
            Self::Core(core, cause) => {
                write!(f, "wake-ups cannot be measured on core {core} ({cause}); choose a core that nproc --all counts")
            }
            Self::Thread(cause) => write!(f, "the measuring thread cannot be started ({cause})"),
            Self::Sleep(cause) => write!(f, "clock_nanosleep until an absolute time is refused ({cause})"),
            Self::Panicked => write!(f, "the measuring thread ended by itself"),
        }
    }
}

impl std::error::Error for WakeupError {}

/// Measures wake-ups on a thread of its own for `duration`: absolute `clock_nanosleep` at 1 kHz, under SCHED_FIFO where permitted.
/// An overrun of a period or more starts the phase again instead of counting the same delay several times.
///
/// # Errors
/// [`WakeupError`]; a refused SCHED_FIFO is none, see [`Wakeup::fifo`].
pub fn measure_wakeup(duration: Duration, core: Option<usize>, priority: i32) -> Result<Wakeup, WakeupError> {
    let count = usize::try_from(duration.as_nanos() / PERIOD_NS as u128).unwrap_or(usize::MAX);
    if count == 0 || duration > DURATION_MAX {
        return Err(WakeupError::Duration(duration));
    }
    std::thread::Builder::new()
        .name("ravenpose-wake".to_owned())
        .spawn(move || {
            if let Some(core) = core {
                realtime::run_on(core).map_err(|cause| WakeupError::Core(core, cause))?;
            }
            let fifo = realtime::set_fifo(priority).is_ok();
            // Touched before the first sample is taken, so that none of them pays for a page fault.
            let mut lateness = vec![u64::MAX; count];
            sample(&mut lateness).map_err(WakeupError::Sleep)?;
            lateness.sort_unstable();
            Ok(summary(&lateness, fifo))
        })
        .map_err(WakeupError::Thread)?
        .join()
        .unwrap_or(Err(WakeupError::Panicked))
}

fn sample(lateness: &mut [u64]) -> std::io::Result<()> {
    let mut wanted = now_ns() + PERIOD_NS;
    for slot in lateness {
        let until = Timespec { tv_sec: wanted / SECOND_NS, tv_nsec: wanted % SECOND_NS };
        loop {
            match clock_nanosleep_absolute(ClockId::Monotonic, &until) {
                Ok(()) => break,
                Err(rustix::io::Errno::INTR) => {}
                Err(cause) => return Err(cause.into()),
            }
        }
        let now = now_ns();
        *slot = u64::try_from(now - wanted).unwrap_or(0);
        wanted += PERIOD_NS;
        if wanted <= now {
            wanted = now + PERIOD_NS;
        }
    }
    Ok(())
}

/// Nearest-rank quantiles of sorted samples; there is at least one.
fn summary(sorted: &[u64], fifo: bool) -> Wakeup {
    let rank = |per_mille: usize| {
        let index = (sorted.len() * per_mille).div_ceil(1000).max(1) - 1;
        sorted.get(index).copied().unwrap_or(0)
    };
    Wakeup { p50_ns: rank(500), p99_ns: rank(990), p999_ns: rank(999), max_ns: rank(1000), samples: sorted.len(), fifo }
}

impl Wakeup {
    /// The verdict: the budget of a cycle is 150 us in 99.9 % and 500 us always.
    pub fn finding(&self) -> Finding {
        let id = "wakeup";
        let us = |ns: u64| ns as f64 / 1000.0;
        let class = if self.fifo { "FIFO" } else { "without FIFO, which was refused" };
        let found = format!(
            "{:.0} us p50, {:.0} us p99, {:.0} us p99.9, {:.0} us worst of {} wake-ups, {class}",
            us(self.p50_ns),
            us(self.p99_ns),
            us(self.p999_ns),
            us(self.max_ns),
            self.samples
        );
        if self.fifo && self.p999_ns <= P999_MAX_NS && self.max_ns <= WORST_MAX_NS {
            return Finding::ok(id, found);
        }
        let remedy = if self.fifo {
            "settle the findings above, then measure again with the robot's real load running"
        } else {
            "settle limits.rtprio, then measure again"
        };
        let level = if self.max_ns > PERIOD_NS as u64 { Level::Fail } else { Level::Warn };
        Finding { id, level, found, remedy: Some(remedy.to_owned()) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use rustix::thread::CpuSet;

    #[test]
    fn quantiles_are_nearest_rank() {
        let sorted: Vec<u64> = (1..=1000).collect();
        let expected = Wakeup { p50_ns: 500, p99_ns: 990, p999_ns: 999, max_ns: 1000, samples: 1000, fifo: true };
        assert_eq!(summary(&sorted, true), expected);
        let one = summary(&[7], false);
        assert_eq!((one.p50_ns, one.p999_ns, one.max_ns, one.samples), (7, 7, 7, 1));
    }

    #[test]
    fn measures_for_about_the_time_that_was_asked() {
        let began = std::time::Instant::now();
        let wakeup = measure_wakeup(Duration::from_millis(50), None, 10).unwrap();
        assert_eq!(wakeup.samples, 50);
        assert!(began.elapsed() >= Duration::from_millis(50));
        assert!(wakeup.p50_ns <= wakeup.p99_ns && wakeup.p99_ns <= wakeup.p999_ns && wakeup.p999_ns <= wakeup.max_ns);
    }

    #[test]
    fn refuses_what_cannot_be_measured() {
        assert!(matches!(measure_wakeup(Duration::ZERO, None, 10), Err(WakeupError::Duration(_))));
        assert!(matches!(measure_wakeup(Duration::from_secs(9999), None, 10), Err(WakeupError::Duration(_))));
        for core in [CpuSet::MAX_CPU - 1, usize::MAX] {
            let error = measure_wakeup(Duration::from_millis(2), Some(core), 10).unwrap_err();
            assert!(matches!(error, WakeupError::Core(..)), "{error}");
        }
    }

    #[test]
    fn priority_out_of_range_is_said_not_hidden() {
        let wakeup = measure_wakeup(Duration::from_millis(2), None, 1000).unwrap();
        assert!(!wakeup.fifo);
        assert!(wakeup.finding().found.contains("without FIFO"));
        assert_ne!(wakeup.finding().level, Level::Ok);
    }

    #[test]
    fn the_verdict_has_three_steps() {
        let good = Wakeup { p50_ns: 5_000, p99_ns: 9_000, p999_ns: 20_000, max_ns: 60_000, samples: 1000, fifo: true };
        assert_eq!(good.finding().level, Level::Ok);
        assert_eq!(Wakeup { p999_ns: 200_000, ..good }.finding().level, Level::Warn);
        assert_eq!(Wakeup { max_ns: 2_000_000, ..good }.finding().level, Level::Fail);
    }
}
