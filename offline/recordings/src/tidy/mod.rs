//! Full states as a tidy table (contracts.md): `t_s` since the first state, motors, torques, commands, joints and tip in the
//! units of the table, truth where there is any. The inverse of [`crate::states`].
//!
//! Torque is divided by the gear, so it is that of the motor shaft. Numbers that a state has as float32 are written with the
//! ten or eleven digits that give the same float32 back when they are turned into its unit again. A truth stands in the row
//! nearest to it in time, if one lies within 20 ms; where it is off that row, `truth_offset_s` says by how much.
//!
//! With one arm the columns have the names of contracts.md, with two each begins with `gold_` or `green_`.

mod align;
mod columns;
mod shown;
mod state_table;

pub use shown::Shown;
pub use state_table::StateTable;

use std::path::Path;

use arm::Side;

use crate::open::{self, Opened};
use crate::stream::{Source, StreamError};
use crate::table::{TableColumn, TableSource};
use crate::{Arms, Recording, table};

/// What a state or truth loses in a tidy table.
pub const LOSSES: [&str; 5] = [
    "tidy tables hold joints, motors and tip position: orientation, commanded motors and tip, encoder counts and offsets, jac_*, board numbers, sublevel and packet numbers are dropped",
    "tidy tables hold the time since the first state; the wall clock of the first one is in the metadata (start_unix_ns), sequence numbers, source times and dt are dropped",
    "numbers are converted from degrees to rad (joint 3 to m) with ten digits, enough to give back the same float32",
    "a truth further than 20 ms from every state, or a second one nearest to the same state, is dropped (and counted)",
    "truth in mm may differ from m in the last of 16 digits",
];

/// What the table shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// The arms; none: those that are connected.
    pub arms: Option<Arms>,
    /// Columns for every kind of truth, also where there is none.
    pub all_truth: bool,
    /// Columns of the reported orientation as a unit quaternion, `qw` to `qz`: end-effector axes into frame 0.
    pub orientation: bool,
}

/// A file as a table, whatever its format: a table as it is, states with columns for all that their whole file holds. Files of states
/// are read twice.
///
/// # Errors
/// As [`open::open`].
pub fn open(path: &Path, options: Options) -> Result<Box<dyn TableSource>, StreamError> {
    open_part(path, options, &|states| states)
}

/// The same, of states with columns for all that `part` of them holds.
///
/// # Errors
/// As [`open::open`].
pub fn open_part(
    path: &Path,
    options: Options,
    part: &dyn Fn(Box<dyn Source>) -> Box<dyn Source>,
) -> Result<Box<dyn TableSource>, StreamError> {
    let shown = match open::open(path)? {
        Opened::Table(table) => return Ok(table),
        Opened::States(source) => Shown::in_all_of(part(source).as_mut())?,
    };
    match open::open(path)? {
        Opened::Table(table) => Ok(table),
        Opened::States(source) => Ok(Box::new(StateTable::showing(part(source), &shown, options))),
    }
}

/// Does a table of states show both arms, each under its own name?
pub fn has_both_arms(columns: &[TableColumn]) -> bool {
    Side::ALL
        .iter()
        .all(|side| columns.iter().any(|column| column.name.strip_prefix(side.name()).is_some_and(|rest| rest.starts_with('_'))))
}

/// All states in memory as a recording in SI.
///
/// # Errors
/// [`StreamError`] of the source.
pub fn to_recording(name: &str, source: Box<dyn Source>, options: Options) -> Result<Recording, StreamError> {
    table::collect(name, &mut StateTable::new(source, options)?)
}
