//! Proof tools: an allocator that counts, a system-call filter that kills, and a thread's page faults.
#![allow(unreachable_pub)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

thread_local! {
    static ARMED: Cell<bool> = const { Cell::new(false) };
}
static CALLS: AtomicU64 = AtomicU64::new(0);

/// Counts allocations, reallocations and frees of armed threads.
pub struct Counting;

fn note() {
    if ARMED.get() {
        CALLS.fetch_add(1, Relaxed);
    }
}

// SAFETY: every call is passed on unchanged to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: the caller's layout.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: the caller's layout.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note();
        // SAFETY: the caller's block.
        unsafe { System.realloc(pointer, layout, size) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        note();
        // SAFETY: the caller's block.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Runs `body` and returns how often it called the allocator on this thread.
pub fn allocator_calls(body: impl FnOnce()) -> u64 {
    let before = CALLS.load(Relaxed);
    ARMED.set(true);
    body();
    ARMED.set(false);
    CALLS.load(Relaxed) - before
}

/// Minor and major faults of a thread of this process, from /proc.
pub fn faults_of(thread: i32) -> (u64, u64) {
    let stat = std::fs::read_to_string(format!("/proc/self/task/{thread}/stat")).expect("stat of the thread");
    let fields: Vec<&str> = stat.rsplit(')').next().expect("fields").split_whitespace().collect();
    (fields[7].parse().expect("minflt"), fields[9].parse().expect("majflt"))
}

pub fn thread_id() -> i32 {
    // SAFETY: no arguments, no memory.
    unsafe { libc::syscall(libc::SYS_gettid) as i32 }
}

/// From now on any system call of this thread but `allowed` kills the process. There is no way back.
pub fn forbid_system_calls_but(allowed: &[i64]) {
    let statement = |code: u32, k: u32| libc::sock_filter { code: code as u16, jt: 0, jf: 0, k };
    let mut program = vec![statement(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0)];
    for (at, number) in allowed.iter().enumerate() {
        // To the last statement, which allows.
        let jt = (allowed.len() - at) as u8;
        program.push(libc::sock_filter {
            code: (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16,
            jt,
            jf: 0,
            k: *number as u32,
        });
    }
    program.push(statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_KILL_PROCESS));
    program.push(statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_ALLOW));
    let filter = libc::sock_fprog { len: program.len() as u16, filter: program.as_mut_ptr() };
    // SAFETY: `filter` and the program it points to live through both calls.
    let refused = unsafe {
        libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0
            || libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &raw const filter) != 0
    };
    assert!(!refused, "the filter is in place");
}

/// Runs this test again as a process of its own, with `ROLE` in its environment, and gives its outcome. The child ends without
/// leaving its shared memory in order (it cannot, under the filter), so that is removed here.
pub fn in_child(test: &str, role: &str) -> std::process::Output {
    let prefix = format!("rp{role}{}_", std::process::id());
    let dir = super::common::TempDir::new(role);
    let output = std::process::Command::new(std::env::current_exe().expect("this program"))
        .args([test, "--exact", "--nocapture", "--test-threads=1"])
        .env("RAVENPOSE_TEST_ROLE", role)
        .env("RAVENPOSE_PREFIX", &prefix)
        .env("RAVENPOSE_ROOT", format!("{}/iceoryx2/", dir.0.display()))
        .output()
        .expect("the child runs");
    super::common::remove_shared_memory(&prefix);
    output
}

/// Times that a proof is tried while the kernel moves pages about.
const ATTEMPTS: u32 = 3;

/// Runs a role that prints `allocator calls N minor faults N major faults N`: all must be 0. One that prints `skipped:` is let go.
///
/// Compaction moves locked pages as well where vm.compact_unevictable_allowed is 1 (`ravenpose check`: memory.compaction), and each page
/// that it moves is a minor fault of whoever touches it next: then once more. Nothing else may be wrong, in any attempt.
pub fn nothing_happens(test: &str, role: &str) {
    for attempt in 1..=ATTEMPTS {
        let before = pages_migrated();
        let output = in_child(test, role);
        let migrated = pages_migrated().zip(before).map_or(0, |(after, before)| after - before);
        let text = String::from_utf8_lossy(&output.stdout);
        println!("{text}pages that the kernel migrated meanwhile: {migrated} (pgmigrate_success from {before:?})");
        assert!(
            output.status.success(),
            "{:?} (a signal means a forbidden system call)\n{}",
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
        if text.contains("skipped:") || text.contains("allocator calls 0 minor faults 0 major faults 0") {
            return;
        }
        let only_minor = text.contains("allocator calls 0 minor faults ") && text.contains(" major faults 0");
        assert!(only_minor && migrated > 0 && attempt < ATTEMPTS, "attempt {attempt}, {migrated} pages migrated: {text}");
        println!("minor faults while the kernel compacted memory: attempt {} of {ATTEMPTS} follows", attempt + 1);
    }
}

/// Pages that the kernel has moved since it started, none where it does not say.
fn pages_migrated() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/vmstat").ok()?;
    text.lines().find_map(|line| line.strip_prefix("pgmigrate_success ")?.parse().ok())
}

pub fn role() -> Option<String> {
    std::env::var("RAVENPOSE_TEST_ROLE").ok()
}
