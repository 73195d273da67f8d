//! `ravenposed`: start, the ordinary thread beside the loop, and the end.

use crate::config::{ARM_NAMES, Config, ModelSource, Wait};
use crate::correction::ArmModel;
use crate::cycle::{ArmModels, Cycle};
use crate::histogram::{self, Histograms};
use crate::model::{self, Estimate, Loaded, ModelError};
use crate::notify::{READY, STOPPING, notify};
use crate::realtime::{self, Missing};
use crate::runner::{Ended, Runner, TestHook, Waiting};
use crate::shared::{self, EventSender, Shared};
use crate::watch::{self, TICK, Watch};
use crate::{abort, say, signals};
use ravenpose_transport::{Message, Settings};
use ravenpose_wire::{ARMS, CorrectedPose, flag};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Longest wait for the loop to send its last message: half a second, in ticks of this thread, so that a stop of the whole process
/// does not count. A loop that runs takes one period; one whose core stands still is waited for.
const STOP_TICKS: u32 = 500;
const STOP_TICK: Duration = Duration::from_millis(1);
/// Longest pause between two tries to open the link anew, each twice as long as the last: each reaches into the controller, too.
const PAUSE_MAX: Duration = Duration::from_secs(1);
/// After so long without a link it is asked whether there can be one.
const SHUT_OUT_AFTER: Duration = Duration::from_secs(3);

const USAGE: &str = "\
ravenposed - corrects the end-effector pose of a RAVEN-II in hard real time
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
    say(message);
    ExitCode::from(2)
}

fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Option<Arguments>, String> {
    let (mut config, mut check_only, mut hook) = (None, false, None);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} wants a value; see --help"));
        match argument.as_str() {
            "--config" => match config.replace(PathBuf::from(value()?)) {
                None => {}
                Some(first) => return Err(format!("--config is given twice, first \"{}\"; leave one", first.display())),
            },
            "--check-config" => check_only = true,
            "--test-hook" => hook = Some(test_hook(&value()?)?),
            "--version" => {
                print(&format!("ravenposed {} (research software, no clinical use)", env!("CARGO_PKG_VERSION")))?;
                return Ok(None);
            }
            "--help" | "-h" => {
                print(USAGE)?;
                return Ok(None);
            }
            _ => return Err(format!("unknown argument {argument:?}; see --help")),
        }
    }
    let config = config.unwrap_or_else(|| PathBuf::from("/etc/ravenpose/ravenposed.toml"));
    Ok(Some(Arguments { config, check_only, test_hook: hook }))
}

fn print(text: &str) -> Result<(), String> {
    writeln!(io::stdout(), "{text}").map_err(|cause| format!("standard output cannot be written: {cause}"))
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
    models: [ArmModels<Estimate>; ARMS],
    names: [String; ARMS],
}

fn start(arguments: &Arguments) -> Result<ExitCode, String> {
    signals::block().map_err(|cause| format!("signals cannot be blocked: {cause}"))?;
    let config = Config::read(&arguments.config).map_err(|error| error.to_string())?;
    let prepared = load_models(&config)?;
    if arguments.check_only {
        print(&format!("{}: configuration and models are good", arguments.config.display()))?;
        return Ok(ExitCode::SUCCESS);
    }
    // Told to stop while models were loaded: nobody has seen this service yet.
    if signals::wait(Duration::ZERO) {
        say("stopped before it ran");
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(core) = config.core {
        realtime::keep_off(core);
    }
    let mut missing = Vec::new();
    let latency = prepare_machine(&config, &mut missing);
    if let Some(first) = missing.first()
        && !config.allow_degraded
    {
        return Err(format!("{first}, or allow_degraded = true in {}", arguments.config.display()));
    }
    for problem in &missing {
        say(&format!("NOT REAL TIME: {problem}"));
    }
    // Memory that the configuration leaves unlocked needs no permission, but the guarantee is as little there.
    let standing = if missing.is_empty() && config.lock_memory { 0 } else { flag::NOT_REALTIME };
    let code = serve(&config, prepared, standing, arguments.test_hook);
    drop(latency);
    code
}

/// Locks memory, and tries on a thread of its own what the loop will need, so that a refusal comes before anything starts.
/// Gives the file that keeps the processor out of deep idle states, if that is asked for.
fn prepare_machine(config: &Config, missing: &mut Vec<Missing>) -> Option<std::fs::File> {
    if config.wait == Wait::Spin {
        missing.extend(realtime::throttling().err());
    }
    if config.lock_memory {
        missing.extend(realtime::lock_memory().err());
    }
    let (core, priority) = (config.core, config.priority);
    let tried = std::thread::Builder::new()
        .spawn(move || (core.map(realtime::pin), realtime::set_fifo(priority)))
        .map_err(|cause| cause.to_string())
        .and_then(|thread| thread.join().map_err(|_| "it failed".to_owned()));
    match tried {
        Ok((pinned, fifo)) => {
            missing.extend(pinned.and_then(Result::err));
            missing.extend(fifo.err());
        }
        Err(cause) => missing.push(Missing {
            what: format!("no thread can be started ({cause})"),
            remedy: "raise TasksMax= and LimitNPROC= of the unit, or LimitMEMLOCK=infinity".to_owned(),
        }),
    }
    if !config.hold_cpu_dma_latency {
        return None;
    }
    realtime::hold_cpu_dma_latency().map_err(|problem| missing.push(problem)).ok()
}

type ModelResult = Result<Loaded, ModelError>;

/// Each model once, however many arms it is for, and all at the same time, the first by this thread: a service that was killed is to be
/// back soon.
fn load_files(config: &Config) -> Result<Vec<(&ModelSource, ModelResult)>, String> {
    let mut sources: Vec<&ModelSource> = Vec::new();
    for source in config.models.iter().flatten().flat_map(|arm| std::iter::once(&arm.position).chain(&arm.orientation)) {
        if !sources.contains(&source) {
            sources.push(source);
        }
    }
    let Some((first, others)) = sources.split_first() else { return Ok(Vec::new()) };
    std::thread::scope(|scope| {
        let start = |source| std::thread::Builder::new().spawn_scoped(scope, move || model::load(source));
        let loading: Vec<_> = others.iter().map(|source| start(*source)).collect();
        let mut loaded = vec![(*first, model::load(first))];
        for (source, thread) in others.iter().zip(loading) {
            let thread = thread.map_err(|cause| format!("no thread can be started ({cause}); raise TasksMax= of the unit"))?;
            loaded.push((*source, thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))));
        }
        Ok(loaded)
    })
}

fn load_models(config: &Config) -> Result<Prepared, String> {
    let files = load_files(config)?;
    let mut names = [String::new(), String::new()];
    let none = || ArmModels::from(ArmModel::None);
    let mut models = [none(), none()];
    for arm in 0..ARMS {
        let Some(sources) = &config.models[arm] else { continue };
        let (model, name) = load_model(config, &files, &sources.position, ARM_NAMES[arm])?;
        (models[arm].position, names[arm]) = (model, name);
        if let Some(source) = &sources.orientation {
            let (model, name) = load_model(config, &files, source, &format!("orientation of the {}", ARM_NAMES[arm]))?;
            models[arm].orientation = model;
            names[arm] = format!("{}; orientation {name}", names[arm]);
        }
    }
    if config.models.iter().all(Option::is_none) {
        say("no model is configured; every pose will be fallback(no_model)");
    }
    Ok(Prepared { models, names })
}

/// A model, and how statistics show it; `whose` arm is for the log.
fn load_model(
    config: &Config,
    files: &[(&ModelSource, ModelResult)],
    source: &ModelSource,
    whose: &str,
) -> Result<(ArmModel<Estimate>, String), String> {
    let file = files.iter().find(|(of, _)| *of == source).map(|(_, result)| result);
    match file.ok_or_else(|| format!("{whose} arm: its model was not loaded"))? {
        Ok(loaded) => {
            let weights = loaded.weights();
            let name = format!("{:016x} {}, {weights}", loaded.model.id, source.path.display());
            let card = &loaded.card;
            say(&format!("{whose} arm: {weights}; {}", card.limits()));
            if card.untrained && config.allow_untrained {
                say(&format!("{whose} arm: the model is UNTRAINED; allow_untrained = true publishes its numbers all the same"));
            } else if card.untrained {
                say(&format!("{whose} arm: the model is untrained; every pose will be fallback(untrained)"));
            }
            Ok((ArmModel::Loaded(Box::new(loaded.model.clone())), name))
        }
        Err(error) if config.allow_degraded => {
            say(&format!("{whose} arm: {error}; going on without it, as allow_degraded says"));
            Ok((ArmModel::Rejected, format!("refused: {}", source.path.display())))
        }
        Err(error) => Err(error.to_string()),
    }
}

type Loop = JoinHandle<Result<Box<Histograms>, String>>;

fn serve(config: &Config, prepared: Prepared, standing: u32, hook: Option<TestHook>) -> Result<ExitCode, String> {
    let shared = Arc::new(Shared::default());
    let (recorder, collector) = histogram::exchange();
    let (event_sender, events) = shared::events();
    let (trouble, troubles) = watch::troubles();
    let cycle = Cycle::new(config.limits, prepared.models, config.allow_untrained, standing);
    let (ready, opened) = sync_channel(1);
    let handle = spawn_loop(config, cycle, hook, (recorder, event_sender, shared.clone()), (ready, trouble))?;
    if !matches!(opened.recv(), Ok(Ok(()))) {
        return Err(match handle.join() {
            Ok(Err(message)) => message,
            _ => "the loop could not be started".to_owned(),
        });
    }
    // From here on a panic ends the process at once: the controller then uses its own pose, and systemd starts us anew.
    std::panic::set_hook(Box::new(|panic| abort(format!("internal error: {panic}"))));
    let mut watch = Watch::new(config, shared, collector, (events, troubles), prepared.names, standing == 0)?;
    notify(READY);
    say(&format!("running; poses on {}, statistics in {}", CorrectedPose::SERVICE, watch.stats_path().display()));
    while !signals::wait(TICK) {
        if handle.is_finished() {
            watch.finish(None);
            say(&match handle.join() {
                Ok(Err(message)) => message,
                _ => "the loop ended by itself".to_owned(),
            });
            return Ok(ExitCode::FAILURE);
        }
        watch.tick();
    }
    notify(STOPPING);
    watch.shared.stop.store(true, Relaxed);
    for _ in 0..STOP_TICKS {
        if handle.is_finished() {
            break;
        }
        std::thread::sleep(STOP_TICK);
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

/// Can no file be made under the transport's root? In a unit's sandbox a directory that was removed and made anew is another one, and read-only:
/// only a new process gets it.
fn is_shut_out(settings: &Settings) -> bool {
    let file = Path::new(&settings.root).join(format!(".ravenposed-{}", std::process::id()));
    let made = std::fs::create_dir_all(&settings.root).and_then(|()| std::fs::write(&file, ""));
    drop(std::fs::remove_file(&file));
    made.is_err()
}

fn spawn_loop(
    config: &Config,
    cycle: Cycle<Estimate>,
    hook: Option<TestHook>,
    ends: (histogram::Recorder, EventSender, Arc<Shared>),
    (ready, trouble): (SyncSender<Result<(), ()>>, SyncSender<String>),
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
            let waiting = Waiting { wait: config.wait, spin_ns: config.spin_ns, keep_warm: config.keep_warm };
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
            loop {
                match runner.run() {
                    Ended::Stopped => break,
                    Ended::AnotherReader => {
                        if let Err(error) = runner.another_reader(&config.transport) {
                            let _ = trouble.try_send(format!("no other reader of states can be opened: {error}"));
                        }
                        continue;
                    }
                    Ended::Reopen => {}
                }
                // Not real time: there is no link.
                let mut said = String::new();
                let mut pause = TICK;
                let begun = Instant::now();
                while let Err(error) = runner.reopen(&config.transport)
                    && !shared.stop.load(Relaxed)
                {
                    let text = error.to_string();
                    // Said by the ordinary thread: a log that hangs holds up nobody.
                    if text != said
                        && trouble.try_send(format!("the link cannot be opened anew: {text}; it is tried again")).is_ok()
                    {
                        said = text;
                    }
                    if begun.elapsed() > SHUT_OUT_AFTER && is_shut_out(&config.transport) {
                        return Err(format!(
                            "the link cannot be opened anew: {said}; {} cannot be written by this process any more: ending, so that it is started anew",
                            config.transport.root
                        ));
                    }
                    std::thread::sleep(pause);
                    pause = (2 * pause).min(PAUSE_MAX);
                }
            }
            Ok(runner.into_recorder().into_active())
        })
        .map_err(|cause| format!("the loop's thread cannot be started: {cause}"))
}
