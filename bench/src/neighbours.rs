//! What processes that are killed, or never read, cost the others: a robot at 1 kHz that goes on through all of it, quiet and disturbed in
//! turn, block by block, so that what the machine does falls on all alike.

use crate::path::{Arms, PATIENCE_NS, PERIOD_NS, World, state};
use crate::soak::IDLE;
use crate::table::{Table, quantiles};
use ravenpose::realtime;
use ravenpose_transport::{Bell, Reader, Settings, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{CorrectedPose, RavenState};
use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// One condition at a stretch.
const BLOCK: Duration = Duration::from_secs(20);
/// After a change of conditions nothing counts for so long: connections are made and taken down.
const BETWEEN: Duration = Duration::from_secs(2);
/// A service lives so long after it says that it runs.
const SERVICE_LIVES: Duration = Duration::from_millis(700);
/// A client to which no pose comes for so long ends.
const PATIENCE: Duration = Duration::from_secs(10);
/// No condition: what is measured then is not kept.
const BETWEEN_BLOCKS: usize = usize::MAX;
/// Queue of a client that is there to be killed, or never reads.
const DEPTH: usize = 64;

/// What the robot does not do itself.
#[derive(Clone, Copy, PartialEq)]
enum Condition {
    Quiet,
    /// As many clients that never read as in the soak.
    Idle,
    /// Clients that come, take a pose and leave, one after the other.
    ClientsLeave,
    /// The same, killed while they hold it.
    ClientsKilled,
    /// The service killed and started again, over and over.
    ServiceKilled,
}

impl Condition {
    fn name(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Idle => "126 clients that never read",
            Self::ClientsLeave => "clients that come and leave",
            Self::ClientsKilled => "clients killed holding a pose",
            Self::ServiceKilled => "the service killed and started again",
        }
    }
}

/// Questions, each with what it compares.
const QUESTIONS: [(&str, &[Condition]); 3] = [
    ("idle", &[Condition::Quiet, Condition::Idle]),
    ("clients", &[Condition::Quiet, Condition::ClientsLeave, Condition::ClientsKilled]),
    ("service", &[Condition::Quiet, Condition::ServiceKilled]),
];

/// What the robot saw under one condition, ns.
struct Seen {
    /// State due to state handed over: the controller's own lateness with the call.
    due: Vec<i64>,
    /// The call alone.
    call: Vec<i64>,
    /// State sent to its pose read.
    whole: Vec<i64>,
    missed: u64,
}

/// What is compared.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Due,
    Call,
    Whole,
}

impl Part {
    fn name(self) -> &'static str {
        match self {
            Self::Due => "state due -> handed over: the controller's own",
            Self::Call => "the publish call of it",
            Self::Whole => "state sent -> pose read",
        }
    }

    fn of(self, seen: &mut Seen) -> &mut Vec<i64> {
        match self {
            Self::Due => &mut seen.due,
            Self::Call => &mut seen.call,
            Self::Whole => &mut seen.whole,
        }
    }
}

/// Asks all questions, or one of them, with `minutes` for each condition, and prints what came of each; an error if a state could not be
/// sent, or a pose of the last service.
pub(crate) fn run(minutes: u64, only: Option<&str>, become_the_robot: fn(), core: usize) -> Result<(), String> {
    let wanted = |name: &str| only.is_none_or(|only| only == name);
    if !QUESTIONS.iter().any(|(name, _)| wanted(name)) {
        return Err(format!("{}: must be idle, clients or service", only.unwrap_or_default()));
    }
    for (_, all) in QUESTIONS.into_iter().filter(|(name, _)| wanted(name)) {
        println!("\n{}", ask(all, minutes, become_the_robot, core)?);
    }
    Ok(())
}

fn ask(conditions: &[Condition], minutes: u64, become_the_robot: fn(), core: usize) -> Result<Table, String> {
    let mut world = World::start("", Arms::One, core)?;
    let settings = world.settings().clone();
    let (condition, stopped) = (AtomicUsize::new(BETWEEN_BLOCKS), AtomicBool::new(false));
    let (mut seen, disturbed) = std::thread::scope(|scope| {
        let robot = scope.spawn(|| {
            become_the_robot();
            robot(&settings, &condition, &stopped, conditions.len(), minutes)
        });
        let disturbed = disturb(&mut world, &settings, conditions, minutes, &condition, core, || robot.is_finished());
        stopped.store(true, Relaxed);
        (robot.join().map_err(|_| "the robot failed".to_owned()).and_then(|seen| seen), disturbed)
    });
    // The robot first: its error is the cause of the others'.
    let seen = seen.as_mut().map_err(|error| error.clone())?;
    let counts = disturbed?;
    let stats = world.stop().ok_or_else(|| format!("the service ended by itself: {}", world.last_words()))?;
    let failures = stats.counter("send_failures").expect("a counter of the service");
    if failures > 0 {
        return Err(format!("{failures} poses could not be sent"));
    }
    let last = conditions.last().map_or("", |condition| condition.name());
    let mut table = Table::new(
        &format!("What neighbours cost: {last}, {minutes} min of each, 1 kHz, us"),
        &["p50", "p99", "p99.9", "max", "missed"],
    );
    for part in [Part::Due, Part::Call, Part::Whole] {
        table.row(part.name(), &[f64::NAN; 5]);
        for ((seen, condition), count) in seen.iter_mut().zip(conditions).zip(&counts) {
            let mut row = quantiles(part.of(seen)).to_vec();
            row.push(if part == Part::Whole { seen.missed as f64 } else { f64::NAN });
            let name = condition.name();
            table.row(&if *count > 0 { format!("  {name}: {count}") } else { format!("  {name}") }, &row);
        }
    }
    Ok(table)
}

/// Makes each condition in turn and says when it holds; returns how many were killed or left, by condition.
fn disturb(
    world: &mut World,
    settings: &Settings,
    conditions: &[Condition],
    minutes: u64,
    holds: &AtomicUsize,
    core: usize,
    is_over: impl Fn() -> bool,
) -> Result<Vec<u64>, String> {
    // Beside the service, whose priority is above this one's: the robot's core is the robot's.
    if let Err(missing) = realtime::pin(core) {
        println!("note: {missing}");
    }
    let mut counts = vec![0; conditions.len()];
    std::thread::sleep(BETWEEN);
    for round in 0..minutes * 60 / BLOCK.as_secs() {
        for turn in 0..conditions.len() {
            let place = (turn + round as usize) % conditions.len();
            if is_over() {
                return Ok(counts);
            }
            if world.ended() {
                return Err(format!("the service ended by itself: {}", world.last_words()));
            }
            let idle = if conditions[place] == Condition::Idle { IDLE } else { 0 };
            let idle = (0..idle).map(|_| Reader::<CorrectedPose>::open(settings, DEPTH)).collect::<Result<Vec<_>, _>>();
            let idle = idle.map_err(|error| error.to_string())?;
            std::thread::sleep(BETWEEN);
            holds.store(place, Relaxed);
            let end = Instant::now() + BLOCK;
            while Instant::now() < end {
                match conditions[place] {
                    Condition::Quiet | Condition::Idle => std::thread::sleep(end - Instant::now()),
                    Condition::ClientsLeave => client(settings, false)?,
                    Condition::ClientsKilled => client(settings, true)?,
                    Condition::ServiceKilled => {
                        world.restart()?;
                        std::thread::sleep(SERVICE_LIVES);
                    }
                }
                counts[place] += u64::from(!matches!(conditions[place], Condition::Quiet | Condition::Idle));
            }
            holds.store(BETWEEN_BLOCKS, Relaxed);
            drop(idle);
            std::thread::sleep(BETWEEN);
        }
    }
    Ok(counts)
}

/// A client process from its start to its end.
fn client(settings: &Settings, is_killed: bool) -> Result<(), String> {
    let program = std::env::current_exe().map_err(|cause| cause.to_string())?;
    let mut command = Command::new(program);
    command.args(["client", if is_killed { "holds" } else { "leaves" }, &settings.prefix, &settings.root]);
    let mut client = Process(command.stdout(Stdio::piped()).spawn().map_err(|cause| format!("a client: {cause}"))?);
    let mut line = String::new();
    let words = client.0.stdout.take().map_or(Ok(0), |output| BufReader::new(output).read_line(&mut line));
    if words.is_err() || line.trim() != "holds a pose" {
        return Err(format!("a client ended before it had a pose: {line}"));
    }
    if is_killed {
        client.0.kill().map_err(|cause| format!("a client cannot be killed: {cause}"))?;
    }
    client.0.wait().map(|_| ()).map_err(|cause| format!("a client: {cause}"))
}

/// A child that does not outlive its owner.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The client's side: takes a pose, says so, and keeps hold of it for ever, or gives it back and leaves.
pub(crate) fn be_a_client(holds: bool, settings: &Settings) -> Result<(), String> {
    let reader = Reader::<CorrectedPose>::open(settings, DEPTH).map_err(|error| error.to_string())?;
    let mut has_one = false;
    let deadline = Instant::now() + PATIENCE;
    while !has_one {
        if Instant::now() > deadline {
            return Err("no pose came".to_owned());
        }
        std::thread::sleep(Duration::from_micros(100));
        let taken = reader.drain(|_| {
            if !std::mem::replace(&mut has_one, true) {
                println!("holds a pose");
            }
            if holds {
                std::thread::sleep(Duration::MAX);
            }
        });
        taken.map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// Publishes at 1 kHz and reads each pose until it is stopped; keeps what it sees under each condition.
fn robot(
    settings: &Settings,
    holds: &AtomicUsize,
    stopped: &AtomicBool,
    conditions: usize,
    minutes: u64,
) -> Result<Vec<Seen>, String> {
    let failed = |error: ravenpose_transport::TransportError| error.to_string();
    let writer: Writer<RavenState> = Writer::open(settings).map_err(failed)?;
    let reader: Reader<CorrectedPose> = Reader::open(settings, 1).map_err(failed)?;
    let bell = Bell::open(settings).map_err(failed)?;
    // A block may end late.
    let room = || Vec::with_capacity((minutes * 60_000 * 3 / 2) as usize);
    let mut seen: Vec<Seen> = (0..conditions).map(|_| Seen { due: room(), call: room(), whole: room(), missed: 0 }).collect();
    let mut next = now_ns();
    let mut sequence = 0;
    while !stopped.load(Relaxed) {
        sequence += 1;
        let state = state(sequence);
        let sent = now_ns();
        writer.send(&state).map_err(failed)?;
        // As the bridge does.
        bell.ring();
        writer.prepare();
        let handed_over = now_ns();
        let answer = reader
            .wait(sent + PATIENCE_NS, |reader| Ok(reader.latest()?.filter(|pose| pose.source_sequence == sequence)))
            .map_err(failed)?;
        let read = now_ns();
        if let Some(seen) = seen.get_mut(holds.load(Relaxed)) {
            seen.due.push(handed_over - next);
            seen.call.push(handed_over - sent);
            match answer {
                Some(_) => seen.whole.push(read - sent),
                None => seen.missed += 1,
            }
        }
        next += PERIOD_NS * ((now_ns() - next) / PERIOD_NS + 1);
        sleep_until_ns(next);
    }
    Ok(seen)
}
