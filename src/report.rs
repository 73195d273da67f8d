//! What the ordinary thread writes: `stats.json` each second, the histogram log and `.hgrm` files once per interval and at the end.
//!
//! Files appear whole or not at all: written beside their name and renamed. The log grows by whole lines; what a failed write left is
//! cut off again.

use crate::config::ARM_NAMES;
use crate::histogram::{Histograms, STAGES};
use crate::shared::{COUNTER_NAMES, Shared};
use hdrhistogram::Histogram;
use hdrhistogram::serialization::interval_log::{IntervalLogWriterBuilder, Tag};
use hdrhistogram::serialization::{Serializer, V2DeflateSerializer, V2Serializer};
use ravenpose_wire::{ARMS, ArmStatus, flag_names};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Version of `stats.json`.
pub const STATS_VERSION: u32 = 1;

/// One stage in `stats.json`; times in ns.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct StageStats {
    pub name: String,
    pub count: u64,
    pub min: u64,
    pub p50: u64,
    pub p99: u64,
    pub p999: u64,
    pub max: u64,
    /// The whole histogram: HdrHistogram V2, hexadecimal.
    pub v2_hex: String,
}

/// One arm in `stats.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ArmStats {
    pub arm: String,
    pub status: String,
    pub flags: Vec<String>,
    pub model: String,
}

/// One counter in `stats.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CounterStats {
    pub name: String,
    pub value: u64,
}

/// `stats.json`: what `ravenpose stats` shows.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct Stats {
    pub version: u32,
    pub pid: u32,
    pub written_unix_s: u64,
    pub uptime_s: u64,
    pub arms: Vec<ArmStats>,
    pub counters: Vec<CounterStats>,
    pub stages: Vec<StageStats>,
}

impl Stats {
    /// What a counter stood at; none of that name.
    pub fn counter(&self, name: &str) -> Option<u64> {
        self.counters.iter().find(|counter| counter.name == name).map(|counter| counter.value)
    }

    /// Collects what the loop has shown.
    pub fn collect(shared: &Shared, total: &Histograms, uptime: Duration, models: &[String; ARMS]) -> Self {
        let arms = (0..ARMS)
            .map(|arm| {
                let (status, flags) = shared.arm(arm);
                ArmStats {
                    arm: ARM_NAMES[arm].to_owned(),
                    status: ArmStatus::name(status).to_owned(),
                    flags: flag_names(flags).map(str::to_owned).collect(),
                    model: models[arm].clone(),
                }
            })
            .collect();
        let counters = COUNTER_NAMES
            .iter()
            .zip(shared.counters())
            .map(|(name, value)| CounterStats { name: (*name).to_owned(), value })
            .collect();
        Self {
            version: STATS_VERSION,
            pid: std::process::id(),
            written_unix_s: SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs()),
            uptime_s: uptime.as_secs(),
            arms,
            counters,
            stages: STAGES.iter().map(|&(stage, name)| StageStats::new(name, total.stage(stage))).collect(),
        }
    }
}

impl StageStats {
    fn new(name: &str, histogram: &Histogram<u64>) -> Self {
        let mut bytes = Vec::new();
        // Writing to memory cannot fail; should the library refuse, the summary stands alone.
        if V2Serializer::new().serialize(histogram, &mut bytes).is_err() {
            bytes.clear();
        }
        Self {
            name: name.to_owned(),
            count: histogram.len(),
            min: histogram.min(),
            p50: histogram.value_at_quantile(0.5),
            p99: histogram.value_at_quantile(0.99),
            p999: histogram.value_at_quantile(0.999),
            max: histogram.max(),
            v2_hex: bytes.iter().fold(String::new(), |mut text, byte| {
                let _ = write!(text, "{byte:02x}");
                text
            }),
        }
    }

    /// The whole histogram, if the file holds it undamaged.
    pub fn histogram(&self) -> Option<Histogram<u64>> {
        let bytes: Option<Vec<u8>> =
            (0..self.v2_hex.len()).step_by(2).map(|at| u8::from_str_radix(self.v2_hex.get(at..at + 2)?, 16).ok()).collect();
        hdrhistogram::serialization::Deserializer::new().deserialize(&mut bytes?.as_slice()).ok()
    }
}

/// Writes a file aside and renames it, so that no reader ever sees a part of it.
///
/// # Errors
/// The system's; the old file is intact then, and nothing is left beside it.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut aside = path.as_os_str().to_owned();
    aside.push(".new");
    let aside = PathBuf::from(aside);
    let written = File::create(&aside).and_then(|mut file| file.write_all(bytes)).and_then(|()| fs::rename(&aside, path));
    if written.is_err() {
        let _ = fs::remove_file(&aside);
    }
    written
}

/// The text of a `.hgrm` file (HdrHistogram's percentile distribution), values in µs.
pub fn hgrm(histogram: &Histogram<u64>) -> String {
    const SCALE: f64 = 1000.0;
    let mut text = format!("{:>12} {:>14} {:>10} {:>14}\n\n", "Value", "Percentile", "TotalCount", "1/(1-Percentile)");
    for step in histogram.iter_quantiles(5) {
        let value = histogram.highest_equivalent(step.value_iterated_to()) as f64 / SCALE;
        let quantile = step.quantile_iterated_to();
        let total = histogram.count_between(0, step.value_iterated_to());
        let _ = if quantile < 1.0 {
            writeln!(text, "{value:12.3} {quantile:2.12} {total:10} {:14.2}", 1.0 / (1.0 - quantile))
        } else {
            writeln!(text, "{value:12.3} {quantile:2.12} {total:10}")
        };
    }
    let _ = writeln!(text, "#[Mean    = {:12.3}, StdDeviation   = {:12.3}]", histogram.mean() / SCALE, histogram.stdev() / SCALE);
    let _ = writeln!(text, "#[Max     = {:12.3}, Total count    = {:12}]", histogram.max() as f64 / SCALE, histogram.len());
    let buckets = 64 - histogram.high().leading_zeros();
    let _ = writeln!(text, "#[Buckets = {buckets:12}, SubBuckets     = {:12}]", 2048);
    text
}

/// The histogram log of one run of the service.
pub struct Log {
    dir: PathBuf,
    path: PathBuf,
    /// When the run began: to date it, and to place intervals whatever is done to the wall clock.
    started: SystemTime,
    since: Instant,
}

impl Log {
    /// A log in `dir`, named after the start time.
    ///
    /// # Errors
    /// The system's, when the directory cannot be made.
    pub fn create(dir: &Path) -> io::Result<Self> {
        fs::create_dir_all(dir)?;
        let started = SystemTime::now();
        let seconds = started.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let path = dir.join(format!("ravenposed-{seconds}-{}.hlog", std::process::id()));
        Ok(Self { dir: dir.to_owned(), path, started, since: Instant::now() })
    }

    /// Appends one interval.
    ///
    /// # Errors
    /// The system's; the log then ends with its last whole interval.
    pub fn append(&self, interval: &Histograms, length: Duration) -> io::Result<()> {
        let text = self.interval(interval, length)?;
        let mut file = File::options().create(true).append(true).open(&self.path)?;
        let before = file.metadata()?.len();
        // The header comes with the first interval only.
        let from = if before == 0 { 0 } else { text.find("Tag=").unwrap_or(0) };
        if let Err(error) = file.write_all(&text.as_bytes()[from..]).and_then(|()| file.flush()) {
            let _ = file.set_len(before);
            return Err(error);
        }
        Ok(())
    }

    /// Writes the `.hgrm` files of everything so far.
    ///
    /// # Errors
    /// The system's; the old file is intact then.
    pub fn summarise(&self, total: &Histograms) -> io::Result<()> {
        for (stage, name) in STAGES {
            write_whole(&self.dir.join(format!("{name}.hgrm")), hgrm(total.stage(stage)).as_bytes())?;
        }
        Ok(())
    }

    fn interval(&self, interval: &Histograms, length: Duration) -> io::Result<String> {
        let mut bytes = Vec::new();
        let mut serializer = V2DeflateSerializer::new();
        let end = self.since.elapsed();
        let mut log = IntervalLogWriterBuilder::new()
            .add_comment("ravenposed latencies, ns; one tag per stage")
            .with_base_time(self.started)
            .with_start_time(self.started)
            .with_max_value_divisor(1000.0)
            .begin_log_with(&mut bytes, &mut serializer)?;
        for (stage, name) in STAGES {
            log.write_histogram(interval.stage(stage), end.saturating_sub(length), length, Tag::new(name))
                .map_err(|error| io::Error::other(format!("{error:?}")))?;
        }
        String::from_utf8(bytes).map_err(io::Error::other)
    }
}
