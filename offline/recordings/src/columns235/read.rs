//! Reading.

use std::path::Path;

use ravenpose_wire::RavenState;

use super::COLUMNS;
use crate::columns::{self, Bad, Cells, Rows, Timeline};
use crate::fields::{self, COLUMNS_235};
use crate::file::Input;
use crate::stream::{Damage, Record, Source, StreamError};

/// Rotations of the older layout's place hold degrees; those of this one stay within ±1 but for rounding.
const ROTATION_MAX: f32 = 1.001;

/// Runlevel of every state, since the text does not hold it: pedal down, as recordings for the estimator are made.
const RUNLEVEL_ASSUMED: i32 = 3;

/// Tip positions of the older layout, and how large they are at least, µm.
const OLDER_POSITION: std::ops::Range<usize> = 230..233;
const OLDER_POSITION_MIN_UM: f64 = 1e3;

/// A 235-column text being read.
pub struct Reader {
    rows: Rows,
    timeline: Timeline,
    metadata: Vec<(String, String)>,
    arms: u32,
    first: Option<Box<RavenState>>,
}

impl Reader {
    /// Opens a file, compressed or not, and reads its first row.
    ///
    /// # Errors
    /// [`StreamError`] if it cannot be opened, is empty, or its first row is not one of this layout.
    pub fn open(path: &Path) -> Result<Self, StreamError> {
        Self::new(path, Input::open(path).map_err(|problem| problem.refusal(path))?)
    }

    /// The same from memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<Self, StreamError> {
        let input = Input::from_bytes(bytes).map_err(|error| crate::file::InputProblem::Read(error).refusal(name))?;
        Self::new(name, input)
    }

    pub(crate) fn new(path: &Path, input: Input) -> Result<Self, StreamError> {
        let mut reader =
            Self { rows: Rows::new(path, input), timeline: Timeline::default(), metadata: metadata(), arms: 0, first: None };
        reader.first = reader.row()?;
        Ok(reader)
    }

    fn row(&mut self) -> Result<Option<Box<RavenState>>, StreamError> {
        let Self { rows, timeline, arms, .. } = self;
        rows.next(|line| {
            let mut state = state_of(line, timeline)?;
            *arms |= fields::arms_by_content(&state);
            state.arms = *arms;
            Ok(state)
        })
    }
}

impl Source for Reader {
    fn format(&self) -> &'static str {
        "235-column text"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    fn progress(&self) -> (u64, u64) {
        self.rows.progress()
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        let state = match self.first.take() {
            Some(first) => Some(first),
            None => self.row()?,
        };
        Ok(state.map(Record::State))
    }

    fn damage(&self) -> Option<&Damage> {
        self.rows.damage()
    }
}

fn metadata() -> Vec<(String, String)> {
    [
        ("dt", columns::DT_NOTE),
        ("sequence", columns::COUNTERS_NOTE),
        ("runlevel", "not in the file; 3 (pedal down) assumed, sublevel and last_seq 0"),
        ("type", "not in the file; 0, connected arms told by their rotations, encoders and motors"),
    ]
    .map(|(key, value)| (key.to_owned(), value.to_owned()))
    .to_vec()
}

fn state_of(line: &[u8], timeline: &mut Timeline) -> Result<Box<RavenState>, Bad> {
    let mut state = Box::new(RavenState::new());
    let mut cells = Cells::new(line);
    let stamp = cells.nanoseconds().and_then(|stamp| stamp.ok_or_else(|| Bad::column(0, "is no time")));
    let parsed = stamp.and_then(|stamp| {
        columns::put(&COLUMNS_235, &mut cells, &mut state)?;
        cells.end()?;
        check_rotations(&state)?;
        Ok(stamp)
    });
    let stamp = parsed.map_err(|bad| judged(line, bad))?;
    if !timeline.complete(&mut state, stamp) {
        return Err(Bad::column(0, "is not a time since 1970 in s"));
    }
    state.runlevel = RUNLEVEL_ASSUMED;
    Ok(state)
}

fn check_rotations(state: &RavenState) -> Result<(), Bad> {
    for (first_column, rotations) in [(13, &state.ori), (31, &state.ori_d)] {
        if let Some(place) = rotations.iter().position(|value| value.abs() > ROTATION_MAX) {
            let what = format!("is {}, but a rotation lies within -1..1", rotations[place]);
            return Err(Bad::column(first_column + place, what));
        }
    }
    Ok(())
}

/// What is wrong with a row that is not of this layout, said as well as possible.
fn judged(line: &[u8], bad: Bad) -> Bad {
    let count = Cells::count_of(line);
    if count == COLUMNS && looks_older(line) {
        return Bad {
            what: "has the older order of 235 columns (tip position at 230..232), which this program does not read".to_owned(),
            remedy: "export the recording again from its bag",
        };
    }
    if count != COLUMNS {
        return Bad { what: format!("has {count} columns where the layout has {COLUMNS}"), remedy: "copy the file again" };
    }
    bad
}

fn looks_older(line: &[u8]) -> bool {
    let mut cells = Cells::new(line);
    let numbers: Vec<f64> = std::iter::from_fn(|| cells.number().ok()).collect();
    numbers.get(OLDER_POSITION).is_some_and(|position| {
        position.iter().all(|value| value.fract() == 0.0) && position.iter().any(|value| value.abs() >= OLDER_POSITION_MIN_UM)
    })
}
