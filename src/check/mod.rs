//! Is this machine fit for a hard-real-time loop, and what is to be done if not?
//!
//! [`examine`] reads what the kernel shows of itself and gives one [`Finding`] per question, each with the exact remedy. It changes
//! nothing. A file that is absent or unreadable gives `unknown`, never `ok`. [`measure_wakeup`] measures instead of reading.
//! `docs/machine.md` explains every id.
//!
//! All paths start at [`Question::sysroot`], so that the tests can show it machines that we do not have. Findings about limits and
//! ownership hold for the process that asks: run the check as the user of the service.

mod cores;
mod kernel;
mod limits;
mod memory;
#[cfg(test)]
mod tests;
mod wakeup;

pub use wakeup::{Wakeup, WakeupError, measure_wakeup};

use serde::Serialize;
use std::path::{Path, PathBuf};

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// As it should be.
    Ok,
    /// Works, but not as predictably as it could; or nobody knows.
    Warn,
    /// The service refuses to start, or real-time operation is impossible.
    Fail,
}

/// The answer to one question about the machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Stable name, as in `docs/machine.md`.
    pub id: &'static str,
    /// How bad it is.
    pub level: Level,
    /// What was found; one line.
    pub found: String,
    /// What to do; one line. Always present unless all is well.
    pub remedy: Option<String>,
}

/// What is wanted of the machine.
#[derive(Debug, Clone, Copy)]
pub struct Question<'a> {
    /// `/`, or a copy of another machine's files.
    pub sysroot: &'a Path,
    /// Core of the loop (`loop.core`).
    pub core: Option<usize>,
    /// SCHED_FIFO priority of the loop (`loop.priority`).
    pub priority: i32,
    /// Does the loop poll without ever sleeping (`wait = "spin"`)?
    pub spins: bool,
}

/// Examines the machine; the order of the findings is fixed.
pub fn examine(question: &Question) -> Vec<Finding> {
    let tree = Tree { root: question.sysroot };
    vec![
        kernel::preemption(&tree),
        kernel::throttling(&tree, question.spins),
        kernel::clock_source(&tree),
        kernel::virtual_machine(&tree),
        cores::chosen(&tree, question.core),
        cores::isolated(&tree, question.core),
        cores::nohz_full(&tree, question.core),
        cores::governor(&tree, question.core),
        cores::smt(&tree, question.core),
        cores::interrupts(&tree, question.core),
        cores::irqbalance(&tree, question.core),
        cores::idle(&tree, question.core),
        cores::dma_latency(&tree),
        limits::priority(question.priority),
        limits::rtprio(&tree, question.priority),
        limits::memlock(&tree),
        limits::cpu_quota(&tree),
        limits::cpuset(&tree, question.core),
        memory::swap(&tree),
        memory::huge_pages(&tree),
        memory::compaction(&tree),
        memory::shared_memory(&tree),
        memory::transport_root(&tree),
        memory::transport_files(&tree),
    ]
}

/// The worst level among the findings.
pub fn worst(findings: &[Finding]) -> Level {
    findings.iter().map(|finding| finding.level).max().unwrap_or(Level::Ok)
}

impl std::fmt::Display for Level {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Ok => "ok",
            Self::Warn => "warn",
            Self::Fail => "FAIL",
        })
    }
}

/// Two lines at most: what was found, and what to do.
impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:<4}  {:<20}  {}", self.level, self.id, self.found)?;
        match &self.remedy {
            Some(remedy) => write!(f, "\n{:28}-> {remedy}", ""),
            None => Ok(()),
        }
    }
}

impl Finding {
    fn ok(id: &'static str, found: impl Into<String>) -> Self {
        Self { id, level: Level::Ok, found: found.into(), remedy: None }
    }

    fn warn(id: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { id, level: Level::Warn, found: found.into(), remedy: Some(remedy.into()) }
    }

    fn fail(id: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { id, level: Level::Fail, found: found.into(), remedy: Some(remedy.into()) }
    }

    /// Nobody knows: `cause` says why.
    fn unknown(id: &'static str, cause: impl std::fmt::Display, remedy: impl Into<String>) -> Self {
        Self::warn(id, format!("unknown: {cause}"), remedy)
    }
}

/// The files of the machine that is examined.
struct Tree<'a> {
    root: &'a Path,
}

impl Tree<'_> {
    /// `path` starts with a slash.
    fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// The trimmed text of a file, or one line that says why there is none.
    fn read(&self, path: &str) -> Result<String, String> {
        std::fs::read(self.path(path))
            .map(|bytes| String::from_utf8_lossy(&bytes).trim().to_owned())
            .map_err(|cause| format!("{path} cannot be read ({cause})"))
    }

    fn read_cpu_list(&self, path: &str) -> Result<Vec<usize>, String> {
        let text = self.read(path)?;
        cpu_list(&text).ok_or_else(|| format!("{path} holds {text:?}, not a list of cores"))
    }

    /// Names in a directory, sorted.
    fn list(&self, path: &str) -> Result<Vec<String>, String> {
        let entries = std::fs::read_dir(self.path(path)).map_err(|cause| format!("{path} cannot be listed ({cause})"))?;
        let mut names: Vec<String> = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort_unstable();
        Ok(names)
    }

    /// Online cores without `core`, as the kernel writes them; what interrupts and other threads should use.
    fn others(&self, core: usize) -> String {
        let online = self.read_cpu_list("/sys/devices/system/cpu/online").unwrap_or_default();
        let others: Vec<usize> = online.into_iter().filter(|&other| other != core).collect();
        if others.is_empty() { "OTHERS".to_owned() } else { show_cpu_list(&others) }
    }
}

/// Largest core number that is believed.
const CORE_MAX: usize = 65_535;

/// Parses `0-3,5`, the empty list and the kernel's `(null)`.
fn cpu_list(text: &str) -> Option<Vec<usize>> {
    if matches!(text.trim(), "" | "(null)") {
        return Some(Vec::new());
    }
    let mut cores = Vec::new();
    for part in text.trim().split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
        if first > last || last > CORE_MAX {
            return None;
        }
        cores.extend(first..=last);
    }
    Some(cores)
}

/// The opposite of [`cpu_list`], for a sorted list.
fn show_cpu_list(cores: &[usize]) -> String {
    cores
        .chunk_by(|a, b| a + 1 == *b)
        .map(|run| match run {
            [first, .., last] => format!("{first}-{last}"),
            [only] => only.to_string(),
            [] => String::new(),
        })
        .collect::<Vec<_>>()
        .join(",")
}
