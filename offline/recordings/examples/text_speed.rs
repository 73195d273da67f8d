//! How fast the text formats and Parquet are read and written, and how much memory that takes.
//!
//! `cargo run --release -p ravenpose-recordings --example text_speed -- [SECONDS] [FOLDER] [NAME]` makes SECONDS (default 60) of
//! 1 kHz motion of both arms with the truth of one, writes it in every format, reads each back, and prints MB per second of
//! processor time twice: of the file, and of the 980-byte messages that the states stand for. The last column is the peak
//! resident memory so far. With NAME only files whose name has it are made.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use arm::Side;
use recordings::describe::describe;
use recordings::open::{Opened, open};
use recordings::save::{StateFormat, TableFormat, copy_states, create_states, create_table};
use recordings::stream::{Damage, Record, Source, StreamError, Truth};
use recordings::synthetic::Synthetic;
use recordings::tidy::{Options, StateTable};
use recordings::{Arms, table};

/// Bytes of a state as ROS sends it.
const MESSAGE_BYTES: u64 = 980;

/// Motion made on the way, so that no recording has to fit the memory.
struct Made {
    motion: Synthetic,
    index: u64,
    count: u64,
    truth: Option<Truth>,
}

impl Source for Made {
    fn format(&self) -> &'static str {
        "synthetic motion"
    }

    fn metadata(&self) -> &[(String, String)] {
        &[]
    }

    fn progress(&self) -> (u64, u64) {
        (self.index, self.count)
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        if let Some(truth) = self.truth.take() {
            return Ok(Some(Record::Truth(truth)));
        }
        if self.index == self.count {
            return Ok(None);
        }
        let mut state = self.motion.state(self.index);
        state.hdr_stamp_sec += 1_570_000_000;
        self.index += 1;
        let mut truth = Truth::unknown(Record::State(Box::new(state)).time_ns(), Side::Gold);
        truth.position_m = [0, 1, 2].map(|axis| f64::from(state.pos[axis]) * 1.000_123e-6);
        truth.joints = [1, 2, 3, 4, 5, 6, 7].map(|joint| f64::from(state.jpos[joint]) * 0.017);
        self.truth = Some(truth);
        Ok(Some(Record::State(Box::new(state))))
    }

    fn damage(&self) -> Option<&Damage> {
        None
    }
}

fn made(count: u64) -> Made {
    Made { motion: Synthetic::new(1, Arms::Both), index: 0, count, truth: None }
}

fn main() -> Result<(), StreamError> {
    let mut arguments = std::env::args().skip(1);
    let seconds: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(60);
    let folder = arguments.next().map_or_else(std::env::temp_dir, PathBuf::from);
    let name_part = arguments.next().unwrap_or_default();
    let wanted = |name: &str| name.contains(&name_part);
    let count = seconds * 1000;
    let messages = count * MESSAGE_BYTES;
    println!("{count} states ({} MB of messages) in {}", messages / 1_000_000, folder.display());
    println!("{:34} {:>8} {:>8} {:>12} {:>14} {:>8}", "what", "wall s", "cpu s", "MB/s of file", "MB/s of states", "peak MiB");
    let base = folder.join("text_speed.rvs");
    let report = |what: &str, path: &Path, start: Start| {
        let (wall, seconds) = (start.wall.elapsed().as_secs_f64(), cpu_time().saturating_sub(start.cpu).as_secs_f64());
        let bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len()) as f64;
        let per_second = |bytes: f64| bytes / 1e6 / seconds;
        println!(
            "{what:34} {wall:8.2} {seconds:8.2} {:12.0} {:14.0} {:8}",
            per_second(bytes),
            per_second(messages as f64),
            peak_mib()
        );
    };
    let start = Start::now();
    let mut sink = create_states(&base, StateFormat::StateFile, &[])?;
    copy_states(&mut made(count), sink.as_mut(), &mut |_, _| {})?;
    sink.finish()?;
    report("make motion, write .rvs", &base, start);
    report_reading("read .rvs", &base, &report)?;
    for (name, format) in [
        ("text_speed.parquet", StateFormat::Parquet),
        ("text_speed.txt", StateFormat::Columns235),
        ("text_speed.252.csv", StateFormat::Columns252),
    ]
    .into_iter()
    .filter(|(name, _)| wanted(name))
    {
        let path = folder.join(name);
        let start = Start::now();
        let mut sink = create_states(&path, format, &[])?;
        copy_states(states(&base)?.as_mut(), sink.as_mut(), &mut |_, _| {})?;
        sink.finish()?;
        report(&format!(".rvs to {name}"), &path, start);
        report_reading(&format!("read {name}"), &path, &report)?;
        let _ = std::fs::remove_file(&path);
    }
    for (name, format) in [
        ("text_speed.csv", TableFormat::Csv),
        ("text_speed.csv.gz", TableFormat::Csv),
        ("text_speed_table.parquet", TableFormat::Parquet),
    ]
    .into_iter()
    .filter(|(name, _)| wanted(name))
    {
        let path = folder.join(name);
        let start = Start::now();
        let mut table = StateTable::new(states(&base)?, Options { arms: Some(Arms::Gold), ..Options::default() })?;
        let mut sink = create_table(&path, format, table::TableSource::columns(&table), &[])?;
        table::copy(&mut table, sink.as_mut(), &mut |_, _| {})?;
        sink.finish()?;
        report(&format!(".rvs to tidy {name}"), &path, start);
        report_reading(&format!("read {name}"), &path, &report)?;
        let start = Start::now();
        describe(&path, &mut |_, _| {})?;
        report(&format!("describe {name}"), &path, start);
        let _ = std::fs::remove_file(&path);
    }
    let start = Start::now();
    describe(&base, &mut |_, _| {})?;
    report("describe .rvs", &base, start);
    let _ = std::fs::remove_file(&base);
    Ok(())
}

fn states(path: &Path) -> Result<Box<dyn Source>, StreamError> {
    match open(path)? {
        Opened::States(source) => Ok(source),
        Opened::Table(_) => unreachable!("this program wrote states"),
    }
}

/// Reads a file to its end.
fn report_reading(what: &str, path: &Path, report: &dyn Fn(&str, &Path, Start)) -> Result<(), StreamError> {
    let start = Start::now();
    let damage = match open(path)? {
        Opened::States(mut source) => {
            while source.next()?.is_some() {}
            source.damage().cloned()
        }
        Opened::Table(mut source) => {
            let mut batch = table::Batch::new(source.columns());
            while source.next(&mut batch)? {}
            source.damage().cloned()
        }
    };
    assert_eq!(damage, None, "{what}");
    report(what, path, start);
    Ok(())
}

/// When a measurement began.
struct Start {
    wall: Instant,
    cpu: Duration,
}

impl Start {
    fn now() -> Self {
        Self { wall: Instant::now(), cpu: cpu_time() }
    }
}

/// Processor time of this process, in steps of 10 ms (Linux): others on the machine do not count.
fn cpu_time() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Fields 14 and 15 of proc(5), counted after the name in brackets, which may hold blanks.
    let after_name = stat.rsplit_once(") ").map_or("", |(_, rest)| rest);
    let ticks: u64 = after_name.split(' ').skip(11).take(2).filter_map(|field| field.parse::<u64>().ok()).sum();
    Duration::from_millis(10 * ticks)
}

/// Peak resident memory of this process, MiB (Linux).
fn peak_mib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) / 1024
}
