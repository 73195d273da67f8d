//! `ravenposed`: start, the ordinary thread beside the loop, and the end.

use crate::config::{Config, Wait};
use crate::cycle::{ArmModel, Cycle};
use crate::histogram::{self, Collector, Histograms};
use crate::network::Plan;
use crate::realtime::{self, Missing};
use crate::report::{self, Log, Stats};
use crate::runner::{Ended, Runner, TestHook, Waiting};
use crate::shared::{self, Event, EventReceiver, EventSender, Shared};
use crate::{model, signals};
use ravenpose_transport::{Message, Probe};
use ravenpose_wire::{ARMS, ArmStatus, CorrectedPose, RavenState, flag, flag_names};
use sd_notify::NotifyState;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const NAMES: [&str; ARMS] = ["gold", "green"];
/// How often the ordinary thread looks: well inside the watchdog's 250 ms.
const TICK: Duration = Duration::from_millis(50);
/// How often `stats.json` is written and the link is probed.
const SECOND: Duration = Duration::from_secs(1);
/// Longest wait for the loop to send its last message.
const STOP_MAX: Duration = Duration::from_millis(100);

const USAGE: &str = "\
ravenposed - corrects the end-effector position of a RAVEN-II in hard real time
Research software, no clinical use.

usage: ravenposed [--config FILE] [--check-config]
  --config FILE    configuration (default /etc/ravenpose/ravenposed.toml)
  --check-config   read the configuration and the models, then exit
  --test-hook AFTER:TURNS:MICROSECONDS
                   for tests: after AFTER messages, busy-wait in TURNS cycles
  --version, --help
exit status: 0 stopped as asked, 2 refused to start (one line says why), 1 failed while running";

struct Arguments {
    config: PathBuf,
    check_only: bool,
    test_hook: Option<TestHook>,
}

/// Runs the service; everything of `main`.
pub fn main(arguments: impl Iterator<Item = String>) -> ExitCode {
    let arguments = match parse(arguments) {
        Ok(Some(arguments)) => arguments,
        Ok(None) => return ExitCode::SUCCESS,
        Err(message) => return refuse(&message),
    };
    match start(&arguments) {
        Ok(code) => code,
        Err(message) => refuse(&message),
    }
}

fn refuse(message: &str) -> ExitCode {
    eprintln!("ravenposed: {message}");
    ExitCode::from(2)
}

fn say(message: &str) {
    eprintln!("ravenposed: {message}");
}

fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Option<Arguments>, String> {
    let mut parsed = Arguments { config: PathBuf::from("/etc/ravenpose/ravenposed.toml"), check_only: false, test_hook: None };
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} wants a value; see --help"));
        match argument.as_str() {
            "--config" => parsed.config = PathBuf::from(value()?),
            "--check-config" => parsed.check_only = true,
            "--test-hook" => parsed.test_hook = Some(test_hook(&value()?)?),
            "--version" => {
                println!("ravenposed {} (research software, no clinical use)", env!("CARGO_PKG_VERSION"));
                return Ok(None);
            }
            "--help" | "-h" => {
                println!("{USAGE}");
                return Ok(None);
            }
            _ => return Err(format!("unknown argument {argument:?}; see --help")),
        }
    }
    Ok(Some(parsed))
}

fn test_hook(text: &str) -> Result<TestHook, String> {
    let numbers: Option<Vec<u64>> = text.split(':').map(|part| part.parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[after, turns, microseconds]) => {
            Ok(TestHook { after, turns, busy_ns: i64::try_from(microseconds.saturating_mul(1000)).unwrap_or(i64::MAX) })
        }
        _ => Err(format!("--test-hook {text:?} is not AFTER:TURNS:MICROSECONDS")),
    }
}

/// Everything that is prepared before any thread starts.
struct Prepared {
    models: [ArmModel<Plan>; ARMS],
    names: [String; ARMS],
}

fn start(arguments: &Arguments) -> Result<ExitCode, String> {
    signals::block().map_err(|cause| format!("signals cannot be blocked: {cause}"))?;
    let config = Config::read(&arguments.config).map_err(|error| error.to_string())?;
    let prepared = load_models(&config)?;
    if arguments.check_only {
        println!("{}: configuration and models are good", arguments.config.display());
        return Ok(ExitCode::SUCCESS);
    }
    let mut missing = Vec::new();
    prepare_machine(&config, &mut missing);
    if let Some(first) = missing.first()
        && !config.allow_degraded
    {
        return Err(format!("{first}, or allow_degraded = true in {}", arguments.config.display()));
    }
    for problem in &missing {
        say(&format!("NOT REAL TIME: {problem}"));
    }
    let latency = if config.hold_cpu_dma_latency { permit(&config, realtime::hold_cpu_dma_latency())? } else { None };
    let standing = if missing.is_empty() { 0 } else { flag::NOT_REALTIME };
    let code = serve(&config, prepared, standing, arguments.test_hook);
    drop(latency);
    code
}

fn permit<T>(config: &Config, granted: Result<T, Missing>) -> Result<Option<T>, String> {
    match granted {
        Ok(value) => Ok(Some(value)),
        Err(problem) if config.allow_degraded => {
            say(&format!("NOT REAL TIME: {problem}"));
            Ok(None)
        }
        Err(problem) => Err(format!("{problem}, or allow_degraded = true")),
    }
}

/// Locks memory, and tries on a thread of its own what the loop will need, so that a refusal comes before anything starts.
fn prepare_machine(config: &Config, missing: &mut Vec<Missing>) {
    if config.wait == Wait::Spin {
        missing.extend(realtime::throttling().err());
    }
    if config.lock_memory {
        missing.extend(realtime::lock_memory().err());
    }
    let (core, priority) = (config.core, config.priority);
    let tried = std::thread::spawn(move || (core.map(realtime::pin), realtime::set_fifo(priority)));
    if let Ok((pinned, fifo)) = tried.join() {
        missing.extend(pinned.and_then(Result::err));
        missing.extend(fifo.err());
    }
}

fn load_models(config: &Config) -> Result<Prepared, String> {
    let mut names = [String::new(), String::new()];
    let mut models = [ArmModel::None, ArmModel::None];
    for arm in 0..ARMS {
        let Some(source) = &config.models[arm] else { continue };
        match model::load(source) {
            Ok((loaded, card)) => {
                names[arm] = format!("{:016x} {}", loaded.id, source.path.display());
                if card.untrained && config.allow_untrained {
                    say(&format!(
                        "{} arm: the model is UNTRAINED; allow_untrained = true publishes its numbers all the same",
                        NAMES[arm]
                    ));
                } else if card.untrained {
                    say(&format!("{} arm: the model is untrained; every pose will be fallback(untrained)", NAMES[arm]));
                }
                models[arm] = ArmModel::Loaded(Box::new(loaded));
            }
            Err(error) if config.allow_degraded => {
                say(&format!("{} arm: {error}; going on without it, as allow_degraded says", NAMES[arm]));
                models[arm] = ArmModel::Rejected;
            }
            Err(error) => return Err(error.to_string()),
        }
    }
    if config.models.iter().all(Option::is_none) {
        say("no model is configured; every pose will be fallback(no_model)");
    }
    Ok(Prepared { models, names })
}

/// The ordinary thread's view of the running service.
struct Watch {
    shared: Arc<Shared>,
    collector: Collector,
    events: EventReceiver,
    interval: Histograms,
    total: Histograms,
    log: Option<Log>,
    stats_path: PathBuf,
    names: [String; ARMS],
    started: Instant,
    interval_began: Instant,
    lines: Lines,
    heartbeat: u64,
    probe: Option<Probe>,
    unreachable: u32,
    write_failed: bool,
    silent_since: Option<Instant>,
    silence_explained: bool,
}

type Loop = JoinHandle<Result<Box<Histograms>, String>>;

fn serve(config: &Config, prepared: Prepared, standing: u32, hook: Option<TestHook>) -> Result<ExitCode, String> {
    let shared = Arc::new(Shared::default());
    let (recorder, collector) = histogram::exchange();
    let (event_sender, events) = shared::events();
    let cycle = Cycle::new(config.limits, prepared.models, config.allow_untrained, standing);
    let (ready, opened) = sync_channel(1);
    let handle = spawn_loop(config, cycle, hook, (recorder, event_sender, shared.clone()), ready)?;
    if !matches!(opened.recv(), Ok(Ok(()))) {
        return Err(match handle.join() {
            Ok(Err(message)) => message,
            _ => "the loop could not be started".to_owned(),
        });
    }
    // From here on a panic ends the process at once: the controller then uses its own pose, and systemd starts us anew.
    std::panic::set_hook(Box::new(|panic| {
        eprintln!("ravenposed: internal error: {panic}");
        std::process::abort();
    }));
    let mut watch = Watch::new(config, shared, collector, events, prepared.names)?;
    notify(&[NotifyState::Ready, NotifyState::Status("running")]);
    say(&format!("running; poses on {}, statistics in {}", CorrectedPose::SERVICE, watch.stats_path.display()));
    while !signals::wait(TICK) {
        if handle.is_finished() {
            watch.finish(None);
            return Err(match handle.join() {
                Ok(Err(message)) => message,
                _ => "the loop ended by itself".to_owned(),
            });
        }
        watch.tick(Duration::from_secs(config.interval_s));
    }
    notify(&[NotifyState::Stopping]);
    watch.shared.stop.store(true, Relaxed);
    let asked = Instant::now();
    while !handle.is_finished() && asked.elapsed() < STOP_MAX {
        std::thread::sleep(Duration::from_millis(1));
    }
    let last = if handle.is_finished() { handle.join().ok().and_then(Result::ok) } else { None };
    let stopped = last.is_some();
    watch.finish(last.as_deref());
    if !stopped {
        say("the loop did not stop in time");
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

fn notify(states: &[NotifyState]) {
    // Without NOTIFY_SOCKET this does nothing; a failure must not end the service.
    let _ = sd_notify::notify(states);
}

fn spawn_loop(
    config: &Config,
    cycle: Cycle<Plan>,
    hook: Option<TestHook>,
    ends: (histogram::Recorder, EventSender, Arc<Shared>),
    ready: SyncSender<Result<(), ()>>,
) -> Result<Loop, String> {
    let config = config.clone();
    std::thread::Builder::new()
        .name("ravenpose-loop".to_owned())
        .stack_size(1 << 20)
        .spawn(move || {
            // Refusals were weighed before; whoever got here without these rights was allowed to.
            let _ = config.core.map(realtime::pin);
            let _ = realtime::set_fifo(config.priority);
            let shared = ends.2.clone();
            let waiting = Waiting { wait: config.wait, spin_ns: config.spin_ns };
            let mut runner = match Runner::open(&config.transport, cycle, config.limits, waiting, ends) {
                Ok(runner) => runner,
                Err(error) => {
                    let _ = ready.send(Err(()));
                    return Err(error.to_string());
                }
            };
            if let Some(hook) = hook {
                runner.set_test_hook(hook);
            }
            let _ = ready.send(Ok(()));
            while runner.run() == Ended::Reopen {
                runner = runner.reopen(&config.transport).unwrap_or_else(|(old, _)| {
                    // Still held by others: the ordinary thread will ask again.
                    shared.reopen.store(false, Relaxed);
                    old
                });
            }
            Ok(runner.into_recorder().into_active())
        })
        .map_err(|cause| format!("the loop's thread cannot be started: {cause}"))
}

impl Watch {
    fn new(
        config: &Config,
        shared: Arc<Shared>,
        collector: Collector,
        events: EventReceiver,
        names: [String; ARMS],
    ) -> Result<Self, String> {
        let log = match &config.histogram_dir {
            None => None,
            Some(dir) => match Log::create(dir) {
                Ok(log) => Some(log),
                Err(cause) => {
                    say(&format!("{}: histograms cannot be written here ({cause}); set report.histogram_dir", dir.display()));
                    None
                }
            },
        };
        if let Err(cause) = std::fs::create_dir_all(&config.runtime_dir) {
            say(&format!("{}: statistics cannot be written here ({cause}); set report.runtime_dir", config.runtime_dir.display()));
        }
        Ok(Self {
            shared,
            collector,
            events,
            interval: Histograms::new(),
            total: Histograms::new(),
            log,
            stats_path: config.runtime_dir.join("stats.json"),
            names,
            started: Instant::now(),
            interval_began: Instant::now(),
            lines: Lines::default(),
            heartbeat: 0,
            probe: Some(Probe::open(&config.transport).map_err(|error| error.to_string())?),
            unreachable: 0,
            write_failed: false,
            silent_since: None,
            silence_explained: false,
        })
    }

    fn tick(&mut self, interval: Duration) {
        let heartbeat = self.shared.heartbeat.load(Relaxed);
        if heartbeat != self.heartbeat {
            self.heartbeat = heartbeat;
            notify(&[NotifyState::Watchdog]);
        }
        while let Some(event) = self.events.dequeue() {
            self.lines.take(&event);
        }
        if self.lines.due() {
            self.lines.print();
            self.collect(None);
            self.check_link();
            self.write_stats();
            if self.interval_began.elapsed() >= interval {
                self.write_log();
            }
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

    /// Are our ports among those that a newcomer finds? And does a publisher's data reach us?
    fn check_link(&mut self) {
        let Some(probe) = &self.probe else { return };
        let (publishers, readers) = probe.count::<RavenState>();
        let (poses, _) = probe.count::<CorrectedPose>();
        let seen = readers > 0 && poses > 0;
        self.unreachable = if seen { 0 } else { self.unreachable + 1 };
        if self.unreachable >= 2 {
            self.unreachable = 0;
            say("the shared files were removed under the service (RemoveIPC, a tmp cleaner?); opening the link anew");
            self.shared.reopen.store(true, Relaxed);
        }
        let stale = (0..ARMS).any(|arm| self.shared.arm(arm).1 & flag::INPUT_STALE != 0);
        let never = self.shared.counters()[1] == 0;
        if publishers == 0 || !(stale || never) {
            self.silent_since = None;
            self.silence_explained = false;
        } else if self.silent_since.get_or_insert_with(Instant::now).elapsed() > 2 * SECOND && !self.silence_explained {
            self.silence_explained = true;
            say(&format!(
                "a publisher of {} is connected but its states do not arrive; it is stopped, or runs as another user: all parties must run as the same user",
                RavenState::SERVICE
            ));
        }
    }

    fn write_stats(&mut self) {
        let stats = Stats::collect(&self.shared, &self.total, self.started.elapsed(), &self.names);
        let written = serde_json::to_vec(&stats)
            .map_err(std::io::Error::other)
            .and_then(|bytes| report::write_whole(&self.stats_path, &bytes));
        self.complain_once(written, "statistics");
    }

    fn write_log(&mut self) {
        let length = self.interval_began.elapsed();
        let Some(log) = &self.log else { return };
        let written = log.write(&self.interval, &self.total, length);
        if written.is_ok() {
            // What could not be written stays for the next try.
            self.interval.clear();
            self.interval_began = Instant::now();
        }
        self.complain_once(written, "histograms");
    }

    fn complain_once(&mut self, written: std::io::Result<()>, what: &str) {
        match written {
            Ok(()) => self.write_failed = false,
            Err(cause) if !self.write_failed => {
                self.write_failed = true;
                say(&format!("{what} cannot be written ({cause}); the loop goes on, trying again each second"));
            }
            Err(_) => {}
        }
    }

    fn finish(&mut self, last: Option<&Histograms>) {
        while let Some(event) = self.events.dequeue() {
            self.lines.take(&event);
        }
        self.lines.print();
        self.collect(last);
        self.write_log();
        self.write_stats();
    }
}

/// At most one line per kind of event and second, with a count of what it stands for.
#[derive(Default)]
struct Lines {
    last: [Option<Event>; Event::KINDS],
    counts: [u64; Event::KINDS],
    printed: Option<Instant>,
}

impl Lines {
    fn take(&mut self, event: &Event) {
        self.last[event.kind()] = Some(*event);
        self.counts[event.kind()] += 1;
    }

    fn due(&self) -> bool {
        self.printed.is_none_or(|printed| printed.elapsed() >= SECOND)
    }

    fn print(&mut self) {
        self.printed = Some(Instant::now());
        for (last, count) in self.last.iter_mut().zip(&mut self.counts) {
            if let Some(event) = last.take() {
                let repeated = if *count > 1 { format!(" ({count} such events in the last second)") } else { String::new() };
                say(&format!("{}{repeated}", describe(&event)));
            }
            *count = 0;
        }
    }
}

fn describe(event: &Event) -> String {
    match *event {
        Event::Arm { arm, status, flags, sequence } => {
            let names: Vec<_> = flag_names(flags).collect();
            format!("{} arm: {} [{}] at state {sequence}", NAMES[arm], ArmStatus::name(status), names.join(" "))
        }
        Event::Source { id, sequence } => format!("control process {id:016x} from state {sequence}"),
        Event::Lost { total, sequence } => format!("states missing before {sequence}; {total} in all"),
        Event::Refused { total } => {
            format!("messages refused (other layout, torn, or not on this machine's CLOCK_MONOTONIC); {total} in all")
        }
        Event::Late { took_ns, sequence } => format!("state {sequence} took {:.1} us, beyond the budget", took_ns as f64 / 1000.0),
        Event::Link { receive, send } => format!("link failures: {receive} receiving, {send} sending"),
        Event::Reopened => "the link was opened anew".to_owned(),
    }
}
