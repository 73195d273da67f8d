//! Trajectories: inputs and labels at the moments of a truth, one trajectory per recording.

pub mod memory;
mod noise;
mod raven;
mod sketch;
mod table;

use crate::error::{TrainingError, hex};
use crate::random::Random;
use arm::Side;
use ravenpose::correction::Quantity;
use ravenpose::memory::Play;
use ravenpose_wire::FEATURES;
use sha2::{Digest, Sha256};
use std::ops::Range;
use std::path::PathBuf;

pub use noise::add_noise;
pub use sketch::Sketch;
pub use table::Columns;

/// One whole run. Rows are moments with truth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Name of its file.
    pub name: String,
    /// Time of each row, s.
    pub time_s: Vec<f64>,
    /// Row-major, [`DataSet::inputs`] numbers per row, units as in the file. A RAVEN-II's 118 features come first, the places of a memory
    /// next, the friction last.
    pub inputs: Vec<f32>,
    /// Row-major, [`DataSet::outputs`] numbers per row: what a model is to give, as the truth says (mm for a RAVEN-II).
    pub labels: Vec<f32>,
    /// The same without the noise that was added; equal to `labels` where none was.
    pub exact: Vec<f32>,
    /// Row-major, as many numbers per row as a memory adds: what those would be had it begun a few seconds before.
    pub young_places: Vec<f32>,
    /// Per row: how long before that memory began, s; NaN where it has settled since.
    pub unsettled_s: Vec<f64>,
    /// Standard deviation in 3D of the noise that was added to `labels`, in their unit; 0 where none was.
    pub noise: f64,
    /// Does the recording say that its truth was measured, not simulated?
    pub is_measured: bool,
    /// Number of the arm's board (`type` of its states); 0 where the file does not say.
    pub board: i32,
    /// Of all states, or all rows of a table with truth, read at whatever rate.
    pub sketch: Sketch,
    /// Per row: had the run's own memory yet to settle? Empty where there is none. A pause begins it anew.
    pub is_unsettled: Vec<bool>,
}

impl Trajectory {
    /// What this run is, whatever its rate: a hash of its first row without memory and noise. A RAVEN-II's state is like no other;
    /// the few columns of a table may begin alike, under the same name too, so there its sketch counts as well.
    pub fn id(&self) -> String {
        let width = self.inputs.len() / self.rows().max(1);
        let outputs = self.exact.len() / self.rows().max(1);
        let mut hash = Sha256::new();
        if width < FEATURES {
            hash.update(&self.name);
            hash.update(self.sketch.word());
        }
        for number in self.inputs.iter().take(width.min(FEATURES)).chain(self.exact.iter().take(outputs)) {
            hash.update(number.to_le_bytes());
        }
        hex(&hash.finalize()[..8])
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.time_s.len()
    }

    /// Time that its rows cover, s, without pauses.
    pub fn seconds(&self) -> f64 {
        let mut spacings: Vec<f64> = self.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        spacings.sort_by(f64::total_cmp);
        let median = spacings.get(spacings.len() / 2).copied().unwrap_or(0.0);
        spacings.iter().filter(|spacing| **spacing <= 2.0 * median).sum::<f64>() + median
    }

    /// When the run's own memory had settled first, s from its first row; none if it never did, or there is none.
    pub fn settled_after_s(&self) -> Option<f64> {
        self.is_unsettled.iter().position(|unsettled| !unsettled).map(|row| self.time_s[row])
    }

    /// Had the run's own memory settled by a row? True where there is none.
    pub fn is_settled(&self, row: usize) -> bool {
        self.is_unsettled.get(row).is_none_or(|unsettled| !unsettled)
    }

    /// The rows in which a memory of such an age had not settled, as it had them then; no rows where there is no memory.
    #[must_use]
    pub fn unsettled(&self, age_s: &Range<f64>) -> Self {
        let places = self.young_places.len() / self.rows().max(1);
        let (inputs, outputs) = (self.inputs.len() / self.rows().max(1), self.labels.len() / self.rows().max(1));
        let mut found = Self { name: self.name.clone(), noise: self.noise, ..Self::default() };
        if places == 0 {
            return found;
        }
        for row in (0..self.rows()).filter(|row| age_s.contains(&self.unsettled_s[*row])) {
            found.time_s.push(self.time_s[row]);
            found.inputs.extend_from_slice(&self.inputs[row * inputs..(row + 1) * inputs]);
            let at = found.inputs.len() - inputs + FEATURES;
            found.inputs[at..at + places].copy_from_slice(&self.young_places[row * places..(row + 1) * places]);
            found.labels.extend_from_slice(&self.labels[row * outputs..(row + 1) * outputs]);
            found.exact.extend_from_slice(&self.exact[row * outputs..(row + 1) * outputs]);
        }
        found
    }

    /// Keeps one row in so many, the first of each.
    pub fn thin(&mut self, every: usize) {
        self.keep(|row| row % every.max(1) == 0);
    }

    /// Keeps some rows.
    fn keep(&mut self, wanted: impl Fn(usize) -> bool) {
        let rows = self.rows();
        let old = std::mem::take(&mut self.time_s);
        let kept = || (0..rows).filter(|row| wanted(*row));
        self.time_s = kept().map(|row| old[row]).collect();
        for numbers in [&mut self.inputs, &mut self.labels, &mut self.exact, &mut self.young_places] {
            let width = numbers.len() / rows.max(1);
            *numbers = kept().flat_map(|row| numbers[row * width..(row + 1) * width].to_vec()).collect();
        }
        if !self.unsettled_s.is_empty() {
            self.unsettled_s = kept().map(|row| self.unsettled_s[row]).collect();
        }
        if !self.is_unsettled.is_empty() {
            self.is_unsettled = kept().map(|row| self.is_unsettled[row]).collect();
        }
    }

    /// Gives every so-manieth row the memory that began a few seconds before, so that a network learns what to make of one.
    pub fn make_young(&mut self, every: usize) {
        let places = self.young_places.len() / self.rows().max(1);
        let inputs = self.inputs.len() / self.rows().max(1);
        if places > 0 {
            for row in (0..self.rows()).step_by(every) {
                let at = row * inputs + FEATURES;
                self.inputs[at..at + places].copy_from_slice(&self.young_places[row * places..(row + 1) * places]);
            }
        }
    }
}

/// Recordings as trajectories with the same inputs and outputs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DataSet {
    /// Names of the inputs.
    pub input_names: Vec<String>,
    /// Names of the outputs, with their unit.
    pub output_names: Vec<String>,
    /// Are the inputs `raven118-v1` and the outputs the tip's error?
    pub is_raven: bool,
    /// One per recording, in the order given.
    pub trajectories: Vec<Trajectory>,
    /// What was assumed or left out, in words.
    pub notes: Vec<String>,
}

impl DataSet {
    /// Numbers per row of inputs.
    pub fn inputs(&self) -> usize {
        self.input_names.len()
    }

    /// Numbers per row of labels.
    pub fn outputs(&self) -> usize {
        self.output_names.len()
    }

    /// Unit of the outputs, in words.
    pub fn unit(&self) -> &'static str {
        match self.output_names.first() {
            Some(name) if self.is_raven && name.ends_with("_deg") => "deg",
            _ if self.is_raven => "mm",
            _ => "units of the truth",
        }
    }

    /// Rows of all trajectories.
    pub fn rows(&self) -> usize {
        self.trajectories.iter().map(Trajectory::rows).sum()
    }
}

/// Names of the three outputs of a RAVEN-II's model, with their unit: true minus reported position, or the turn from the reported to the
/// true orientation as a rotation vector, both in frame 0.
const fn outputs_of(target: Quantity) -> [&'static str; 3] {
    match target {
        Quantity::Position => ["error_x_mm", "error_y_mm", "error_z_mm"],
        Quantity::Orientation => ["turn_x_deg", "turn_y_deg", "turn_z_deg"],
    }
}

/// How recordings become trajectories.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// At most so many rows per second of truth.
    pub truth_hz: f64,
    /// Standard deviation in 3D of the noise that is added to the truth, in the labels' unit: for simulated runs, whose truth is exact.
    /// A recording that says that its truth was measured is given none.
    pub truth_noise: f64,
    /// Seed of that noise.
    pub seed: u64,
    /// Memory of the recent motion that is appended to the inputs of a RAVEN-II.
    pub plays: Vec<Play>,
    /// Is the friction of motors 1 to 3 appended behind it, as the observer that is fitted to the training rows sees it?
    pub friction: bool,
    /// Arm of a RAVEN-II.
    pub arm: Side,
    /// What of its tip is learnt.
    pub target: Quantity,
    /// Named columns instead of the state of a RAVEN-II.
    pub columns: Option<Columns>,
}

impl Default for Reading {
    fn default() -> Self {
        Self {
            truth_hz: 30.0,
            truth_noise: 0.0,
            seed: 0,
            plays: Vec::new(),
            friction: false,
            arm: Side::Gold,
            target: Quantity::Position,
            columns: None,
        }
    }
}

impl Reading {
    /// Is friction appended? It stands behind the places of a memory and has no form without one.
    pub fn tells_friction(&self) -> bool {
        self.friction && !self.plays.is_empty()
    }
}

/// Purpose of the stream of random numbers that noise is drawn from.
const NOISE: u64 = 11;

/// Reads recordings, one trajectory each; `seen` hears how many are done.
///
/// # Errors
/// [`TrainingError`] for files that cannot be read, have no truth, contradict their header or hold NaN.
pub fn read(files: &[PathBuf], reading: &Reading, seen: &mut dyn FnMut(usize, usize)) -> Result<DataSet, TrainingError> {
    let mut data = match &reading.columns {
        Some(columns) => table::empty(columns),
        None => raven::empty(reading.target, &reading.plays),
    };
    for (index, file) in files.iter().enumerate() {
        let mut trajectory = match &reading.columns {
            Some(columns) => table::read(file, columns, reading.truth_hz, &mut data.notes)?,
            None => raven::read(file, reading, &mut data.notes)?,
        };
        if reading.truth_noise > 0.0 && trajectory.is_measured {
            data.notes.push(format!("{}: its truth was measured: no noise is added", trajectory.name));
        } else if reading.truth_noise > 0.0 {
            let mut random = Random::new(reading.seed.wrapping_add(index as u64), NOISE);
            add_noise(&mut trajectory, data.output_names.len(), reading.truth_noise, &mut random);
        }
        data.trajectories.push(trajectory);
        seen(index + 1, files.len());
    }
    Ok(data)
}
