//! What is in a recording: what `ravenpose info` prints, found in one pass with bounded memory.
//!
//! [`Description`] prints as a table for people (`{}`) and serialises for programs. Shares are of 1. Channels of states have
//! the names and units of the message; joint 3 of jpos, jpos_d and jvel is in m × 57.29578 as published.

mod channel;
mod show;
mod standstill;
mod states;
mod table;
mod timing;

use std::path::Path;

use serde::Serialize;

pub use channel::{Channel, Word};
pub use standstill::Standstill;
pub use timing::{Gap, Timing};

use crate::open::{Opened, open};
use crate::stream::{Damage, Source, StreamError};
use crate::table::TableSource;

/// What is in a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Description {
    /// The file.
    pub file: String,
    /// Name of its format.
    pub format: String,
    /// Its size.
    pub bytes: u64,
    /// `key = value` pairs that it carries or that its reader had to assume.
    pub metadata: Vec<(String, String)>,
    /// Topics of the file with their type and number of messages, where the format has such.
    pub topics: Vec<Topic>,
    /// States or rows, then truth of each arm: how many, and their times.
    pub streams: Vec<Stream>,
    /// Columns or fields.
    pub channels: Vec<Channel>,
    /// Rows that repeat the row before in everything but their time: polled faster than updated.
    pub repeated_rows: u64,
    /// How often the robot stood still.
    pub standstill: Vec<Standstill>,
    /// Amplifier commands at their limits.
    pub saturation: Vec<Saturation>,
    /// Runlevels with their share.
    pub runlevels: Vec<RunlevelShare>,
    /// What is known of the true pose.
    pub truth: Vec<TruthCoverage>,
    /// What else a reader should know, one sentence each.
    pub findings: Vec<String>,
    /// Where the file is damaged; everything above is about what stands before.
    pub damage: Option<DamageAt>,
}

/// A topic of the file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// Type of its messages.
    pub type_name: String,
    /// Messages in the file.
    pub messages: u64,
    /// Do states or truth come from it?
    pub is_read: bool,
}

/// One of the streams of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stream {
    /// `states`, `rows`, `truth gold`, `truth green`.
    pub name: String,
    /// How many records.
    pub count: u64,
    /// Its times; none where it has none.
    pub timing: Option<Timing>,
}

/// An amplifier command at its limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Saturation {
    /// Channel.
    pub channel: String,
    /// RAVEN's limit, counts (raven2-plant.toml, `dac_limit`).
    pub limit_counts: u32,
    /// Share of rows at or beyond the limit.
    pub share: f64,
    /// Share of rows at the largest or smallest value that occurs, which tells another limit.
    pub at_extreme_share: f64,
}

/// How often a runlevel occurs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunlevelShare {
    /// 0 e-stop, 1 initialising, 2 pedal up, 3 pedal down; none: all that come after the first 32 different ones.
    pub runlevel: Option<i64>,
    /// Share of rows.
    pub share: f64,
}

/// What is known of the true pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TruthCoverage {
    /// The arm; empty for a table.
    pub arm: String,
    /// Samples per state, or share of rows, with a position.
    pub position_share: f64,
    /// The same with a rotation.
    pub rotation_share: f64,
    /// The same with a joint.
    pub joints_share: f64,
}

/// Where a file is damaged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DamageAt {
    /// `byte N` or `line N`.
    pub place: String,
    /// What is wrong there.
    pub what: String,
}

impl From<&Damage> for DamageAt {
    fn from(damage: &Damage) -> Self {
        Self { place: damage.place.to_string(), what: damage.what.clone() }
    }
}

/// Describes a recording of any format; `progress` hears bytes so far and in all.
///
/// # Errors
/// [`StreamError`] for what [`open`] refuses and for a disk that fails.
pub fn describe(path: &Path, progress: &mut dyn FnMut(u64, u64)) -> Result<Description, StreamError> {
    let name = path.display().to_string();
    let mut description = match open(path)? {
        Opened::States(mut source) => of_states(&name, source.as_mut(), progress)?,
        Opened::Table(mut source) => of_table(&name, source.as_mut(), progress)?,
    };
    description.bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    Ok(description)
}

/// Describes a stream of states; `name` stands for the file.
///
/// # Errors
/// [`StreamError`] of the source.
pub fn of_states(name: &str, source: &mut dyn Source, progress: &mut dyn FnMut(u64, u64)) -> Result<Description, StreamError> {
    states::describe(name, source, progress)
}

/// Describes a table; `name` stands for the file.
///
/// # Errors
/// [`StreamError`] of the source.
pub fn of_table(name: &str, source: &mut dyn TableSource, progress: &mut dyn FnMut(u64, u64)) -> Result<Description, StreamError> {
    table::describe(name, source, progress)
}

/// `part` of `all`, 0 of nothing.
fn share(part: u64, all: u64) -> f64 {
    if all == 0 { 0.0 } else { part as f64 / all as f64 }
}

/// Rows per runlevel, bounded.
#[derive(Default)]
struct Runlevels {
    counts: std::collections::BTreeMap<i64, u64>,
    others: u64,
}

impl Runlevels {
    const DIFFERENT_MAX: usize = 32;

    fn see(&mut self, runlevel: i64) {
        let has_room = self.counts.len() < Self::DIFFERENT_MAX;
        match self.counts.get_mut(&runlevel) {
            Some(count) => *count += 1,
            None if has_room => {
                self.counts.insert(runlevel, 1);
            }
            None => self.others += 1,
        }
    }

    fn shares(&self, rows: u64) -> Vec<RunlevelShare> {
        let known = self.counts.iter().map(|(runlevel, count)| (Some(*runlevel), *count));
        let others = (self.others > 0).then_some((None, self.others));
        known.chain(others).map(|(runlevel, count)| RunlevelShare { runlevel, share: share(count, rows) }).collect()
    }
}
