//! Recordings of full states as a stream: what every format reads and writes one record at a time, so that an hour of
//! 1 kHz states passes through in bounded memory.

use std::path::PathBuf;

use arm::{JOINTS, Side};
use ravenpose_wire::RavenState;

/// One record of a stream.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// One control cycle of the robot.
    State(Box<RavenState>),
    /// Where an arm really was.
    Truth(Truth),
}

impl Record {
    /// Time stamp, ns since 1970: `hdr.stamp` of a state.
    pub fn time_ns(&self) -> i64 {
        match self {
            Self::State(state) => i64::from(state.hdr_stamp_sec) * 1_000_000_000 + i64::from(state.hdr_stamp_nsec),
            Self::Truth(truth) => truth.time_ns,
        }
    }
}

/// Metadata of a recording whose truth was measured, not simulated.
pub const TRUTH_MEASURED: (&str, &str) = ("truth_source", "measured");

/// Was the truth of a recording with such metadata measured? False where it does not say.
pub fn is_truth_measured(metadata: &[(String, String)]) -> bool {
    metadata.iter().any(|(key, value)| (key.as_str(), value.as_str()) == TRUTH_MEASURED)
}

/// Where an arm really was, as far as a tracker, joint encoders or a simulator know it. What is not known is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Time, ns since 1970, on the clock of the states.
    pub time_ns: i64,
    /// Which arm.
    pub side: Side,
    /// Tip, m, frame 0 of the arm; NaN where there was no frame.
    pub position_m: [f64; 3],
    /// Rotation of the tip in frame 0: w, x, y, z.
    pub quaternion_wxyz: [f64; 4],
    /// Joint positions measured at the joints, rad, joint 3 in m.
    pub joints: [f64; JOINTS],
    /// Force of the cable of each joint, N (the difference between its two sides).
    pub cable_force_n: [f64; JOINTS],
}

impl Truth {
    /// A truth of which only time and arm are known.
    pub const fn unknown(time_ns: i64, side: Side) -> Self {
        Self {
            time_ns,
            side,
            position_m: [f64::NAN; 3],
            quaternion_wxyz: [f64::NAN; 4],
            joints: [f64::NAN; JOINTS],
            cable_force_n: [f64::NAN; JOINTS],
        }
    }
}

/// A recording being read, record by record in the order of the file.
pub trait Source {
    /// Name of the format, for people: `MCAP`, `rosbag v1`, `252-column CSV`, ...
    fn format(&self) -> &'static str;

    /// `key = value` pairs that the file carries.
    fn metadata(&self) -> &[(String, String)];

    /// How much of the file has been read: bytes so far, bytes in all.
    fn progress(&self) -> (u64, u64);

    /// The next record; none at the end. A damaged file yields everything before the damage, then ends: see
    /// [`Source::damage`].
    ///
    /// # Errors
    /// [`StreamError`] where the file cannot be read at all (disk, permission), or is not what its header says.
    fn next(&mut self) -> Result<Option<Record>, StreamError>;

    /// After the end: where and how the file is damaged or cut off, none for a whole one.
    fn damage(&self) -> Option<&Damage>;

    /// The channels of the file as far as it has been read, those that no record comes from included. Empty for a format
    /// that has none.
    fn channels(&self) -> Vec<Channel> {
        Vec::new()
    }
}

/// A channel (a topic) of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// Its name: `/ravenstate`.
    pub topic: String,
    /// Type of its messages: `raven_2/raven_state`.
    pub type_name: String,
    /// How its messages are encoded: `ros1`, `cdr`, `json`, ...
    pub encoding: String,
    /// Messages so far.
    pub messages: u64,
    /// Do records come from it? Messages of other channels are counted and passed over.
    pub is_read: bool,
}

/// A recording being written. What is written stands under its final name only after [`Sink::finish`]; a sink that is
/// dropped before leaves nothing (but see the crash-safe MCAP writer, which says otherwise).
pub trait Sink {
    /// Appends a record.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses, or where the format cannot hold the record without loss.
    fn write(&mut self, record: &Record) -> Result<(), StreamError>;

    /// Completes the file.
    ///
    /// # Errors
    /// [`StreamError`] where the disk refuses.
    fn finish(self: Box<Self>) -> Result<(), StreamError>;
}

/// Where a file stops being readable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Byte in the file (of the compressed file where it is one), or the line for text.
    pub place: Place,
    /// What is wrong there, in a few words.
    pub what: String,
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Offset, bytes from 0.
    Byte(u64),
    /// Line, from 1.
    Line(u64),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Line(line) => write!(f, "line {line}"),
        }
    }
}

/// Why a stream cannot be read or written: one line with the file, the place, what is wrong and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {}{what}; {remedy}", file.display().to_string().escape_debug(), place.map_or_else(String::new, |place| format!("{place}: ")))]
pub struct StreamError {
    /// The file.
    pub file: PathBuf,
    /// Where in it, if anywhere.
    pub place: Option<Place>,
    /// What is wrong.
    pub what: String,
    /// What to do.
    pub remedy: String,
}
