//! How an effect shows: the error against what it depends on, with the fitted curve.

use plot::figure::{Axis, Colour, Figure, Mark, Panel};

use super::{AFTER, BEFORE, scale_of, title};
use crate::{Point, Signature};

/// Points drawn at most.
const POINTS_MAX: usize = 1500;

/// One signature: above the error as it was with the curve, below what is left.
pub(crate) fn signature(picture: &Signature, width_px: f64) -> Figure {
    let curve = || picture.curve.iter().flatten();
    let x_scale = scale_of(&picture.feature, picture.before.iter().chain(curve()).map(|point| point.0));
    let y_scale = scale_of(&picture.error, picture.before.iter().chain(curve()).map(|point| point.1));
    let scaled = |point: &Point| (point.0 * x_scale.per_unit, point.1 * y_scale.per_unit);
    let dots = |points: &[Point], colour: Colour| {
        let stride = points.len() / POINTS_MAX + 1;
        let finite = points.iter().step_by(stride).map(scaled).filter(|(x, y)| x.is_finite() && y.is_finite());
        Mark::Dots { colour, points: finite.collect() }
    };
    let bands = picture.band.iter().map(|stroke| {
        let scaled = |(x, low, high): &(f64, f64, f64)| (x * x_scale.per_unit, low * y_scale.per_unit, high * y_scale.per_unit);
        Mark::Band { colour: Colour::INK, points: stroke.iter().map(scaled).filter(finite_band).collect() }
    });
    let strokes = picture.curve.iter().map(|stroke| stroke.iter().map(scaled).filter(|(x, y)| x.is_finite() && y.is_finite()));
    let fitted = Mark::strokes("", Colour::INK, strokes.map(Iterator::collect).collect()).style("strong");
    let low_high = extent(picture.before.iter().chain(curve()).map(|point| point.1 * y_scale.per_unit));
    let axis = || Axis::new(title("Error", &y_scale)).range(low_high.0, low_high.1);
    let before = Panel::new(axis())
        .mark(Mark::Rule { y: 0.0 })
        .mark(dots(&picture.before, BEFORE))
        .marks(bands)
        .mark(fitted)
        .height(170.0)
        .note("before; line: fitted");
    let name = title(&picture.feature.name, &x_scale);
    let heading = format!("{} against {}", picture.error.name, uncapital(&picture.feature.name));
    let mut figure = Figure::new(heading, Axis::new(name)).panel(before).width(width_px).caption(&picture.caption);
    if !picture.after.is_empty() {
        let after = Panel::new(axis()).mark(Mark::Rule { y: 0.0 }).mark(dots(&picture.after, AFTER)).height(170.0).note("after");
        figure = figure.panel(after);
    }
    figure
}

fn finite_band((x, low, high): &(f64, f64, f64)) -> bool {
    x.is_finite() && low.is_finite() && high.is_finite()
}

/// Least and greatest with some room, zero inside.
fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.filter(|value| value.is_finite()).fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let room = 0.06 * (high - low);
    (low - room, high + room)
}

/// With a small letter, unless it is a name like `J3`.
fn uncapital(text: &str) -> String {
    let mut letters = text.chars();
    match (letters.next(), letters.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() => first.to_lowercase().chain(letters).collect(),
        _ => text.to_owned(),
    }
}
