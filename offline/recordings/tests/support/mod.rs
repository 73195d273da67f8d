//! Shared by the tests of formats: records of all sorts, files with damage.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use std::path::{Path, PathBuf};

use arm::Side;
use ravenpose_wire::RavenState;
use recordings::stream::{Damage, Record, Sink, Source, StreamError, Truth};
use recordings::{Arms, synthetic};

/// SplitMix64: the same numbers for ever.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.bits() % end.max(1) as u64) as usize
    }

    /// In -1..1.
    pub(crate) fn unit(&mut self) -> f64 {
        self.bits() as i64 as f64 / i64::MAX as f64
    }
}

/// States of smooth motion of both arms, 1 kHz, that begin at this time.
pub(crate) fn motion(count: usize, start_s: u32) -> Vec<RavenState> {
    let mut states = synthetic::states(5, count as f64 * 1e-3, Arms::Both).expect("states").states;
    for state in &mut states {
        state.hdr_stamp_sec += start_s;
    }
    states
}

/// A truth that knows everything, near a state.
pub(crate) fn truth_of(state: &RavenState, side: Side, random: &mut Random) -> Truth {
    Truth {
        time_ns: stamp_ns(state),
        side,
        position_m: std::array::from_fn(|_| random.unit() * 0.2),
        quaternion_wxyz: std::array::from_fn(|_| random.unit()),
        joints: std::array::from_fn(|_| random.unit()),
        cable_force_n: std::array::from_fn(|_| random.unit() * 40.0),
    }
}

pub(crate) fn stamp_ns(state: &RavenState) -> i64 {
    i64::from(state.hdr_stamp_sec) * 1_000_000_000 + i64::from(state.hdr_stamp_nsec)
}

pub(crate) fn record(state: &RavenState) -> Record {
    Record::State(Box::new(*state))
}

/// Writes all records and completes the file.
pub(crate) fn write(mut sink: Box<dyn Sink>, records: &[Record]) {
    for record in records {
        sink.write(record).unwrap_or_else(|error| panic!("{error}"));
    }
    sink.finish().unwrap_or_else(|error| panic!("{error}"));
}

/// All records of a source, and its damage.
pub(crate) fn read(mut source: Box<dyn Source>) -> (Vec<Record>, Option<Damage>) {
    let mut records = Vec::new();
    while let Some(record) = source.next().unwrap_or_else(|error| panic!("{error}")) {
        records.push(record);
    }
    assert!(source.next().expect("end").is_none(), "nothing comes after the end");
    let (done, total) = source.progress();
    assert!(done <= total, "{done} of {total}");
    (records, source.damage().cloned())
}

pub(crate) fn states_of(records: &[Record]) -> Vec<RavenState> {
    records.iter().filter_map(|record| if let Record::State(state) = record { Some(**state) } else { None }).collect()
}

pub(crate) fn truths_of(records: &[Record]) -> Vec<Truth> {
    records.iter().filter_map(|record| if let Record::Truth(truth) = record { Some(*truth) } else { None }).collect()
}

/// The message without header, times and connected arms.
pub(crate) fn message_of(state: &RavenState) -> RavenState {
    let mut message = *state;
    message.seal(0);
    message.source_id = 0;
    message.source_time_ns = 0;
    message.arms = 0;
    message.hdr_seq = 0;
    message.hdr_stamp_sec = 0;
    message.hdr_stamp_nsec = 0;
    message.dt_sec = 0;
    message.dt_nsec = 0;
    message
}

/// Equal as bytes are, so that an unknown number equals itself.
pub(crate) fn same_truth(a: &Truth, b: &Truth) -> bool {
    let bits = |truth: &Truth| -> Vec<u64> {
        let numbers = truth.position_m.iter().chain(&truth.quaternion_wxyz).chain(&truth.joints).chain(&truth.cable_force_n);
        numbers.map(|value| if value.is_nan() { u64::MAX } else { value.to_bits() }).collect()
    };
    a.time_ns == b.time_ns && a.side == b.side && bits(a) == bits(b)
}

/// The refusal in one line that begins with the file.
pub(crate) fn refused<T>(result: Result<T, StreamError>, path: &Path) -> String {
    let Err(error) = result else { panic!("{} was taken", path.display()) };
    one_line(&error, path)
}

pub(crate) fn one_line(error: &StreamError, path: &Path) -> String {
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    text.strip_prefix(&format!("{}: ", path.display())).unwrap_or_else(|| panic!("{text}")).to_owned()
}

/// All files below a folder, sorted.
pub(crate) fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = std::fs::read_dir(folder) else { return found };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() { found.extend(files_below(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

/// Is this one of the tables of data, by its name?
pub(crate) fn is_table(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    Path::new(name).extension().is_some_and(|extension| extension == "csv")
}
