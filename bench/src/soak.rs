//! The service for long, under load and faults: memory streamed and a disk written beside it, clients that never read, inputs that it
//! has to refuse. What it answers is held against what it was sent.

use crate::path::{PERIOD_NS, WARM_UP, World, state};
use crate::table::{Table, quantiles};
use ravenpose::check;
use ravenpose::cycle::Limits;
use ravenpose_transport::{Message as _, Reader, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{ArmStatus, CorrectedPose, FALLBACK_REASONS, RavenState, flag};
use std::io::{Seek as _, Write as _};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;

/// Clients that connect and never read: all places but that of the client that judges, and one for whoever looks on.
pub(crate) const IDLE: usize = CorrectedPose::MAX_READERS - 2;
/// Messages that wait for them.
const IDLE_DEPTH: usize = 4;
/// Memory that is streamed: more than any cache.
const STREAMED: usize = 256 << 20;
/// What is written before the file begins anew.
const WRITTEN: u64 = 256 << 20;
/// Every so many states one that is not finite, one that no robot can be in, one that comes twice: primes, so that they mix.
const NOT_FINITE: u64 = 1009;
const IMPOSSIBLE: u64 = 1511;
const TWICE: u64 = 2003;
/// Messages that may wait for the client that judges.
const DEPTH: usize = 256;

/// Silence after which the service is looked at.
const SILENCE_NS: i64 = 1_000_000_000;
/// States on their way at the end of a part; and those that may be skipped while corrections return after a fault, where raw poses are counted.
const SLACK: u64 = 100;

/// What a part of the soak came to.
#[derive(Default)]
struct Seen {
    /// Made by the robot to sealed by the service, of the state that a pose answers, ns.
    age: Vec<i64>,
    poses: u64,
    /// Poses that this client lost since it was held up itself.
    missed: u64,
    valid: u64,
    /// Faults sent and answered as such.
    refused: u64,
    /// Raw poses after a fault: corrections return after a while.
    held: u64,
    /// Raw poses for what the machine did: late, stale, and settling after it.
    delayed: u64,
    /// Good cycles that the last pose was still short of; none if that pose is not known.
    hold: Option<u32>,
}

/// Quiet for a minute, then under `load` for `minutes`.
pub(crate) fn run(minutes: u64, load: Load, service_core: usize, priority: i32) -> Result<Table, String> {
    let title = format!("Soak: 1 kHz for {minutes} min with load, {IDLE} idle clients and faults, us");
    let mut table = Table::new(&title, &["p50", "p99", "p99.9", "max"]);
    let wakeup = |table: &mut Table, name: &str| {
        let found =
            check::measure_wakeup(Duration::from_secs(10), Some(service_core), priority).map_err(|error| error.to_string())?;
        table.row(name, &[found.p50_ns, found.p99_ns, found.p999_ns, found.max_ns].map(|ns| ns as f64 / 1000.0));
        Ok::<_, String>(())
    };
    wakeup(&mut table, "quiet: wake-up of a FIFO thread, 10 s")?;
    part(&mut table, "quiet", 60, 0, service_core)?;
    load.begin();
    wakeup(&mut table, "loaded: wake-up of a FIFO thread, 10 s")?;
    part(&mut table, "loaded", minutes * 60, IDLE, service_core)?;
    load.stop()?;
    Ok(table)
}

fn part(table: &mut Table, name: &str, seconds: u64, idle: usize, core: usize) -> Result<(), String> {
    let mut world = World::start_counted(core)?;
    let settings = world.settings().clone();
    let open = |depth| Reader::<CorrectedPose>::open(&settings, depth).map_err(|error| error.to_string());
    let _idle = (0..idle).map(|_| open(IDLE_DEPTH)).collect::<Result<Vec<_>, _>>()?;
    let link = (Writer::<RavenState>::open(&settings).map_err(|error| error.to_string())?, open(DEPTH)?);
    // The service is new to the first states.
    let mut warming = Seen::default();
    send(&mut world, &link, 1..=WARM_UP, &mut warming)?;
    let before = (world.loop_faults(), world.allocations());
    let mut seen = Seen { age: Vec::with_capacity((seconds * 1000) as usize), hold: warming.hold, ..Seen::default() };
    let (first, last) = (WARM_UP + 1, WARM_UP + seconds * 1000);
    send(&mut world, &link, first..=last, &mut seen)?;
    let after = (world.loop_faults(), world.allocations());
    let ended = world.ended();
    let stats =
        world.stop().filter(|_| !ended).ok_or_else(|| format!("{name}: the service ended by itself: {}", world.last_words()))?;
    let counter = |name: &str| stats.counter(name).expect("a counter of the service");
    let us = |quantiles: [u64; 4]| quantiles.map(|ns| ns as f64 / 1000.0);
    table.row(&format!("{name}: state made -> pose sealed, {} poses", seen.poses), &quantiles(&mut seen.age));
    for stage in
        stats.stages.iter().filter(|stage| stage.count > 0 && ["inference", "total", "input_to_output"].contains(&&*stage.name))
    {
        table.row(&format!("    {}", stage.name), &us([stage.p50, stage.p99, stage.p999, stage.max]));
    }
    let (sent, skipped) = (last - WARM_UP, counter("skipped"));
    let faulty = (first..=last).filter(|sequence| wanted(*sequence) != 0).count() as u64;
    let Seen { poses, missed, valid, refused, held, delayed, .. } = seen;
    println!(
        "{name}: {sent} states sent, {poses} poses and {missed} that this client missed; {valid} valid, {refused} of {faulty} faults answered as such, \
         {held} raw after one, {delayed} raw for lateness; {skipped} skipped, {} came twice; {}",
        counter("duplicates"),
        allocated(before.1, after.1),
    );
    let wrong = [
        (counter("lost") > 0, "states were lost"),
        (counter("out_of_order") > 0, "states came out of order"),
        (counter("send_failures") > 0, "poses could not be sent"),
        (counter("readers_left_out") > 0, "a client could not be connected"),
        (poses + missed + skipped + SLACK < sent, "states were not answered"),
        (refused + missed + skipped + delayed < faulty, "faults were not answered as such"),
        (valid * 2 < poses, "less than half of the poses were valid"),
        (before.0.is_some() && before.0 != after.0, "the loop's thread had page faults"),
        (before.1.is_some() && before.1.map(|all| all[0]) != after.1.map(|all| all[0]), "the loop's thread used the heap"),
    ];
    wrong.into_iter().find(|(wrong, _)| *wrong).map_or(Ok(()), |(_, what)| Err(format!("{name}: {what}")))
}

/// What was taken from the heap meanwhile, in words.
fn allocated(before: Option<[u64; 2]>, after: Option<[u64; 2]>) -> String {
    let Some((before, after)) = before.zip(after) else { return "allocations not counted".to_owned() };
    format!("{} allocations by the loop's thread and {} by all others", after[0] - before[0], after[1] - before[1])
}

/// Sends these states, one a millisecond, and judges every pose that comes meanwhile.
fn send(
    world: &mut World,
    (writer, reader): &(Writer<RavenState>, Reader<CorrectedPose>),
    sequences: std::ops::RangeInclusive<u64>,
    seen: &mut Seen,
) -> Result<(), String> {
    let mut next = now_ns();
    let (mut read_ns, mut heard_ns) = (next, next);
    let mut last: Option<u64> = None;
    for sequence in sequences {
        let mut state = state(sequence);
        match wanted(sequence) {
            0 => {}
            flag::INPUT_NOT_FINITE => state.jpos[1] = f32::NAN,
            _ => state.jpos[1] = 1e9,
        }
        state.seal(sequence);
        for _ in 0..=u64::from(sequence.is_multiple_of(TWICE)) {
            writer.send(&state).map_err(|error| error.to_string())?;
        }
        next += PERIOD_NS * ((now_ns() - next) / PERIOD_NS + 1);
        sleep_until_ns(next);
        // Held up for so long, this client itself has lost poses.
        let held_up = now_ns() - read_ns > DEPTH as i64 * PERIOD_NS;
        read_ns = now_ns();
        while let Some(pose) = reader.next().map_err(|error| error.to_string())? {
            let expected = last.map_or(pose.sequence, |last| last + 1);
            if pose.sequence != expected && !held_up {
                return Err(format!("pose {} came, {expected} was expected", pose.sequence));
            }
            seen.missed += pose.sequence.saturating_sub(expected);
            seen.hold = seen.hold.filter(|_| last.is_some() && pose.sequence == expected);
            (last, heard_ns) = (Some(pose.sequence), read_ns);
            judge(&pose, seen)?;
        }
        if read_ns - heard_ns > SILENCE_NS && world.ended() {
            return Err(format!("the service ended by itself: {}", world.last_words()));
        }
    }
    Ok(())
}

/// The flag that a state calls for; 0 for a good one.
fn wanted(sequence: u64) -> u32 {
    if sequence.is_multiple_of(NOT_FINITE) {
        flag::INPUT_NOT_FINITE
    } else if sequence.is_multiple_of(IMPOSSIBLE) {
        flag::INPUT_IMPOSSIBLE
    } else {
        0
    }
}

/// Are status and flags those that the state which this pose answers calls for?
fn judge(pose: &CorrectedPose, seen: &mut Seen) -> Result<(), String> {
    /// What a machine that stops for a moment may do to any pose.
    const DELAYED: u32 = flag::INPUT_STALE | flag::BUDGET_EXCEEDED | flag::NEW_SOURCE;
    /// What is said of an impossible state as well.
    const ALONG: u32 = flag::SETTLING | flag::OUT_OF_RANGE | flag::OUT_OF_DOMAIN;
    let (arm, sequence) = (&pose.arm[0], pose.source_sequence);
    let good_cycles = Limits::default().good_cycles;
    let reasons = arm.flags & FALLBACK_REASONS;
    seen.poses += 1;
    seen.age.push(pose.publish_time_ns - pose.source_time_ns);
    let after_fault = (sequence % NOT_FINITE).min(sequence % IMPOSSIBLE) <= u64::from(good_cycles) + SLACK;
    // Every reason begins the settling anew, and every good cycle brings it nearer, by one.
    let is_good = reasons == 0 || reasons & flag::SETTLING != 0;
    let counted = match seen.hold.replace(arm.hold_cycles) {
        _ if !is_good => arm.hold_cycles == good_cycles,
        Some(before) => arm.hold_cycles == before.saturating_sub(1),
        None => true,
    };
    if !counted {
        return Err(format!("state {sequence}: {} cycles to settle, flags {:#x}", arm.hold_cycles, arm.flags));
    }
    let valid = arm.status == ArmStatus::Valid as u32;
    match (wanted(sequence), reasons & !DELAYED) {
        (0, 0) if valid && reasons == 0 && arm.hold_cycles == 0 => seen.valid += 1,
        // One that is stale is not judged again.
        (_, 0) if !valid && reasons != 0 => seen.delayed += 1,
        (0, flag::SETTLING) if !valid && after_fault => seen.held += 1,
        (0, flag::SETTLING) if !valid => seen.delayed += 1,
        (wanted, found) if wanted & found != 0 && !valid && found & !(wanted | ALONG) == 0 => seen.refused += 1,
        _ => return Err(format!("a wrong answer to state {sequence}: status {}, flags {:#x}", arm.status, arm.flags)),
    }
    Ok(())
}

/// What a thread of the load does until it is told to stop.
type Work = fn(&AtomicBool) -> Result<(), String>;

/// Threads that take memory bandwidth and the disk once they are let. Made while this thread has neither a core nor a priority of its own,
/// which they would have as well.
pub(crate) struct Load {
    begun: Arc<AtomicBool>,
    stopped: Arc<AtomicBool>,
    threads: Vec<std::thread::JoinHandle<Result<(), String>>>,
}

impl Load {
    /// Threads for one core, which wait.
    pub(crate) fn new(core: usize) -> Result<Self, String> {
        let (begun, stopped) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let start = |work: Work| {
            let (begun, stopped) = (begun.clone(), stopped.clone());
            let run = move || {
                ravenpose::realtime::pin(core).map_err(|missing| missing.to_string())?;
                while !begun.load(Relaxed) && !stopped.load(Relaxed) {
                    std::thread::sleep(Duration::from_millis(10));
                }
                work(&stopped)
            };
            std::thread::Builder::new().name("load".to_owned()).spawn(run).map_err(|cause| cause.to_string())
        };
        let threads = [stream as Work, write].into_iter().map(start).collect::<Result<_, _>>()?;
        Ok(Self { begun, stopped, threads })
    }

    fn begin(&self) {
        self.begun.store(true, Relaxed);
    }

    fn stop(self) -> Result<(), String> {
        self.stopped.store(true, Relaxed);
        self.threads
            .into_iter()
            .try_for_each(|thread| thread.join().unwrap_or_else(|_| Err("a thread of the load failed".to_owned())))
    }
}

#[expect(clippy::unnecessary_wraps, reason = "as the other work of a load")]
fn stream(stop: &AtomicBool) -> Result<(), String> {
    let mut words = vec![1_u64; STREAMED / 8];
    while !stop.load(Relaxed) {
        for word in &mut words {
            *word = word.wrapping_mul(3);
        }
    }
    std::hint::black_box(&words);
    Ok(())
}

fn write(stop: &AtomicBool) -> Result<(), String> {
    let path = std::env::temp_dir().join(format!("ravenpose-soak-{}", std::process::id()));
    fill(&path, stop).map_err(|cause| format!("{}: {cause}", path.display()))
}

fn fill(path: &Path, stop: &AtomicBool) -> std::io::Result<()> {
    let mut file = std::fs::File::create(path)?;
    // It goes with its handle, however this program ends.
    std::fs::remove_file(path)?;
    let block = vec![7; 1 << 20];
    while !stop.load(Relaxed) {
        file.write_all(&block)?;
        file.sync_data()?;
        if file.stream_position()? >= WRITTEN {
            file.set_len(0)?;
            file.rewind()?;
        }
    }
    Ok(())
}
