//! Any bytes as a recording with 235 or 252 columns.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use recordings::stream::{Record, Source};
use recordings::table::{Batch, TableSource};
use recordings::{columns235, columns252};

/// States of a source that was opened; every one is whole and numbered.
fn states(source: &mut dyn Source) -> u64 {
    let mut count = 0;
    while let Some(record) = source.next().expect("memory can be read") {
        if let Record::State(state) = record {
            count += 1;
            assert!(state.admit().is_ok() && state.sequence == count);
        }
    }
    assert!(matches!(source.next(), Ok(None)), "the end stays the end");
    count
}

fuzz_target!(|data: &[u8]| {
    let name = Path::new("fuzz.txt");
    if let Ok(mut reader) = columns235::Reader::from_bytes(name, data.to_vec()) {
        assert!(states(&mut reader) > 0);
    }
    let Ok(mut reader) = columns252::Reader::from_bytes(name, data.to_vec(), None) else { return };
    let count = states(&mut reader);
    // What is a row of states is one of the table.
    let mut table = columns252::Table::from_bytes(name, data.to_vec()).expect("its first row is of the layout");
    let mut batch = Batch::new(table.columns());
    let mut rows = 0;
    while table.next(&mut batch).expect("memory can be read") {
        rows += batch.rows() as u64;
    }
    assert!(rows >= count, "{rows} rows, {count} states");
});
