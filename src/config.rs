//! `ravenposed.toml`: strict, every complaint with file, line, column, key and remedy.

use crate::correction::{Pace, Quantity};
use crate::cycle::Limits;
use crate::network::Format;
use ravenpose_transport::{Listener, Settings};
use ravenpose_wire::ARMS;
use std::io::Read;
use std::ops::RangeInclusive;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest configuration file that is read.
const SIZE_MAX: u64 = 1 << 20;
/// Longest piece of the file that a message repeats, in characters.
const SHOWN_MAX: usize = 60;

/// Why a configuration was refused; one line.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error(
        "{path}: cannot read the configuration: {cause}; make it (an empty file will do, systemd/ravenposed.toml is a beginning), or give another with --config FILE"
    )]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wait {
    /// Poll without a pause: lowest latency, takes the whole core.
    Spin,
    /// Sleep until shortly before the next state is due, then poll. The default.
    Sleep,
    /// Be woken by the publisher's bell: least processor time, tens of microseconds more.
    Event,
}

/// The arms' names, as the configuration has them.
pub const ARM_NAMES: [&str; ARMS] = ["gold", "green"];

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
    /// Read the weights while polling, so that they are in the caches when a state comes.
    pub keep_warm: bool,
    /// Keep the processor out of deep idle states.
    pub hold_cpu_dma_latency: bool,
    /// Lock all memory.
    pub lock_memory: bool,
    /// Limits of the cycle.
    pub limits: Limits,
    /// Models of the gold and of the green arm.
    pub models: [Option<ArmSources>; 2],
    /// Where `stats.json` is written each second.
    pub runtime_dir: PathBuf,
    /// Where histograms are written; none if absent.
    pub histogram_dir: Option<PathBuf>,
    /// Interval of the histogram log, s.
    pub interval_s: u64,
}

/// Largest deviation of smaller weights that is allowed unless the configuration says otherwise, thousandths of the network's unit.
pub const WEIGHTS_DEVIATION: f64 = 10.0;

/// The models of one arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSources {
    /// Corrects the position.
    pub position: ModelSource,
    /// Corrects the orientation.
    pub orientation: Option<ModelSource>,
}

/// A model file, the hash that it must have, and how its weights are to be stored.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSource {
    /// The ONNX file.
    pub path: PathBuf,
    /// SHA-256 in hexadecimal; without it `FILE.sha256` is read.
    pub sha256: Option<String>,
    /// The format of the weights; the smallest that is exact enough if none is stated.
    pub weights: Option<Format>,
    /// Largest deviation from float64 that smaller weights may bring, thousandths of the network's unit: µm, or of a degree.
    pub weights_deviation: f64,
    /// What it corrects.
    pub quantity: Quantity,
}

impl ModelSource {
    /// A file that corrects the position, with its hash beside it and everything else as by default.
    pub fn new(path: PathBuf) -> Self {
        Self { path, sha256: None, weights: None, weights_deviation: WEIGHTS_DEVIATION, quantity: Quantity::Position }
    }
}

impl Config {
    /// Reads and checks a configuration file. Relative paths in it start at its own directory.
    ///
    /// # Errors
    /// [`ConfigError`], one line.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let name = shown_path(path);
        let bytes = read_regular(path, SIZE_MAX).map_err(|cause| ConfigError::Unreadable { path: name.clone(), cause })?;
        let refuse = |good: &[u8], message: &str| {
            let good = String::from_utf8_lossy(good);
            Source { path: &name, text: &good }.error(good.len(), format!("{message}; save the file as UTF-8"))
        };
        if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
            return Err(refuse(b"", "UTF-16 text"));
        }
        if let Some(zero) = bytes.iter().position(|byte| *byte == 0) {
            return Err(refuse(&bytes[..zero], "a zero byte, as UTF-16 text has it"));
        }
        let text = std::str::from_utf8(&bytes).map_err(|cause| refuse(&bytes[..cause.valid_up_to()], "not UTF-8 text"))?;
        Self::parse(&name, text, path.parent().unwrap_or(Path::new(".")))
    }

    /// Checks the text of a configuration; `path` names it in messages, relative paths in it start at `base`.
    ///
    /// # Errors
    /// [`ConfigError::Invalid`].
    pub fn parse(path: &str, text: &str, base: &Path) -> Result<Self, ConfigError> {
        // Some editors mark UTF-8 so.
        let source = Source { path, text: text.strip_prefix('\u{feff}').unwrap_or(text) };
        let mut file = source.document()?;
        let allow_untrained = file.boolean("allow_untrained", false)?;
        let allow_degraded = file.boolean("allow_degraded", false)?;
        let table = file.table("transport")?;
        let root_at = table.place("root").unwrap_or(0);
        let transport = transport(table)?;
        let mut looping = file.table("loop")?;
        let limits = limits(file.table("limits")?)?;
        let [gold, green] = ARM_NAMES;
        let models = [arm_models(file.optional_table(gold)?, base)?, arm_models(file.optional_table(green)?, base)?];
        let mut report = file.table("report")?;
        let config = Self {
            allow_untrained,
            allow_degraded,
            transport,
            core: looping.integer("core", 0..=4095)?.map(|core| core as usize),
            priority: looping.integer("priority", 1..=95)?.unwrap_or(80) as i32,
            wait: looping.wait("wait")?.unwrap_or(Wait::Sleep),
            spin_ns: looping.integer("spin_us", 0..=900)?.unwrap_or(400) * 1000,
            keep_warm: looping.boolean("keep_warm", true)?,
            hold_cpu_dma_latency: looping.boolean("hold_cpu_dma_latency", false)?,
            lock_memory: looping.boolean("lock_memory", true)?,
            limits,
            models,
            runtime_dir: base.join(report.path("runtime_dir")?.unwrap_or_else(|| PathBuf::from("/run/ravenpose"))),
            histogram_dir: report.path("histogram_dir")?.map(|dir| base.join(dir)),
            interval_s: report.integer("interval_s", 1..=86_400)?.unwrap_or(60) as u64,
        };
        looping.finish()?;
        report.finish()?;
        file.finish()?;
        if config.wait == Wait::Event {
            Listener::check(&config.transport).map_err(|error| source.error(root_at, error.to_string()))?;
        }
        Ok(config)
    }
}

fn limits(mut table: Table) -> Result<Limits, ConfigError> {
    let default = Limits::default();
    let (stale_at, period_at) = (table.place("stale_us"), table.place("period_us"));
    let period_us = table.integer("period_us", 100..=10_000)?.unwrap_or(1000);
    let limits = Limits {
        period_ns: period_us * 1000,
        stale_ns: table.integer("stale_us", 100..=1_000_000)?.map_or(default.stale_ns, |us| us * 1000),
        budget_ns: table.integer("budget_us", 1..=100_000)?.map_or(default.budget_ns, |us| us * 1000),
        good_cycles: table.integer("good_cycles", 1..=100_000)?.unwrap_or(100) as u32,
        position: Pace {
            recover: table.number("recover_um_per_cycle", 0.01..=1000.0)?.unwrap_or(default.position.recover),
            rate: table.number("rate_um_per_cycle", 0.01..=15_000.0)?.unwrap_or(default.position.rate),
            envelope: table.number("envelope_mm", 0.01..=50.0)?.map_or(default.position.envelope, |mm| mm * 1000.0),
        },
        orientation: Pace {
            recover: table.number("recover_deg_per_cycle", 0.0001..=2.0)?.unwrap_or(default.orientation.recover),
            rate: table.number("rate_deg_per_cycle", 0.0001..=90.0)?.unwrap_or(default.orientation.rate),
            envelope: table.number("envelope_deg", 0.01..=90.0)?.unwrap_or(default.orientation.envelope),
        },
        late_degraded: table.integer("late_degraded", 1..=1000)?.unwrap_or(3) as u32,
        late_fallback: table.integer("late_fallback", 1..=1000)?.unwrap_or(10) as u32,
    };
    if limits.stale_ns <= limits.period_ns {
        let by_default = if stale_at.is_none() { " (the default)" } else { "" };
        let stale_us = limits.stale_ns / 1000;
        let message = format!("limits.stale_us = {stale_us}{by_default} must be longer than limits.period_us = {period_us}");
        return Err(table.source.error(stale_at.or(period_at).unwrap_or(0), message));
    }
    table.finish()?;
    Ok(limits)
}

fn transport(mut table: Table) -> Result<Settings, ConfigError> {
    let root_at = table.place("root");
    let mut settings = Settings::default();
    let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let prefix = |text: &str| (1..=32).contains(&text.len()) && text.chars().all(good);
    if let Some(prefix) = table.text("prefix", "1 to 32 letters, digits, '_' or '-'", prefix)? {
        settings.prefix = prefix;
    }
    let root = |text: &str| text.starts_with('/') && text.len() <= 100 && !text.contains(char::is_control);
    if let Some(root) = table.text("root", "an absolute path of at most 100 bytes", root)? {
        settings.root = if root.ends_with('/') { root } else { root + "/" };
    }
    settings.check().map_err(|error| table.source.error(root_at.unwrap_or(0), error.to_string()))?;
    table.finish()?;
    Ok(settings)
}

fn arm_models(table: Option<Table>, base: &Path) -> Result<Option<ArmSources>, ConfigError> {
    let Some(mut table) = table else { return Ok(None) };
    let orientation = table.optional_table("orientation")?;
    let position = model(table, base, Quantity::Position)?;
    let orientation = orientation.map(|table| model(table, base, Quantity::Orientation)).transpose()?;
    Ok(Some(ArmSources { position, orientation }))
}

fn model(mut table: Table, base: &Path, quantity: Quantity) -> Result<ModelSource, ConfigError> {
    let path = table.path("model")?;
    let hash = |text: &str| text.len() == 64 && text.chars().all(|c| c.is_ascii_hexdigit());
    let sha256 = table.text("sha256", "64 hexadecimal digits, as `sha256sum MODEL.onnx` prints", hash)?;
    let weights = table.weights("weights")?;
    let weights_deviation = table.number(quantity.deviation_key(), 0.001..=1000.0)?.unwrap_or(WEIGHTS_DEVIATION);
    let (source, name, start) = (table.source, table.name.clone(), table.start);
    table.finish()?;
    match path {
        Some(path) => {
            let sha256 = sha256.map(|hash| hash.to_ascii_lowercase());
            Ok(ModelSource { path: base.join(path), sha256, weights, weights_deviation, quantity })
        }
        None => Err(source.error(start, format!("{name}.model is missing; add model = \"FILE.onnx\" to [{name}]"))),
    }
}

/// The text with its name, for messages that point into it.
#[derive(Clone, Copy)]
struct Source<'a> {
    path: &'a str,
    text: &'a str,
}

impl<'a> Source<'a> {
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

    fn document(self) -> Result<Table<'a>, ConfigError> {
        let entries = DeTable::parse(self.text).map_err(|error| self.syntax(&error))?.into_inner();
        Ok(Table { source: self, name: String::new(), start: 0, entries, taken: Vec::new() })
    }

    fn syntax(&self, error: &toml::de::Error) -> ConfigError {
        let span = error.span().unwrap_or(0..0);
        let start = span.start;
        if error.message() == "duplicate key" {
            let key = one_line(self.text.get(span).unwrap_or_default(), SHOWN_MAX);
            return self.error(start, format!("`{key}` is given twice; keep one"));
        }
        let before = self.text.get(..start).unwrap_or_default();
        let line = self.text[before.rfind('\n').map_or(0, |at| at + 1)..].lines().next().unwrap_or_default().trim();
        let place = if line.is_empty() { String::new() } else { format!(" in `{}`", one_line(line, SHOWN_MAX)) };
        let problem = match error.message() {
            // What toml says of every value that it cannot read.
            vague if vague.starts_with("string values must be quoted") => {
                "the value is missing, followed by something else, or text without quotes".to_owned()
            }
            exact => one_line(exact, 2 * SHOWN_MAX),
        };
        self.error(start, format!("not TOML{place}: {problem}; write key = value, text in double quotes, tables as [name]"))
    }
}

/// A table of the file. Each key is taken once; what is left at the end is unknown.
struct Table<'a> {
    source: Source<'a>,
    /// Empty for the file itself.
    name: String,
    start: usize,
    entries: DeTable<'a>,
    taken: Vec<&'static str>,
}

impl<'a> Table<'a> {
    fn place(&self, key: &str) -> Option<usize> {
        self.entries.get(key).map(|value| value.span().start)
    }

    /// Takes a key's value and reads it; `read` gives `None` for whatever is not `wanted`.
    fn take<T>(
        &mut self,
        key: &'static str,
        wanted: &str,
        read: impl FnOnce(&DeValue<'a>) -> Option<T>,
    ) -> Result<Option<T>, ConfigError> {
        self.taken.push(key);
        let Some(value) = self.entries.remove(key) else { return Ok(None) };
        read(value.get_ref()).map(Some).ok_or_else(|| self.refuse(key, &value, wanted))
    }

    fn refuse(&self, key: &str, value: &Spanned<DeValue>, wanted: &str) -> ConfigError {
        let found = match value.get_ref() {
            DeValue::Table(_) => " is a table and".to_owned(),
            DeValue::Array(_) => " is a list and".to_owned(),
            _ => format!(" = {}", one_line(self.source.text.get(value.span()).unwrap_or_default(), SHOWN_MAX)),
        };
        self.source.error(value.span().start, format!("{}{found} must be {wanted}", self.full_name(key)))
    }

    fn integer(&mut self, key: &'static str, allowed: RangeInclusive<i64>) -> Result<Option<i64>, ConfigError> {
        let wanted = format!("a whole number from {} to {}", allowed.start(), allowed.end());
        self.take(key, &wanted, |value| whole(value).filter(|number| allowed.contains(number)))
    }

    fn number(&mut self, key: &'static str, allowed: RangeInclusive<f64>) -> Result<Option<f64>, ConfigError> {
        let wanted = format!("a number from {} to {}", allowed.start(), allowed.end());
        self.take(key, &wanted, |value| {
            let number = match value {
                DeValue::Float(float) => float.as_str().parse().ok(),
                _ => whole(value).map(|number| number as f64),
            };
            number.filter(|number| allowed.contains(number))
        })
    }

    fn boolean(&mut self, key: &'static str, default: bool) -> Result<bool, ConfigError> {
        Ok(self.take(key, "true or false, without quotes", DeValue::as_bool)?.unwrap_or(default))
    }

    fn text(&mut self, key: &'static str, wanted: &str, good: impl Fn(&str) -> bool) -> Result<Option<String>, ConfigError> {
        let wanted = format!("{wanted}, in quotes");
        self.take(key, &wanted, |value| value.as_str().filter(|text| good(text)).map(str::to_owned))
    }

    fn path(&mut self, key: &'static str) -> Result<Option<PathBuf>, ConfigError> {
        let good = |text: &str| !text.is_empty() && !text.contains(char::is_control);
        Ok(self.text(key, "a path without control characters", good)?.map(PathBuf::from))
    }

    /// `None` is the free choice, stated or not.
    fn weights(&mut self, key: &'static str) -> Result<Option<Format>, ConfigError> {
        let format = |text: &str| if text == "auto" { Some(None) } else { text.parse().ok().map(Some) };
        let wanted = "\"auto\", \"f32\", \"f16\", \"bf16\", \"i16\", \"i12\" or \"i8\"";
        Ok(self.take(key, wanted, |value| value.as_str().and_then(format))?.flatten())
    }

    fn wait(&mut self, key: &'static str) -> Result<Option<Wait>, ConfigError> {
        const WAITS: [(&str, Wait); 3] = [("spin", Wait::Spin), ("sleep", Wait::Sleep), ("event", Wait::Event)];
        self.take(key, "\"spin\", \"sleep\" or \"event\"", |value| {
            WAITS.iter().find(|(name, _)| value.as_str() == Some(name)).map(|(_, wait)| *wait)
        })
    }

    fn optional_table(&mut self, key: &'static str) -> Result<Option<Self>, ConfigError> {
        let (source, start) = (self.source, self.place(key).unwrap_or(0));
        let name = self.full_name(key);
        let entries = self.take(key, &format!("a table, written [{name}] once"), |value| value.as_table().cloned())?;
        Ok(entries.map(|entries| Self { source, name, start, entries, taken: Vec::new() }))
    }

    /// `limits.stale_us`.
    fn full_name(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// The table, or an empty one.
    fn table(&mut self, key: &'static str) -> Result<Self, ConfigError> {
        let (source, name) = (self.source, self.full_name(key));
        let empty = || Self { source, name, start: 0, entries: DeTable::new(), taken: Vec::new() };
        Ok(self.optional_table(key)?.unwrap_or_else(empty))
    }

    fn finish(self) -> Result<(), ConfigError> {
        let Some(unknown) = self.entries.keys().min_by_key(|key| key.span().start) else { return Ok(()) };
        let key = unknown.get_ref();
        let hint = nearest(key, &self.taken).map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default();
        let place = if self.name.is_empty() { String::new() } else { format!(" in [{}]", self.name) };
        let message = format!("unknown key `{}`{place}{hint}; allowed here: {}", one_line(key, SHOWN_MAX), self.taken.join(", "));
        Err(self.source.error(unknown.span().start, message))
    }
}

fn whole(value: &DeValue) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

/// Reads a regular file of bounded size. Never blocks: opening a FIFO would otherwise wait for a writer.
pub(crate) fn read_regular(path: &Path, size_max: u64) -> Result<Vec<u8>, String> {
    let words = |cause: std::io::Error| cause.to_string();
    let file = std::fs::OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path).map_err(words)?;
    let metadata = file.metadata().map_err(words)?;
    if !metadata.is_file() {
        return Err("not a regular file".to_owned());
    }
    if metadata.len() > size_max {
        return Err(format!("{} bytes, more than the {size_max} allowed", metadata.len()));
    }
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    // The file may grow while it is read: never take more than was allowed.
    let read = file.take(size_max).read_to_end(&mut bytes).map_err(words)?;
    if read as u64 != metadata.len() {
        return Err("the file changed while it was read; try again".to_owned());
    }
    Ok(bytes)
}

/// A path as messages show it.
pub(crate) fn shown_path(path: &Path) -> String {
    one_line(&path.display().to_string(), 4096)
}

/// Foreign text made fit for one line of a log: whatever could end the line, move the cursor or reverse the text is escaped.
pub(crate) fn one_line(raw: &str, chars_max: usize) -> String {
    let mut line = String::new();
    for (count, c) in raw.chars().enumerate() {
        if count == chars_max {
            line.push('…');
            break;
        }
        if matches!(c, '"' | '\'' | '\\') { line.push(c) } else { line.extend(c.escape_debug()) }
    }
    line
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
