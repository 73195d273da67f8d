//! Any tidy CSV (or Parquet) table with named inputs and truth.

use super::sketch::Windows;
use super::{DataSet, Trajectory};
use crate::error::{TrainingError, shown};
use recordings::csv::{self, CsvProblem};
use recordings::open::{Kind, kind, open_table};
use recordings::{Recording, table};
use std::path::Path;

/// Which columns of a table are what.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Columns {
    /// Inputs, by the names of the file.
    pub inputs: Vec<String>,
    /// Truth, by the names of the file.
    pub truth: Vec<String>,
    /// What is reported of the same quantities: the label is truth - reported. Empty: the label is the truth itself.
    pub reported: Vec<String>,
    /// Play operators on each input, memory of where it came from: half widths in the inputs' units, as read.
    pub plays: Vec<f64>,
}

/// A data set of such tables without trajectories.
pub(super) fn empty(columns: &Columns) -> DataSet {
    let mut input_names = columns.inputs.clone();
    for input in &columns.inputs {
        input_names.extend(columns.plays.iter().map(|width| format!("play({input}, {width})")));
    }
    let output_names = if columns.reported.is_empty() {
        columns.truth.clone()
    } else {
        columns.truth.iter().map(|name| format!("error of {name}")).collect()
    };
    DataSet { input_names, output_names, ..DataSet::default() }
}

/// Reads one table.
pub(super) fn read(file: &Path, columns: &Columns, truth_hz: f64, notes: &mut Vec<String>) -> Result<Trajectory, TrainingError> {
    if !columns.reported.is_empty() && columns.reported.len() != columns.truth.len() {
        return Err(TrainingError::Unfit {
            file: shown(file),
            what: format!("{} reported columns for {} of truth", columns.reported.len(), columns.truth.len()),
            remedy: "name one reported column per column of truth, in the same order, or none",
        });
    }
    let recording = recording(file)?;
    let truth = of_names(file, &recording, &columns.truth, true)?;
    let inputs = of_names(file, &recording, &columns.inputs, false)?;
    let reported = of_names(file, &recording, &columns.reported, false)?;
    let name = file.file_name().map_or_else(|| shown(file), |name| name.to_string_lossy().into_owned());
    let mut found = Trajectory { name, ..Trajectory::default() };
    let (mut next_s, mut before_s) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let mut left_out = 0;
    let mut sketch = Windows::default();
    let mut memories = Memories { widths: &columns.plays, held: Vec::new() };
    for row in 0..recording.rows() {
        let time_s = recording.time_s().map_or(row as f64, |time| time[row]);
        let truth_is_there = truth.iter().all(|column| column[row].is_finite());
        let values: Vec<f64> = inputs.iter().map(|column| column[row]).collect();
        if let Some(bad) = values.iter().position(|value| !(*value as f32).is_finite()) {
            return Err(TrainingError::Unfit {
                file: shown(file),
                what: format!(
                    "{} is empty, not a number or beyond float32 in row {} after the header",
                    columns.inputs[bad],
                    row + 1
                ),
                remedy: "fill or remove the row",
            });
        }
        // A session that begins anew is another one, not a part of the last.
        if time_s < before_s {
            next_s = f64::NEG_INFINITY;
            memories.held.clear();
        }
        before_s = time_s;
        let remembered = memories.next(&values);
        if !truth_is_there {
            left_out += 1;
            continue;
        }
        let labels: Vec<f32> = (0..truth.len())
            .map(|output| (truth[output][row] - reported.get(output).map_or(0.0, |column| column[row])) as f32)
            .collect();
        sketch.add(values.iter().map(|value| *value as f32).chain(labels.iter().copied()));
        if recording.time_s().is_some() && time_s < next_s {
            continue;
        }
        next_s = time_s + 1.0 / truth_hz - 1e-9;
        found.time_s.push(time_s);
        found.inputs.extend(values.iter().chain(&remembered).map(|value| *value as f32));
        found.labels.extend(labels);
    }
    if left_out > 0 {
        notes.push(format!("{}: {left_out} rows without truth left out", shown(file)));
    }
    if found.rows() == 0 {
        return Err(TrainingError::NoTruth { file: shown(file), looked_for: "no row has all columns of truth".to_owned() });
    }
    if let Some(bad) = found.labels.iter().position(|label| !label.is_finite()) {
        return Err(TrainingError::Unfit {
            file: shown(file),
            what: format!("the label of row {} with truth is not a number", bad / columns.truth.len() + 1),
            remedy: "fill or remove the row",
        });
    }
    found.exact.clone_from(&found.labels);
    found.sketch = sketch.finish();
    Ok(found)
}

fn recording(file: &Path) -> Result<Recording, TrainingError> {
    let refused = |error: &dyn std::fmt::Display| TrainingError::Recording(error.to_string());
    if kind(file).map_err(|error| refused(&error))? == Kind::Csv {
        // Strict about units where the file is tidy; tables without a time are read as they are.
        match csv::read_with_gaps(file) {
            Ok(recording) => return Ok(recording),
            Err(error) if matches!(*error.problem, CsvProblem::TimeNotFirst) => {}
            Err(error) => return Err(refused(&error)),
        }
    }
    let mut source = open_table(file).map_err(|error| refused(&error))?;
    let found = table::collect(&file.display().to_string(), source.as_mut()).map_err(|error| refused(&error))?;
    match source.damage() {
        None => Ok(found),
        Some(damage) => Err(TrainingError::Unfit {
            file: shown(file),
            what: format!("{}: {}", damage.place, damage.what),
            remedy: "copy the file again, or cut off what stands behind",
        }),
    }
}

/// Columns by their name in the file or by the SI name that the reader gave them.
fn of_names<'a>(file: &Path, recording: &'a Recording, names: &[String], is_truth: bool) -> Result<Vec<&'a [f64]>, TrainingError> {
    names
        .iter()
        .map(|name| {
            let found = recording.columns.iter().find(|column| column.original == *name || column.name == *name);
            found.map(|column| column.values.as_slice()).ok_or_else(|| {
                if is_truth {
                    return TrainingError::NoTruth { file: shown(file), looked_for: format!("no column {name}") };
                }
                TrainingError::Unfit {
                    file: shown(file),
                    what: format!("has no column {name}"),
                    remedy: "`ravenpose info FILE` lists the columns",
                }
            })
        })
        .collect()
}

/// Play operators on each input: y follows x where x leaves [y - r, y + r].
struct Memories<'a> {
    widths: &'a [f64],
    held: Vec<Vec<f64>>,
}

impl Memories<'_> {
    /// The next row; gives x - y of every play.
    fn next(&mut self, values: &[f64]) -> Vec<f64> {
        if self.held.is_empty() {
            self.held = values.iter().map(|value| vec![*value; self.widths.len()]).collect();
        }
        let mut places = Vec::new();
        for (value, held) in values.iter().zip(&mut self.held) {
            for (width, held) in self.widths.iter().zip(held) {
                *held = held.max(value - width).min(value + width);
                places.push(value - *held);
            }
        }
        places
    }
}
