//! When will the next state come? A phase lock on observed arrivals, as pure arithmetic.
//!
//! The lock keeps a schedule, one arrival per period, and follows arrivals slowly: a controller that was late once is on time again the
//! next time, and a loop that followed it would sleep through that. Several odd arrivals in a row move the schedule at once. Stamps play
//! no part: a controller may stamp early and publish late.

/// An arrival further from the schedule than this is odd.
const ODD_NS: i64 = 100_000;
/// So many odd ones in a row are the new schedule.
const ODD_IN_ROW: u32 = 3;

/// The lock.
#[derive(Debug, Clone, Copy)]
pub struct PhaseLock {
    period_ns: i64,
    spin_ns: i64,
    grace_ns: i64,
    /// Some point of the schedule.
    anchor_ns: Option<i64>,
    /// The arrival that the last wait was for.
    planned_ns: i64,
    /// The point of the schedule that the state taken last belongs to.
    slot_ns: i64,
    last: Option<Found>,
    in_row: u32,
    odd_in_row: u32,
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
    /// It came while the loop polled, after a poll that ended without one: before its due time it is the one that was missed.
    PollingAfterMiss,
}

impl PhaseLock {
    /// A lock for states every `period_ns`, polling `spin_ns` before one is due.
    pub fn new(period_ns: i64, spin_ns: i64) -> Self {
        let spin_ns = spin_ns.min(period_ns / 2);
        // At least a quarter of each period is slept, so that real-time throttling never finds a loop that does not sleep.
        let grace_ns = period_ns - spin_ns - period_ns / 4;
        Self {
            period_ns,
            spin_ns,
            grace_ns,
            anchor_ns: None,
            planned_ns: 0,
            slot_ns: i64::MIN / 2,
            last: None,
            in_row: 0,
            odd_in_row: 0,
        }
    }

    /// The first expected arrival after `now_ns` that has not been taken yet.
    pub fn expected_ns(&self, now_ns: i64) -> i64 {
        let Some(anchor) = self.anchor_ns else { return now_ns + self.period_ns };
        let after = now_ns.max(self.slot_ns + self.period_ns / 2);
        anchor + self.period_ns * ((after - anchor).div_euclid(self.period_ns) + 1)
    }

    /// What to do from `now_ns` on.
    pub fn plan(&mut self, now_ns: i64) -> Plan {
        let expected = self.expected_ns(now_ns);
        self.planned_ns = expected;
        Plan { wake_ns: (expected - self.spin_ns).max(now_ns), deadline_ns: expected + self.grace_ns }
    }

    /// Learns from a state that was taken at `now_ns`.
    pub fn learn(&mut self, found: Found, now_ns: i64) {
        const STEP_NS: i64 = 10_000;
        const DOUBLINGS_MAX: u32 = 5;
        if self.anchor_ns.is_none() {
            self.anchor_ns = Some(now_ns);
            self.slot_ns = now_ns;
            return;
        }
        if self.last != Some(found) {
            self.last = Some(found);
            self.in_row = 0;
        }
        self.in_row = self.in_row.saturating_add(1);
        let planned = self.planned_ns;
        let error = now_ns - planned;
        let missed = found == Found::AfterMiss || (found == Found::PollingAfterMiss && error < 0);
        self.slot_ns = if missed { planned - self.period_ns } else { planned };
        let anchor = match found {
            Found::Polling if error.abs() <= ODD_NS => {
                self.odd_in_row = 0;
                planned + error / 8
            }
            Found::Polling => {
                self.odd_in_row += 1;
                if self.odd_in_row >= ODD_IN_ROW {
                    self.odd_in_row = 0;
                    now_ns
                } else {
                    planned
                }
            }
            // Earlier than this loop looks; how much is unknown.
            Found::Waiting => planned - (STEP_NS << self.in_row.min(DOUBLINGS_MAX)),
            // Later than this loop looks.
            Found::AfterMiss if self.in_row >= ODD_IN_ROW => {
                self.in_row = 0;
                planned + self.grace_ns
            }
            Found::AfterMiss | Found::PollingAfterMiss => planned,
        };
        // What belongs to a slot moves with it.
        self.slot_ns += anchor - planned;
        self.anchor_ns = Some(anchor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: i64 = 1_000_000;
    /// Polling before a state is due: the default, and less.
    const SPINS: [i64; 2] = [400_000, 200_000];

    /// Each time of polling with each of these.
    fn with_spins<const N: usize>(cases: [i64; N]) -> impl Iterator<Item = (i64, i64)> {
        SPINS.into_iter().flat_map(move |spin| cases.map(|case| (spin, case)))
    }

    /// Runs the lock against a controller that publishes at `arrival(k)`; returns how late each of the last half was taken.
    fn lateness(spin: i64, arrival: impl Fn(i64) -> i64, cycles: i64) -> Vec<i64> {
        let mut lock = PhaseLock::new(PERIOD, spin);
        let (mut now, mut taken, mut missed) = (0, -1, false);
        let mut late = Vec::new();
        while taken < cycles {
            let plan = lock.plan(now);
            let next = taken + 1;
            let woke = plan.wake_ns.max(now) + 30_000;
            let (at, found) = if arrival(next) <= woke {
                (woke, if missed { Found::AfterMiss } else { Found::Waiting })
            } else if arrival(next) < plan.deadline_ns {
                (arrival(next), if missed { Found::PollingAfterMiss } else { Found::Polling })
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
            lock.learn(found, at);
            if taken > cycles / 2 {
                late.push(at - arrival(taken));
            }
            now = at + 60_000;
            missed = false;
        }
        late.sort_unstable();
        late
    }

    fn jitter(k: i64, most: i64) -> i64 {
        (k * 7919).rem_euclid(2 * most + 1) - most
    }

    #[test]
    fn arrivals_are_met_whatever_their_phase() {
        let phases = [0, 10_000, 100_000, 240_000, 300_000, 500_000, 700_000, 900_000];
        for (spin, phase) in with_spins(phases) {
            let late = lateness(spin, |k| k * PERIOD + phase + jitter(k, 5_000), 4_000);
            assert!(late.len() > 1_990, "phase {phase}: only {} of 2000 taken", late.len());
            assert!(late[late.len() - 1] < 1_000, "phase {phase}: {} ns late", late[late.len() - 1]);
        }
    }

    #[test]
    fn one_late_arrival_costs_nothing_but_itself() {
        let delays = [150_000, 300_000, 500_000, 700_000, 900_000];
        for (spin, delay) in with_spins(delays) {
            let late = lateness(spin, |k| k * PERIOD + jitter(k, 5_000) + if k % 50 == 0 { delay } else { 0 }, 4_000);
            let odd = late.iter().filter(|late| **late > 1_000).count();
            // Later than the polling lasts: that one waits for the next look, no other does.
            assert!(
                odd <= if delay > PERIOD * 3 / 4 - spin { 41 } else { 0 },
                "spin {spin}, delay {delay}: {odd} of {} taken late",
                late.len()
            );
        }
    }

    #[test]
    fn a_controller_that_moves_its_phase_is_followed() {
        let shifts = [50_000, 200_000, 400_000, 600_000, 800_000];
        for (spin, shift) in with_spins(shifts) {
            let late = lateness(spin, |k| k * PERIOD + jitter(k, 5_000) + if k > 3_000 { shift } else { 0 }, 4_000);
            let odd = late.iter().filter(|late| **late > 1_000).count();
            assert!(odd <= 12, "shift {shift}: {odd} taken late");
        }
    }

    #[test]
    fn a_controller_whose_period_is_a_little_off_is_followed() {
        let drifts = [-500, -20, 20, 500];
        for (spin, drift) in with_spins(drifts) {
            let late = lateness(spin, |k| k * (PERIOD + drift) + jitter(k, 5_000), 4_000);
            assert!(late[late.len() - 1] < 1_000, "drift {drift}: {} ns late", late[late.len() - 1]);
        }
    }

    #[test]
    fn at_least_a_quarter_of_each_period_is_slept() {
        for spin in [0, 50_000, 200_000, 500_000, 900_000] {
            let mut lock = PhaseLock::new(PERIOD, spin);
            lock.learn(Found::Polling, 0);
            let plan = lock.plan(1_000);
            assert!(plan.wake_ns - 1_000 >= PERIOD / 4, "{plan:?}");
            assert!(plan.deadline_ns - plan.wake_ns <= PERIOD * 3 / 4);
        }
    }

    #[test]
    fn without_a_state_it_looks_once_per_period() {
        assert_eq!(PhaseLock::new(PERIOD, 0).expected_ns(5), 5 + PERIOD);
    }
}
