//! `ravenposed.toml`: strict, every complaint with file, line, column, key and remedy.

use crate::cycle::Limits;
use ravenpose_transport::Settings;
use serde::Deserialize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toml::Spanned;

/// Largest configuration file that is read.
const SIZE_MAX: u64 = 1 << 20;

/// Why a configuration was refused; one line.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{path}: cannot read the configuration: {cause}; give the file with --config FILE")]
    Unreadable {
        /// As given.
        path: String,
        /// The system's reason.
        cause: String,
    },
    /// Not a configuration.
    #[error("{path}:{line}:{column}: {message}")]
    Invalid {
        /// As given.
        path: String,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// What, and the remedy.
        message: String,
    },
}

/// How the loop waits for the next state (`docs/decisions/0003`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wait {
    /// Poll without a pause: lowest latency, takes the whole core.
    Spin,
    /// Sleep until shortly before the next state is due, then poll. The default.
    Sleep,
    /// Be woken by the publisher's bell: least processor time, tens of microseconds more.
    Event,
}

/// A checked configuration.
#[derive(Debug, Clone)]
pub struct Config {
    /// Correct with models that are marked untrained.
    pub allow_untrained: bool,
    /// Start although a real-time guarantee or a model is missing; every message is flagged then.
    pub allow_degraded: bool,
    /// Where the shared files live.
    pub transport: Settings,
    /// Core to pin the loop to.
    pub core: Option<usize>,
    /// SCHED_FIFO priority of the loop.
    pub priority: i32,
    /// How to wait.
    pub wait: Wait,
    /// Polling before a state is due, ns (`wait = "sleep"`).
    pub spin_ns: i64,
    /// Keep the processor out of deep idle states.
    pub hold_cpu_dma_latency: bool,
    /// Lock all memory.
    pub lock_memory: bool,
    /// Limits of the cycle.
    pub limits: Limits,
    /// Model of the gold and of the green arm.
    pub models: [Option<ModelSource>; 2],
    /// Where `stats.json` is written each second.
    pub runtime_dir: PathBuf,
    /// Where histograms are written; none if absent.
    pub histogram_dir: Option<PathBuf>,
    /// Interval of the histogram log, s.
    pub interval_s: u64,
}

/// A model file and, optionally, the hash that it must have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelSource {
    /// The ONNX file.
    pub path: PathBuf,
    /// SHA-256 in hexadecimal; without it `FILE.sha256` is read.
    pub sha256: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    allow_untrained: bool,
    #[serde(default)]
    allow_degraded: bool,
    transport: Option<TransportTable>,
    r#loop: Option<LoopTable>,
    limits: Option<LimitsTable>,
    gold: Option<ModelTable>,
    green: Option<ModelTable>,
    report: Option<ReportTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TransportTable {
    prefix: Option<Spanned<String>>,
    root: Option<Spanned<String>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct LoopTable {
    core: Option<Spanned<i64>>,
    priority: Option<Spanned<i64>>,
    wait: Option<Wait>,
    spin_us: Option<Spanned<i64>>,
    hold_cpu_dma_latency: Option<bool>,
    lock_memory: Option<bool>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct LimitsTable {
    period_us: Option<Spanned<i64>>,
    stale_us: Option<Spanned<i64>>,
    budget_us: Option<Spanned<i64>>,
    good_cycles: Option<Spanned<i64>>,
    recover_um_per_cycle: Option<Spanned<f64>>,
    rate_um_per_cycle: Option<Spanned<f64>>,
    envelope_mm: Option<Spanned<f64>>,
    late_degraded: Option<Spanned<i64>>,
    late_fallback: Option<Spanned<i64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelTable {
    model: PathBuf,
    sha256: Option<Spanned<String>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct ReportTable {
    runtime_dir: Option<PathBuf>,
    histogram_dir: Option<PathBuf>,
    interval_s: Option<Spanned<i64>>,
}

/// The text with its name, for messages that point into it.
struct Source<'a> {
    path: &'a str,
    text: &'a str,
}

impl Config {
    /// Reads and checks a configuration file. Relative paths in it start at its own directory.
    ///
    /// # Errors
    /// [`ConfigError`], one line.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let name = path.display().to_string();
        let unreadable = |cause: String| ConfigError::Unreadable { path: name.clone(), cause };
        let size = std::fs::metadata(path).map_err(|cause| unreadable(cause.to_string()))?;
        if !size.is_file() {
            return Err(unreadable("not a regular file".to_owned()));
        }
        if size.len() > SIZE_MAX {
            return Err(unreadable(format!("{} bytes, more than the {SIZE_MAX} allowed", size.len())));
        }
        let bytes = std::fs::read(path).map_err(|cause| unreadable(cause.to_string()))?;
        let text = std::str::from_utf8(&bytes).map_err(|cause| {
            let good = String::from_utf8_lossy(&bytes[..cause.valid_up_to()]).into_owned();
            Source { path: &name, text: &good }.error(good.len(), "not UTF-8 text; save the file as UTF-8".to_owned())
        })?;
        Self::parse(&name, text, path.parent().unwrap_or(Path::new(".")))
    }

    /// Checks the text of a configuration; `path` names it in messages, relative paths in it start at `base`.
    ///
    /// # Errors
    /// [`ConfigError::Invalid`].
    pub fn parse(path: &str, text: &str, base: &Path) -> Result<Self, ConfigError> {
        let source = Source { path, text };
        let file: File = toml::from_str(text).map_err(|error| source.toml_error(&error))?;
        let looping = file.r#loop.unwrap_or_default();
        let limits = source.limits(file.limits.unwrap_or_default())?;
        let report = file.report.unwrap_or_default();
        let mut transport = Settings::default();
        if let Some(table) = file.transport {
            transport = source.transport(table, transport)?;
        }
        let model = |table: Option<ModelTable>| -> Result<Option<ModelSource>, ConfigError> {
            let Some(table) = table else { return Ok(None) };
            let sha256 = table.sha256.map(|hash| source.sha256(&hash)).transpose()?;
            Ok(Some(ModelSource { path: base.join(table.model), sha256 }))
        };
        Ok(Self {
            allow_untrained: file.allow_untrained,
            allow_degraded: file.allow_degraded,
            transport,
            core: source.integer("loop.core", looping.core, 0..=4095)?.map(|core| core as usize),
            priority: source.integer("loop.priority", looping.priority, 1..=95)?.unwrap_or(80) as i32,
            wait: looping.wait.unwrap_or(Wait::Sleep),
            spin_ns: source.integer("loop.spin_us", looping.spin_us, 0..=900)?.unwrap_or(200) * 1000,
            hold_cpu_dma_latency: looping.hold_cpu_dma_latency.unwrap_or(false),
            lock_memory: looping.lock_memory.unwrap_or(true),
            limits,
            models: [model(file.gold)?, model(file.green)?],
            runtime_dir: base.join(report.runtime_dir.unwrap_or_else(|| PathBuf::from("/run/ravenpose"))),
            histogram_dir: report.histogram_dir.map(|dir| base.join(dir)),
            interval_s: source.integer("report.interval_s", report.interval_s, 1..=86_400)?.unwrap_or(60) as u64,
        })
    }
}

impl Source<'_> {
    fn error(&self, offset: usize, message: String) -> ConfigError {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        ConfigError::Invalid {
            path: self.path.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            message,
        }
    }

    fn toml_error(&self, error: &toml::de::Error) -> ConfigError {
        let message = error.message().lines().collect::<Vec<_>>().join(" ");
        let message = match unknown_key(&message) {
            Some((key, allowed)) => {
                let nearest = nearest(key, &allowed).map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default();
                format!("unknown key `{key}`{nearest}; allowed here: {}", allowed.join(", "))
            }
            None => format!("{message}; see docs/configuration.md"),
        };
        self.error(error.span().map_or(0, |span| span.start), message)
    }

    fn integer(&self, key: &str, value: Option<Spanned<i64>>, allowed: RangeInclusive<i64>) -> Result<Option<i64>, ConfigError> {
        let Some(value) = value else { return Ok(None) };
        let (start, value) = (value.span().start, value.into_inner());
        if allowed.contains(&value) {
            return Ok(Some(value));
        }
        Err(self.error(start, format!("{key} = {value} is outside {} to {}", allowed.start(), allowed.end())))
    }

    fn number(&self, key: &str, value: Option<Spanned<f64>>, low: f64, high: f64, default: f64) -> Result<f64, ConfigError> {
        let Some(value) = value else { return Ok(default) };
        let (start, value) = (value.span().start, value.into_inner());
        if value >= low && value <= high {
            return Ok(value);
        }
        Err(self.error(start, format!("{key} = {value} is outside {low} to {high}")))
    }

    fn limits(&self, table: LimitsTable) -> Result<Limits, ConfigError> {
        let default = Limits::default();
        let period_us = self.integer("limits.period_us", table.period_us, 100..=100_000)?.unwrap_or(1000);
        let stale = table.stale_us.as_ref().map_or(0, |value| value.span().start);
        let limits = Limits {
            period_ns: period_us * 1000,
            stale_ns: self.integer("limits.stale_us", table.stale_us, 100..=1_000_000)?.map_or(default.stale_ns, |us| us * 1000),
            budget_ns: self.integer("limits.budget_us", table.budget_us, 1..=100_000)?.map_or(default.budget_ns, |us| us * 1000),
            good_cycles: self.integer("limits.good_cycles", table.good_cycles, 1..=100_000)?.unwrap_or(100) as u32,
            recover_um: self.number("limits.recover_um_per_cycle", table.recover_um_per_cycle, 0.01, 1000.0, default.recover_um)?,
            rate_um: self.number("limits.rate_um_per_cycle", table.rate_um_per_cycle, 0.01, 15_000.0, default.rate_um)?,
            envelope_um: self.number("limits.envelope_mm", table.envelope_mm, 0.01, 50.0, default.envelope_um / 1000.0)? * 1000.0,
            late_degraded: self.integer("limits.late_degraded", table.late_degraded, 1..=1000)?.unwrap_or(3) as u32,
            late_fallback: self.integer("limits.late_fallback", table.late_fallback, 1..=1000)?.unwrap_or(10) as u32,
        };
        if limits.stale_ns <= limits.period_ns {
            return Err(self.error(
                stale,
                format!("limits.stale_us = {} must be longer than limits.period_us = {period_us}", limits.stale_ns / 1000),
            ));
        }
        Ok(limits)
    }

    fn transport(&self, table: TransportTable, mut settings: Settings) -> Result<Settings, ConfigError> {
        if let Some(prefix) = table.prefix {
            let (start, prefix) = (prefix.span().start, prefix.into_inner());
            let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if prefix.is_empty() || prefix.len() > 32 || !prefix.chars().all(good) {
                return Err(self.error(start, format!("transport.prefix = {prefix:?} must be 1 to 32 letters, digits, '_' or '-'")));
            }
            settings.prefix = prefix;
        }
        if let Some(root) = table.root {
            let (start, root) = (root.span().start, root.into_inner());
            if !root.starts_with('/') || root.len() > 100 {
                return Err(self.error(start, format!("transport.root = {root:?} must be an absolute path of at most 100 bytes")));
            }
            settings.root = if root.ends_with('/') { root } else { root + "/" };
        }
        Ok(settings)
    }

    fn sha256(&self, hash: &Spanned<String>) -> Result<String, ConfigError> {
        let text = hash.get_ref();
        if text.len() == 64 && text.chars().all(|c| c.is_ascii_hexdigit()) {
            return Ok(text.to_ascii_lowercase());
        }
        Err(self.error(hash.span().start, "sha256 must be 64 hexadecimal digits, as `sha256sum MODEL.onnx` prints".to_owned()))
    }
}

/// The key and the allowed keys of serde's message "unknown field `x`, expected `a` or `b`" / "expected one of `a`, `b`".
fn unknown_key(message: &str) -> Option<(&str, Vec<&str>)> {
    let rest = message.strip_prefix("unknown field `")?;
    let (key, rest) = rest.split_once('`')?;
    Some((key, rest.split('`').skip(1).step_by(2).collect()))
}

/// The allowed key with the fewest edits, if that is near enough to be a slip.
pub(crate) fn nearest<'a>(key: &str, allowed: &[&'a str]) -> Option<&'a str> {
    let (distance, name) = allowed.iter().map(|name| (edits(key, name), *name)).min()?;
    (distance <= 1 + key.len() / 3).then_some(name)
}

fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
