//! Pictures of training.

use crate::train::{Point, best};
use plot::figure::{Axis, Colour, Figure, Mark, Panel, svg_document};

/// Learning curves as a figure; 3D RMS of what is left, in the labels' unit.
pub fn curves(points: &[Point], unit: &str) -> Figure {
    let line = |name: &str, colour, of: fn(&Point) -> f64| {
        Mark::line(name, colour, points.iter().map(|point| (point.epoch as f64, of(point))).collect())
    };
    let panel = Panel::new(Axis::new(format!("RMS left, {unit}")))
        .mark(line("training", Colour::BLUE, |point| point.train_rms))
        .mark(line("validation", Colour::ORANGE, |point| point.validation_rms));
    let caption = best(points).map_or_else(String::new, |best| {
        format!("Least on validation: {:.3} {unit} in epoch {}; that network is kept.", best.validation_rms, best.epoch)
    });
    Figure::new("Learning curves", Axis::new("Epoch")).panel(panel).caption(caption)
}

/// The same as an SVG file.
pub fn curves_svg(points: &[Point], unit: &str) -> String {
    svg_document(&[curves(points, unit)])
}
