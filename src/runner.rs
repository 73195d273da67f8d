//! The loop: gives the pure cycle a clock, shared memory and a way to wait.
//!
//! After [`Runner::open`] nothing here allocates, locks, blocks (but for the one waiting call) or panics;
//! `tests/realtime.rs` proves it over a million turns.

use crate::config::Wait;
use crate::correction::Estimator;
use crate::cycle::{Cycle, Limits, Stopwatch};
use crate::histogram::{Recorder, Stage};
use crate::phase::{Found, PhaseLock};
use crate::shared::{Event, EventSender, LinkCounters, Shared};
use ravenpose_transport::{DEPTH_MAX, Listener, Reader, Settings, TransportError, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{ARMS, CorrectedPose, FALLBACK_REASONS, RavenState};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

/// Depth of the state queue, the largest: a backlog is skipped, and counted as such up to this depth. Virtual machines stop for 0.1 s.
const QUEUE: usize = DEPTH_MAX;
/// After this many periods without a state the loop stops polling around the expected time and looks once per period.
const MISSES_MAX: u32 = 50;

/// A fault on demand, for tests of the watchdog and of overruns (`ravenposed --test-hook`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TestHook {
    /// Published messages before the fault.
    pub after: u64,
    /// Number of turns that have it.
    pub turns: u64,
    /// Busy time in each, ns.
    pub busy_ns: i64,
}

/// How the loop waits.
pub struct Waiting {
    /// Strategy.
    pub wait: Wait,
    /// Polling before a state is due, ns.
    pub spin_ns: i64,
    /// Keep the models warm while polling.
    pub keep_warm: bool,
}

/// Why the loop ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// It was asked to stop.
    Stopped,
    /// It was asked to open its link anew.
    Reopen,
    /// It was asked to open another reader of states.
    AnotherReader,
}

/// How a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Waited {
    /// The loop was looking when a state came, or when none did.
    Polled,
    /// The loop was asleep until now.
    Slept,
}

struct Link {
    reader: Reader<RavenState>,
    writer: Writer<CorrectedPose>,
    listener: Option<Listener>,
}

impl Link {
    fn open(settings: &Settings, wait: Wait) -> Result<Self, TransportError> {
        Ok(Self {
            // The pose first: its one publisher's place tells whether another service runs.
            writer: Writer::open(settings)?,
            reader: Reader::open(settings, QUEUE)?,
            listener: (wait == Wait::Event).then(|| Listener::open(settings)).transpose()?,
        })
    }
}

/// The loop and all that it owns.
pub struct Runner<E> {
    cycle: Cycle<E>,
    limits: Limits,
    waiting: Waiting,
    /// Absent only while it is opened anew.
    link: Option<Link>,
    phase: PhaseLock,
    pose: CorrectedPose,
    recorder: Recorder,
    events: EventSender,
    shared: Arc<Shared>,
    link_counters: LinkCounters,
    misses: u32,
    seen: Seen,
    test_hook: Option<TestHook>,
}

/// What the last event said, so that only changes are reported.
struct Seen {
    arms: [u64; ARMS],
    source_id: Option<u64>,
    lost: u64,
    refused: u64,
    late: u64,
    link_failures: u64,
}

/// Stage times of one turn.
#[expect(clippy::struct_field_names, reason = "the unit belongs to each name")]
struct Laps {
    last_ns: i64,
    features_ns: i64,
    inference_ns: i64,
}

impl Stopwatch for Laps {
    fn features_done(&mut self) {
        let now = now_ns();
        self.features_ns += now - self.last_ns;
        self.last_ns = now;
    }

    fn inference_done(&mut self) {
        let now = now_ns();
        self.inference_ns += now - self.last_ns;
        self.last_ns = now;
    }
}

impl<E: Estimator> Runner<E> {
    /// Opens the link. Call it on the thread that will run the loop.
    ///
    /// # Errors
    /// Any [`TransportError`] of opening.
    pub fn open(
        settings: &Settings,
        cycle: Cycle<E>,
        limits: Limits,
        waiting: Waiting,
        (recorder, events, shared): (Recorder, EventSender, Arc<Shared>),
    ) -> Result<Self, TransportError> {
        let link = Some(Link::open(settings, waiting.wait)?);
        let mut cycle = cycle;
        cycle.begin_at(now_ns());
        Ok(Self {
            cycle,
            limits,
            phase: PhaseLock::new(limits.period_ns, waiting.spin_ns),
            waiting,
            link,
            pose: CorrectedPose::new(),
            recorder,
            events,
            shared,
            link_counters: LinkCounters::default(),
            misses: 0,
            seen: Seen { arms: [0; ARMS], source_id: None, lost: 0, refused: 0, late: 0, link_failures: 0 },
            test_hook: None,
        })
    }

    /// Arms a fault for a test.
    pub fn set_test_hook(&mut self, hook: TestHook) {
        self.test_hook = Some(hook);
    }

    /// Runs until it is told to stop (then the last message is flagged so) or to open its link anew.
    pub fn run(&mut self) -> Ended {
        loop {
            if self.shared.stop.load(Relaxed) {
                self.stop();
                return Ended::Stopped;
            }
            if self.shared.reopen.load(Relaxed) {
                return Ended::Reopen;
            }
            if self.shared.another_reader.load(Relaxed) {
                return Ended::AnotherReader;
            }
            self.turn();
        }
    }

    /// Opens another reader of states beside the one that hears nothing, which then goes: a publisher that could not connect that one tries
    /// again when a reader comes. Poses go on as they are. Not real-time: nothing flows then anyway.
    ///
    /// # Errors
    /// Any [`TransportError`] of opening; the reader stays what it was.
    pub fn another_reader(&mut self, settings: &Settings) -> Result<(), TransportError> {
        let reader = Reader::open(settings, QUEUE);
        // Until here the watchdog is patient.
        self.shared.another_reader.store(false, Relaxed);
        if let Some(link) = &mut self.link {
            link.reader = reader?;
        }
        Ok(())
    }

    /// Drops the link and opens it anew, after the shared files were removed under it. Not real-time: nothing flows then anyway.
    ///
    /// # Errors
    /// Any [`TransportError`] of opening; there is no link then, call it again.
    pub fn reopen(&mut self, settings: &Settings) -> Result<(), TransportError> {
        // Dropped first: what is left of the old services goes with their last user.
        self.link = None;
        self.shared.heartbeat.fetch_add(1, Relaxed);
        self.link = Some(Link::open(settings, self.waiting.wait)?);
        self.shared.heartbeat.fetch_add(1, Relaxed);
        self.shared.reopen.store(false, Relaxed);
        self.report(Event::Reopened);
        Ok(())
    }

    /// One cycle: wait, take the newest state, answer it, publish, record.
    pub fn turn(&mut self) {
        let waited = self.wait();
        let accepted = self.cycle.counters().accepted;
        let start_ns = self.take();
        let mut laps = Laps { last_ns: start_ns, features_ns: 0, inference_ns: 0 };
        let fresh = self.cycle.counters().accepted != accepted;
        self.learn(fresh, waited, start_ns);
        if self.cycle.step(start_ns, &mut laps, &mut self.pose) {
            self.run_test_hook();
            let finish_ns = now_ns();
            self.cycle.finish(finish_ns, false, &mut self.pose);
            self.send();
            if fresh {
                self.record(start_ns, finish_ns, &laps);
            }
            self.report_answer(finish_ns - start_ns);
        }
        self.report_changes();
        self.shared.show(self.cycle.counters(), &self.link_counters);
        self.shared.heartbeat.fetch_add(1, Relaxed);
        self.recorder.exchange();
    }

    /// Waits for a state, at most until the next one is overdue or the newest becomes stale.
    fn wait(&mut self) -> Waited {
        let now = now_ns();
        let newest = self.cycle.newest().map(|state| state.source_time_ns.min(now));
        let period = self.limits.period_ns;
        let stale = newest.map(|source| source + self.limits.stale_ns).filter(|&stale| stale > now).unwrap_or(i64::MAX);
        match self.waiting.wait {
            Wait::Spin => {
                self.poll_until((now + period).min(stale));
                Waited::Polled
            }
            Wait::Sleep if self.misses > MISSES_MAX => {
                let wake = self.phase.expected_ns(now).min(stale);
                self.prepare();
                sleep_until_ns(wake);
                self.recorder.record(Stage::Wakeup, now_ns() - wake);
                Waited::Slept
            }
            Wait::Sleep => {
                let plan = self.phase.plan(now);
                let wake = plan.wake_ns.min(stale);
                // A state may be there after it, and the answer to one that is late should not wait for a place.
                self.prepare();
                sleep_until_ns(wake);
                if wake > now {
                    self.recorder.record(Stage::Wakeup, now_ns() - wake);
                }
                if self.waiting_state() {
                    return Waited::Slept;
                }
                self.poll_until(plan.deadline_ns.min(stale));
                Waited::Polled
            }
            Wait::Event => {
                self.prepare();
                // A state that is a little late is waited for; once one is missing, an answer is given every period.
                let late = if self.misses == 0 { period / 4 } else { 0 };
                let deadline = (now + period + late).min(stale);
                let mut left = deadline - now;
                while left > 0 && !self.waiting_state() && !self.shared.stop.load(Relaxed) {
                    if let Some(listener) = self.listener() {
                        listener.wait(Duration::from_nanos(left as u64));
                    }
                    left = deadline - now_ns();
                }
                Waited::Polled
            }
        }
    }

    fn listener(&self) -> Option<&Listener> {
        self.link.as_ref().and_then(|link| link.listener.as_ref())
    }

    /// Tells the phase lock how a state was found, or that none came.
    fn learn(&mut self, fresh: bool, waited: Waited, now_ns: i64) {
        if !fresh {
            self.misses = self.misses.saturating_add(1);
            return;
        }
        let found = match (waited, self.misses) {
            (Waited::Polled, 1..=MISSES_MAX) => Found::PollingAfterMiss,
            (Waited::Polled, _) => Found::Polling,
            (Waited::Slept, 1..=MISSES_MAX) => Found::AfterMiss,
            // Before the loop woke, or out of a long silence: where in the period it came is unknown.
            (Waited::Slept, _) => Found::Waiting,
        };
        self.misses = 0;
        // The other modes wait without a schedule, so there is none to follow.
        if self.waiting.wait == Wait::Sleep {
            self.phase.learn(found, now_ns);
        }
    }

    fn prepare(&self) {
        if let Some(link) = &self.link {
            link.writer.prepare();
        }
    }

    fn poll_until(&mut self, deadline_ns: i64) {
        self.prepare();
        // Bounded by the deadline, at most one period away, but for a reader that comes: connecting it takes the system's time, as in sending.
        while !self.waiting_state() && now_ns() < deadline_ns {
            if self.waiting.keep_warm {
                self.keep_warm();
            } else {
                std::hint::spin_loop();
            }
        }
    }

    /// The models all the time, the way out once per round of their pieces.
    fn keep_warm(&mut self) {
        if self.cycle.keep_warm()
            && let Some(link) = &self.link
        {
            link.writer.prepare();
            link.writer.keep_warm();
        }
    }

    fn waiting_state(&self) -> bool {
        self.link.as_ref().is_some_and(|link| link.reader.has_message())
    }

    /// Takes what waits; returns when the newest was taken, or now if nothing was.
    fn take(&mut self) -> i64 {
        let link = &self.link;
        let drain = |take: &mut dyn FnMut(&RavenState)| link.as_ref().is_none_or(|link| link.reader.drain(take).is_ok());
        let (taken_ns, sound) = offer_each(&mut self.cycle, now_ns, drain);
        self.link_counters.receive_failures += u64::from(!sound);
        taken_ns.unwrap_or_else(now_ns)
    }

    fn send(&mut self) {
        if self.link.as_ref().is_none_or(|link| link.writer.send(&self.pose).is_err()) {
            self.link_counters.send_failures += 1;
        }
        self.shared.show_arms(&self.pose);
    }

    fn record(&mut self, start_ns: i64, finish_ns: i64, laps: &Laps) {
        let sent_ns = now_ns();
        let recorder = &mut self.recorder;
        recorder.record(Stage::InputAge, start_ns - self.pose.source_time_ns);
        recorder.record(Stage::Features, laps.features_ns);
        recorder.record(Stage::Inference, laps.inference_ns);
        recorder.record(Stage::Publish, sent_ns - finish_ns);
        recorder.record(Stage::Total, sent_ns - start_ns);
        recorder.record(Stage::InputToOutput, sent_ns - self.pose.source_time_ns);
    }

    /// The last message: flagged `stopping`, correction zero.
    fn stop(&mut self) {
        let now = self.take();
        if self.cycle.stop(now, &mut self.pose) {
            self.send();
        }
        self.shared.show(self.cycle.counters(), &self.link_counters);
    }

    /// Ends the loop and gives up its histograms for the last report.
    pub fn into_recorder(self) -> Recorder {
        self.recorder
    }

    fn run_test_hook(&mut self) {
        let Some(hook) = &mut self.test_hook else { return };
        if self.cycle.counters().published < hook.after || hook.turns == 0 {
            return;
        }
        hook.turns -= 1;
        let end = now_ns().saturating_add(hook.busy_ns);
        while now_ns() < end {
            std::hint::spin_loop();
        }
    }

    fn report(&mut self, event: Event) {
        if self.events.enqueue(event).is_err() {
            self.link_counters.events_dropped += 1;
        }
    }

    /// What changed with this answer.
    fn report_answer(&mut self, took_ns: i64) {
        let (id, sequence) = (self.pose.source_id, self.pose.source_sequence);
        if self.seen.source_id != Some(id) {
            self.seen.source_id = Some(id);
            self.report(Event::Source { id, sequence });
        }
        for arm in 0..ARMS {
            let (status, flags) = (self.pose.arm[arm].status, self.pose.arm[arm].flags);
            let packed = u64::from(status) << 32 | u64::from(flags & FALLBACK_REASONS);
            if packed != self.seen.arms[arm] {
                self.seen.arms[arm] = packed;
                self.report(Event::Arm { arm, status, flags, sequence });
            }
        }
        let late = self.cycle.counters().late;
        if late != self.seen.late {
            self.seen.late = late;
            self.report(Event::Late { took_ns, sequence });
        }
    }

    /// What changed whether or not there was an answer.
    fn report_changes(&mut self) {
        let counters = *self.cycle.counters();
        if counters.lost != self.seen.lost {
            self.seen.lost = counters.lost;
            self.report(Event::Lost { total: counters.lost, sequence: self.pose.source_sequence });
        }
        if counters.refused != self.seen.refused {
            self.seen.refused = counters.refused;
            self.report(Event::Refused { total: counters.refused });
        }
        self.link_counters.readers_left_out += self.link.as_ref().map_or(0, |link| link.writer.take_left_out());
        let LinkCounters { receive_failures: receive, send_failures: send, readers_left_out: readers, .. } = self.link_counters;
        let failures = receive + send + readers;
        if failures != self.seen.link_failures {
            self.seen.link_failures = failures;
            self.report(Event::Link { receive, send, readers });
        }
    }
}

/// Offers each state that `drain` takes, with the time after it was taken; returns the last of these times, and what `drain` said.
///
/// Read before, the clock would put a state that comes while this thread is held up into the future: connecting to a new control
/// process takes longer than the cycle allows for.
fn offer_each<E: Estimator>(
    cycle: &mut Cycle<E>,
    clock: impl Fn() -> i64,
    drain: impl FnOnce(&mut dyn FnMut(&RavenState)) -> bool,
) -> (Option<i64>, bool) {
    let mut taken_ns = None;
    let sound = drain(&mut |state| cycle.offer(state, *taken_ns.insert(clock())));
    (taken_ns, sound)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correction::ArmModel;
    use crate::model::Estimate;
    use std::cell::Cell;

    #[test]
    fn states_that_come_while_the_queue_is_read_are_not_from_the_future() {
        let mut cycle = Cycle::<Estimate>::new(Limits::default(), [ArmModel::None, ArmModel::None], true, 0);
        let clock = Cell::new(1_000_000_000);
        let (taken_ns, sound) = offer_each(
            &mut cycle,
            || clock.get(),
            |take| {
                for sequence in 1..=3 {
                    // The machine stops, then the control process sends.
                    clock.set(clock.get() + 42_000_000);
                    let mut state = RavenState::new();
                    state.source_id = 1;
                    state.source_time_ns = clock.get();
                    state.seal(sequence);
                    take(&state);
                }
                true
            },
        );
        assert_eq!((taken_ns, sound), (Some(clock.get()), true));
        let counters = cycle.counters();
        assert_eq!((counters.accepted, counters.refused, counters.skipped), (3, 0, 2));
    }
}
