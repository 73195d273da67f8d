//! Writing full states.

use std::path::Path;

use arm::Side;
use ravenpose_wire::RavenState;

use super::STATES_LAYOUT;
use super::state_columns::{self, TRUTH_NUMBERS};
use super::write::{Column, Groups, Values};
use crate::fields::{self, MESSAGE};
use crate::stream::{Record, Sink, StreamError, Truth};

/// Rows that are taken apart together, column by column: one at a time, each would touch some 300 columns' ends.
const ROWS: usize = 64;

/// What stands in one row.
#[derive(Default)]
struct Row {
    state: Option<Box<RavenState>>,
    truths: [Option<Truth>; 2],
}

impl Row {
    fn is_empty(&self) -> bool {
        self.state.is_none() && self.truths == [None, None]
    }
}

/// A Parquet file of full states being written.
pub struct StateWriter {
    groups: Groups,
    /// The row that may still get truth.
    row: Row,
    /// Those that are complete.
    rows: Vec<Row>,
}

impl StateWriter {
    /// Begins a file with its metadata.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path, metadata: &[(String, String)]) -> Result<Self, StreamError> {
        let groups = Groups::create(path, state_columns::columns(), STATES_LAYOUT, metadata)?;
        Ok(Self { groups, row: Row::default(), rows: Vec::with_capacity(ROWS) })
    }

    /// The row at hand is complete.
    fn row_done(&mut self) -> Result<(), StreamError> {
        let row = std::mem::take(&mut self.row);
        if !row.is_empty() {
            self.rows.push(row);
        }
        if self.rows.len() >= ROWS { self.take_apart() } else { Ok(()) }
    }

    fn take_apart(&mut self) -> Result<(), StreamError> {
        let (of_state, of_truth) = self.groups.columns.split_at_mut(state_columns::HEADER.len() + message_numbers());
        push_states(of_state, &self.rows);
        for (columns, side) in of_truth.chunks_mut(1 + TRUTH_NUMBERS).zip(Side::ALL) {
            for row in &self.rows {
                push_truth(columns, row.truths[side.index()].as_ref());
            }
        }
        self.rows.clear();
        self.groups.rows_done()
    }
}

impl Sink for StateWriter {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        match record {
            Record::State(state) => {
                self.row_done()?;
                self.row.state = Some(state.clone());
            }
            Record::Truth(truth) => {
                if self.row.truths[truth.side.index()].is_some() {
                    self.row_done()?;
                }
                self.row.truths[truth.side.index()] = Some(*truth);
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), StreamError> {
        self.row_done()?;
        self.take_apart()?;
        self.groups.finish()
    }
}

fn message_numbers() -> usize {
    MESSAGE.iter().map(|field| field.count()).sum()
}

/// Appends the states' cells; empty ones for a row that holds truth only.
fn push_states(columns: &mut [Column], rows: &[Row]) {
    for column in &mut *columns {
        for row in rows {
            column.cell(row.state.is_some());
        }
    }
    let (header, mut message) = columns.split_at_mut(state_columns::HEADER.len());
    let states = || rows.iter().filter_map(|row| row.state.as_deref());
    for state in states() {
        for (column, value) in header.iter_mut().zip(state_columns::header(state)) {
            if let Values::I64(values) = &mut column.values {
                values.push(value);
            }
        }
    }
    for field in MESSAGE {
        let (of_field, rest) = message.split_at_mut(field.count());
        message = rest;
        for state in states() {
            match (field.get)(state) {
                fields::Values::Int(numbers) => {
                    for (number, column) in numbers.iter().zip(&mut *of_field) {
                        if let Values::I32(values) = &mut column.values {
                            values.push(*number);
                        }
                    }
                }
                fields::Values::Float(numbers) => {
                    for (number, column) in numbers.iter().zip(&mut *of_field) {
                        if let Values::F32(values) = &mut column.values {
                            values.push(*number);
                        }
                    }
                }
            }
        }
    }
}

/// Appends a truth's cells; what is not known is empty.
fn push_truth(columns: &mut [Column], truth: Option<&Truth>) {
    let Some((time, numbers)) = columns.split_first_mut() else { return };
    time.cell(truth.is_some());
    let Some(truth) = truth else {
        for column in numbers {
            column.cell(false);
        }
        return;
    };
    if let Values::I64(values) = &mut time.values {
        values.push(truth.time_ns);
    }
    for (column, number) in numbers.iter_mut().zip(state_columns::truth_numbers(truth)) {
        column.cell(!number.is_nan());
        if let Values::F64(values) = &mut column.values
            && !number.is_nan()
        {
            values.push(number);
        }
    }
}
