//! The two streams as they come in, and what must hold of them.

use nalgebra::Vector3;

use super::PairError;
use super::track::{Frame, Track};
use crate::Recording;

/// What the arm reported: columns of equal length, one value per state, borrowed from wherever they are.
#[derive(Debug, Clone, Copy)]
pub struct Reported<'a> {
    /// Time on the state's clock, s, rising.
    pub t_s: &'a [f64],
    /// Tip position x, y, z in frame 0, m; NaN where unknown.
    pub position_m: [&'a [f64]; 3],
    /// Tip orientation as a unit quaternion w, x, y, z: end-effector axes into frame 0.
    pub quaternion: Option<[&'a [f64]; 4]>,
    /// Runlevel of the control software.
    pub runlevel: Option<&'a [f64]>,
}

/// What the cameras saw: one entry per frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Truth {
    /// Time on the truth's clock, s, rising.
    pub t_s: Vec<f64>,
    /// Tip position in the truth's frame, m; NaN where the frame was lost.
    pub position_m: Vec<[f64; 3]>,
    /// Orientation as a unit quaternion w, x, y, z: end-effector (fixture) axes into the truth's frame; NaN where lost.
    pub quaternion: Option<Vec<[f64; 4]>>,
}

const REPORTED: [&str; 3] = ["x_m", "y_m", "z_m"];
/// Columns of the true tip in a run's own table.
const TRUTH: [&str; 3] = ["truth_x_m", "truth_y_m", "truth_z_m"];
const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];
const TRUE_QUATERNION: [&str; 4] = ["truth_qw", "truth_qx", "truth_qy", "truth_qz"];
const NEEDS: &str = "time (t_s) and the tip's position on both sides (x_mm, y_mm, z_mm and truth_x_mm, truth_y_mm, truth_z_mm)";

const NEEDS_TRUTH: &str = "a true position beside the reported one";

fn column<'a>(recording: &'a Recording, name: &'static str, needs: &'static str) -> Result<&'a [f64], PairError> {
    recording.column(name).ok_or_else(|| PairError::MissingColumn { recording: recording.name.clone(), column: name, needs })
}

fn columns<'a, const N: usize>(
    recording: &'a Recording,
    names: [&'static str; N],
    needs: &'static str,
) -> Result<[&'a [f64]; N], PairError> {
    let mut found: [&[f64]; N] = [&[]; N];
    for (place, name) in found.iter_mut().zip(names) {
        *place = column(recording, name, needs)?;
    }
    Ok(found)
}

impl<'a> Reported<'a> {
    /// From a recording: `t_s`, `x_m`, `y_m`, `z_m`, and `qw`, `qx`, `qy`, `qz`, `runlevel` where they are.
    ///
    /// # Errors
    /// [`PairError::MissingColumn`].
    pub fn from_recording(recording: &'a Recording) -> Result<Self, PairError> {
        Ok(Self {
            t_s: column(recording, "t_s", NEEDS)?,
            position_m: columns(recording, REPORTED, NEEDS)?,
            quaternion: columns(recording, QUATERNION, NEEDS).ok(),
            runlevel: recording.column("runlevel"),
        })
    }

    pub(super) fn checked(&self, gap_max_s: f64) -> Result<Track<'a>, PairError> {
        let rows = self.t_s.len();
        let quaternion = self.quaternion.iter().flatten().map(|column| column.len());
        let lengths = self.position_m.iter().map(|column| column.len()).chain(quaternion).chain(self.runlevel.map(<[f64]>::len));
        same_length("reported", rows, lengths)?;
        rising("reported", self.t_s)?;
        if rows < 2 {
            let what = format!("{rows} rows; record at least two states");
            return Err(PairError::Column { stream: "reported", what });
        }
        Ok(Track { t_s: self.t_s, position_m: self.position_m, gap_max_s })
    }
}

impl Truth {
    /// The true tip inside a run, `truth_x_m`, `truth_y_m`, `truth_z_m`: its rows with a true position. What the arm itself reported
    /// is none.
    ///
    /// # Errors
    /// [`PairError::MissingColumn`].
    pub fn of_run(recording: &Recording) -> Result<Self, PairError> {
        let (t_s, axes) = (column(recording, "t_s", NEEDS)?, columns(recording, TRUTH, NEEDS_TRUTH)?);
        let at = |row: usize| axes.map(|axis| axis[row]);
        let rows: Vec<usize> = (0..t_s.len()).filter(|row| at(*row).iter().any(|value| value.is_finite())).collect();
        // It stands in the row of the state next to it, and was seen so much later.
        let offset = recording.column("truth_offset_s");
        let seen_s = |row: usize| t_s[row] + offset.map_or(0.0, |offset| if offset[row].is_finite() { offset[row] } else { 0.0 });
        let turned: Option<[&[f64]; 4]> = columns(recording, TRUE_QUATERNION, NEEDS).ok();
        Ok(Self {
            t_s: rows.iter().map(|&row| seen_s(row)).collect(),
            position_m: rows.iter().map(|&row| at(row)).collect(),
            quaternion: turned.map(|columns| rows.iter().map(|&row| columns.map(|column| column[row])).collect()),
        })
    }

    /// From a file of truth. With `truth_x_m`, `truth_y_m`, `truth_z_m` in it (a tidy CSV of a run), its rows with a true position
    /// are the frames; lost ones are then not to be told from rows without a frame. Otherwise (`truth.csv` of the vision)
    /// `x_m`, `y_m`, `z_m` are the true position and every row is a frame.
    ///
    /// # Errors
    /// [`PairError::MissingColumn`].
    pub fn from_recording(recording: &Recording) -> Result<Self, PairError> {
        if TRUTH.iter().any(|name| recording.column(name).is_some()) {
            return Self::of_run(recording);
        }
        let (t_s, axes) = (column(recording, "t_s", NEEDS)?, columns(recording, REPORTED, NEEDS)?);
        let turned: Option<[&[f64]; 4]> = columns(recording, QUATERNION, NEEDS).ok();
        let rows = 0..t_s.len();
        Ok(Self {
            t_s: t_s.to_vec(),
            position_m: rows.clone().map(|row| axes.map(|axis| axis[row])).collect(),
            quaternion: turned.map(|columns| rows.map(|row| columns.map(|column| column[row])).collect()),
        })
    }

    /// Frames with a position.
    pub(super) fn checked(&self, frames_min: usize) -> Result<Vec<Frame>, PairError> {
        let lengths = [self.position_m.len()].into_iter().chain(self.quaternion.as_ref().map(Vec::len));
        same_length("truth", self.t_s.len(), lengths)?;
        rising("truth", &self.t_s)?;
        let seen = self.t_s.iter().zip(&self.position_m).filter(|(_, position)| position.iter().all(|value| value.is_finite()));
        let frames: Vec<Frame> = seen.map(|(t_s, position)| Frame { t_s: *t_s, position_m: Vector3::from(*position) }).collect();
        if frames.len() < frames_min.max(3) {
            return Err(PairError::TooFewFrames { found: frames.len(), needed: frames_min.max(3), frames: self.t_s.len() });
        }
        Ok(frames)
    }
}

fn same_length(stream: &'static str, rows: usize, lengths: impl Iterator<Item = usize>) -> Result<(), PairError> {
    for length in lengths {
        if length != rows {
            let what = format!("a column has {length} values for {rows} times; give one for each");
            return Err(PairError::Column { stream, what });
        }
    }
    Ok(())
}

fn rising(stream: &'static str, times: &[f64]) -> Result<(), PairError> {
    for (row, pair) in times.windows(2).enumerate() {
        // A time that is not a number compares with nothing, so it fails.
        let rises = pair[1] > pair[0];
        if !rises {
            return Err(PairError::TimeNotRising { stream, row: row + 1, before: pair[0], now: pair[1] });
        }
    }
    match times.iter().position(|time| !time.is_finite()) {
        Some(row) => Err(PairError::Column { stream, what: format!("row {row}: time {} is not finite", times[row]) }),
        None => Ok(()),
    }
}
