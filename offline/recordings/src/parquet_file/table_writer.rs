//! Writing tables.

use std::path::Path;

use parquet::data_type::ByteArray;

use super::TABLE_LAYOUT;
use super::write::{Column, Groups, Values};
use crate::stream::StreamError;
use crate::table::{Batch, ColumnCells, TableColumn, TableSink};

/// A Parquet file of a table being written: DOUBLE or UTF-8 columns under their own names, missing cells null.
pub struct TableWriter {
    groups: Groups,
}

impl TableWriter {
    /// Begins a file with its metadata.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path, columns: &[TableColumn], metadata: &[(String, String)]) -> Result<Self, StreamError> {
        let empty = |column: &TableColumn| if column.text { Values::Text(Vec::new()) } else { Values::F64(Vec::new()) };
        let columns = columns.iter().map(|column| Column::new(column.name.clone(), empty(column))).collect();
        Ok(Self { groups: Groups::create(path, columns, TABLE_LAYOUT, metadata)? })
    }
}

impl TableSink for TableWriter {
    fn write(&mut self, batch: &Batch) -> Result<(), StreamError> {
        for (column, cells) in self.groups.columns.iter_mut().zip(&batch.columns) {
            match (&mut column.values, cells) {
                (Values::F64(values), ColumnCells::Numbers(numbers)) => {
                    values.extend(numbers.iter().filter(|number| !number.is_nan()));
                    for number in numbers {
                        column.cell(!number.is_nan());
                    }
                }
                (Values::Text(values), ColumnCells::Texts(texts)) => {
                    values.extend(texts.iter().filter(|text| !text.is_empty()).map(ByteArray::from));
                    texts.iter().for_each(|text| column.cell(!text.is_empty()));
                }
                // Both were made for the same columns.
                _ => debug_assert!(false, "cells of another kind"),
            }
        }
        // Batches are smaller than row groups: no group grows beyond its bound by more than a batch.
        self.groups.rows_done()
    }

    fn finish(self: Box<Self>) -> Result<(), StreamError> {
        self.groups.finish()
    }
}
