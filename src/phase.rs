//! When will the next state come? A phase lock on observed arrivals, as pure arithmetic.
//!
//! The stamp of a state says when its control cycle was, not when it was handed over: a controller may stamp early and publish late.
//! So the lock learns the offset between the two, from arrivals that it saw (it was polling) and from those that it can only bracket
//! (it was asleep).

/// The lock.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "the unit belongs to each name")]
pub struct PhaseLock {
    period_ns: i64,
    spin_ns: i64,
    grace_ns: i64,
    /// From a state's stamp to its arrival.
    offset_ns: i64,
}

/// A wait: sleep, then poll.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Sleep until here.
    pub wake_ns: i64,
    /// Poll until here.
    pub deadline_ns: i64,
}

/// How a state was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// It came while the loop polled: its arrival is known.
    Polling,
    /// It was there when the loop woke: it came earlier.
    Waiting,
    /// It was there when the loop woke, after a poll that ended without one: it came between the two.
    AfterMiss,
}

impl PhaseLock {
    /// A lock for states every `period_ns`, polling `spin_ns` before one is due.
    pub fn new(period_ns: i64, spin_ns: i64) -> Self {
        let spin_ns = spin_ns.min(period_ns / 2);
        // At least a quarter of each period is slept, so that real-time throttling never finds a loop that does not sleep.
        let grace_ns = period_ns - spin_ns - period_ns / 4;
        Self { period_ns, spin_ns, grace_ns, offset_ns: 0 }
    }

    /// The first expected arrival after `now_ns`, given the newest state's stamp.
    pub fn expected_ns(&self, stamp_ns: Option<i64>, now_ns: i64) -> i64 {
        let Some(stamp) = stamp_ns else { return now_ns + self.period_ns };
        let first = stamp.min(now_ns) + self.offset_ns;
        if first > now_ns { first } else { first + self.period_ns * ((now_ns - first) / self.period_ns + 1) }
    }

    /// What to do from `now_ns` on.
    pub fn plan(&self, stamp_ns: Option<i64>, now_ns: i64) -> Plan {
        let mut expected = self.expected_ns(stamp_ns, now_ns);
        // A state taken a moment before it was due must not be waited for again.
        if stamp_ns.is_some_and(|stamp| expected - stamp < self.offset_ns + self.period_ns / 2) {
            expected += self.period_ns;
        }
        Plan { wake_ns: (expected - self.spin_ns).max(now_ns), deadline_ns: expected + self.grace_ns }
    }

    /// Learns from a state with stamp `stamp_ns` that was taken at `now_ns`.
    pub fn learn(&mut self, found: Found, stamp_ns: i64, now_ns: i64) {
        const STEP_NS: i64 = 20_000;
        let offset = match found {
            Found::Polling => {
                let seen = (now_ns - stamp_ns).rem_euclid(self.period_ns);
                self.offset_ns + (seen - self.offset_ns) / 4
            }
            Found::Waiting => self.offset_ns - STEP_NS,
            Found::AfterMiss => self.offset_ns + self.grace_ns,
        };
        // An offset of a whole period is none: the state before it.
        self.offset_ns = offset.rem_euclid(self.period_ns);
        if found == Found::Waiting && offset < 0 {
            self.offset_ns = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: i64 = 1_000_000;

    /// Runs the lock against a controller that publishes `delay` after its stamp, with `jitter`; returns the latencies of the last half.
    fn latencies(delay: i64, jitter: i64, cycles: i64) -> Vec<i64> {
        let mut lock = PhaseLock::new(PERIOD, 200_000);
        let arrival = |k: i64| k * PERIOD + delay + (k * 7919 % (2 * jitter + 1)) - jitter;
        let (mut now, mut taken, mut missed) = (0, -1, false);
        let mut stamp = None;
        let mut late = Vec::new();
        while taken < cycles {
            let plan = lock.plan(stamp, now);
            let next = taken + 1;
            let woke = plan.wake_ns.max(now) + 30_000;
            let (at, found) = if arrival(next) <= woke {
                (woke, if missed { Found::AfterMiss } else { Found::Waiting })
            } else if arrival(next) < plan.deadline_ns {
                (arrival(next), Found::Polling)
            } else {
                now = plan.deadline_ns.max(woke);
                missed = true;
                continue;
            };
            // The newest that has arrived.
            taken = next;
            while arrival(taken + 1) <= at {
                taken += 1;
            }
            lock.learn(found, taken * PERIOD, at);
            if taken > cycles / 2 {
                late.push(at - arrival(taken));
            }
            stamp = Some(taken * PERIOD);
            now = at + 60_000;
            missed = false;
        }
        late
    }

    #[test]
    fn arrivals_are_met_whatever_the_delay_between_stamp_and_publication() {
        for delay in [0, 10_000, 100_000, 240_000, 300_000, 500_000, 700_000, 900_000] {
            let mut late = latencies(delay, if delay == 0 { 0 } else { 5_000 }, 4_000);
            late.sort_unstable();
            let p99 = late[late.len() * 99 / 100];
            assert!(p99 < 1_000, "delay {delay}: p99 {p99} ns late");
            assert!(late.len() > 1_900, "delay {delay}: only {} of 2000 taken", late.len());
        }
    }

    #[test]
    fn at_least_a_quarter_of_each_period_is_slept() {
        for spin in [0, 50_000, 200_000, 500_000, 900_000] {
            let lock = PhaseLock::new(PERIOD, spin);
            let plan = lock.plan(Some(0), 1_000);
            assert!(plan.wake_ns - 1_000 >= PERIOD / 4, "{plan:?}");
            assert!(plan.deadline_ns - plan.wake_ns <= PERIOD * 3 / 4);
        }
    }

    #[test]
    fn without_a_state_it_looks_once_per_period() {
        assert_eq!(PhaseLock::new(PERIOD, 0).expected_ns(None, 5), 5 + PERIOD);
    }
}
