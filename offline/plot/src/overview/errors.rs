//! Error signals: true - reported where there is a truth, else what there is, under its right name.

use super::content::{Channel, Content, Signal};
use crate::statistics::Statistics;

/// What an error is the difference of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The controller's belief against the truth: what this project is about.
    TrueReported,
    /// For recordings without a reported position.
    TrueCommanded,
    /// How well the controller follows; says nothing about the truth.
    Tracking,
}

impl Kind {
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::TrueReported => "true \u{2212} reported",
            Self::TrueCommanded => "true \u{2212} commanded",
            Self::Tracking => "commanded \u{2212} reported",
        }
    }
}

/// The error of a joint or an axis of the tip.
pub(super) struct Error {
    pub(super) label: String,
    pub(super) kind: Kind,
    /// Shown unit, one value per row, NaN where unknown.
    pub(super) values: Vec<f64>,
    pub(super) unit: &'static str,
    pub(super) statistics: Statistics,
}

impl Error {
    fn new(label: &str, kind: Kind, values: Vec<f64>, unit: &'static str) -> Self {
        let statistics = Statistics::of(values.iter().copied());
        Self { label: label.to_owned(), kind, values, unit, statistics }
    }
}

/// Minuend - subtrahend in the unit in which the subtrahend is shown.
fn difference(label: &str, kind: Kind, from: &Signal<'_>, take: &Signal<'_>) -> Error {
    Error::new(label, kind, from.shown().zip(take.shown()).map(|(a, b)| a - b).collect(), take.scale.unit)
}

/// The error of a channel that says most, if it has any.
pub(super) fn of(channel: &Channel<'_>) -> Option<Error> {
    let label = &channel.label;
    let (truth, reported, commanded) = (channel.truth.as_ref(), channel.reported.as_ref(), channel.commanded.as_ref());
    // A column of truth without a single value is none.
    let truth = truth.filter(|truth| truth.values.iter().any(|value| value.is_finite()));
    match (truth, reported, commanded) {
        (Some(truth), Some(reported), _) => Some(difference(label, Kind::TrueReported, truth, reported)),
        (Some(truth), None, Some(commanded)) => Some(difference(label, Kind::TrueCommanded, truth, commanded)),
        _ => tracking(channel),
    }
}

/// Commanded - reported.
pub(super) fn tracking(channel: &Channel<'_>) -> Option<Error> {
    let (commanded, reported) = (channel.commanded.as_ref()?, channel.reported.as_ref()?);
    Some(difference(&channel.label, Kind::Tracking, commanded, reported))
}

/// Errors of a recording.
pub(super) struct Errors {
    /// x, y, z, all of one kind.
    pub(super) tip: Option<[Error; 3]>,
    /// Length of the tip's error.
    pub(super) tip_3d: Option<Error>,
    /// By the joint's number.
    pub(super) joints: Vec<(u32, Error)>,
    /// Tracking errors beside the ones above, where those are others.
    pub(super) tracking: Vec<Error>,
}

impl Errors {
    pub(super) fn new(content: &Content<'_>) -> Self {
        let tip = content.tip.as_ref().and_then(tip);
        let tip_3d = tip.as_ref().map(length);
        let joints: Vec<(u32, Error)> = content.joints.iter().filter_map(|(number, joint)| Some((*number, of(joint)?))).collect();
        let mut tracked = Vec::new();
        if tip.as_ref().is_some_and(|tip| tip[0].kind != Kind::Tracking) {
            tracked.extend(content.tip.iter().flatten().filter_map(tracking));
        }
        for (number, error) in &joints {
            if error.kind != Kind::Tracking {
                tracked.extend(content.joints.get(number).and_then(tracking));
            }
        }
        Self { tip, tip_3d, joints, tracking: tracked }
    }

    /// All of them, in the order of a table.
    pub(super) fn all(&self) -> impl Iterator<Item = &Error> {
        let joints = self.joints.iter().map(|(_, error)| error);
        self.tip.iter().flatten().chain(&self.tip_3d).chain(joints).chain(&self.tracking)
    }

    pub(super) fn joint(&self, number: u32) -> Option<&Error> {
        self.joints.iter().find(|(other, _)| *other == number).map(|(_, error)| error)
    }
}

fn tip(axes: &[Channel<'_>; 3]) -> Option<[Error; 3]> {
    let [x, y, z] = axes;
    let all = [of(x)?, of(y)?, of(z)?];
    all.iter().all(|error| error.kind == all[0].kind).then_some(all)
}

fn length([x, y, z]: &[Error; 3]) -> Error {
    let values = x.values.iter().zip(&y.values).zip(&z.values).map(|((x, y), z)| (x * x + y * y + z * z).sqrt()).collect();
    Error::new("Tip 3D", x.kind, values, x.unit)
}
