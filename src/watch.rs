//! The ordinary thread beside the loop: watchdog, log, statistics, and an eye on the link.

use crate::config::{ARM_NAMES, Config};
use crate::eye::{Eye, Sight};
use crate::histogram::{Collector, Histograms};
use crate::notify::{WATCHDOG, notify};
use crate::report::{Log, Stats};
use crate::shared::{Event, EventReceiver, Shared};
use crate::writer::Writer;
use crate::{abort, say};
use ravenpose_transport::Message;
use ravenpose_wire::{ARMS, ArmStatus, FALLBACK_REASONS, RavenState, flag_names};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// How often the ordinary thread looks.
pub const TICK: Duration = Duration::from_millis(30);
/// Ticks without a heartbeat after which the loop is stuck: 180 ms on a real-time machine. Counted in ticks of this thread, so that
/// a stop of the whole process is not taken for one.
const STUCK_TICKS: u32 = 6;
/// The same where the loop has no real-time rights and may be held up by anything.
const STUCK_TICKS_DEGRADED: u32 = 167;
/// How often statistics are written and the link is probed.
const SECOND: Duration = Duration::from_secs(1);
/// What the loop says while it has no link; more than a few lines a second nobody reads.
const TROUBLES: usize = 4;
const REMOVED: &str = "the shared files were removed under the service (RemoveIPC, a tmp cleaner?)";
/// So often in the life of a control process, after twice as long each time, another reader is tried while it is there and silent: the last time after
/// some eight minutes.
const SILENCE_TRIES: u32 = 9;
/// For this long after the link was opened anew it is opened again if newcomers still do not find it.
const REOPEN_AGAIN: Duration = Duration::from_secs(20);
/// How long the last files may take.
const WRITE_MAX: Duration = Duration::from_millis(500);

/// For what the loop says while it has no link, so that a log that hangs does not hold it up.
pub fn troubles() -> (SyncSender<String>, Receiver<String>) {
    sync_channel(TROUBLES)
}

/// The ordinary thread's view of the running service.
pub struct Watch {
    /// What the loop shows and is told.
    pub shared: Arc<Shared>,
    collector: Collector,
    events: EventReceiver,
    /// What the loop says while it has no link.
    troubles: Receiver<String>,
    interval: Histograms,
    total: Histograms,
    writer: Writer,
    stats_path: PathBuf,
    names: [String; ARMS],
    started: Instant,
    interval_length: Duration,
    interval_began: Instant,
    lines: Lines,
    heartbeat: u64,
    still: u32,
    stuck_ticks: u32,
    eye: Eye,
    /// What the eye said last where it could not see, so that it is said once.
    blind: Option<String>,
    /// States taken in when the link was last checked.
    accepted: u64,
    /// Messages refused until then.
    refused: u64,
    /// Failures to receive until then.
    receive_failures: u64,
    /// A publisher could not be connected, and nothing has come since.
    deaf: bool,
    unreachable: u32,
    /// When the link was first opened anew after it had worked.
    reopened: Option<Instant>,
    silent_since: Option<Instant>,
    /// How often another reader was tried with this control process.
    silence_tries: u32,
}

impl Watch {
    /// Prepares everything; `names` are the models' as shown in the statistics, `realtime` tells whether the loop has its rights.
    ///
    /// # Errors
    /// One line, when shared memory or a thread cannot be had.
    pub fn new(
        config: &Config,
        shared: Arc<Shared>,
        collector: Collector,
        (events, troubles): (EventReceiver, Receiver<String>),
        names: [String; ARMS],
        realtime: bool,
    ) -> Result<Self, String> {
        let log = config.histogram_dir.as_deref().and_then(open_log);
        if let Err(cause) = std::fs::create_dir_all(&config.runtime_dir) {
            say(&format!("{}: statistics cannot be written here ({cause}); set report.runtime_dir", config.runtime_dir.display()));
        }
        let stats_path = config.runtime_dir.join("stats.json");
        Ok(Self {
            shared,
            collector,
            events,
            troubles,
            interval: Histograms::new(),
            total: Histograms::new(),
            writer: Writer::start(stats_path.clone(), log)
                .map_err(|cause| format!("the writer's thread cannot be started: {cause}"))?,
            stats_path,
            names,
            started: Instant::now(),
            interval_length: Duration::from_secs(config.interval_s),
            interval_began: Instant::now(),
            lines: Lines::default(),
            heartbeat: 0,
            still: 0,
            stuck_ticks: if realtime { STUCK_TICKS } else { STUCK_TICKS_DEGRADED },
            accepted: 0,
            refused: 0,
            receive_failures: 0,
            deaf: false,
            eye: Eye::open(&config.transport)?,
            blind: None,
            unreachable: 0,
            reopened: None,
            silent_since: None,
            silence_tries: 0,
        })
    }

    /// Where the statistics are.
    pub fn stats_path(&self) -> &Path {
        &self.stats_path
    }

    /// One look: every [`TICK`].
    pub fn tick(&mut self) {
        self.check_heartbeat();
        while let Some(event) = self.events.dequeue() {
            self.lines.take(&event);
        }
        for line in self.troubles.try_iter().take(TROUBLES) {
            self.writer.line(line);
        }
        if self.lines.due() {
            self.lines.print(&self.writer);
            self.collect(None);
            self.look();
            self.write_stats();
            // A look comes once a second: the one nearest to the interval's end closes it.
            if self.interval_began.elapsed() + SECOND / 2 >= self.interval_length {
                self.write_log();
            }
        }
    }

    /// Feeds the watchdog while the heartbeat moves; ends the process when it has stood still for too long, so that the service
    /// starts anew whether or not somebody outside watches.
    fn check_heartbeat(&mut self) {
        let heartbeat = self.shared.heartbeat.load(Relaxed);
        if heartbeat != self.heartbeat {
            self.heartbeat = heartbeat;
            self.still = 0;
            notify(WATCHDOG);
            return;
        }
        self.still += 1;
        // Opening a link or a reader may take a second; a hang in it ends like any other.
        let opening = self.shared.reopen.load(Relaxed) || self.shared.another_reader.load(Relaxed);
        match stillness(self.still, if opening { STUCK_TICKS_DEGRADED } else { self.stuck_ticks }) {
            Stillness::Allowed => notify(WATCHDOG),
            Stillness::Doubtful => {}
            Stillness::Stuck => abort(format!(
                "the loop is stuck: no turn for {} ms; ending, so that it is started anew",
                TICK.as_millis() * u128::from(self.still)
            )),
        }
    }

    fn collect(&mut self, last: Option<&Histograms>) {
        let (interval, total) = (&mut self.interval, &mut self.total);
        let mut add = |set: &Histograms| {
            interval.add(set);
            total.add(set);
        };
        self.collector.collect(&mut add);
        last.map(add);
    }

    /// Takes what the eye saw. Where it could not see nothing is known of the link, and nothing is done to it.
    fn look(&mut self) {
        match self.eye.sight() {
            Some(Ok(sight)) => {
                self.blind = None;
                self.check_link(sight);
            }
            Some(Err(why)) if self.blind.as_ref() != Some(&why) => {
                self.writer.line(format!("whether newcomers find the link cannot be seen: {why}"));
                self.blind = Some(why);
            }
            Some(Err(_)) | None => {}
        }
    }

    /// Are our ports among those that a newcomer finds? And does a publisher's data reach us?
    fn check_link(&mut self, Sight { publishers, readers, poses }: Sight) {
        let counters = self.shared.counters();
        let (accepted, refused, receive_failures) = (counters[1], counters[7], counters[11]);
        let flows = std::mem::replace(&mut self.accepted, accepted) != accepted;
        // What is refused does arrive; the log says so by itself.
        let refuses = std::mem::replace(&mut self.refused, refused) != refused;
        if readers > 0 && poses > 0 {
            self.unreachable = 0;
        } else {
            self.unreachable += 1;
        }
        // Services of one name share their file names: whoever leaves the old one last also removes the new one's files. So one
        // opening may not be enough, and what flows after one may be cut off again.
        let settling = self.reopened.is_some_and(|reopened| reopened.elapsed() < REOPEN_AGAIN);
        if self.unreachable == 2 && flows && !settling {
            // What works is left alone: it would only be interrupted.
            self.writer
                .line(format!("{REMOVED}; the running link goes on, newcomers cannot join until the control process is restarted"));
        } else if self.unreachable >= 2 && (!flows || settling) && !self.shared.reopen.load(Relaxed) {
            self.unreachable = 0;
            if !settling {
                self.reopened = Some(Instant::now());
            }
            self.writer.line(format!("{REMOVED}; opening the link anew"));
            self.shared.reopen.store(true, Relaxed);
        }
        let failed = std::mem::replace(&mut self.receive_failures, receive_failures) != receive_failures;
        self.deaf = failed || (self.deaf && !flows);
        let waits = self.shared.reopen.load(Relaxed) || self.shared.another_reader.load(Relaxed);
        // Nothing tries again to connect a publisher and a reader before one comes or goes; another reader does.
        if self.deaf && !flows && publishers > 0 && !waits {
            self.deaf = false;
            self.writer.line("the control process could not be connected; another reader is opened".to_owned());
            self.shared.another_reader.store(true, Relaxed);
        }
        if publishers == 0 || flows || refuses {
            self.silent_since = None;
            self.silence_tries = if publishers == 0 { 0 } else { self.silence_tries };
        } else if self.silent_since.get_or_insert_with(Instant::now).elapsed() > 2 * SECOND * (1 << self.silence_tries)
            && self.silence_tries < SILENCE_TRIES
            && !waits
        {
            // A controller that could not connect us (no descriptor free) tries again when a reader comes, and not before.
            self.silence_tries += 1;
            self.writer.line(format!(
                "a publisher of {} is connected but its states do not arrive; it is stopped, or could not connect this reader, or runs as another \
                 user: all parties must run as the same user; another reader is opened",
                RavenState::SERVICE
            ));
            self.shared.another_reader.store(true, Relaxed);
        }
    }

    fn write_stats(&self) {
        let stats = Stats::collect(&self.shared, &self.total, self.started.elapsed(), &self.names);
        if let Ok(bytes) = serde_json::to_vec(&stats) {
            self.writer.stats(bytes);
        }
    }

    fn write_log(&mut self) {
        if self.writer.log(&self.interval, &self.total, self.interval_began.elapsed()) {
            self.interval.clear();
            self.interval_began = Instant::now();
        }
    }

    /// The end: what is left to say and to write.
    pub fn finish(mut self, last: Option<&Histograms>) {
        while let Some(event) = self.events.dequeue() {
            self.lines.take(&event);
        }
        self.lines.print(&self.writer);
        self.collect(last);
        self.write_log();
        self.write_stats();
        self.eye.close();
        if !self.writer.finish(WRITE_MAX) {
            say("the last histograms could not be written in time");
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stillness {
    /// Less than the loop may take: the watchdog is fed.
    Allowed,
    /// Unfed, the watchdog is the second line of defence.
    Doubtful,
    Stuck,
}

/// What so many ticks without a heartbeat are, where so many are one too many.
fn stillness(ticks: u32, stuck: u32) -> Stillness {
    if ticks >= stuck {
        Stillness::Stuck
    } else if ticks + STUCK_TICKS <= stuck {
        Stillness::Allowed
    } else {
        Stillness::Doubtful
    }
}

fn open_log(dir: &Path) -> Option<Log> {
    Log::create(dir)
        .map_err(|cause| say(&format!("{}: histograms cannot be written here ({cause}); set report.histogram_dir", dir.display())))
        .ok()
}

/// At most one line per kind of event and second, with a count of what it stands for.
#[derive(Default)]
struct Lines {
    last: [Option<Event>; Event::KINDS],
    counts: [u64; Event::KINDS],
    /// Every reason that was given since the last line.
    reasons: [u32; Event::KINDS],
    printed: Option<Instant>,
}

impl Lines {
    fn take(&mut self, event: &Event) {
        self.last[event.kind()] = Some(*event);
        self.counts[event.kind()] += 1;
        if let Event::Arm { flags, .. } = event {
            self.reasons[event.kind()] |= flags & FALLBACK_REASONS;
        }
    }

    fn due(&self) -> bool {
        self.printed.is_none_or(|printed| printed.elapsed() >= SECOND)
    }

    fn print(&mut self, writer: &Writer) {
        self.printed = Some(Instant::now());
        for kind in 0..Event::KINDS {
            let (count, reasons) = (std::mem::take(&mut self.counts[kind]), std::mem::take(&mut self.reasons[kind]));
            let Some(event) = self.last[kind].take() else { continue };
            let mut line = describe(&event);
            if count > 1 {
                let _ = write!(line, " ({count} such events in the last second");
                let names: Vec<_> = flag_names(reasons).collect();
                if !names.is_empty() {
                    let _ = write!(line, ", reasons among them: {}", names.join(" "));
                }
                line.push(')');
            }
            writer.line(line);
        }
    }
}

fn describe(event: &Event) -> String {
    match *event {
        Event::Arm { arm, status, flags, sequence } => {
            let names: Vec<_> = flag_names(flags).collect();
            format!("{} arm: {} [{}] at state {sequence}", ARM_NAMES[arm], ArmStatus::name(status), names.join(" "))
        }
        Event::Source { id, sequence } => format!("control process {id:016x} from state {sequence}"),
        Event::Lost { total, sequence } => format!("states missing before {sequence}; {total} in all"),
        Event::Refused { total } => {
            format!("messages refused (other layout, torn, or not on this machine's CLOCK_MONOTONIC); {total} in all")
        }
        Event::Late { took_ns, sequence } => format!("state {sequence} took {:.1} us, beyond the budget", took_ns as f64 / 1000.0),
        Event::Link { receive, send, readers } => {
            format!("link failures: {receive} receiving, {send} sending, {readers} connecting a reader, which gets no pose")
        }
        Event::Reopened => "the link was opened anew".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_without_rights_is_fed_for_as_long_as_it_is_given_and_one_with_them_only_while_it_turns() {
        let of = |stuck| (1..=stuck).map(|ticks| stillness(ticks, stuck)).collect::<Vec<_>>();
        let realtime = of(STUCK_TICKS);
        assert_eq!(realtime[..STUCK_TICKS as usize - 1], [Stillness::Doubtful; STUCK_TICKS as usize - 1]);
        let degraded = of(STUCK_TICKS_DEGRADED);
        let fed = degraded.iter().take_while(|tick| **tick == Stillness::Allowed).count() as u32;
        // What is left unfed at the end is what a real-time loop has.
        assert_eq!(fed, STUCK_TICKS_DEGRADED - STUCK_TICKS);
        assert!([realtime, degraded].iter().all(|all| all.last() == Some(&Stillness::Stuck)));
    }
}
