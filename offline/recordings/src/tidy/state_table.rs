//! A stream of states as a table.

use std::collections::VecDeque;

use arm::Side;

use super::Options;
use super::align::{Align, Row};
use super::columns::ArmColumns;
use super::shown::Shown;
use crate::stream::{Channel, Damage, Record, Source, StreamError};
use crate::table::{BATCH_ROWS, Batch, ColumnCells, TableColumn, TableSource};

/// Records that are looked at to decide which columns there are, where the rest is not known yet.
const PEEK: usize = 8192;

/// States as they stream by, row by row.
pub struct StateTable {
    source: Box<dyn Source>,
    peeked: VecDeque<Record>,
    align: Align,
    arms: Vec<ArmColumns>,
    columns: Vec<TableColumn>,
    metadata: Vec<(String, String)>,
    start_ns: Option<i64>,
    ended: bool,
    uncovered: u64,
    row: Vec<f64>,
}

impl StateTable {
    /// Looks at the first 8192 records and decides on the columns: the connected arms, and the truth that is known. For what comes
    /// once only; a file may be looked at from end to end first ([`super::open`]).
    ///
    /// # Errors
    /// [`StreamError`] of the source.
    pub fn new(mut source: Box<dyn Source>, options: Options) -> Result<Self, StreamError> {
        let mut peeked = VecDeque::new();
        while peeked.len() < PEEK {
            match source.next()? {
                Some(record) => peeked.push_back(record),
                None => break,
            }
        }
        let mut shown = Shown::default();
        for record in &peeked {
            shown.include(record.clone());
        }
        Ok(Self::begun(source, peeked, &shown.ended(), options))
    }

    /// With columns for what the source is known to hold.
    pub fn showing(source: Box<dyn Source>, shown: &Shown, options: Options) -> Self {
        Self::begun(source, VecDeque::new(), shown, options)
    }

    fn begun(source: Box<dyn Source>, peeked: VecDeque<Record>, shown: &Shown, options: Options) -> Self {
        let sides = options.arms.map_or_else(|| shown.arms(), |arms| arms.sides().to_vec());
        let of = |side: &Side| shown.truth(*side, options.all_truth);
        let arms: Vec<ArmColumns> = sides.iter().map(|side| ArmColumns::new(*side, of(side), options.orientation)).collect();
        let start_ns = shown.first_state_ns;
        let mut columns = vec![TableColumn::number("t_s")];
        for arm in &arms {
            let prefix = if arms.len() > 1 { format!("{}_", arm.arm.side.name()) } else { String::new() };
            columns.extend(arm.names(&prefix));
        }
        columns.push(TableColumn::number("runlevel"));
        let metadata = metadata(source.as_ref(), &sides, start_ns);
        let row = Vec::with_capacity(columns.len());
        Self { source, peeked, align: Align::default(), arms, columns, metadata, start_ns, ended: false, uncovered: 0, row }
    }

    fn next_row(&mut self) -> Result<Option<Row>, StreamError> {
        while !self.ended {
            let record = match self.peeked.pop_front() {
                Some(record) => Some(record),
                None => self.source.next()?,
            };
            match record {
                Some(record) => {
                    if let Some(row) = self.align.push(record) {
                        return Ok(Some(row));
                    }
                }
                None => self.ended = true,
            }
        }
        Ok(self.align.rest())
    }

    fn put(&mut self, row: &Row, batch: &mut Batch) {
        self.row.clear();
        self.row.push(row.time_ns.saturating_sub(*self.start_ns.get_or_insert(row.time_ns)) as f64 / 1e9);
        for arm in &self.arms {
            let truth = row.truths[arm.arm.side.index()].as_ref();
            self.uncovered += u64::from(
                truth.is_some_and(|truth| !arm.truth.covers(truth) || (!arm.truth.offset && truth.time_ns != row.time_ns)),
            );
            arm.push(&mut self.row, &row.state, row.time_ns, truth);
        }
        self.row.push(f64::from(row.state.runlevel));
        for (cells, value) in batch.columns.iter_mut().zip(&self.row) {
            if let ColumnCells::Numbers(values) = cells {
                values.push(*value);
            }
        }
    }
}

impl TableSource for StateTable {
    fn format(&self) -> &'static str {
        self.source.format()
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    fn columns(&self) -> &[TableColumn] {
        &self.columns
    }

    fn progress(&self) -> (u64, u64) {
        self.source.progress()
    }

    fn next(&mut self, batch: &mut Batch) -> Result<bool, StreamError> {
        batch.clear();
        while batch.rows() < BATCH_ROWS {
            let Some(row) = self.next_row()? else { break };
            self.put(&row, batch);
        }
        Ok(batch.rows() > 0)
    }

    fn damage(&self) -> Option<&Damage> {
        self.source.damage()
    }

    fn findings(&self) -> Vec<String> {
        let mut findings = Vec::new();
        if self.align.dropped > 0 {
            findings.push(format!("{} truth samples had no row of their own within 20 ms and were dropped", self.align.dropped));
        }
        if self.uncovered > 0 {
            findings.push(format!(
                "{} truth samples know more than the first {PEEK} records, by which the columns were chosen: ask for all truth columns",
                self.uncovered
            ));
        }
        findings
    }

    fn channels(&self) -> Vec<Channel> {
        self.source.channels()
    }
}

/// Metadata of the table: each key once, as readers of tidy CSV want it.
fn metadata(source: &dyn Source, sides: &[Side], start_ns: Option<i64>) -> Vec<(String, String)> {
    let mut metadata: Vec<(String, String)> = Vec::new();
    let mut add = |key: &str, value: &str| {
        if metadata.iter().all(|(other, _)| other != key) {
            metadata.push((key.to_owned(), value.to_owned()));
        }
    };
    if let [side] = sides {
        add("arm", side.name());
    }
    if let Some(start_ns) = start_ns {
        add("start_unix_ns", &start_ns.to_string());
    }
    source.metadata().iter().for_each(|(key, value)| add(key, value));
    add("robot", "raven2");
    add("converted_from", source.format());
    metadata
}
