//! Any bytes as a state file.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use recordings::statefile::Reader;
use recordings::stream::{Record, Source};

fuzz_target!(|data: &[u8]| {
    let Ok(mut reader) = Reader::from_bytes(Path::new("fuzz.rvs"), data.to_vec()) else { return };
    assert!(reader.period_ns() > 0);
    let mut count = 0;
    while let Some(record) = reader.next().expect("memory can be read") {
        let Record::State(state) = record else { panic!("a state file holds states") };
        count += 1;
        assert!(state.admit().is_ok() && state.sequence == count);
    }
    assert!(matches!(reader.next(), Ok(None)), "the end stays the end");
});
