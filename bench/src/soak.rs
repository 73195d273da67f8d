//! The service for long, under load and faults: memory streamed and a disk written beside it, clients that never read, inputs that it
//! has to refuse. What it answers is held against what it was sent.

use crate::path::{PERIOD_NS, WARM_UP, World, state};
use crate::table::{Table, quantiles};
use ravenpose::check;
use ravenpose_transport::{Reader, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{ArmStatus, CorrectedPose, RavenState, flag};
use std::io::{Seek as _, Write as _};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;

/// Clients that connect and never read.
const IDLE: usize = 100;
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

/// What a part of the soak came to.
#[derive(Default)]
struct Seen {
    /// State sent to pose taken, of the state that the pose answers, ns.
    whole: Vec<i64>,
    poses: u64,
    valid: u64,
    /// Faults sent and answered as such.
    refused: u64,
    /// Fallback that a fault before it began: corrections return after a while.
    held: u64,
    /// Fallback for what the machine did: late, stale, settling.
    delayed: u64,
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
    let mut world = World::start("", core)?;
    let open = |depth| Reader::<CorrectedPose>::open(&world.settings, depth).map_err(|error| error.to_string());
    let _idle = (0..idle).map(|_| open(IDLE_DEPTH)).collect::<Result<Vec<_>, _>>()?;
    let reader = open(DEPTH)?;
    let writer: Writer<RavenState> = Writer::open(&world.settings).map_err(|error| error.to_string())?;
    let mut seen = Seen::default();
    send(&writer, &reader, 1..=WARM_UP, &mut seen)?;
    let before = world.loop_faults();
    seen = Seen { whole: Vec::with_capacity((seconds * 1000) as usize), ..Seen::default() };
    let sent = send(&writer, &reader, WARM_UP + 1..=WARM_UP + seconds * 1000, &mut seen)?;
    let faults = world.loop_faults().zip(before).map(|(after, before)| after - before);
    let stats = world.stop().ok_or_else(|| format!("{name}: the service ended by itself: {}", world.last_words()))?;
    let counter = |name: &str| stats.counters.iter().find(|counter| counter.name == name).map_or(0, |counter| counter.value);
    table.row(&format!("{name}: state sent -> pose taken, {} poses", seen.poses), &quantiles(&mut seen.whole));
    for stage in
        stats.stages.iter().filter(|stage| stage.count > 0 && ["inference", "total", "input_to_output"].contains(&&*stage.name))
    {
        table.row(&format!("    {}", stage.name), &[stage.p50, stage.p99, stage.p999, stage.max].map(|ns| ns as f64 / 1000.0));
    }
    println!(
        "{name}: {sent} states sent, {} poses, {} valid, {} faults answered as such, {} held after one, {} fallbacks for lateness, {} skipped, {} twice; page faults of the \
         loop's thread: {}",
        seen.poses,
        seen.valid,
        seen.refused,
        seen.held,
        seen.delayed,
        counter("skipped"),
        counter("duplicates"),
        faults.map_or_else(|| "not known".to_owned(), |faults| faults.to_string()),
    );
    for (what, count) in
        [("lost", counter("lost")), ("out_of_order", counter("out_of_order")), ("send_failures", counter("send_failures"))]
    {
        if count > 0 {
            return Err(format!("{name}: {what}: {count}"));
        }
    }
    if faults.is_some_and(|faults| faults > 0) {
        return Err(format!("{name}: the loop's thread had page faults"));
    }
    Ok(())
}

/// Sends these states, one a millisecond, and judges every pose that comes meanwhile; returns how many were sent.
fn send(
    writer: &Writer<RavenState>,
    reader: &Reader<CorrectedPose>,
    sequences: std::ops::RangeInclusive<u64>,
    seen: &mut Seen,
) -> Result<u64, String> {
    let count = sequences.clone().count() as u64;
    let mut next = now_ns();
    let mut read_ns = next;
    let mut last: Option<u64> = None;
    for sequence in sequences {
        let mut state = state(sequence);
        if sequence.is_multiple_of(NOT_FINITE) {
            state.jpos[1] = f32::NAN;
        } else if sequence.is_multiple_of(IMPOSSIBLE) {
            state.jpos[1] = 1e9;
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
            if last.is_some_and(|last| pose.sequence != last + 1) && !held_up {
                return Err(format!("pose {} came after {last:?}", pose.sequence));
            }
            last = Some(pose.sequence);
            judge(&pose, seen)?;
        }
    }
    Ok(count)
}

/// Are status and flags those that the state which this pose answers calls for?
fn judge(pose: &CorrectedPose, seen: &mut Seen) -> Result<(), String> {
    const FAULTS: u32 = flag::INPUT_NOT_FINITE | flag::INPUT_IMPOSSIBLE;
    /// What a machine that stops for a moment may do to any pose.
    const DELAYED: u32 = flag::INPUT_STALE | flag::BUDGET_EXCEEDED | flag::SETTLING | flag::NEW_SOURCE;
    let arm = &pose.arm[0];
    let wanted = match pose.source_sequence {
        sequence if sequence.is_multiple_of(NOT_FINITE) => flag::INPUT_NOT_FINITE,
        sequence if sequence.is_multiple_of(IMPOSSIBLE) => flag::INPUT_IMPOSSIBLE,
        _ => 0,
    };
    let reasons = arm.flags & ravenpose_wire::FALLBACK_REASONS & !flag::UNTRAINED;
    let valid = arm.status == ArmStatus::Valid as u32;
    seen.poses += 1;
    seen.whole.push(pose.publish_time_ns - pose.source_time_ns);
    let (faulty, delayed) = (reasons & FAULTS != 0, reasons & DELAYED != 0);
    match (wanted, valid) {
        (0, true) if reasons == 0 => seen.valid += 1,
        (0, false) if faulty && reasons & !(DELAYED | FAULTS) == 0 => seen.held += 1,
        (0, false) if delayed && reasons & !DELAYED == 0 => seen.delayed += 1,
        (wanted, false) if reasons & wanted != 0 => seen.refused += 1,
        _ => {
            return Err(format!("a wrong answer to state {}: status {}, flags {:#x}", pose.source_sequence, arm.status, arm.flags));
        }
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
    let written = fill(&path, stop).map_err(|cause| format!("{}: {cause}", path.display()));
    let _ = std::fs::remove_file(&path);
    written
}

fn fill(path: &Path, stop: &AtomicBool) -> std::io::Result<()> {
    let mut file = std::fs::File::create(path)?;
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
