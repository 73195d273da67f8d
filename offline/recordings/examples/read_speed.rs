//! How fast a recording is read, and in how much memory.
//!
//! usage: `read_speed FILE`, or `read_speed --make MINUTES FILE` to write one first (`.mcap`, `.bag`, `.lz4.bag`): 1 kHz states
//! of synthetic motion with noise in every encoder, and the truth of both arms at 100 Hz.
//!
//! Prints megabytes (of 10^6 bytes) per second of the file and of the messages in it, and the peak of the resident memory.

use std::path::Path;
use std::time::Instant;

use arm::Side;
use recordings::Arms;
use recordings::mcap_file::{McapSink, McapSource};
use recordings::ros::STATE_BYTES;
use recordings::rosbag_file::{ChunkCompression, RosbagSink, RosbagSource};
use recordings::stream::{Record, Sink, Source, Truth};
use recordings::synthetic::Synthetic;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--make", minutes, file] => {
            make(Path::new(file), minutes.parse()?)?;
            read(Path::new(file))
        }
        [file] if !file.starts_with('-') => read(Path::new(file)),
        _ => Err("usage: read_speed [--make MINUTES] FILE".into()),
    }
}

fn make(path: &Path, minutes: f64) -> Result<(), Failure> {
    let mut sink: Box<dyn Sink> = match path.to_string_lossy() {
        name if name.ends_with(".mcap") => Box::new(McapSink::create(path, &[])?),
        name if name.ends_with(".lz4.bag") => Box::new(RosbagSink::create(path, &[], ChunkCompression::Lz4)?),
        _ => Box::new(RosbagSink::create(path, &[], ChunkCompression::None)?),
    };
    let motion = Synthetic::new(1, Arms::Both);
    // States are computed beforehand for a second only: making them is not what is measured.
    let second: Vec<_> = (0..1000).map(|index| motion.state(index)).collect();
    let mut noise = 1_u64;
    let begin = Instant::now();
    let count = (minutes * 60_000.0) as u64;
    for index in 0..count {
        let mut state = second[(index % 1000) as usize];
        state.seal(index + 1);
        (state.hdr_stamp_sec, state.hdr_stamp_nsec) = ((index / 1000) as u32, (index % 1000) as u32 * 1_000_000);
        for (count, (angle, torque)) in state.enc_vals.iter_mut().zip(state.mpos.iter_mut().zip(&mut state.tau)) {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *count += (noise >> 62) as i32;
            *angle += (noise >> 62) as f32 * 0.09;
            *torque += (noise >> 40) as f32 * 1e-9;
        }
        let record = Record::State(Box::new(state));
        let time_ns = record.time_ns();
        sink.write(&record)?;
        if index % 10 == 0 {
            for side in Side::ALL {
                sink.write(&Record::Truth(Truth { joints: [index as f64; 7], ..Truth::unknown(time_ns, side) }))?;
            }
        }
    }
    sink.finish()?;
    println!("written in {:.1} s", begin.elapsed().as_secs_f64());
    Ok(())
}

fn read(path: &Path) -> Result<(), Failure> {
    let begin = Instant::now();
    let mut source: Box<dyn Source> = if path.extension().is_some_and(|extension| extension == "mcap") {
        Box::new(McapSource::open(path)?)
    } else {
        Box::new(RosbagSource::open(path)?)
    };
    let (mut states, mut truths, mut sum) = (0_u64, 0_u64, 0_i64);
    while let Some(record) = source.next()? {
        match record {
            Record::State(state) => {
                states += 1;
                sum = sum.wrapping_add(i64::from(state.enc_vals[0]));
            }
            Record::Truth(_) => truths += 1,
        }
    }
    let (seconds, size) = (begin.elapsed().as_secs_f64(), std::fs::metadata(path)?.len() as f64);
    let messages = states as f64 * STATE_BYTES as f64;
    println!("{states} states, {truths} truths, {:.1} MB in {seconds:.2} s (check {sum})", size / 1e6);
    println!("{:.0} MB/s of the file, {:.0} MB/s of state messages", size / 1e6 / seconds, messages / 1e6 / seconds);
    println!("peak resident memory {:.1} MiB", peak_kib()? / 1024.0);
    Ok(())
}

/// Peak resident memory, KiB, as Linux counts it.
fn peak_kib() -> Result<f64, Failure> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).ok_or("no VmHWM")?;
    Ok(line.split_whitespace().nth(1).ok_or("no number")?.parse()?)
}
