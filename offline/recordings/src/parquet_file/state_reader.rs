//! Reading full states.

use std::collections::VecDeque;
use std::path::Path;

use arm::Side;
use ravenpose_wire::RavenState;

use super::STATES_LAYOUT;
use super::read::{CellValues, Cells, Groups};
use super::state_columns::{self, HEADER, TRUTH_NUMBERS};
use super::store::Store;
use super::write::Values;
use crate::fields::{self, MESSAGE};
use crate::file::refusal;
use crate::stream::{Damage, Record, Source, StreamError, Truth};

/// Rows decoded at a time: their states fit the processor's second cache.
const BATCH_ROWS: usize = 512;

/// A Parquet file of full states being read.
pub struct StateReader {
    groups: Groups,
    records: VecDeque<Record>,
}

impl StateReader {
    /// Opens a file; none if it is a Parquet file of something else.
    ///
    /// # Errors
    /// [`StreamError`] if it cannot be opened or is damaged beyond reading.
    pub fn open(path: &Path) -> Result<Option<Self>, StreamError> {
        Self::new(path, Store::open(path)?)
    }

    /// The same from memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`StateReader::open`].
    pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<Option<Self>, StreamError> {
        Self::new(name, Store::memory(bytes))
    }

    fn new(path: &Path, store: Store) -> Result<Option<Self>, StreamError> {
        let groups = Groups::open(path, store)?;
        if groups.layout.as_deref() != Some(STATES_LAYOUT) {
            return Ok(None);
        }
        check_columns(&groups)?;
        Ok(Some(Self { groups, records: VecDeque::new() }))
    }

    fn fill(&mut self) {
        let rows = self.groups.next(BATCH_ROWS);
        if rows == 0 {
            return;
        }
        let cells = &self.groups.cells;
        let Some(time) = cells.first() else { return };
        let has_state: Vec<bool> = time.present(rows).collect();
        let states = states(cells, rows);
        let (of_truth, start) = (1 + TRUTH_NUMBERS, HEADER.len() + MESSAGE.iter().map(|field| field.count()).sum::<usize>());
        let gold = truths(&cells[start..start + of_truth], Side::Gold, rows);
        let green = truths(&cells[start + of_truth..], Side::Green, rows);
        for ((state, has_state), truths) in states.into_iter().zip(has_state).zip(gold.into_iter().zip(green)) {
            if has_state {
                self.records.push_back(Record::State(Box::new(state)));
            }
            self.records.extend([truths.0, truths.1].into_iter().flatten().map(Record::Truth));
        }
    }
}

impl Source for StateReader {
    fn format(&self) -> &'static str {
        "Parquet of states"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.groups.metadata
    }

    fn progress(&self) -> (u64, u64) {
        self.groups.progress()
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        if self.records.is_empty() {
            self.fill();
        }
        Ok(self.records.pop_front())
    }

    fn damage(&self) -> Option<&Damage> {
        self.groups.damage()
    }
}

/// Every column must be there, in its place and of its type: the layout says so.
fn check_columns(groups: &Groups) -> Result<(), StreamError> {
    let expected = state_columns::columns();
    let same = expected.len() == groups.names.len()
        && expected.iter().zip(&groups.names).zip(&groups.cells).all(|((column, name), cells)| {
            let types = matches!(
                (&column.values, &cells.values),
                (Values::I32(_), CellValues::I32(_))
                    | (Values::I64(_), CellValues::I64(_))
                    | (Values::F32(_), CellValues::F32(_))
                    | (Values::F64(_), CellValues::F64(_))
            );
            column.name == *name && types
        });
    if same {
        return Ok(());
    }
    let what = format!("says that it holds {STATES_LAYOUT} but has other columns");
    Err(refusal(groups.path(), None, what, "write it again with this release"))
}

/// The states of a batch; rows without a state are zero.
fn states(cells: &[Cells], rows: usize) -> Vec<RavenState> {
    let mut states = vec![RavenState::new(); rows];
    for (place, column) in cells[..HEADER.len()].iter().enumerate() {
        if let CellValues::I64(values) = &column.values {
            for (row, value) in column.rows_with_value(rows).zip(values) {
                state_columns::set_header(&mut states[row], place, *value);
            }
        }
    }
    let mut columns = cells[HEADER.len()..].iter();
    for field in MESSAGE {
        for (place, column) in (0..field.count()).zip(&mut columns) {
            put_place(&mut states, column, rows, field.get_mut, place);
        }
    }
    states
}

fn put_place(
    states: &mut [RavenState],
    column: &Cells,
    rows: usize,
    get_mut: for<'a> fn(&'a mut RavenState) -> fields::ValuesMut<'a>,
    place: usize,
) {
    match &column.values {
        CellValues::I32(values) => {
            for (row, value) in column.rows_with_value(rows).zip(values) {
                if let fields::ValuesMut::Int(numbers) = get_mut(&mut states[row]) {
                    numbers[place] = *value;
                }
            }
        }
        CellValues::F32(values) => {
            for (row, value) in column.rows_with_value(rows).zip(values) {
                if let fields::ValuesMut::Float(numbers) = get_mut(&mut states[row]) {
                    numbers[place] = *value;
                }
            }
        }
        _ => {}
    }
}

/// The truths of a batch, one per row or none.
fn truths(cells: &[Cells], side: Side, rows: usize) -> Vec<Option<Truth>> {
    let mut truths = vec![None; rows];
    let Some((time, numbers)) = cells.split_first() else { return truths };
    if let CellValues::I64(values) = &time.values {
        for (row, time_ns) in time.rows_with_value(rows).zip(values) {
            truths[row] = Some(Truth::unknown(*time_ns, side));
        }
    }
    for (place, column) in numbers[..TRUTH_NUMBERS].iter().enumerate() {
        if let CellValues::F64(values) = &column.values {
            for (row, value) in column.rows_with_value(rows).zip(values) {
                if let Some(truth) = &mut truths[row] {
                    state_columns::set_truth(truth, place, *value);
                }
            }
        }
    }
    truths
}
