//! Any bytes as an MCAP file.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use recordings::mcap_file::McapSource;
use recordings::stream::Source;

fuzz_target!(|data: &[u8]| {
    let Ok(mut source) = McapSource::new(Path::new("fuzz.mcap"), data, data.len() as u64) else { return };
    let mut records = 0_u64;
    let ended = loop {
        match source.next() {
            Ok(Some(record)) => records += u64::from(record.time_ns() != i64::MIN),
            Ok(None) => break true,
            Err(_) => break false,
        }
    };
    let messages: u64 = source.channels().iter().filter(|channel| channel.is_read).map(|channel| channel.messages).sum();
    assert!(records <= messages, "a record out of nothing");
    // The end stays the end, and a file without damage was read to its last byte.
    if ended {
        assert!(matches!(source.next(), Ok(None)));
        let (read, size) = source.progress();
        assert!(source.damage().is_some() || read == size);
    }
});
