//! What a recording holds, by role: joints, motors, tip, the rest.

use std::borrow::Cow;
use std::collections::BTreeMap;

use recordings::Recording;

use super::names::{Scale, axis, parse};
use super::{Options, PlotError};
use crate::figure::bins::extent;

/// A column with the unit that it is shown in.
#[derive(Debug, Clone)]
pub(super) struct Signal<'a> {
    pub(super) values: Cow<'a, [f64]>,
    pub(super) scale: Scale,
}

impl Signal<'_> {
    /// Shown value of a row.
    pub(super) fn at(&self, row: usize) -> f64 {
        self.values[row] * self.scale.factor
    }

    /// Shown values.
    pub(super) fn shown(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.values.iter().map(|value| value * self.scale.factor)
    }
}

/// A joint, or an axis of the tip: what was wanted, what the controller reports, what was measured from outside.
#[derive(Debug, Clone, Default)]
pub(super) struct Channel<'a> {
    pub(super) label: String,
    pub(super) commanded: Option<Signal<'a>>,
    pub(super) reported: Option<Signal<'a>>,
    pub(super) truth: Option<Signal<'a>>,
    pub(super) velocity: Option<Signal<'a>>,
    /// Torque, force or amplifier command, with its name.
    pub(super) load: Option<(&'static str, Signal<'a>)>,
}

impl<'a> Channel<'a> {
    /// Where the joint is: reported if possible.
    pub(super) fn position(&self) -> Option<&Signal<'a>> {
        self.reported.as_ref().or(self.commanded.as_ref()).or(self.truth.as_ref())
    }

    fn is_empty(&self) -> bool {
        self.commanded.is_none() && self.reported.is_none() && self.truth.is_none()
    }
}

/// Columns that no role claims, of one quantity.
#[derive(Debug, Clone)]
pub(super) struct Family<'a> {
    pub(super) name: String,
    /// Name of the line and the column.
    pub(super) members: Vec<(String, Signal<'a>)>,
}

/// A recording by role.
pub(super) struct Content<'a> {
    /// Time, s, or the number of the row.
    pub(super) time: Cow<'a, [f64]>,
    /// Title of its axis.
    pub(super) time_title: &'static str,
    /// Is it a time?
    pub(super) timed: bool,
    pub(super) joints: BTreeMap<u32, Channel<'a>>,
    pub(super) motors: BTreeMap<u32, Channel<'a>>,
    /// x, y, z, all of them or none.
    pub(super) tip: Option<[Channel<'a>; 3]>,
    pub(super) others: Vec<Family<'a>>,
    /// Columns in all.
    pub(super) columns: usize,
}

/// Which field of a joint or motor a quantity fills; the first name that is there wins.
static COMMANDED: [&str; 2] = ["jpos_d", "q_des"];
static REPORTED: [&str; 2] = ["jpos", "q"];
static TRUTH: [&str; 2] = ["truth_jpos", "q_act"];
static VELOCITY: [&str; 2] = ["jvel", "dq"];
static LOADS: [(&str, &str); 3] = [("jtau", "Joint load"), ("tau", "Motor torque"), ("dac", "Amplifier command")];

/// Columns by quantity and number.
struct Columns<'a> {
    by_name: BTreeMap<(String, Option<u32>), (usize, Signal<'a>)>,
    claimed: Vec<usize>,
}

impl<'a> Columns<'a> {
    fn take(&mut self, family: &str, index: Option<u32>) -> Option<Signal<'a>> {
        let (place, signal) = self.by_name.get(&(family.to_owned(), index))?;
        self.claimed.push(*place);
        Some(signal.clone())
    }

    fn first(&mut self, families: &[&str], index: Option<u32>) -> Option<Signal<'a>> {
        families.iter().find_map(|family| self.take(family, index))
    }

    fn has(&self, family: &str) -> bool {
        self.by_name.keys().any(|(name, _)| name == family)
    }

    fn indices(&self, families: &[&str]) -> Vec<u32> {
        let mut found: Vec<u32> =
            self.by_name.keys().filter(|(name, _)| families.contains(&name.as_str())).filter_map(|(_, index)| *index).collect();
        found.sort_unstable();
        found.dedup();
        found
    }
}

impl<'a> Content<'a> {
    /// # Errors
    /// [`PlotError`]: nothing to draw, or columns of unequal length.
    pub(super) fn new(recording: &'a Recording, options: &Options) -> Result<Self, PlotError> {
        let rows = recording.columns.first().map_or(0, |column| column.values.len());
        if rows == 0 {
            return Err(PlotError::Empty { recording: recording.name.clone() });
        }
        if let Some(column) = recording.columns.iter().find(|column| column.values.len() != rows) {
            let (recording, column, found) = (recording.name.clone(), column.name.clone(), column.values.len());
            return Err(PlotError::Unequal { recording, column, found, expected: rows });
        }
        let time = recording.time_s().filter(|time| time.iter().all(|t| t.is_finite()));
        let rows = chosen(recording, time, rows, options)?;
        let mut columns = Columns { by_name: BTreeMap::new(), claimed: Vec::new() };
        for (place, column) in recording.columns.iter().enumerate().filter(|(_, column)| column.name != "t_s" || time.is_none()) {
            let name = parse(&column.name);
            let signal = Signal { values: Cow::Borrowed(&column.values[rows.clone()]), scale: name.scale };
            columns.by_name.entry((name.family.to_owned(), name.index)).or_insert((place, signal));
        }
        let joints = joints(&mut columns);
        let motors = motors(&mut columns);
        let tip = tip(&mut columns);
        let others = others(recording, &columns, &rows, time.is_some());
        let row_numbers = || Cow::Owned(rows.clone().map(|row| row as f64).collect());
        Ok(Self {
            time: time.map_or_else(row_numbers, |time| Cow::Borrowed(&time[rows.clone()])),
            time_title: if time.is_some() { "Time, s" } else { "Row" },
            timed: time.is_some(),
            joints,
            motors,
            tip,
            others,
            columns: recording.columns.len(),
        })
    }

    /// First and last time.
    pub(super) fn span(&self) -> (f64, f64) {
        extent(self.time.iter().copied())
    }
}

fn chosen(
    recording: &Recording,
    time: Option<&[f64]>,
    rows: usize,
    options: &Options,
) -> Result<std::ops::Range<usize>, PlotError> {
    let row = |limit: f64| time.map_or_else(|| (limit.max(0.0) as usize).min(rows), |time| time.partition_point(|t| *t < limit));
    let first = options.from_s.map_or(0, row);
    let end = options.to_s.map_or(rows, |to| row(to.next_up()));
    if first < end {
        return Ok(first..end);
    }
    let (from_s, to_s) = time.map_or((0.0, rows as f64), |time| (time[0], time[rows - 1]));
    Err(PlotError::NothingChosen { recording: recording.name.clone(), from_s, to_s })
}

fn joints<'a>(columns: &mut Columns<'a>) -> BTreeMap<u32, Channel<'a>> {
    let families = [COMMANDED, REPORTED, TRUTH].concat();
    // A table of one joint names it without a number.
    let alone = columns.by_name.contains_key(&("q".to_owned(), None)).then_some(None);
    let numbered: Vec<Option<u32>> = columns.indices(&families).into_iter().map(Some).chain(alone).collect();
    // With names of the arm's joints its torques are at the joints; RAVEN's are at the motors.
    let joint_side = columns.has("q");
    let mut joints = BTreeMap::new();
    for index in numbered {
        let channel = Channel {
            label: index.map_or("Joint".to_owned(), |index| format!("Joint {index}")),
            commanded: columns.first(&COMMANDED, index),
            reported: columns.first(&REPORTED, index),
            truth: columns.first(&TRUTH, index),
            velocity: columns.first(&VELOCITY, index),
            load: load(columns, index, joint_side),
        };
        joints.insert(index.unwrap_or(0), channel);
    }
    joints
}

fn load<'a>(columns: &mut Columns<'a>, index: Option<u32>, joint_side: bool) -> Option<(&'static str, Signal<'a>)> {
    LOADS.iter().find_map(|(family, name)| {
        let mut signal = columns.take(family, index)?;
        let (low, high) = extent(signal.values.iter().copied());
        signal.scale = signal.scale.fitted_to(high.max(-low));
        Some((if joint_side { "Joint load" } else { name }, signal))
    })
}

fn motors<'a>(columns: &mut Columns<'a>) -> BTreeMap<u32, Channel<'a>> {
    let mut motors = BTreeMap::new();
    // Many turns: radians read better than tens of thousands of degrees.
    let in_rad = |signal: Option<Signal<'a>>, unit| {
        signal.map(|signal| Signal { scale: Scale { factor: signal.scale.factor.to_radians(), unit }, ..signal })
    };
    for index in columns.indices(&["mpos", "mpos_d", "mvel"]) {
        let (reported, commanded) = (columns.take("mpos", Some(index)), columns.take("mpos_d", Some(index)));
        let channel = Channel {
            label: format!("Motor {index}"),
            commanded: in_rad(commanded, "rad"),
            reported: in_rad(reported, "rad"),
            truth: None,
            velocity: in_rad(columns.take("mvel", Some(index)), "rad/s"),
            load: load(columns, Some(index), false),
        };
        motors.insert(index, channel);
    }
    motors
}

fn tip<'a>(columns: &mut Columns<'a>) -> Option<[Channel<'a>; 3]> {
    // `truth.csv` of the vision calls the true position plainly x, y, z; it is the table of numbered frames with a quaternion.
    let of_cameras = columns.has("frame") && columns.has("qw");
    let axes = ["x", "y", "z"].map(|axis| {
        let plain = columns.take(axis, None);
        let (reported, seen) = if of_cameras { (None, plain) } else { (plain, None) };
        Channel {
            label: format!("Tip {axis}"),
            commanded: columns.take(&format!("{axis}_d"), None),
            reported,
            truth: columns.take(&format!("truth_{axis}"), None).or(seen),
            ..Channel::default()
        }
    });
    axes.iter().any(|axis| !axis.is_empty()).then_some(axes)
}

fn others<'a>(recording: &'a Recording, columns: &Columns<'a>, rows: &std::ops::Range<usize>, timed: bool) -> Vec<Family<'a>> {
    let mut families: Vec<Family<'a>> = Vec::new();
    for (place, column) in recording.columns.iter().enumerate() {
        if columns.claimed.contains(&place) || (timed && column.name == "t_s") {
            continue;
        }
        let name = parse(&column.name);
        let signal = Signal { values: Cow::Borrowed(&column.values[rows.clone()]), scale: name.scale };
        let (family, line) = match (name.index, axis(name.family)) {
            (Some(index), _) => (name.family, index.to_string()),
            (None, Some((group, axis))) => (group, axis.to_owned()),
            (None, None) => (name.family, String::new()),
        };
        let same =
            |other: &&mut Family<'a>| !line.is_empty() && other.name == family && other.members[0].1.scale.unit == name.scale.unit;
        match families.iter_mut().find(same) {
            Some(family) => family.members.push((line, signal)),
            None => families.push(Family { name: family.to_owned(), members: vec![(line, signal)] }),
        }
    }
    families
}
