//! `[columns]` of a robot file: under which names recordings of other origin hold what tidy CSV has.

use std::collections::BTreeMap;

use recordings::{Column, Recording};
use serde::Deserialize;
use toml::Spanned;

use super::error::{line_of, syntax};
use super::tables::value;
use super::{RobotError, RobotModel};

/// A column of a recording that stands for one of tidy CSV.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedColumn {
    /// Name in tidy CSV, SI: `jpos_1_rad`.
    pub name: String,
    /// Name in the recording.
    pub source: String,
    /// What its values are multiplied by.
    pub scale: f64,
}

impl RobotModel {
    /// A recording with the columns that the robot's file maps, under their own names; those that it has already stay.
    #[must_use]
    pub fn mapped(&self, mut recording: Recording) -> Recording {
        for MappedColumn { name, source, scale } in &self.columns {
            if recording.column(name).is_none()
                && let Some(values) = recording.column(source)
            {
                let values = values.iter().map(|value| value * scale).collect();
                recording.columns.push(Column::new(name.clone(), values));
            }
        }
        recording
    }
}

#[derive(Deserialize)]
struct File {
    #[serde(default)]
    columns: BTreeMap<Spanned<String>, Spanned<Source>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Source {
    Name(String),
    Scaled { column: String, scale: f64 },
}

/// Quantities that may be mapped.
const QUANTITIES: [&str; 8] = ["jpos_d", "jpos", "truth_jpos", "mpos", "jtau", "tau", "dac", "truth"];
/// Units in which they are then.
const UNITS: [&str; 5] = ["rad", "m", "nm", "n", "counts"];

/// Is it `QUANTITY_NUMBER_UNIT` (tip: `truth_AXIS_m`)?
fn known(name: &str) -> bool {
    let Some((head, unit)) = name.rsplit_once('_') else { return false };
    let Some((quantity, index)) = head.rsplit_once('_') else { return false };
    let place = if quantity == "truth" { matches!(index, "x" | "y" | "z") } else { index.parse::<u8>().is_ok_and(|n| n > 0) };
    QUANTITIES.contains(&quantity) && UNITS.contains(&unit) && place
}

pub(super) fn read(text: &str) -> Result<Vec<MappedColumn>, RobotError> {
    let file: File = toml::from_str(text).map_err(|error| syntax(&error, text))?;
    let one = |(key, table): (&Spanned<String>, &Spanned<Source>)| {
        let refuse = |what: &str| value(line_of(text, key.span().start), format!("columns.{}", key.get_ref()), what);
        let (source, scale) = match table.get_ref() {
            Source::Name(name) => (name.clone(), 1.0),
            Source::Scaled { column, scale } => (column.clone(), *scale),
        };
        if !known(key.get_ref()) {
            return Err(refuse("is not a column of tidy CSV in SI units, as jpos_1_rad, truth_jpos_1_m, jtau_1_nm or jtau_1_n"));
        }
        if source.is_empty() || !(scale.is_finite() && scale != 0.0) {
            return Err(refuse("must name a column, or be { column = \"NAME\", scale = NUMBER } with a scale other than 0"));
        }
        Ok(MappedColumn { name: key.get_ref().clone(), source, scale })
    };
    file.columns.iter().map(one).collect()
}
