//! Figures over time: joints, motors, tip, errors, and the channels without a role.

use super::content::{Channel, Content, Family, Signal};
use super::errors::{Error, Errors, Kind, of};
use super::words::{short, sizes};
use crate::figure::decimate::min_max;
use crate::figure::{Axis, Colour, Figure, Mark, Panel};

/// A line breaks where values are missing for this many times their mean distance.
const GAP: f64 = 20.0;

/// Values over time, reduced to `columns` px.
fn line(content: &Content<'_>, values: impl ExactSizeIterator<Item = f64>, name: &str, colour: Colour, columns: usize) -> Mark {
    let span = content.span();
    let values: Vec<(f64, f64)> = content.time.iter().copied().zip(values).filter(|(_, value)| value.is_finite()).collect();
    let gap = GAP * (span.1 - span.0) / values.len().max(2) as f64;
    Mark::strokes(name, colour, min_max(values, span, columns, gap))
}

fn signal_line(content: &Content<'_>, signal: Option<&Signal<'_>>, name: &str, colour: Colour, columns: usize) -> Option<Mark> {
    signal.map(|signal| line(content, signal.shown(), name, colour, columns))
}

fn time_axis(content: &Content<'_>) -> Axis {
    let (first, last) = content.span();
    Axis::new(content.time_title).range(first, last)
}

fn error_colour(kind: Kind) -> Colour {
    if kind == Kind::Tracking { Colour::BLUE } else { Colour::VERMILLION }
}

/// Commanded, reported and true position, and below it the differences.
fn channel(content: &Content<'_>, channel: &Channel<'_>) -> Option<Figure> {
    let unit = channel.position()?.scale;
    let mut figure = Figure::new(&channel.label, time_axis(content));
    let columns = figure.columns_px();
    let lines = [
        signal_line(content, channel.commanded.as_ref(), "commanded", Colour::GREY, columns).map(|mark| mark.style("broad")),
        signal_line(content, channel.reported.as_ref(), "reported", Colour::BLUE, columns),
        signal_line(content, channel.truth.as_ref(), "true", Colour::VERMILLION, columns).map(|mark| mark.style("thin")),
    ];
    figure = figure.panel(Panel::new(Axis::new(unit.titled("Position"))).height(130.0).marks(lines.into_iter().flatten()));
    let Some(error) = of(channel) else { return Some(figure.caption(missing(channel))) };
    let mark = line(content, error.values.iter().copied(), "", error_colour(error.kind), columns);
    let title = format!("{}, {}", capital(error.kind.words()), error.unit);
    let statistics = error.statistics;
    let below = Panel::new(Axis::new(title).including(0.0)).height(70.0).mark(Mark::Rule { y: 0.0 }).mark(mark);
    let caption =
        format!("{}: mean {} {}, {}.", error.kind.words(), short(statistics.mean), error.unit, sizes(&statistics, error.unit));
    Some(figure.panel(below).caption(capital(&caption)))
}

fn missing(channel: &Channel<'_>) -> String {
    let parts = [("commanded", &channel.commanded), ("reported", &channel.reported), ("true", &channel.truth)];
    let absent: Vec<&str> = parts.iter().filter(|(_, signal)| signal.is_none()).map(|(name, _)| *name).collect();
    format!("Not in the recording: {} position, so there is no difference to show.", absent.join(" and "))
}

/// The text with a capital letter in front.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Figures of the joints.
pub(super) fn joints(content: &Content<'_>) -> Vec<Figure> {
    content.joints.values().filter_map(|joint| channel(content, joint)).collect()
}

/// Figures of the tip.
pub(super) fn tip(content: &Content<'_>) -> Vec<Figure> {
    content.tip.iter().flatten().filter_map(|axis| channel(content, axis)).collect()
}

/// Figures of the motors: position, velocity, load.
pub(super) fn motors(content: &Content<'_>) -> Vec<Figure> {
    let figure = |motor: &Channel<'_>| {
        let mut figure = Figure::new(&motor.label, time_axis(content));
        let columns = figure.columns_px();
        let parts = [
            ("Position", motor.reported.as_ref(), Colour::BLUE),
            ("Velocity", motor.velocity.as_ref(), Colour::GREEN),
            motor.load.as_ref().map_or(("Load", None, Colour::PURPLE), |(name, load)| (*name, Some(load), Colour::PURPLE)),
        ];
        for (name, signal, colour) in parts {
            if let (Some(mark), Some(signal)) = (signal_line(content, signal, "", colour, columns), signal) {
                figure = figure.panel(Panel::new(Axis::new(signal.scale.titled(name))).height(80.0).mark(mark.style("thin")));
            }
        }
        figure
    };
    content.motors.values().map(figure).collect()
}

/// Lines of one figure at most.
const LINES: usize = 6;

/// A figure of a quantity that has no role here.
pub(super) fn other(content: &Content<'_>, family: &Family<'_>) -> Figure {
    let mut figure = Figure::new(&family.name, time_axis(content));
    let columns = figure.columns_px();
    let lines = family.members.iter().take(LINES).enumerate();
    let marks = lines.map(|(i, (name, signal))| line(content, signal.shown(), name, Colour::choice(i), columns).style("thin"));
    let title = family.members[0].1.scale.titled("Value");
    figure = figure.panel(Panel::new(Axis::new(title)).height(110.0).marks(marks));
    if family.members.len() > LINES { figure.caption(format!("{LINES} of {} columns.", family.members.len())) } else { figure }
}

/// Panels of errors over time that are drawn at most.
const ERROR_PANELS: usize = 8;

/// The error over time: tip axes and length, or the joints where there is no tip.
pub(super) fn errors(content: &Content<'_>, errors: &Errors, width_px: f64) -> Option<Figure> {
    let joints = || errors.joints.iter().map(|(_, error)| error).collect::<Vec<_>>();
    let chosen: Vec<&Error> = errors.tip.as_ref().map_or_else(joints, |tip| tip.iter().chain(&errors.tip_3d).collect());
    let kind = chosen.first()?.kind;
    let mut figure = Figure::new(format!("Error over time: {}", kind.words()), time_axis(content)).width(width_px);
    let columns = figure.columns_px();
    for error in chosen.iter().take(ERROR_PANELS) {
        let statistics = error.statistics;
        let title = format!("{}, {}", error.label, error.unit);
        let note = format!("RMS {}  p95 {}  max {}", short(statistics.rms), short(statistics.p95), short(statistics.max));
        let colour = if error.label == "Tip 3D" { Colour::INK } else { error_colour(error.kind) };
        let mark = line(content, error.values.iter().copied(), "", colour, columns).style("thin");
        figure = figure
            .panel(Panel::new(Axis::new(title).including(0.0)).height(86.0).mark(Mark::Rule { y: 0.0 }).mark(mark).note(note));
    }
    Some(figure.caption(errors.tip_3d.as_ref().map_or_else(|| each(&chosen), |length| of_tip(errors, length))))
}

fn each(errors: &[&Error]) -> String {
    let one = |error: &&Error| format!("{}: {}.", error.label, sizes(&error.statistics, error.unit));
    errors.iter().take(ERROR_PANELS).map(one).collect::<Vec<_>>().join(" ")
}

fn of_tip(errors: &Errors, length: &Error) -> String {
    let (statistics, unit) = (&length.statistics, length.unit);
    let per_axis: Vec<String> = errors.tip.iter().flatten().map(|error| short(error.statistics.rms)).collect();
    let (sizes, count, per_axis) = (sizes(statistics, unit), statistics.count, per_axis.join(", "));
    format!("3D error: {sizes} in {count} samples. RMS per axis x, y, z: {per_axis} {unit}.")
}
