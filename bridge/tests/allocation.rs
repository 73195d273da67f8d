//! The bridge's calls allocate nothing and make no system call after `open`: a million publishes and reads through the C functions
//! themselves, under a counting allocator and a filter that kills at the first system call.

#[path = "../../tests/common/mod.rs"]
mod common;
#[path = "../../tests/common/proof.rs"]
mod proof;

use proof::{Counting, allocator_calls, faults_of, forbid_system_calls_but, nothing_happens, role, thread_id};
use ravenpose_bridge::*;
use ravenpose_transport::{Reader, Settings, Writer, now_ns};
use ravenpose_wire::{CorrectedPose, RavenState};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering::SeqCst};
use std::time::Duration;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const CALLS: u64 = 1_000_000;
const TEST: &str = "a_million_publishes_and_reads_allocate_nothing_and_call_nothing";

#[test]
fn a_million_publishes_and_reads_allocate_nothing_and_call_nothing() {
    if role().as_deref() == Some("bridge") {
        million();
    }
    nothing_happens(TEST, "bridge");
}

fn million() -> ! {
    static THREAD: AtomicI32 = AtomicI32::new(0);
    static GO: AtomicBool = AtomicBool::new(false);
    static DONE: AtomicBool = AtomicBool::new(false);
    static ALLOCATIONS: AtomicU64 = AtomicU64::new(u64::MAX);
    static READ: AtomicU64 = AtomicU64::new(0);
    // SAFETY: no memory is passed.
    if unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) } != 0 {
        println!("skipped: memory cannot be locked here, so that a page fault proves nothing; raise the memlock limit");
        std::process::exit(0);
    }
    let calling = std::thread::spawn(|| {
        let settings = Settings::from_env();
        let states: Reader<RavenState> = Reader::open(&settings, 1).expect("the service's end");
        let poses: Writer<CorrectedPose> = Writer::open(&settings).expect("the service's end");
        let mut publisher = null_mut();
        let mut reader = null_mut();
        // SAFETY: valid pointers, as the header asks.
        unsafe {
            assert_eq!(ravenpose_publisher_open(&Options::default(), &raw mut publisher, null_mut(), 0), 0);
            assert_eq!(ravenpose_pose_reader_open(&Options::default(), &raw mut reader, null_mut(), 0), 0);
        }
        let mut own = RavenState::new();
        let mut pose = CorrectedPose::new();
        let mut got = CorrectedPose::new();
        let mut calls = |count: u64| {
            for call in 0..count {
                if call % 2 == 0 {
                    let mut state = null_mut();
                    // SAFETY: live handles, and `state` was given by `loan`.
                    unsafe {
                        assert_eq!(ravenpose_publisher_loan(publisher, &raw mut state), 0);
                        (*state).pos[0] = call as i32;
                        assert_eq!(ravenpose_publisher_send(publisher), 0);
                    }
                } else {
                    own.pos[0] = call as i32;
                    // SAFETY: live handle and a state.
                    assert_eq!(unsafe { ravenpose_publisher_publish(publisher, &raw const own) }, 0);
                }
                // Sometimes the service does not keep up, sometimes it sleeps: nothing holds the publisher up.
                if call % 3 == 0 {
                    let taken = states.latest().expect("state").expect("one waits");
                    assert_eq!(taken.pos[0], call as i32);
                    pose.seal(taken.sequence);
                    pose.source_time_ns = now_ns();
                    poses.send(&pose).expect("pose sent");
                }
                // SAFETY: live handle, valid place.
                let code = unsafe { ravenpose_pose_reader_take(reader, &raw mut got) };
                assert_eq!(code, i32::from(call % 3 != 0));
                if code == 0 {
                    assert_eq!(got.sequence, pose.sequence);
                    let (mut um, mut matrix) = ([0.0; 3], [0.0; 9]);
                    // SAFETY: a pose that came, and room.
                    let rule = unsafe {
                        [
                            ravenpose_position(&raw const got, 0, ravenpose_now_ns(), um.as_mut_ptr()),
                            ravenpose_orientation(&raw const got, 0, ravenpose_now_ns(), matrix.as_mut_ptr()),
                        ]
                    };
                    assert_eq!(rule, [Code::Absent as i32; 2]);
                    READ.fetch_add(1, SeqCst);
                }
            }
        };
        calls(3_000);
        THREAD.store(thread_id(), SeqCst);
        while !GO.load(SeqCst) {
            std::hint::spin_loop();
        }
        forbid_system_calls_but(&[]);
        ALLOCATIONS.store(allocator_calls(|| calls(CALLS)), SeqCst);
        DONE.store(true, SeqCst);
        loop {
            std::hint::spin_loop();
        }
    });
    while THREAD.load(SeqCst) == 0 {
        assert!(!calling.is_finished(), "the calls did not begin");
        std::thread::sleep(Duration::from_millis(5));
    }
    let before = faults_of(THREAD.load(SeqCst));
    GO.store(true, SeqCst);
    while !DONE.load(SeqCst) {
        assert!(!calling.is_finished(), "the calls ended");
        std::thread::sleep(Duration::from_millis(5));
    }
    let after = faults_of(THREAD.load(SeqCst));
    assert!(READ.load(SeqCst) > CALLS / 3);
    println!(
        "calls {CALLS} allocator calls {} minor faults {} major faults {}",
        ALLOCATIONS.load(SeqCst),
        after.0 - before.0,
        after.1 - before.1
    );
    std::process::exit(0);
}
