//! Writing.

use std::io::Write;
use std::path::{Path, PathBuf};

use arm::published::SLOT_OF_JOINT;
use arm::{JOINTS, Side};
use ravenpose_wire::RavenState;

use super::match_truth::{MatchTruth, holds_joints};
use super::read::ENCODERS;
use crate::columns;
use crate::fields::COLUMNS_252;
use crate::file::{WholeFile, cannot_write};
use crate::stream::{Record, Sink, StreamError, Truth};
use crate::text;

/// A 252-column CSV being written: one row per state, with the nearest truth of one arm, that of the first truth that comes.
/// What the format cannot hold is told by [`super::LOSSES`].
pub struct Writer {
    path: PathBuf,
    file: WholeFile,
    row: Vec<u8>,
    pairs: MatchTruth,
    first_ns: Option<i64>,
}

impl Writer {
    /// Begins a file.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    pub fn create(path: &Path) -> Result<Self, StreamError> {
        let file = WholeFile::create(path).map_err(|error| cannot_write(path, &error))?;
        Ok(Self { path: path.to_owned(), file, row: Vec::new(), pairs: MatchTruth::default(), first_ns: None })
    }

    fn put(&mut self, state: &RavenState, truth: Option<&Truth>) -> Result<(), StreamError> {
        let stamp_ns = i64::from(state.hdr_stamp_sec) * 1_000_000_000 + i64::from(state.hdr_stamp_nsec);
        let first_ns = *self.first_ns.get_or_insert(stamp_ns);
        self.row.clear();
        encoders(&mut self.row, truth, first_ns);
        self.row.push(b',');
        text::nanoseconds_as_exponent18(&mut self.row, stamp_ns);
        for joint in reported_joints(state, truth.map_or(connected_side(state), |truth| truth.side)) {
            self.row.push(b',');
            text::exponent18(&mut self.row, joint);
        }
        self.row.push(b',');
        text::nanoseconds_as_exponent18(&mut self.row, stamp_ns);
        columns::splice(&COLUMNS_252, state, &mut self.row, b',', int, float);
        self.row.push(b'\n');
        self.file.write_all(&self.row).map_err(|error| cannot_write(&self.path, &error))
    }
}

impl Sink for Writer {
    fn write(&mut self, record: &Record) -> Result<(), StreamError> {
        match record {
            Record::State(state) => {
                if let Some((state, truth)) = self.pairs.state(state.clone()) {
                    self.put(&state, truth.as_ref())?;
                }
            }
            Record::Truth(truth) => {
                if !holds_joints(record) || !self.pairs.truth(truth) {
                    return Ok(());
                }
                while let Some((state, nearest)) = self.pairs.next_until(truth) {
                    self.put(&state, nearest.as_ref())?;
                }
                self.pairs.remember(truth);
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), StreamError> {
        while let Some((state, truth)) = self.pairs.rest() {
            self.put(&state, truth.as_ref())?;
        }
        let Self { path, file, .. } = *self;
        file.finish().map_err(|error| cannot_write(&path, &error))
    }
}

/// Columns 0 to 3.
fn encoders(row: &mut Vec<u8>, truth: Option<&Truth>, first_ns: i64) {
    let Some(truth) = truth else {
        row.extend_from_slice(b"nan,nan,nan,nan");
        return;
    };
    text::nanoseconds_as_exponent18(row, truth.time_ns.saturating_sub(first_ns));
    for joint in &truth.joints[..ENCODERS] {
        row.push(b',');
        text::exponent18(row, *joint);
    }
}

/// Reported joint positions in rad and m, in place of those of CRTK.
fn reported_joints(state: &RavenState, side: Side) -> [f64; JOINTS] {
    SLOT_OF_JOINT.map(|slot| f64::from(state.jpos[8 * side.index() + slot]).to_radians())
}

/// The arm to show where no truth names one.
fn connected_side(state: &RavenState) -> Side {
    if state.connected() & 3 == 2 { Side::Green } else { Side::Gold }
}

fn int(out: &mut Vec<u8>, value: i32) {
    text::exponent18(out, f64::from(value));
}

fn float(out: &mut Vec<u8>, value: f32) {
    text::exponent18(out, f64::from(value));
}
