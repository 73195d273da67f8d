//! State files as streams: the same bytes as in memory, and what stands before the damage.
#![allow(missing_docs)]

mod common;
mod support;

use std::path::Path;

use arm::Side;
use common::Scratch;
use ravenpose_wire::RavenState;
use recordings::statefile::{self, HEADER_BYTES, Reader, Writer};
use recordings::stream::{Place, Record, Source, Truth};
use support::{motion, read, record, refused, states_of, write};

const RECORD: usize = size_of::<RavenState>();

fn bytes_of(count: usize) -> (Vec<u8>, Vec<RavenState>) {
    let scratch = Scratch::new(&format!("rvs-{count}"));
    let path = scratch.path().join("run.rvs");
    let states = motion(count, 0);
    statefile::write(&path, &states, 1_000_000).expect("write");
    (std::fs::read(&path).expect("file"), states)
}

#[test]
fn a_streamed_file_is_the_same_to_the_byte() {
    let scratch = Scratch::new("rvs-same");
    let path = scratch.path().join("run.rvs");
    let (bytes, states) = bytes_of(700);
    let mut records: Vec<Record> = states.iter().map(record).collect();
    records.insert(3, Record::Truth(Truth::unknown(0, Side::Gold)));
    write(Box::new(Writer::create(&path, None).expect("create")), &records);
    assert_eq!(std::fs::read(&path).expect("file"), bytes);
    let reader = Reader::open(&path).expect("open");
    assert_eq!((reader.period_ns(), reader.metadata()), (1_000_000, &[("period_ns".to_owned(), "1000000".to_owned())][..]));
    let (found, damage) = read(Box::new(reader));
    assert_eq!((states_of(&found), damage), (states, None));
}

#[test]
fn states_of_another_source_are_numbered_anew() {
    let scratch = Scratch::new("rvs-anew");
    let path = scratch.path().join("run.rvs");
    let mut states = motion(20, 1_570_000_000);
    for (index, state) in states.iter_mut().enumerate() {
        state.seal(77 + 3 * index as u64);
        state.source_time_ns = 0;
        state.hdr_stamp_nsec = 10_000_000 * index as u32;
    }
    write(Box::new(Writer::create(&path, None).expect("create")), &states.iter().map(record).collect::<Vec<_>>());
    let file = statefile::read(&path).expect("a good file");
    assert_eq!(file.period_ns, 10_000_000, "the period of the states");
    for (index, state) in file.states.iter().enumerate() {
        assert_eq!((state.sequence, state.source_time_ns), (index as u64 + 1, 10_000_000 * index as i64));
        assert_eq!((state.hdr_stamp_sec, state.jpos), (states[index].hdr_stamp_sec, states[index].jpos));
    }
}

#[test]
fn a_cut_file_yields_its_whole_states() {
    let (bytes, states) = bytes_of(5);
    for cut in (0..bytes.len()).step_by(61) {
        let reader = Reader::from_bytes(Path::new("cut.rvs"), bytes[..cut].to_vec());
        if cut < HEADER_BYTES {
            let text = refused(reader, Path::new("cut.rvs"));
            assert_eq!(text, format!("has {cut} bytes, less than the header of 64; write it again"));
            continue;
        }
        let (found, damage) = read(Box::new(reader.expect("open")));
        let whole = (cut - HEADER_BYTES) / RECORD;
        assert_eq!(states_of(&found), states[..whole]);
        let damage = damage.expect("damage");
        assert_eq!(damage.place, Place::Byte((HEADER_BYTES + whole * RECORD) as u64));
        assert_eq!(damage.what, format!("the file ends after {whole} of 5 states, so its checksum cannot be verified"));
    }
}

#[test]
fn a_flipped_byte_is_noticed_at_the_latest_by_the_checksum() {
    let (bytes, states) = bytes_of(4);
    let change = |at: usize| {
        let mut changed = bytes.clone();
        changed[at] ^= 0x10;
        let (found, damage) = read(Box::new(Reader::from_bytes(Path::new("flip.rvs"), changed).expect("open")));
        (found.len(), damage.expect("damage"))
    };
    // A number of the second state, then its sequence.
    let (count, damage) = change(HEADER_BYTES + RECORD + 300);
    assert_eq!(count, 4);
    assert!(damage.what.ends_with(": one of them was changed"), "{}", damage.what);
    let (count, damage) = change(HEADER_BYTES + RECORD + 24);
    assert_eq!((count, damage.place), (1, Place::Byte((HEADER_BYTES + RECORD) as u64)));
    assert_eq!(damage.what, "state 1 is torn");
    let more = [bytes.clone(), vec![0]].concat();
    let (found, damage) = read(Box::new(Reader::from_bytes(Path::new("more.rvs"), more).expect("open")));
    assert_eq!((states_of(&found), damage.expect("damage").what.as_str()), (states, "more bytes follow than the header says"));
}

#[test]
fn a_file_without_states_is_not_written() {
    let scratch = Scratch::new("rvs-none");
    let path = scratch.path().join("run.rvs");
    let sink: Box<dyn recordings::stream::Sink> = Box::new(Writer::create(&path, None).expect("create"));
    assert_eq!(refused(sink.finish(), &path), "holds no states; write at least one");
    assert_eq!(std::fs::read_dir(scratch.path()).expect("folder").count(), 0);
}
