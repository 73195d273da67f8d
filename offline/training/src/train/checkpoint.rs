//! Checkpoints: everything that training needs to go on, written aside and renamed, so that a kill leaves the one before.
//!
//! One line of JSON, then the numbers as little-endian float32: network, best network, both moments.

use super::{Course, Point};
use crate::data::Trajectory;
use crate::error::{TrainingError, hex};
use crate::preset::Recipe;
use crate::random::Random;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::Path;

/// The first line.
#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    identity: String,
    steps: u64,
    seconds: f64,
    random: Random,
    curves: Vec<Point>,
}

const FORMAT: &str = "ravenpose-checkpoint/1";

/// What a run is: its recipe and its data, as a hash.
pub(super) fn identity(recipe: &Recipe, train: &[Trajectory], validation: &[Trajectory]) -> String {
    let mut hash = Sha256::new();
    hash.update(format!("{recipe:?}"));
    for one in train.iter().chain(validation) {
        hash.update(format!("{}:{}", one.name, one.rows()));
        for number in one.inputs.iter().chain(&one.labels) {
            hash.update(number.to_le_bytes());
        }
    }
    hex(&hash.finalize()[..16])
}

/// Writes a checkpoint.
pub(super) fn save(file: &Path, identity: &str, course: &mut Course) -> Result<(), TrainingError> {
    let header = Header {
        format: FORMAT.to_owned(),
        identity: identity.to_owned(),
        steps: course.adam.steps,
        seconds: course.seconds,
        random: course.random.clone(),
        curves: course.curves.clone(),
    };
    let failed =
        |what: String| TrainingError::file(file, format!("cannot be written: {what}"), "free the disk or choose another --out");
    let mut bytes = serde_json::to_vec(&header).map_err(|error| failed(error.to_string()))?;
    bytes.push(b'\n');
    for numbers in slots(course) {
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }
    outputs::write(file, &bytes).map_err(|error| failed(error.to_string()))
}

/// Puts a checkpoint into a course that has begun.
pub(super) fn load(file: &Path, identity: &str, course: &mut Course) -> Result<(), TrainingError> {
    let damaged = |what: &str| TrainingError::file(file, format!("is no checkpoint: {what}"), "remove it to begin anew");
    let bytes = fs::read(file).map_err(|error| damaged(&error.to_string()))?;
    let line = bytes.iter().position(|byte| *byte == b'\n').ok_or_else(|| damaged("it has no header"))?;
    let (header, numbers) = (&bytes[..line], &bytes[line + 1..]);
    let header: Header = serde_json::from_slice(header).map_err(|error| damaged(&error.to_string()))?;
    if header.format != FORMAT || header.identity != identity {
        let what = "other data or another recipe".to_owned();
        return Err(TrainingError::Checkpoint { file: crate::error::shown(file), what });
    }
    let count: usize = slots(course).iter().map(|numbers| numbers.len()).sum();
    if numbers.len() != 4 * count {
        return Err(damaged("it is cut off"));
    }
    let mut stored = numbers.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]));
    for slot in slots(course) {
        slot.iter_mut().zip(&mut stored).for_each(|(to, from)| *to = from);
    }
    (course.adam.steps, course.seconds) = (header.steps, header.seconds);
    (course.random, course.curves) = (header.random, header.curves);
    Ok(())
}

fn slots(course: &mut Course) -> Vec<&mut [f32]> {
    let moments = course.adam.first.iter_mut().chain(&mut course.adam.second).map(Vec::as_mut_slice);
    [course.network.all_numbers(), course.best.all_numbers(), moments.collect()].into_iter().flatten().collect()
}
