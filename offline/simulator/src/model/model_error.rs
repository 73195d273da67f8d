//! `[model_error]` of a robot file: how far a model is off what it was learnt from.

use serde::Deserialize;
use toml::Spanned;

use super::RobotError;
use super::error::{line_of, syntax};
use super::tables::{not_negative, value};

/// RMS of what a model leaves of the simulation that it was learnt from; empty where that is not known. What a comparison with
/// this model shows below it may be the model's own error.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelError {
    /// Torque at each joint, N·m or N.
    #[serde(default)]
    pub torque: Vec<f64>,
    /// Motor minus joint position of each joint, rad or m.
    #[serde(default)]
    pub deflection: Vec<f64>,
    /// Tip along x, y and z, m.
    #[serde(default)]
    pub tip_m: Vec<f64>,
}

#[derive(Deserialize)]
struct File {
    model_error: Option<Spanned<ModelError>>,
}

impl ModelError {
    /// Lists by their keys, and how many numbers each has for a robot with so many joints.
    fn lists(&self, joints: usize) -> [(&'static str, &[f64], usize); 3] {
        [("torque", &self.torque, joints), ("deflection", &self.deflection, joints), ("tip_m", &self.tip_m, 3)]
    }

    /// Lists that hold something, by their keys.
    pub(super) fn known(&self) -> impl Iterator<Item = (&'static str, &[f64])> {
        self.lists(0).into_iter().filter(|(_, list, _)| !list.is_empty()).map(|(key, list, _)| (key, list))
    }
}

pub(super) fn read(text: &str, joints: usize) -> Result<ModelError, RobotError> {
    let file: File = toml::from_str(text).map_err(|error| syntax(&error, text))?;
    let Some(found) = file.model_error else { return Ok(ModelError::default()) };
    for (key, list, count) in found.get_ref().lists(joints) {
        if !list.is_empty() && (list.len() != count || !not_negative(list)) {
            let what = format!("must hold {count} numbers of 0 or more");
            return Err(value(line_of(text, found.span().start), format!("model_error.{key}"), what));
        }
    }
    Ok(found.into_inner())
}
