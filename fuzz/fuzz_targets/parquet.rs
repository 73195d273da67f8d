//! Any bytes as a Parquet file of states and of a table.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use recordings::parquet_file::{StateReader, TableReader};
use recordings::stream::Source;
use recordings::table::{Batch, TableSource};

/// A short file may hold two thousand million equal rows: reading on proves nothing.
const BATCHES_MAX: usize = 200;

fuzz_target!(
    init: {
        // The reader promises to turn a panic of the decoder into damage. The fuzzer's own hook would end the process before
        // it can; a panic that leaves the reader still ends it.
        std::panic::set_hook(Box::new(|_| {}));
    },
    |data: &[u8]| {
        let name = Path::new("fuzz.parquet");
        if let Ok(Some(mut reader)) = StateReader::from_bytes(name, data.to_vec()) {
            for _ in 0..BATCHES_MAX * 512 {
                if reader.next().expect("memory can be read").is_none() {
                    break;
                }
            }
        }
        let Ok(mut reader) = TableReader::from_bytes(name, data.to_vec()) else { return };
        let mut batch = Batch::new(reader.columns());
        for _ in 0..BATCHES_MAX {
            if !reader.next(&mut batch).expect("memory can be read") {
                break;
            }
            assert!(batch.columns.iter().all(|cells| cells.len() == batch.rows()));
        }
    }
);
