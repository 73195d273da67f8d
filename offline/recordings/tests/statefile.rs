//! State files come back whole; anything damaged is refused with one line.
#![allow(missing_docs)]

mod common;

use std::path::Path;

use common::Scratch;
use ravenpose_wire::RavenState;
use recordings::statefile::{self, HEADER_BYTES, PERIOD_NS, StateFile};
use recordings::{Arms, synthetic};

const RECORD: usize = size_of::<RavenState>();

fn some_states(count: usize) -> Vec<RavenState> {
    synthetic::states(3, count as f64 * 1e-3, Arms::Both).expect("states").states
}

fn refusal(path: &Path) -> String {
    let text = statefile::read(path).expect_err("damaged").to_string();
    assert!(!text.contains('\n'), "{text}");
    text.strip_prefix(&format!("{}: ", path.display())).unwrap_or_else(|| panic!("{text}")).to_owned()
}

#[test]
fn states_come_back_bit_for_bit_and_nothing_else_is_left() {
    let scratch = Scratch::new("state-good");
    let path = scratch.path().join("run.rvnstate");
    let states = some_states(2500);
    statefile::write(&path, &states, PERIOD_NS).expect("write");
    let read = statefile::read(&path).expect("read");
    assert_eq!(read, StateFile { period_ns: PERIOD_NS, states });
    statefile::write(&path, &read.states[..10], 2_000_000).expect("replace");
    assert_eq!(statefile::read(&path).expect("read").states.len(), 10);
    let names: Vec<_> = std::fs::read_dir(scratch.path()).expect("folder").map(|entry| entry.expect("entry").file_name()).collect();
    assert_eq!(names, ["run.rvnstate"]);
}

#[test]
fn the_layout_is_the_documented_one() {
    let scratch = Scratch::new("state-layout");
    let path = scratch.path().join("run.rvnstate");
    let states = some_states(2);
    statefile::write(&path, &states, PERIOD_NS).expect("write");
    let bytes = std::fs::read(&path).expect("file");
    assert_eq!(bytes.len(), HEADER_BYTES + 2 * RECORD);
    assert_eq!(&bytes[..8], b"RVNSTATE");
    assert_eq!(bytes[8..16], [1, 0, 0, 0, (RECORD & 255) as u8, (RECORD >> 8) as u8, 0, 0]);
    assert_eq!(bytes[16..32], [2, 0, 0, 0, 0, 0, 0, 0, 0x40, 0x42, 0x0f, 0, 0, 0, 0, 0]);
    assert_eq!(bytes[32..40], statefile::fnv1a(&bytes[HEADER_BYTES..]).to_le_bytes());
    assert!(bytes[40..64].iter().all(|byte| *byte == 0));
    let jpos = HEADER_BYTES + RECORD + std::mem::offset_of!(RavenState, jpos);
    assert_eq!(bytes[jpos..jpos + 4], states[1].jpos[0].to_le_bytes());
}

/// Changes bytes of a good file and reads it.
fn damaged(change: impl FnOnce(&mut Vec<u8>)) -> String {
    static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
    let scratch = Scratch::new(&format!("state-bad-{}", COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed)));
    let path = scratch.path().join("run.rvnstate");
    statefile::write(&path, &some_states(3), PERIOD_NS).expect("write");
    let mut bytes = std::fs::read(&path).expect("file");
    change(&mut bytes);
    std::fs::write(&path, bytes).expect("file");
    refusal(&path)
}

/// Puts the hash of the changed records into the header.
fn rehash(bytes: &mut [u8]) {
    let hash = statefile::fnv1a(&bytes[HEADER_BYTES..]);
    bytes[32..40].copy_from_slice(&hash.to_le_bytes());
}

#[test]
fn damaged_headers_are_refused() {
    assert_eq!(damaged(|bytes| bytes[0] = b'X'), "does not begin with RVNSTATE; it is not a state file");
    assert_eq!(damaged(|bytes| bytes[8] = 2), "has format version 2, this program reads 1; write it again with this release");
    assert_eq!(
        damaged(|bytes| bytes[12..16].copy_from_slice(&8_u32.to_le_bytes())),
        format!("has records of 8 bytes, RavenState has {RECORD}; write it again with this release")
    );
    assert_eq!(damaged(|bytes| bytes[24..32].fill(0)), "has a period of 0 ns, which must be positive; write it again");
    assert_eq!(
        damaged(|bytes| bytes[31] = 0x80),
        format!("has a period of {} ns, which must be positive; write it again", i64::MIN + PERIOD_NS)
    );
    assert_eq!(
        damaged(|bytes| bytes[63] = 1),
        "has something in the reserved bytes 40..64 of its header; write it again with this release"
    );
    assert_eq!(damaged(|bytes| bytes.truncate(63)), "has 63 bytes, less than the header of 64; write it again");
    assert_eq!(damaged(Vec::clear), "has 0 bytes, less than the header of 64; write it again");
}

#[test]
fn wrong_counts_are_refused_before_anything_is_allocated() {
    let cut = |said: u64, found: usize| {
        format!("says {said} records but has {found} bytes after its header; it was cut short or appended to, write it again")
    };
    assert_eq!(damaged(|bytes| bytes.truncate(HEADER_BYTES + 3 * RECORD - 1)), cut(3, 3 * RECORD - 1));
    assert_eq!(damaged(|bytes| bytes.push(0)), cut(3, 3 * RECORD + 1));
    assert_eq!(damaged(|bytes| bytes[16] = 4), cut(4, 3 * RECORD));
    assert_eq!(damaged(|bytes| bytes[16..24].fill(255)), cut(u64::MAX, 3 * RECORD));
    let empty = damaged(|bytes| {
        bytes.truncate(HEADER_BYTES);
        bytes[16] = 0;
        rehash(bytes);
    });
    assert_eq!(empty, "holds no states; write at least one");
}

#[test]
fn damaged_records_are_refused() {
    let one_bit = damaged(|bytes| bytes[HEADER_BYTES + RECORD + 200] ^= 1);
    assert!(one_bit.contains(", its header says ") && one_bit.ends_with("; it was damaged, write it again"), "{one_bit}");
    let swapped = damaged(|bytes| {
        bytes[HEADER_BYTES..HEADER_BYTES + 2 * RECORD].rotate_left(RECORD);
        rehash(bytes);
    });
    assert_eq!(swapped, "record 0 is out of sequence; write the states again");
    let torn = damaged(|bytes| {
        bytes[HEADER_BYTES + 2 * RECORD + 8] ^= 1;
        rehash(bytes);
    });
    assert_eq!(torn, "record 2 is torn; write the states again");
    let layout = damaged(|bytes| {
        bytes[HEADER_BYTES + RECORD] = 9;
        rehash(bytes);
    });
    assert_eq!(layout, "record 1 has another layout; write the states again");
}

#[test]
fn what_cannot_be_written_leaves_nothing() {
    let scratch = Scratch::new("state-unwritable");
    let path = scratch.path().join("run.rvnstate");
    let good = some_states(3);
    let mut torn = good.clone();
    torn[1].guard_tail = 0;
    for (states, period_ns, what) in [
        (&good[..0], PERIOD_NS, "holds no states"),
        (&good[1..], PERIOD_NS, "record 0 is out of sequence"),
        (&torn[..], PERIOD_NS, "record 1 is torn"),
        (&good[..], 0, "has a period of 0 ns"),
    ] {
        let text = statefile::write(&path, states, period_ns).expect_err(what).to_string();
        assert!(text.contains(what), "{text}");
    }
    let nowhere = scratch.path().join("absent/run.rvnstate");
    assert!(
        statefile::write(&nowhere, &good, PERIOD_NS).expect_err("folder").to_string().contains("cannot be written (No such file")
    );
    let folder = scratch.path().join("folder");
    std::fs::create_dir(&folder).expect("folder");
    assert!(statefile::write(&folder, &good, PERIOD_NS).expect_err("folder").to_string().contains("cannot be written"));
    let left: Vec<_> = std::fs::read_dir(scratch.path()).expect("folder").map(|entry| entry.expect("entry").file_name()).collect();
    assert_eq!(left, ["folder"]);
    assert!(refusal(&path).starts_with("cannot be read (No such file or directory"));
}
