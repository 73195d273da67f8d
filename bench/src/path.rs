//! The whole path through shared memory: this process publishes at 1 kHz on one core, `ravenposed` answers on another, and this
//! process polls for the answer. Real processes, real service, one arm.
//!
//! This module contains `unsafe`: a signal to a child process.

use crate::table::{Table, quantiles};
use ravenpose::config::ModelSource;
use ravenpose::realtime;
use ravenpose::report::{StageStats, Stats};
use ravenpose_transport::{Bell, Listener, Reader, Settings, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{ArmStatus, CorrectedPose, RavenState, features};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::Duration;

pub(crate) const PERIOD_NS: i64 = 1_000_000;
/// Name of the thread whose faults count, as /proc has it.
const LOOP_THREAD: &str = "(ravenpose-loop)";
/// Answers later than this are given up: the next state is due.
pub(crate) const PATIENCE_NS: i64 = 900_000;
/// Wide: a machine that stops for a moment is to make no pose uncorrected.
const LIMITS: &str = "[limits]\nstale_us = 1000000\nbudget_us = 100000\nlate_fallback = 1000\n";
/// States before anything is measured: connecting, warming up, becoming valid.
pub(crate) const WARM_UP: u64 = 1_500;

/// A link of this process alone; its files go with it.
pub(crate) struct OwnLink {
    dir: PathBuf,
    pub(crate) settings: Settings,
}

impl OwnLink {
    pub(crate) fn new(name: &str) -> Self {
        let process = std::process::id();
        let dir = std::env::temp_dir().join(format!("ravenpose-{name}-{process}"));
        let settings = Settings { prefix: format!("rp{name}{process}_"), root: format!("{}/iceoryx2/", dir.display()) };
        Self { dir, settings }
    }
}

impl Drop for OwnLink {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.dir);
        for entry in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.settings.prefix) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

/// A service on a link of its own.
pub(crate) struct World {
    link: OwnLink,
    /// Is what it takes from the heap counted?
    counted: bool,
    service: Child,
}

/// `allocations.c`, built; empty where there was nothing to build it with.
const COUNTER: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/allocations.so"));
const COUNTS: &str = "allocations";

impl World {
    /// With these lines in its `[loop]` table.
    pub(crate) fn start(waiting: &str, arms: Arms, core: usize) -> Result<Self, String> {
        Self::begin(waiting, arms, core, false)
    }

    /// As by default, with one arm, and [`World::allocations`].
    pub(crate) fn start_counted(core: usize) -> Result<Self, String> {
        Self::begin("", Arms::One, core, true)
    }

    fn begin(waiting: &str, arms: Arms, core: usize, counted: bool) -> Result<Self, String> {
        let link = OwnLink::new("bench");
        let dir = &link.dir;
        std::fs::create_dir_all(dir).map_err(|cause| cause.to_string())?;
        let models = arms.tables()?;
        let text = format!(
            "allow_untrained = true\nallow_degraded = true\n{LIMITS}[transport]\nprefix = \"{}\"\nroot = \"{}\"\n[loop]\ncore = {core}\n{waiting}\n{models}[report]\nruntime_dir = \"{}\"\n",
            link.settings.prefix,
            link.settings.root,
            dir.display()
        );
        std::fs::write(dir.join("c.toml"), text).map_err(|cause| cause.to_string())?;
        let service = service(dir, counted)?;
        let mut world = Self { link, counted, service };
        world.runs()?;
        Ok(world)
    }

    pub(crate) fn settings(&self) -> &Settings {
        &self.link.settings
    }

    /// Returns when the service says that it runs.
    fn runs(&mut self) -> Result<(), String> {
        for _ in 0..3000 {
            if self.log().contains("running") {
                return Ok(());
            }
            if self.ended() {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Err(format!("ravenposed did not start: {}", self.last_words()))
    }

    /// Kills the service with SIGKILL and starts the next one.
    pub(crate) fn restart(&mut self) -> Result<(), String> {
        if self.ended() {
            return Err(format!("ravenposed ended by itself: {}", self.last_words()));
        }
        let killed = self.service.kill().and_then(|()| self.service.wait());
        killed.map_err(|cause| format!("ravenposed cannot be killed: {cause}"))?;
        self.service = service(&self.link.dir, self.counted)?;
        self.runs()
    }

    fn log(&self) -> String {
        std::fs::read_to_string(self.link.dir.join("log")).unwrap_or_default()
    }

    pub(crate) fn last_words(&self) -> String {
        self.log().lines().last().unwrap_or_default().to_owned()
    }

    /// Has the service ended by itself?
    pub(crate) fn ended(&mut self) -> bool {
        matches!(self.service.try_wait(), Ok(Some(_)))
    }

    /// Page faults of the loop's thread so far; none where the kernel does not say.
    pub(crate) fn loop_faults(&self) -> Option<u64> {
        let threads = std::fs::read_dir(format!("/proc/{}/task", self.service.id())).ok()?;
        let mut stats = threads.flatten().filter_map(|thread| std::fs::read_to_string(thread.path().join("stat")).ok());
        let of_loop = stats.find_map(|stat| stat.split_once(LOOP_THREAD).map(|(_, rest)| rest.to_owned()))?;
        // After the name: state, six numbers, then minor faults, those of children, major ones.
        let fields: Vec<&str> = of_loop.split_whitespace().collect();
        Some(fields.get(7)?.parse::<u64>().ok()? + fields.get(9)?.parse::<u64>().ok()?)
    }

    /// What the loop's thread and all others took from the heap so far; none where nothing counts.
    pub(crate) fn allocations(&self) -> Option<[u64; 2]> {
        let bytes = std::fs::read(self.link.dir.join(COUNTS)).ok()?;
        let (counts, _) = bytes.as_chunks::<8>();
        let counts: [u64; 2] = [u64::from_ne_bytes(*counts.first()?), u64::from_ne_bytes(*counts.get(1)?)];
        (counts[1] > 0).then_some(counts)
    }

    pub(crate) fn stop(&mut self) -> Option<Stats> {
        // SAFETY: a signal to our own child, which was not waited for yet.
        unsafe { libc::kill(self.service.id() as i32, libc::SIGTERM) };
        let _ = self.service.wait();
        serde_json::from_slice(&std::fs::read(self.link.dir.join("stats.json")).ok()?).ok()
    }
}

/// Starts the service of this directory's configuration; what counts its allocations in front of the C library, if wanted and built.
fn service(dir: &Path, counted: bool) -> Result<Child, String> {
    let program = std::env::current_exe().map_err(|cause| cause.to_string())?.with_file_name("ravenposed");
    let log = std::fs::File::create(dir.join("log")).map_err(|cause| cause.to_string())?;
    let mut command = Command::new(&program);
    command.arg("--config").arg(dir.join("c.toml")).stderr(log);
    if counted && !COUNTER.is_empty() {
        let (counter, counts) = (dir.join("allocations.so"), dir.join(COUNTS));
        let made = std::fs::write(&counter, COUNTER).and_then(|()| std::fs::write(&counts, [0; 16]));
        made.map_err(|cause| format!("{}: {cause}", counter.display()))?;
        command.env("LD_PRELOAD", counter).env("RAVENPOSE_ALLOCATIONS", counts);
    }
    command.spawn().map_err(|cause| format!("{}: {cause}; run make build", program.display()))
}

impl Drop for World {
    fn drop(&mut self) {
        let _ = self.service.kill();
        let _ = self.service.wait();
    }
}

/// Which arms there are, and what corrects them.
#[derive(Clone, Copy)]
pub(crate) enum Arms {
    /// Gold, its position by the network of the paper's size.
    One,
    /// Both, each so.
    Two,
    /// Both, position and orientation of each by the models that ship.
    Shipped,
}

const PAPER: &str = "models/untrained.onnx";
/// The models that ship: of the position, and of the orientation.
pub(crate) const SHIPPED: [&str; 2] = ["models/raven2-worn.onnx", "models/raven2-worn-orientation.onnx"];

impl Arms {
    /// Tables of the configuration.
    fn tables(self) -> Result<String, String> {
        let model = |path: &str| {
            let path = std::fs::canonicalize(path).map_err(|cause| format!("{path}: {cause}"))?;
            Ok::<_, String>(format!("model = \"{}\"", path.display()))
        };
        let names = if matches!(self, Self::One) { &["gold"][..] } else { &["gold", "green"] };
        let mut tables = String::new();
        for name in names {
            if let Self::Shipped = self {
                let [position, orientation] = SHIPPED.map(model);
                let _ = write!(tables, "[{name}]\n{}\n[{name}.orientation]\n{}\n", position?, orientation?);
            } else {
                let _ = write!(tables, "[{name}]\n{}\n", model(PAPER)?);
            }
        }
        Ok(tables)
    }

    /// What is the same in all states of them.
    fn state(self) -> Result<RavenState, String> {
        let mut state = state(0);
        if matches!(self, Self::Two | Self::Shipped) {
            (state.arms, state.type_) = (3, [49; 2]);
            let gold: [f32; 8] = std::array::from_fn(|joint| state.jpos[joint]);
            state.jpos[8..].copy_from_slice(&gold);
            state.jpos_d[8..].copy_from_slice(&gold);
        }
        if let Self::Shipped = self {
            // One that both were trained on.
            let loaded = ravenpose::model::load(&ModelSource::new(SHIPPED[0].into())).map_err(|error| error.to_string())?;
            let golden = loaded.card.golden.first().ok_or_else(|| format!("{}: no golden pair", SHIPPED[0]))?;
            (0..2).for_each(|arm| features::insert(&golden.input, arm, &mut state));
        }
        Ok(state)
    }
}

/// A state of one arm, made now.
pub(crate) fn state(sequence: u64) -> RavenState {
    let mut state = RavenState::new();
    state.arms = 1;
    state.runlevel = 3;
    state.type_ = [49, 0];
    state.dt_nsec = 1_000_000;
    state.jpos[..3].copy_from_slice(&[30.0, 90.0, 22.9]);
    state.jpos_d[..3].copy_from_slice(&[30.0, 90.0, 22.9]);
    state.source_id = 1;
    made_now(state, sequence)
}

/// The next one; its encoders have moved.
fn made_now(mut state: RavenState, sequence: u64) -> RavenState {
    let moved = (sequence % 16) as i32 - (state.sequence % 16) as i32;
    for arm in 0..2 {
        state.enc_vals[8 * arm] += moved;
        state.pos[3 * arm] += moved;
    }
    state.source_time_ns = now_ns();
    state.seal(sequence);
    state
}

/// What one run of the service came to.
struct Measured {
    /// State sent to pose read, ns.
    whole: Vec<i64>,
    /// The robot's own call, ns.
    handed_over: Vec<i64>,
    missed: u64,
    stats: Stats,
}

impl Measured {
    /// Quantiles from state sent to pose read, and how many were missed.
    fn row(&mut self) -> Vec<f64> {
        let mut row = quantiles(&mut self.whole).to_vec();
        row.push(self.missed as f64);
        row
    }
}

/// Times that a measurement is tried on a machine that stops for so long that the service's watchdog ends it.
const ATTEMPTS: u32 = 3;

/// One service for `seconds`, with these lines in its `[loop]` table; none where it ended by itself in each attempt.
fn measure(waiting: &str, arms: Arms, service_core: usize, seconds: u64) -> Result<Option<Measured>, String> {
    for _ in 0..ATTEMPTS {
        let measured = measure_once(waiting, arms, service_core, seconds)?;
        if measured.is_some() {
            return Ok(measured);
        }
        println!("note: ravenposed ended by itself while it was measured");
    }
    Ok(None)
}

fn measure_once(waiting: &str, arms: Arms, service_core: usize, seconds: u64) -> Result<Option<Measured>, String> {
    let mut world = World::start(waiting, arms, service_core)?;
    let mut state = arms.state()?;
    let connected = state.connected();
    let writer: Writer<RavenState> = Writer::open(world.settings()).map_err(|error| error.to_string())?;
    let reader: Reader<CorrectedPose> = Reader::open(world.settings(), 1).map_err(|error| error.to_string())?;
    let bell = Bell::open(world.settings()).map_err(|error| error.to_string())?;
    let mut whole = Vec::with_capacity((seconds * 1000) as usize);
    let mut handed_over = Vec::with_capacity((seconds * 1000) as usize);
    let (mut answered, mut missed, mut valid) = (0_u64, 0_u64, 0_u64);
    let mut next = now_ns();
    for sequence in 1..=WARM_UP + seconds * 1000 {
        state = made_now(state, sequence);
        let sent = now_ns();
        writer.send(&state).map_err(|error| error.to_string())?;
        // As the bridge does.
        bell.ring();
        writer.prepare();
        if sequence > WARM_UP {
            handed_over.push(now_ns() - sent);
        }
        let answer = reader
            .wait(sent + PATIENCE_NS, |reader| Ok(reader.latest()?.filter(|pose| pose.source_sequence == sequence)))
            .map_err(|error| error.to_string())?;
        let took = now_ns() - sent;
        if sequence > WARM_UP {
            if let Some(pose) = answer {
                whole.push(took);
                answered += 1;
                let is_valid = |arm: usize| connected & (1 << arm) == 0 || pose.arm[arm].status == ArmStatus::Valid as u32;
                valid += u64::from((0..2).all(is_valid));
            } else {
                // As long at least.
                whole.push(PATIENCE_NS);
                missed += 1;
            }
            if answer.is_none() && world.ended() {
                println!("note: {}", world.last_words());
                return Ok(None);
            }
        }
        // As a controller's timer does: what was missed is skipped, the phase is kept.
        next += PERIOD_NS * ((now_ns() - next) / PERIOD_NS + 1);
        sleep_until_ns(next);
    }
    let Some(stats) = world.stop() else { return Ok(None) };
    if valid * 2 < answered {
        return Err(format!("only {valid} of {answered} answers were valid: this measures fallback"));
    }
    Ok(Some(Measured { whole, handed_over, missed, stats }))
}

/// Round trips of [`hop`], the first of which do not count.
const TRIPS: u64 = 20_000;
const FIRST_TRIPS: u64 = 2_000;
/// When an answer to a trip is given up.
const TRIP_MAX_NS: i64 = 100_000_000;

/// Quantiles of a message's way through shared memory and nothing else, µs: half of the time from a state sent here to a pose sent back by a
/// thread on the service's core that does nothing but that; both poll.
pub(crate) fn hop(service_core: usize, priority: i32) -> Result<[f64; 4], String> {
    let link = OwnLink::new("hop");
    trips(&link.settings, service_core, priority).map(|mut halves| quantiles(&mut halves))
}

fn trips(settings: &Settings, service_core: usize, priority: i32) -> Result<Vec<i64>, String> {
    let told = |error: ravenpose_transport::TransportError| error.to_string();
    let stopped = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| {
            as_the_service(service_core, priority);
            let reader: Reader<RavenState> = Reader::open(settings, 1).map_err(told)?;
            let writer: Writer<CorrectedPose> = Writer::open(settings).map_err(told)?;
            let mut pose = CorrectedPose::new();
            while !stopped.load(std::sync::atomic::Ordering::Relaxed) {
                if let Some(state) = reader.latest().map_err(told)? {
                    pose.source_sequence = state.sequence;
                    pose.seal(state.sequence);
                    writer.send(&pose).map_err(told)?;
                }
                std::hint::spin_loop();
            }
            Ok::<(), String>(())
        });
        let here = || -> Result<Vec<i64>, String> {
            let writer: Writer<RavenState> = Writer::open(settings).map_err(told)?;
            let reader: Reader<CorrectedPose> = Reader::open(settings, 1).map_err(told)?;
            while writer.readers() == 0 || reader.publishers() == 0 {
                if other.is_finished() {
                    return Err("a hop could not be measured: the other side did not start".to_owned());
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            let mut halves = Vec::with_capacity(TRIPS as usize);
            for sequence in 1..=TRIPS {
                let state = state(sequence);
                let sent = now_ns();
                writer.send(&state).map_err(told)?;
                let answered =
                    |reader: &Reader<CorrectedPose>| Ok(reader.latest()?.filter(|pose| pose.source_sequence == sequence));
                let answer = reader.wait(sent + TRIP_MAX_NS, answered).map_err(told)?;
                if answer.is_some() && sequence > FIRST_TRIPS {
                    halves.push((now_ns() - sent) / 2);
                }
            }
            Ok(halves)
        };
        let found = here();
        stopped.store(true, std::sync::atomic::Ordering::Relaxed);
        other.join().map_err(|_| "a part of the benchmark failed".to_owned())??;
        found
    })
}

/// Makes this thread run as the service's loop does, as far as it may.
fn as_the_service(core: usize, priority: i32) {
    for missing in [realtime::pin(core), realtime::set_fifo(priority)].into_iter().filter_map(Result::err) {
        println!("note: {missing}");
    }
}

/// States of [`woken_hop`], the first of which do not count, and how long its other side waits for one.
const WAKINGS: u64 = 5_000;
const FIRST_WAKINGS: u64 = 500;
const WAKING_MAX: Duration = Duration::from_millis(100);

/// Quantiles of a message's way to a thread that an event wakes and that does nothing else, µs, once a millisecond: from before it is sent to when that
/// thread, on the service's core, has it.
pub(crate) fn woken_hop(service_core: usize, priority: i32) -> Result<[f64; 4], String> {
    let link = OwnLink::new("woken");
    let told = |error: ravenpose_transport::TransportError| error.to_string();
    let stopped = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| {
            as_the_service(service_core, priority);
            let listener = Listener::open(&link.settings).map_err(told)?;
            let reader: Reader<RavenState> = Reader::open(&link.settings, 1).map_err(told)?;
            let mut ways = Vec::with_capacity(WAKINGS as usize);
            while !stopped.load(std::sync::atomic::Ordering::Relaxed) {
                if listener.wait(WAKING_MAX)
                    && let Some(state) = reader.latest().map_err(told)?
                    && state.sequence > FIRST_WAKINGS
                {
                    ways.push(now_ns() - state.source_time_ns);
                }
            }
            Ok::<_, String>(ways)
        });
        let here = || -> Result<(), String> {
            let writer: Writer<RavenState> = Writer::open(&link.settings).map_err(told)?;
            let bell = Bell::open(&link.settings).map_err(told)?;
            while writer.readers() == 0 || !bell.ring() {
                if other.is_finished() {
                    return Err("a hop could not be measured: the other side did not start".to_owned());
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            let mut next = now_ns();
            for sequence in 1..=WAKINGS {
                writer.send(&state(sequence)).map_err(told)?;
                let _ = bell.ring();
                next += PERIOD_NS * ((now_ns() - next) / PERIOD_NS + 1);
                sleep_until_ns(next);
            }
            Ok(())
        };
        let sent = here();
        stopped.store(true, std::sync::atomic::Ordering::Relaxed);
        let ways = other.join().map_err(|_| "a part of the benchmark failed".to_owned())??;
        sent.map(|()| ways)
    })
    .map(|mut ways| quantiles(&mut ways))
}

/// What is asked of the whole path, beside what these tables say: of each way of waiting that has its rows.
pub(crate) fn asked(table: &Table, waits: &[&str]) -> Table {
    let mut all = Table::new("What is asked of the whole path, and what this run reached, us", &["asked", "reached", "met"]);
    let met = |asked: f64, reached: f64| [asked, reached, f64::from(u8::from(reached <= asked))];
    for wait in waits {
        // Who waits for an event is woken, whatever it does then.
        let hop = table.find(if *wait == "event" { WOKEN_HOP } else { HOP }).map_or(f64::NAN, |row| row[0]);
        let rows = table.rows_after(&format!("{wait}: "));
        let median = |name: &str| rows.iter().find(|(row, _)| row.trim() == name).and_then(|(_, values)| values.first().copied());
        let (Some(inference), Some(total), Some(whole)) = (median("inference"), median("total"), median("input_to_output")) else {
            continue;
        };
        all.row(&format!("{wait}: input to output, at most guard and network, 3 us and a hop"), &met(inference + 3.0 + hop, whole));
        all.row(&format!("{wait}: the loop's own cost (total less guard and network), below"), &met(2.0, total - inference));
    }
    all
}

/// Name of the row of [`hop`].
pub(crate) const HOP: &str = "one hop through shared memory, half of there and back";

/// Name of the row of [`woken_hop`].
pub(crate) const WOKEN_HOP: &str = "one hop to a thread that an event wakes";

/// Real-time throttling off for as long as this lives, as a thread that spins needs it (docs/machine.md): what it was comes back.
struct Unthrottled {
    before: String,
}

impl Unthrottled {
    const SETTING: &str = "/proc/sys/kernel/sched_rt_runtime_us";

    /// None where it may not be changed.
    fn new() -> Option<Self> {
        let before = std::fs::read_to_string(Self::SETTING).ok()?;
        std::fs::write(Self::SETTING, "-1\n").ok()?;
        Some(Self { before })
    }
}

impl Drop for Unthrottled {
    fn drop(&mut self) {
        if let Err(cause) = std::fs::write(Self::SETTING, &self.before) {
            eprintln!("note: {} was {} and is -1 now: {cause}", Self::SETTING, self.before.trim());
        }
    }
}

/// Measures one way of waiting for `seconds`; adds its rows to the table.
pub(crate) fn run(table: &mut Table, wait: &str, service_core: usize, seconds: u64) -> Result<(), String> {
    let unthrottled = if wait == "spin" { Unthrottled::new() } else { None };
    if wait == "spin" && unthrottled.is_none() {
        println!("note: real-time throttling stays on: it stops a thread that spins for 50 ms of every second");
    }
    let Some(mut measured) = measure(&format!("wait = \"{wait}\""), Arms::One, service_core, seconds)? else {
        table.row(&format!("{wait}: not measured, the machine stopped for too long"), &[f64::NAN; 5]);
        return Ok(());
    };
    table.row(&format!("{wait}: state sent -> pose read, two processes"), &measured.row());
    let mut row = quantiles(&mut measured.handed_over).to_vec();
    row.push(f64::NAN);
    table.row("    the robot's own publish call", &row);
    for name in ["input_age", "features", "inference", "publish", "total", "input_to_output", "wakeup"] {
        if let Some(stage) = measured.stats.stages.iter().find(|stage| stage.name == name && stage.count > 0) {
            table.row(&format!("    {name}"), &of_stage(stage));
        }
    }
    Ok(())
}

/// Quantiles of a stage as the service tells them, µs; misses are not its matter.
fn of_stage(stage: &StageStats) -> [f64; 5] {
    let us = |ns: u64| ns as f64 / 1000.0;
    [us(stage.p50), us(stage.p99), us(stage.p999), us(stage.max), f64::NAN]
}

/// A service that is measured beside others: name, lines of its `[loop]` table, arms.
type Setup = (&'static str, &'static str, Arms);

/// What polling longer and reading the weights meanwhile bring, in the default mode: each alone, both and neither.
pub(crate) fn means(service_core: usize, rounds: usize, seconds: u64) -> Result<Table, String> {
    const MEANS: [Setup; 4] = [
        ("both, as by default", "", Arms::One),
        ("polling 200 us before a state is due, not 400", "spin_us = 200", Arms::One),
        ("weights not kept warm", "keep_warm = false", Arms::One),
        ("neither", "spin_us = 200\nkeep_warm = false", Arms::One),
    ];
    let title = format!("State sent -> pose read, {rounds} x {seconds} s each");
    side_by_side(&title, &MEANS, service_core, rounds, seconds)
}

/// What a second arm and the models that ship cost, in the default mode.
pub(crate) fn arms(service_core: usize, rounds: usize, seconds: u64) -> Result<Table, String> {
    const ARMS: [Setup; 3] = [
        ("one arm, 600-500-400", "", Arms::One),
        ("two arms, 600-500-400 each", "", Arms::Two),
        ("two arms, both shipped models each", "", Arms::Shipped),
    ];
    let title = format!("State sent -> pose read by arms and models, {rounds} x {seconds} s each");
    side_by_side(&title, &ARMS, service_core, rounds, seconds)
}

/// Round by round, each time another one first.
fn side_by_side(title: &str, setups: &[Setup], service_core: usize, rounds: usize, seconds: u64) -> Result<Table, String> {
    let mut all: Vec<Option<Measured>> = setups.iter().map(|_| None).collect();
    for round in 0..rounds {
        for turn in 0..setups.len() {
            let at = (turn + round) % setups.len();
            let (name, waiting, arms) = setups[at];
            let Some(mut found) = measure(waiting, arms, service_core, seconds)? else {
                println!("note: {name}: round {} of {rounds} not measured, the machine stopped for too long", round + 1);
                continue;
            };
            match &mut all[at] {
                Some(sum) => {
                    sum.whole.append(&mut found.whole);
                    sum.missed += found.missed;
                }
                empty => *empty = Some(found),
            }
        }
    }
    let mut table = Table::new(title, &["p50", "p99", "p99.9", "max", "missed"]);
    for ((name, ..), measured) in setups.iter().zip(&mut all) {
        if let Some(measured) = measured {
            table.row(name, &measured.row());
        }
    }
    Ok(table)
}
