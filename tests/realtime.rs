//! The loop's promises, proven on the real runner over real shared memory: no allocation, no page fault, no system call but the
//! waiting one, over a million free-running turns and over a minute at 1 kHz.

mod common;
#[path = "common/proof.rs"]
mod proof;

use proof::{Counting, allocator_calls, faults_of, forbid_system_calls_but, nothing_happens, role, thread_id};
use ravenpose::config::{ModelSource, Wait};
use ravenpose::correction::ArmModel;
use ravenpose::cycle::{ArmModels, Cycle, Limits};
use ravenpose::load::{self, LoadCard};
use ravenpose::memory::Play;
use ravenpose::model::Estimate;
use ravenpose::network::Plan;
use ravenpose::runner::{Runner, Waiting};
use ravenpose::shared::Shared;
use ravenpose::{histogram, model, realtime, shared};
use ravenpose_importer::{Activation, Network};
use ravenpose_transport::{Bell, Reader, Settings, Writer, now_ns, sleep_until_ns};
use ravenpose_wire::{ArmStatus, CorrectedPose, FEATURES, RavenState};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering::SeqCst};
use std::time::Duration;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// One at a time: each wants the machine for itself.
static MACHINE: std::sync::Mutex<()> = std::sync::Mutex::new(());

const TURNS: u64 = 1_000_000;
const WARM_UP: u64 = 5_000;

fn untrained() -> ArmModel<Estimate> {
    let loaded = model::load(&ModelSource::new(common::untrained())).expect("the repository's model");
    ArmModel::Loaded(Box::new(loaded.model))
}

/// The same with another network, which has plays on all joints in front, and an eye on the load.
fn remembering() -> ArmModel<Estimate> {
    let mut loaded = model::load(&ModelSource::new(common::untrained())).expect("the repository's model");
    let plays: Vec<Play> = (56..64).map(|input| Play { input, half_width: 0.05 }).collect();
    let weight = |place: usize, _: usize| 0.001 * (place % 17) as f32 - 0.008;
    let network = Network { plays, ..Network::dense(&[FEATURES + 8, 64, 3], Activation::Tanh, weight) };
    let load = LoadCard {
        expected: std::array::from_fn(|_| vec![0.001; load::expected_len(8)]),
        pull: [[0.04, 1e-7, 1e-7, 1e-7]; load::MOTORS],
        noise_nm: [0.1; load::MOTORS],
        weight: [1e5; load::MOTORS],
        travel_deg: [2e4; load::MOTORS],
        information: [1e-3; load::MOTORS],
        limit_kg: 1e6,
        friction: None,
    };
    loaded.model.allowed.runlevels = vec![3];
    loaded.model.estimator = Estimate::new(&network, Plan::new(&network)).watching(Some(load));
    ArmModel::Loaded(Box::new(loaded.model))
}

fn runner(settings: &Settings, wait: Wait) -> (Runner<Estimate>, histogram::Collector, shared::EventReceiver, Arc<Shared>) {
    let limits = Limits::default();
    let gold = ArmModels { position: untrained(), orientation: remembering() };
    let cycle = Cycle::new(limits, [gold, remembering().into()], true, 0);
    let (recorder, collector) = histogram::exchange();
    let (sender, events) = shared::events();
    let shown = Arc::new(Shared::default());
    let waiting = Waiting { wait, spin_ns: 400_000, keep_warm: true };
    let runner = Runner::open(settings, cycle, limits, waiting, (recorder, sender, shown.clone())).expect("link");
    (runner, collector, events, shown)
}

/// Ends a child of these tests where memory cannot be locked: then a page fault proves nothing.
fn lock_memory_or_skip() {
    if let Err(missing) = realtime::lock_memory() {
        println!("skipped: {missing}");
        std::process::exit(0);
    }
}

/// A state of both arms inside the domain of the untrained model.
fn state(sequence: u64) -> RavenState {
    let mut state = RavenState::new();
    state.arms = 3;
    state.runlevel = 3;
    state.type_ = [49, 22];
    state.dt_nsec = 1_000_000;
    for arm in 0..2 {
        state.pos[arm * 3] = (sequence % 1000) as i32;
        // There and back, further than any play.
        let moved = (sequence % 1000).min(1000 - sequence % 1000) as f32 * 1e-3;
        state.jpos[arm * 8..arm * 8 + 3].copy_from_slice(&[30.0 + moved, 90.0 - moved, 22.9]);
        state.jpos_d[arm * 8..arm * 8 + 3].copy_from_slice(&[30.0, 90.0, 22.9]);
        state.enc_vals[arm * 8] = (sequence % 1000) as i32;
    }
    state.source_id = 1;
    state.source_time_ns = now_ns();
    state.seal(sequence);
    state
}

/// Every tenth thousand turn has a fault, so that fallback paths are proven too.
fn faulty(sequence: u64) -> RavenState {
    let mut state = state(sequence);
    match sequence % 10_000 {
        0 => state.tau[0] = f32::NAN,
        1_250 => state.runlevel = 2,
        2_500 => state.pos[0] = 9_000_000,
        5_000 => state.guard_tail ^= 1,
        7_500 => state.source_time_ns -= 50_000_000,
        _ => {}
    }
    state
}

#[test]
fn a_million_turns_allocate_nothing_fault_nothing_and_call_nothing() {
    if role().as_deref() == Some("million") {
        million();
    }
    let _machine = MACHINE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    nothing_happens("a_million_turns_allocate_nothing_fault_nothing_and_call_nothing", "million");
}

/// In a process of its own: one thread turns the loop under a filter that kills at the first system call; this one watches.
fn million() -> ! {
    static THREAD: AtomicI32 = AtomicI32::new(0);
    static GO: AtomicBool = AtomicBool::new(false);
    static DONE: AtomicBool = AtomicBool::new(false);
    static CALLS: AtomicU64 = AtomicU64::new(u64::MAX);
    static VALID: AtomicU64 = AtomicU64::new(0);
    lock_memory_or_skip();
    let turning = std::thread::spawn(move || {
        let settings = Settings::from_env();
        let (mut runner, _collector, _events, _) = runner(&settings, Wait::Spin);
        let writer: Writer<RavenState> = Writer::open(&settings).expect("writer");
        let reader: Reader<CorrectedPose> = Reader::open(&settings, 64).expect("reader");
        let mut sequence = 0;
        let mut turns = |count: u64| {
            for _ in 0..count {
                sequence += 1;
                writer.send(&faulty(sequence)).expect("state sent");
                if sequence % 100 == 0 {
                    // Two more overtake it.
                    for _ in 0..2 {
                        sequence += 1;
                        writer.send(&faulty(sequence)).expect("state sent");
                    }
                }
                runner.turn();
                if sequence % 1000 == 0 {
                    // Nothing comes: a period of polling, and of keeping the weights warm.
                    runner.turn();
                }
                while let Some(pose) = reader.next().expect("pose read") {
                    if pose.arm.iter().all(|arm| arm.status == ArmStatus::Valid as u32) {
                        VALID.fetch_add(1, SeqCst);
                    }
                }
            }
        };
        turns(WARM_UP);
        THREAD.store(thread_id(), SeqCst);
        while !GO.load(SeqCst) {
            std::hint::spin_loop();
        }
        forbid_system_calls_but(&[]);
        CALLS.store(allocator_calls(|| turns(TURNS)), SeqCst);
        DONE.store(true, SeqCst);
        // No way out of the filter: stay here until the process ends.
        loop {
            std::hint::spin_loop();
        }
    });
    while THREAD.load(SeqCst) == 0 {
        assert!(!turning.is_finished(), "the loop did not begin");
        std::thread::sleep(Duration::from_millis(10));
    }
    let before = faults_of(THREAD.load(SeqCst));
    GO.store(true, SeqCst);
    while !DONE.load(SeqCst) {
        assert!(!turning.is_finished(), "the loop ended");
        std::thread::sleep(Duration::from_millis(10));
    }
    let after = faults_of(THREAD.load(SeqCst));
    assert!(VALID.load(SeqCst) > TURNS / 2, "the network ran: {} valid", VALID.load(SeqCst));
    println!(
        "turns {TURNS} allocator calls {} minor faults {} major faults {}",
        CALLS.load(SeqCst),
        after.0 - before.0,
        after.1 - before.1
    );
    std::process::exit(0);
}

#[test]
fn a_minute_at_1_khz_keeps_its_core_and_policy_and_only_sleeps() {
    if role().as_deref() == Some("minute") {
        at_1_khz(Wait::Sleep, 60, &[libc::SYS_clock_nanosleep]);
    }
    let _machine = MACHINE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    nothing_happens("a_minute_at_1_khz_keeps_its_core_and_policy_and_only_sleeps", "minute");
}

#[test]
fn five_seconds_of_waiting_for_the_bell_allocate_nothing_and_only_wait() {
    if role().as_deref() == Some("bell") {
        at_1_khz(Wait::Event, 5, &[libc::SYS_ppoll, libc::SYS_recvfrom]);
    }
    let _machine = MACHINE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    nothing_happens("five_seconds_of_waiting_for_the_bell_allocate_nothing_and_only_wait", "bell");
}

/// States of 1 kHz with their bell, and a stop of ten periods after every 500th of them: then the wait ends as the newest state becomes stale.
fn at_1_khz(wait: Wait, seconds: u64, calls_allowed: &'static [i64]) -> ! {
    static THREAD: AtomicI32 = AtomicI32::new(0);
    static DONE: AtomicBool = AtomicBool::new(false);
    static CALLS: AtomicU64 = AtomicU64::new(u64::MAX);
    const CORE: usize = 1;
    lock_memory_or_skip();
    let settings = Settings::from_env();
    let (ready, opened) = std::sync::mpsc::channel();
    let link = settings.clone();
    let turning = std::thread::spawn(move || {
        let (mut runner, collector, _events, shown) = runner(&link, wait);
        if let Err(missing) = realtime::pin(CORE).and_then(|()| realtime::set_fifo(80)) {
            println!("skipped: {missing}");
            std::process::exit(0);
        }
        assert_eq!(realtime::scheduling(), (libc::SCHED_FIFO, 80, vec![CORE]), "policy, priority and core of the loop's thread");
        ready.send((shown, collector)).expect("the test waits");
        for _ in 0..3_000 {
            runner.turn();
        }
        THREAD.store(thread_id(), SeqCst);
        forbid_system_calls_but(calls_allowed);
        let calls = allocator_calls(|| {
            for _ in 0..(seconds * 1000) {
                runner.turn();
            }
        });
        CALLS.store(calls, SeqCst);
        DONE.store(true, SeqCst);
        // It may call no more than before, and goes on doing so until the process ends.
        loop {
            runner.turn();
        }
    });
    let (shown, mut collector) = opened.recv().expect("the loop runs");
    let writer: Writer<RavenState> = Writer::open(&settings).expect("writer");
    let bell = Bell::open(&settings).expect("bell");
    let mut next = now_ns();
    let mut before = None;
    let mut sequence = 0;
    let mut measured = histogram::Histograms::new();
    while !DONE.load(SeqCst) {
        assert!(!turning.is_finished(), "the loop ended");
        sequence += 1;
        writer.send(&state(sequence)).expect("state sent");
        bell.ring();
        if before.is_none() && THREAD.load(SeqCst) != 0 {
            before = Some((faults_of(THREAD.load(SeqCst)), shown.counters()));
        }
        if sequence % 1000 == 0 {
            collector.collect(|set| measured.add(set));
        }
        let periods = if sequence % 500 == 0 { 10 } else { 1 };
        next = (next + periods * 1_000_000).max(now_ns() - 1_000_000);
        sleep_until_ns(next);
    }
    let after = faults_of(THREAD.load(SeqCst));
    let (before, counters_before) = before.expect("the loop warmed up");
    let accepted = shown.counters()[1] - counters_before[1];
    // How many of them a machine that stops lets through is not what is tested.
    assert!(accepted > seconds * 100, "states came: {accepted}");
    let age = measured.stage(histogram::Stage::InputToOutput);
    println!(
        "{seconds} s at 1 kHz: states {accepted} allocator calls {} minor faults {} major faults {}; input to output p50 {:.1} us p99.9 {:.1} us",
        CALLS.load(SeqCst),
        after.0 - before.0,
        after.1 - before.1,
        age.value_at_quantile(0.5) as f64 / 1e3,
        age.value_at_quantile(0.999) as f64 / 1e3
    );
    std::process::exit(0);
}
