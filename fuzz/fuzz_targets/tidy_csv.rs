//! Any bytes as tidy CSV: as a run, as a table, and described.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use recordings::table::{self, TableSource};
use recordings::{csv, describe};

fuzz_target!(|data: &[u8]| {
    let run = csv::read_text("fuzz.csv", data);
    if let Err(error) = &run {
        assert!(!error.to_string().contains('\n'));
    }
    let name = Path::new("fuzz.csv");
    let Ok(mut source) = csv::Table::from_bytes(name, data) else { return };
    let found = table::collect("fuzz.csv", &mut source).expect("memory can be read");
    assert!(found.columns.iter().all(|column| column.values.len() == found.rows()));
    assert!(found.texts.iter().all(|column| column.values.len() == found.rows()));
    // What the strict reader vouches for is a whole table.
    if let Ok(run) = run {
        assert_eq!((run.rows(), source.damage()), (found.rows(), None));
    }
    let mut source = csv::Table::from_bytes(name, data).expect("as before");
    let description = describe::of_table("fuzz.csv", &mut source, &mut |_, _| {}).expect("memory can be read");
    assert_eq!(description.streams[0].count, found.rows() as u64);
    assert!(!description.to_string().is_empty());
});
