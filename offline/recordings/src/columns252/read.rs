//! Reading as states and truth.

use std::path::Path;

use arm::Side;
use ravenpose_wire::RavenState;

use super::{COLUMNS, COLUMNS_WITH_FORCE};
use crate::columns::{self, Bad, Cells, Rows, Timeline};
use crate::fields::{self, COLUMNS_252};
use crate::file::{Input, InputProblem};
use crate::stream::{Damage, Record, Source, StreamError, Truth};

/// Rotations stay within ±1 but for rounding.
const ROTATION_MAX: f32 = 1.001;

/// Joints with an external encoder.
pub(super) const ENCODERS: usize = 3;

/// Columns of the CRTK sample: its time and seven joints.
const CRTK: usize = 8;

/// Columns of the force sensor: its time and three axes.
const FORCE: usize = 4;

/// A 252-column CSV being read.
pub struct Reader {
    rows: Rows,
    timeline: Timeline,
    metadata: Vec<(String, String)>,
    side: Option<Side>,
    arms: u32,
    /// Read and not yet given.
    first: Option<Row>,
    truth: Option<Truth>,
    /// Given last, to give a sample of several rows once.
    truth_before: Option<Truth>,
}

/// One row.
pub(super) struct Row {
    pub(super) state: Box<RavenState>,
    /// Time since the first state, ns, and joints of the external encoders.
    pub(super) encoders: Option<(i64, [f64; ENCODERS])>,
}

impl Reader {
    /// Opens a file, compressed or not, and reads its first row. The external encoders are taken to be on the only arm
    /// whose board has a number, otherwise on the gold one; `side` says it better.
    ///
    /// # Errors
    /// [`StreamError`] if it cannot be opened, is empty, or its first row is not one of this layout.
    pub fn open(path: &Path, side: Option<Side>) -> Result<Self, StreamError> {
        Self::new(path, Input::open(path).map_err(|problem| problem.refusal(path))?, side)
    }

    /// The same from memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn from_bytes(name: &Path, bytes: Vec<u8>, side: Option<Side>) -> Result<Self, StreamError> {
        let input = Input::from_bytes(bytes).map_err(|error| InputProblem::Read(error).refusal(name))?;
        Self::new(name, input, side)
    }

    pub(crate) fn new(path: &Path, input: Input, side: Option<Side>) -> Result<Self, StreamError> {
        let mut reader = Self {
            rows: Rows::new(path, input),
            timeline: Timeline::default(),
            metadata: Vec::new(),
            side,
            arms: 0,
            first: None,
            truth: None,
            truth_before: None,
        };
        let mut with_force = false;
        let Self { rows, timeline, .. } = &mut reader;
        reader.first = rows.next(|line| {
            with_force = Cells::count_of(line) == COLUMNS_WITH_FORCE;
            row_of(line, timeline)
        })?;
        if let Some(first) = &reader.first {
            reader.side =
                side.or(Some(if first.state.type_[0] == 0 && first.state.type_[1] != 0 { Side::Green } else { Side::Gold }));
        }
        reader.metadata = metadata(reader.side.unwrap_or(Side::Gold), with_force);
        Ok(reader)
    }

    fn row(&mut self) -> Result<Option<Row>, StreamError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        let Self { rows, timeline, .. } = self;
        rows.next(|line| row_of(line, timeline))
    }

    /// The truth of a row, unless it is the sample of the row before.
    fn truth_of(&mut self, row: &Row) -> Option<Truth> {
        let (since_start_ns, joints) = row.encoders?;
        let time_ns = self.timeline.first_ns().checked_add(since_start_ns)?;
        let mut truth = Truth::unknown(time_ns, self.side.unwrap_or(Side::Gold));
        truth.joints[..ENCODERS].copy_from_slice(&joints);
        let same = |before: &Truth| before.time_ns == time_ns && before.joints[..ENCODERS] == truth.joints[..ENCODERS];
        if self.truth_before.as_ref().is_some_and(same) {
            return None;
        }
        self.truth_before = Some(truth);
        Some(truth)
    }
}

impl Source for Reader {
    fn format(&self) -> &'static str {
        "252-column CSV"
    }

    fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    fn progress(&self) -> (u64, u64) {
        self.rows.progress()
    }

    fn next(&mut self) -> Result<Option<Record>, StreamError> {
        if let Some(truth) = self.truth.take() {
            return Ok(Some(Record::Truth(truth)));
        }
        let Some(mut row) = self.row()? else {
            return Ok(None);
        };
        self.truth = self.truth_of(&row);
        self.arms |= connected(&row.state);
        row.state.arms = self.arms;
        Ok(Some(Record::State(row.state)))
    }

    fn damage(&self) -> Option<&Damage> {
        self.rows.damage()
    }
}

/// Arms whose board has a number; where neither has, arms that show any sign of life.
fn connected(state: &RavenState) -> u32 {
    let boards = u32::from(state.type_[0] != 0) | (u32::from(state.type_[1] != 0) << 1);
    if boards == 0 { fields::arms_by_content(state) } else { boards }
}

fn metadata(side: Side, with_force: bool) -> Vec<(String, String)> {
    let force = if with_force { " and 252-255 (force sensor)" } else { "" };
    vec![
        ("dt".to_owned(), columns::DT_NOTE.to_owned()),
        ("sequence".to_owned(), columns::COUNTERS_NOTE.to_owned()),
        ("truth".to_owned(), format!("columns 0-3, external encoders of joints 1 to 3, taken for the {} arm", side.name())),
        ("left_out".to_owned(), format!("columns 4-11 (CRTK joints){force} are neither state nor truth and are left out")),
    ]
}

pub(super) fn row_of(line: &[u8], timeline: &mut Timeline) -> Result<Row, Bad> {
    parse(&mut Cells::new(line), timeline).map_err(|bad| judged(line, bad))
}

fn parse(cells: &mut Cells<'_>, timeline: &mut Timeline) -> Result<Row, Bad> {
    let mut state = Box::new(RavenState::new());
    let since_start = cells.nanoseconds()?;
    let joints = [cells.number()?, cells.number()?, cells.number()?];
    cells.nanoseconds()?;
    for _ in 1..CRTK {
        cells.number()?;
    }
    let stamp = cells.nanoseconds()?.ok_or_else(|| Bad::column(12, "is no time"))?;
    columns::put(&COLUMNS_252, cells, &mut state)?;
    if cells.more() {
        cells.nanoseconds()?;
        for _ in 1..FORCE {
            cells.number()?;
        }
    }
    cells.end()?;
    check_rotations(&state)?;
    if !timeline.complete(&mut state, stamp) {
        return Err(Bad::column(12, "is not a time since 1970 in s"));
    }
    let encoders = since_start.filter(|_| joints.iter().any(|joint| !joint.is_nan())).map(|time| (time, joints));
    Ok(Row { state, encoders })
}

fn check_rotations(state: &RavenState) -> Result<(), Bad> {
    for (first_column, rotations) in [(40, &state.ori), (58, &state.ori_d)] {
        if let Some(place) = rotations.iter().position(|value| value.abs() > ROTATION_MAX) {
            let what = format!("is {}, but a rotation lies within -1..1", rotations[place]);
            return Err(Bad::column(first_column + place, what));
        }
    }
    Ok(())
}

fn judged(line: &[u8], bad: Bad) -> Bad {
    let count = Cells::count_of(line);
    if count == COLUMNS || count == COLUMNS_WITH_FORCE {
        return bad;
    }
    Bad {
        what: format!("has {count} columns where the layout has {COLUMNS} or {COLUMNS_WITH_FORCE}"),
        remedy: "copy the file again",
    }
}
