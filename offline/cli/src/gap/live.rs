//! `ravenpose gap --watch` beside a running service: the newest minute of its stream of states, every quarter of a minute.
//!
//! A listening thread empties the link; this one keeps a minute of states and says what comes of each look; a third one
//! analyses. A look that is due while the last one is still at work is left out, never queued.

use super::{Wish, arms_of, differs, quietly, status, write};
use crate::output;
use ::gap::analysis::{Given, Options, Outcome};
use ::gap::needed::keep_needed;
use ::gap::verdicts::sha256;
use ::gap::watch::{STEP_S, WINDOW_S};
use crossbeam_queue::ArrayQueue;
use ravenpose::signals;
use ravenpose_transport::{DEPTH_MAX, Reader, Settings};
use ravenpose_wire::{PEDAL_DOWN, RavenState};
use recordings::stream::{Damage, Record, Source, StreamError};
use recordings::tidy::{self, StateTable};
use recordings::{Recording, table};
use simulator::RobotModel;
use std::collections::VecDeque;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// States that may wait for this thread: two seconds.
const WAITING_MAX: usize = 2048;
/// This thread looks at the queue that often.
const PAUSE: Duration = Duration::from_millis(50);
/// A step of the states' clock beyond this begins the minute anew, ns.
const BREAK_NS: i64 = 1_000_000_000;
/// Without a state for so long something is said, once.
const PATIENCE: Duration = Duration::from_secs(5);

/// A minute of states, as a recording that nobody wrote.
struct Minute(VecDeque<RavenState>);

impl Source for Minute {
    fn format(&self) -> &'static str {
        "stream"
    }

    fn metadata(&self) -> &[(String, String)] {
        &[]
    }

    fn progress(&self) -> (u64, u64) {
        (0, 0)
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        Ok(self.0.pop_front().map(|state| Record::State(Box::new(state))))
    }

    fn damage(&self) -> Option<&Damage> {
        None
    }
}

/// What was heard: the newest minute with the pedal down, and when the next look is due.
struct Heard {
    minute: VecDeque<RavenState>,
    /// Stamp of the first state of all, ns.
    first_ns: Option<i64>,
    /// Stamp from which a further look is due, ns.
    due_ns: i64,
}

fn stamp_ns(state: &RavenState) -> i64 {
    i64::from(state.hdr_stamp_sec) * 1_000_000_000 + i64::from(state.hdr_stamp_nsec)
}

fn ns(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

impl Heard {
    fn new() -> Self {
        Self { minute: VecDeque::new(), first_ns: None, due_ns: 0 }
    }

    /// Takes a state; the stretch to look at where one is due. Another source, or a clock that jumps, begins anew.
    fn take(&mut self, mut state: RavenState) -> Option<VecDeque<RavenState>> {
        if (state.hdr_stamp_sec, state.hdr_stamp_nsec) == (0, 0) {
            // Without a stamp of the robot's own: when it was sent.
            state.hdr_stamp_sec = u32::try_from(state.source_time_ns / 1_000_000_000).unwrap_or(0);
            state.hdr_stamp_nsec = (state.source_time_ns % 1_000_000_000) as u32;
        }
        if state.runlevel != PEDAL_DOWN {
            return None;
        }
        let now_ns = stamp_ns(&state);
        let last = self.minute.back().map(|last| (last.source_id == state.source_id, now_ns - stamp_ns(last)));
        if last.is_some_and(|(same, step_ns)| same && (-BREAK_NS..=0).contains(&step_ns)) {
            // Told twice, or late.
            return None;
        }
        if last.is_none_or(|(same, step_ns)| !same || step_ns.abs() > BREAK_NS) {
            self.minute.clear();
            self.due_ns = now_ns + ns(STEP_S);
        }
        self.first_ns.get_or_insert(now_ns);
        self.minute.push_back(state);
        while self.minute.front().is_some_and(|first| now_ns - stamp_ns(first) > ns(WINDOW_S)) {
            self.minute.pop_front();
        }
        (now_ns >= self.due_ns).then(|| {
            self.due_ns = now_ns + ns(STEP_S);
            self.minute.clone()
        })
    }
}

/// One look, as the analysing thread tells it.
struct Look {
    from_s: f64,
    to_s: f64,
    outcome: Result<Outcome, String>,
}

/// Watches until a stop signal, or for so many seconds. The report is that of the last look that found a difference, else of the
/// last one, and is written at once where there is one: the watch may go on for days.
pub(super) fn watch(model: &RobotModel, options: &Options, wish: &Wish) -> Result<ExitCode, String> {
    if wish.seconds.is_some_and(|seconds| !(seconds > 0.0 && seconds < 1e9)) {
        return Err("--seconds: must be a number above 0".to_owned());
    }
    signals::block().map_err(|error| format!("signals cannot be blocked: {error}"))?;
    let queue = ArrayQueue::new(WAITING_MAX);
    let (stop, busy) = (AtomicBool::new(false), AtomicBool::new(false));
    let (ask, asked) = mpsc::channel::<(f64, VecDeque<RavenState>)>();
    let (tell, told) = mpsc::channel::<Look>();
    say!("watching the running service; Ctrl-C ends it");
    std::thread::scope(|scope| {
        let (queue, stop, busy) = (&queue, &stop, &busy);
        let listening = scope.spawn(move || listen(queue, stop));
        let analysing = scope.spawn(move || {
            for (from_s, minute) in asked {
                let length_ns = minute.back().map_or(0, stamp_ns) - minute.front().map_or(0, stamp_ns);
                let to_s = from_s + length_ns as f64 / 1e9;
                let outcome = look(model, options, minute);
                let heard = tell.send(Look { from_s, to_s, outcome });
                busy.store(false, Ordering::Release);
                if heard.is_err() {
                    break;
                }
            }
        });
        let ended = attend(wish, (queue, &ask, &told), busy, || listening.is_finished() || analysing.is_finished());
        stop.store(true, Ordering::Relaxed);
        drop(ask);
        let heard = listening.join().map_err(|_| "the listening thread failed".to_owned()).and_then(|heard| heard);
        ended.and_then(|ended| heard.map(|()| ended))
    })
}

type Links<'a> = (&'a ArrayQueue<RavenState>, &'a mpsc::Sender<(f64, VecDeque<RavenState>)>, &'a mpsc::Receiver<Look>);

/// Asks for looks and says what comes of them, until the end.
fn attend(wish: &Wish, (queue, ask, told): Links, busy: &AtomicBool, gone: impl Fn() -> bool) -> Result<ExitCode, String> {
    let (begun, mut last_state) = (Instant::now(), Instant::now());
    let (mut heard, mut report, mut warned) = (Heard::new(), Report::default(), false);
    let over = || wish.seconds.is_some_and(|seconds| begun.elapsed().as_secs_f64() >= seconds);
    while !over() && !gone() && !signals::wait(PAUSE) {
        while let Some(state) = queue.pop() {
            last_state = Instant::now();
            let Some(minute) = heard.take(state) else { continue };
            if busy.swap(true, Ordering::AcqRel) {
                continue;
            }
            let since = heard.first_ns.unwrap_or(0);
            let from_s = minute.front().map_or(0, |first| stamp_ns(first) - since) as f64 / 1e9;
            if ask.send((from_s, minute)).is_err() {
                return Err("the analysing thread failed".to_owned());
            }
        }
        if !warned && last_state.elapsed() > PATIENCE {
            complain!("note: no states are heard; does the controller publish, as the same user?");
            warned = true;
        }
        for look in told.try_iter() {
            if !report.add(look, wish)? {
                return report.end(wish);
            }
        }
    }
    // The look that is under way is worth its few seconds.
    while busy.load(Ordering::Acquire) && !gone() {
        std::thread::sleep(PAUSE);
    }
    for look in told.try_iter() {
        report.add(look, wish)?;
    }
    report.end(wish)
}

/// What is told at the end.
#[derive(Default)]
struct Report(Option<Outcome>);

impl Report {
    /// Says a look, and writes its report where it is the one to be kept; false where nobody listens any more.
    fn add(&mut self, look: Look, wish: &Wish) -> Result<bool, String> {
        let outcome = look.outcome?;
        let words = gap_report::headlines(&outcome.report).join(" ");
        let goes_on = output::say(format_args!("{:.0} to {:.0} s: {words}\n", look.from_s, look.to_s));
        if differs(&outcome) || !self.0.as_ref().is_some_and(differs) {
            write(&outcome, wish.out)?;
            self.0 = Some(outcome);
        }
        Ok(goes_on)
    }

    fn end(self, wish: &Wish) -> Result<ExitCode, String> {
        let Some(outcome) = self.0 else {
            return Err(format!(
                "no look was possible: {STEP_S:.0} s of states with the pedal down are needed; start the controller, or give a \
                 recording with --real"
            ));
        };
        say!("{}", wish.out.join("report.html").display());
        Ok(status(outcome.report.status))
    }
}

fn look(model: &RobotModel, options: &Options, minute: VecDeque<RavenState>) -> Result<Outcome, String> {
    let missed: u64 = minute.iter().zip(minute.iter().skip(1)).map(|(a, b)| b.sequence.saturating_sub(a.sequence + 1)).sum();
    let notes = (missed > 0)
        .then(|| format!("stream: {missed} states were not heard or came with the pedal up; {} are looked at", minute.len()));
    let mut recording = as_table(minute, model)?;
    keep_needed(&mut recording, model);
    let mut bytes = Vec::new();
    for value in recording.columns.iter().flat_map(|column| &column.values) {
        bytes.extend(value.to_le_bytes());
    }
    let given = Given {
        id: "stream".to_owned(),
        real_sha256: sha256(&bytes),
        real: recording,
        notes: notes.into_iter().collect(),
        sim: None,
    };
    quietly(model, &[given], options)
}

fn as_table(minute: VecDeque<RavenState>, model: &RobotModel) -> Result<Recording, String> {
    let options = tidy::Options { arms: Some(arms_of(model.side())), all_truth: false };
    let table = StateTable::new(Box::new(Minute(minute)), options);
    table.and_then(|mut table| table::collect("stream", &mut table)).map_err(|error| error.to_string())
}

/// Empties the link until told to stop. A state that finds the queue full is dropped: the hole is left out of the analysis.
fn listen(queue: &ArrayQueue<RavenState>, stop: &AtomicBool) -> Result<(), String> {
    let states = Reader::<RavenState>::open(&Settings::from_env(), DEPTH_MAX).map_err(|error| error.to_string())?;
    while !stop.load(Ordering::Relaxed) {
        let taken = states.drain(|state| {
            if state.admit().is_ok() {
                let _ = queue.push(*state);
            }
        });
        taken.map_err(|error| error.to_string())?;
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(source: u64, stamp_ms: i64) -> RavenState {
        let mut state = RavenState::new();
        state.source_id = source;
        state.runlevel = PEDAL_DOWN;
        state.source_time_ns = stamp_ms * 1_000_000;
        state
    }

    #[test]
    fn a_look_is_due_every_quarter_of_a_minute_at_a_minute_at_most() {
        let mut heard = Heard::new();
        let looks: Vec<(i64, usize)> = (1..=100_000).filter_map(|ms| Some((ms, heard.take(state(1, ms))?.len()))).collect();
        assert_eq!(
            looks,
            [(15_001, 15_001), (30_001, 30_001), (45_001, 45_001), (60_001, 60_001), (75_001, 60_001), (90_001, 60_001)]
        );
    }

    #[test]
    fn another_source_a_jump_and_a_pause_begin_anew_and_the_pedal_up_is_no_motion() {
        let mut heard = Heard::new();
        for (source, from_ms) in [(1, 1_000), (2, 6_000), (2, 20_000), (2, 3_000)] {
            for ms in from_ms..from_ms + 4_000 {
                assert!(heard.take(state(source, ms)).is_none());
            }
            assert_eq!(heard.minute.len(), 4_000, "{source} {from_ms}");
        }
        assert!(heard.take(state(2, 6_500)).is_none(), "told twice");
        assert_eq!(heard.minute.len(), 4_000);
        let mut up = state(2, 7_000);
        up.runlevel = 2;
        assert!(heard.take(up).is_none());
        assert_eq!(heard.minute.len(), 4_000);
    }
}
