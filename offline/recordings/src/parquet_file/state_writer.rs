//! Writing full states.

use std::path::Path;

use arm::Side;
use ravenpose_wire::RavenState;

use super::STATES_LAYOUT;
use super::state_columns::{self, TRUTH_NUMBERS};
use super::write::{Column, Groups, Values};
use crate::fields::{self, MESSAGE};
use crate::stream::{Record, Sink, StreamError, Truth};

/// A Parquet file of full states being written.
pub struct StateWriter {
    groups: Groups,
    /// The row that may still get truth.
    state: Option<Box<RavenState>>,
    truths: [Option<Truth>; 2],
}

impl StateWriter {
    /// Begins a file with its metadata.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path, metadata: &[(String, String)]) -> Result<Self, StreamError> {
        let groups = Groups::create(path, state_columns::columns(), STATES_LAYOUT, metadata)?;
        Ok(Self { groups, state: None, truths: [None, None] })
    }

    fn row(&mut self) -> Result<(), StreamError> {
        if self.state.is_none() && self.truths == [None, None] {
            return Ok(());
        }
        let state = self.state.take();
        let (of_state, of_truth) = self.groups.columns.split_at_mut(state_columns::HEADER.len() + message_numbers());
        push_state(of_state, state.as_deref());
        for (columns, side) in of_truth.chunks_mut(1 + TRUTH_NUMBERS).zip(Side::ALL) {
            push_truth(columns, self.truths[side.index()].take().as_ref());
        }
        self.groups.row_done()
    }
}

impl Sink for StateWriter {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        match record {
            Record::State(state) => {
                self.row()?;
                self.state = Some(state.clone());
            }
            Record::Truth(truth) => {
                if self.truths[truth.side.index()].is_some() {
                    self.row()?;
                }
                self.truths[truth.side.index()] = Some(*truth);
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), StreamError> {
        self.row()?;
        self.groups.finish()
    }
}

fn message_numbers() -> usize {
    MESSAGE.iter().map(|field| field.count()).sum()
}

/// Appends a state's cells; empty ones for a row that holds truth only.
fn push_state(columns: &mut [Column], state: Option<&RavenState>) {
    for column in &mut *columns {
        column.cell(state.is_some());
    }
    let Some(state) = state else { return };
    let (header, message) = columns.split_at_mut(state_columns::HEADER.len());
    for (column, value) in header.iter_mut().zip(state_columns::header(state)) {
        if let Values::I64(values) = &mut column.values {
            values.push(value);
        }
    }
    let mut columns = message.iter_mut().map(|column| &mut column.values);
    for field in MESSAGE {
        match (field.get)(state) {
            fields::Values::Int(numbers) => {
                for (number, column) in numbers.iter().zip(&mut columns) {
                    if let Values::I32(values) = column {
                        values.push(*number);
                    }
                }
            }
            fields::Values::Float(numbers) => {
                for (number, column) in numbers.iter().zip(&mut columns) {
                    if let Values::F32(values) = column {
                        values.push(*number);
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
