//! `ravenpose gap --watch` beside a running service: the newest minute of its stream of states, every quarter of a minute.
//!
//! A listening thread empties the link; this one keeps a minute of states and says what comes of each look; a third one
//! analyses. A look that is due while the last one is still at work is left out, never queued.

use super::{Wish, arms_of, differs, quietly, status, write};
use crate::output;
use ::gap::found::Outcome;
use ::gap::given::{Given, Options};
use ::gap::needed::keep_needed;
use ::gap::verdicts::sha256;
use ::gap::watch::{STEP_S, WINDOW_S};
use crossbeam_queue::ArrayQueue;
use ravenpose::signals;
use ravenpose_transport::{DEPTH_MAX, Reader, Settings};
use ravenpose_wire::{PEDAL_DOWN, RavenState};
use recordings::stream::{Damage, Record, Source, StreamError};
use recordings::table::TableSource;
use recordings::tidy::{self, StateTable};
use recordings::{Arms, Recording, table};
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
/// A clock that is set back by more than this begins the minute anew, ns.
const BREAK_NS: i64 = 1_000_000_000;
/// More than this between two states is no motion that was heard, ns.
const HOLE_NS: i64 = 10_000_000;
/// Without a state for so long something is said, and the link is opened anew: its files may have been removed.
const PATIENCE: Duration = Duration::from_secs(5);

/// States, as a recording that nobody wrote.
struct States(VecDeque<RavenState>);

impl Source for States {
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

/// What was heard: the newest minute with the pedal down, and how much of it is new since the last look.
struct Heard {
    minute: VecDeque<RavenState>,
    /// From the first state of all to the minute's own clock, ns: another source has another clock.
    offset_ns: i64,
    /// Motion heard since the last look, ns.
    new_ns: i64,
}

fn stamp_ns(state: &RavenState) -> i64 {
    i64::from(state.hdr_stamp_sec) * 1_000_000_000 + i64::from(state.hdr_stamp_nsec)
}

fn ns(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

/// A minute of states, and s from the first state of all to its first.
type Minute = (f64, VecDeque<RavenState>);

impl Heard {
    fn new() -> Self {
        Self { minute: VecDeque::new(), offset_ns: 0, new_ns: 0 }
    }

    /// Takes a state; the stretch to look at where one is due. Another source, or a clock set back, begins anew; a pause is a hole.
    fn take(&mut self, mut state: RavenState) -> Option<Minute> {
        if (state.hdr_stamp_sec, state.hdr_stamp_nsec) == (0, 0) {
            // Without a stamp of the robot's own: when it was sent.
            state.hdr_stamp_sec = u32::try_from(state.source_time_ns / 1_000_000_000).unwrap_or(0);
            state.hdr_stamp_nsec = (state.source_time_ns % 1_000_000_000) as u32;
        }
        if state.runlevel != PEDAL_DOWN {
            return None;
        }
        let now_ns = stamp_ns(&state);
        match self.minute.back().map(|last| (last.source_id == state.source_id, stamp_ns(last))) {
            // Told twice, or late.
            Some((true, last_ns)) if (last_ns - BREAK_NS..=last_ns).contains(&now_ns) => return None,
            Some((true, last_ns)) if now_ns > last_ns => self.new_ns += (now_ns - last_ns).min(HOLE_NS),
            before => {
                self.offset_ns = before.map_or(0, |(_, last_ns)| self.offset_ns + last_ns) - now_ns;
                self.minute.clear();
                self.new_ns = 0;
            }
        }
        self.minute.push_back(state);
        while self.minute.front().is_some_and(|first| now_ns - stamp_ns(first) > ns(WINDOW_S)) {
            self.minute.pop_front();
        }
        (self.new_ns >= ns(STEP_S)).then(|| {
            self.new_ns = 0;
            (self.minute.front().map_or(0, |first| self.offset_ns + stamp_ns(first)) as f64 / 1e9, self.minute.clone())
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
    let (ask, asked) = mpsc::channel::<Minute>();
    let (tell, told) = mpsc::channel::<Look>();
    say!("watching the running service; Ctrl-C ends it");
    std::thread::scope(|scope| {
        let (queue, stop, busy) = (&queue, &stop, &busy);
        let listening = scope.spawn(move || listen(queue, stop));
        let analysing = scope.spawn(move || {
            for (from_s, minute) in asked {
                let length_ns = minute.back().map_or(0, stamp_ns) - minute.front().map_or(0, stamp_ns);
                let to_s = from_s + length_ns as f64 / 1e9;
                let outcome = look(model, options, (from_s, minute));
                let heard = tell.send(Look { from_s, to_s, outcome });
                busy.store(false, Ordering::Release);
                if heard.is_err() {
                    break;
                }
            }
        });
        let ended = attend(wish, (queue, &ask, &told), busy, &[&|| listening.is_finished(), &|| analysing.is_finished()]);
        stop.store(true, Ordering::Relaxed);
        drop(ask);
        // Why a thread ended says more than that nothing came of it.
        listening.join().map_err(|_| "the listening thread failed".to_owned()).and_then(|heard| heard)?;
        analysing.join().map_err(|_| "the analysing thread failed".to_owned())?;
        ended
    })
}

type Links<'a> = (&'a ArrayQueue<RavenState>, &'a mpsc::Sender<Minute>, &'a mpsc::Receiver<Look>);

/// Asks for looks and says what comes of them, until the end. `gone`: whether the listening and the analysing thread have ended.
fn attend(wish: &Wish, (queue, ask, told): Links, busy: &AtomicBool, gone: &[&dyn Fn() -> bool; 2]) -> Result<ExitCode, String> {
    let (begun, mut last_state) = (Instant::now(), Instant::now());
    let (mut heard, mut report, mut warned) = (Heard::new(), Report::default(), false);
    let over = || wish.seconds.is_some_and(|seconds| begun.elapsed().as_secs_f64() >= seconds);
    while !over() && !gone.iter().any(|gone| gone()) && !signals::wait(PAUSE) {
        while let Some(state) = queue.pop() {
            (last_state, warned) = (Instant::now(), false);
            let Some(minute) = heard.take(state) else { continue };
            // A look that is late is left out.
            if !busy.swap(true, Ordering::AcqRel) && ask.send(minute).is_err() {
                break;
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
    // The look that is under way is worth its few seconds; whoever asks twice need not wait.
    while busy.load(Ordering::Acquire) && !gone[1]() && !signals::wait(PAUSE) {}
    for look in told.try_iter() {
        report.add(look, wish)?;
    }
    report.end(wish)
}

/// What is told at the end.
#[derive(Default)]
struct Report {
    kept: Option<Outcome>,
    /// Why the last look that was not possible was not.
    fault: Option<String>,
}

impl Report {
    /// Says a look, and writes its report where it is the one to be kept; false where nobody listens any more. A minute that cannot
    /// be looked at (an arm that stands still) is no end of the watch.
    fn add(&mut self, look: Look, wish: &Wish) -> Result<bool, String> {
        let (from_s, to_s) = (look.from_s, look.to_s);
        let outcome = match look.outcome {
            Ok(outcome) => outcome,
            Err(fault) => {
                let goes_on = output::say(format_args!("{from_s:.0} to {to_s:.0} s: not looked at: {fault}\n"));
                self.fault = Some(fault);
                return Ok(goes_on);
            }
        };
        let words = gap_report::headlines(&outcome.report).join(" ");
        let goes_on = output::say(format_args!("{from_s:.0} to {to_s:.0} s: {words}\n"));
        if differs(&outcome) || !self.kept.as_ref().is_some_and(differs) {
            write(&outcome, wish.out)?;
            self.kept = Some(outcome);
        }
        Ok(goes_on)
    }

    fn end(self, wish: &Wish) -> Result<ExitCode, String> {
        if let Some(outcome) = self.kept {
            say!("{}", wish.out.join("report.html").display());
            return Ok(status(outcome.report.status));
        }
        let needed = format!(
            "no look was possible: {STEP_S:.0} s of states with the pedal down are needed; start the controller, or give a recording \
             with --real"
        );
        Err(self.fault.unwrap_or(needed))
    }
}

fn look(model: &RobotModel, options: &Options, (from_s, minute): Minute) -> Result<Outcome, String> {
    let mut notes = Vec::new();
    let missed: u64 = minute.iter().zip(minute.iter().skip(1)).map(|(a, b)| b.sequence.saturating_sub(a.sequence + 1)).sum();
    if missed > 0 {
        notes.push(format!("stream: {missed} states were not heard or came with the pedal up; {} are looked at", minute.len()));
    }
    let mut recording = as_table(minute, model, &mut notes)?;
    keep_needed(&mut recording, model);
    // On the clock of the whole watch.
    if let Some(time) = recording.columns.iter_mut().find(|column| column.name == "t_s") {
        time.values.iter_mut().for_each(|t| *t += from_s);
    }
    let mut bytes = Vec::new();
    for value in recording.columns.iter().flat_map(|column| &column.values) {
        bytes.extend(value.to_le_bytes());
    }
    let given = Given { id: "stream".to_owned(), real_sha256: sha256(&bytes), real: recording, notes, sim: None };
    quietly(model, &[given], options)
}

/// The minute as a table: of two connected arms that of the model, else the one that there is.
fn as_table(minute: VecDeque<RavenState>, model: &RobotModel, notes: &mut Vec<String>) -> Result<Recording, String> {
    let table = |states: VecDeque<RavenState>, arms: Option<Arms>| {
        StateTable::new(Box::new(States(states)), tidy::Options { arms, all_truth: false, orientation: false })
            .map_err(|error| error.to_string())
    };
    let first: VecDeque<RavenState> = minute.iter().take(1).copied().collect();
    let both = tidy::has_both_arms(table(first, None)?.columns());
    let arms = both.then(|| arms_of(model.side()));
    notes.extend(arms.map(|_| format!("stream: holds both arms; the {} one is looked at", model.side().name())));
    table::collect("stream", &mut table(minute, arms)?).map_err(|error| error.to_string())
}

/// Empties the link until told to stop. A state that finds the queue full is dropped: the hole is left out of the analysis.
fn listen(queue: &ArrayQueue<RavenState>, stop: &AtomicBool) -> Result<(), String> {
    let open = || Reader::<RavenState>::open(&Settings::from_env(), DEPTH_MAX).map_err(|error| error.to_string());
    let (mut states, mut last) = (open()?, Instant::now());
    while !stop.load(Ordering::Relaxed) {
        let mut any = false;
        let taken = states.drain(|state| {
            any = true;
            if state.admit().is_ok() {
                let _ = queue.push(*state);
            }
        });
        taken.map_err(|error| error.to_string())?;
        if any {
            last = Instant::now();
        } else if last.elapsed() > PATIENCE {
            drop(states);
            (states, last) = (open()?, Instant::now());
        }
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
        let looks: Vec<(i64, usize, f64)> =
            (1..=100_000).filter_map(|ms| heard.take(state(1, ms)).map(|(from_s, minute)| (ms, minute.len(), from_s))).collect();
        let wanted: Vec<(i64, usize, f64)> =
            [(15_001, 15_001, 0.0), (30_001, 30_001, 0.0), (45_001, 45_001, 0.0), (60_001, 60_001, 0.0)]
                .into_iter()
                .chain([(75_001, 60_001, 15.0), (90_001, 60_001, 30.0)])
                .collect();
        assert_eq!(looks, wanted);
    }

    #[test]
    fn another_source_and_a_clock_set_back_begin_anew_and_the_watch_s_own_clock_goes_on() {
        let mut heard = Heard::new();
        let mut from_s = Vec::new();
        for (source, from_ms) in [(1, 1_000), (2, 600_000), (2, 3_000)] {
            for ms in from_ms..from_ms + 20_000 {
                if let Some((from, minute)) = heard.take(state(source, ms)) {
                    assert_eq!(minute.len(), 15_001, "{source} {from_ms}");
                    from_s.push(from);
                }
            }
        }
        assert_eq!(from_s, [0.0, 19.999, 39.998]);
    }

    #[test]
    fn a_pedal_that_is_up_for_a_while_costs_its_time_alone() {
        let mut heard = Heard::new();
        // Six seconds down, four up.
        let mut looks = Vec::new();
        for ms in 1..=40_000 {
            let mut now = state(1, ms);
            now.runlevel = if ms % 10_000 < 6_000 { PEDAL_DOWN } else { 2 };
            assert!(heard.take(now).is_none() || now.runlevel == PEDAL_DOWN);
            if heard.new_ns == 0 && now.runlevel == PEDAL_DOWN && ms > 1 {
                looks.push((ms, heard.minute.len()));
            }
        }
        assert_eq!(looks.len(), 1, "{looks:?}");
        assert!((22_900..23_100).contains(&looks[0].0), "{looks:?}");
        assert!(heard.take(state(1, 35_000)).is_none(), "late");
    }
}
