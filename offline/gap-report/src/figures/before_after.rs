//! A held-out run before and after the correction, with the band in which noise stays.

use plot::figure::{Axis, Colour, Figure, Mark, Panel, decimate};

use super::{AFTER, BEFORE, scale_of, title};
use crate::BeforeAfter;
use crate::text::with_unit;

/// Length of the stretch that is enlarged, s.
const CLOSE_UP_S: f64 = 5.0;

/// The whole run, and below it a stretch where the error was greatest, if the run is much longer than that.
pub(crate) fn before_after(picture: &BeforeAfter, width_px: f64) -> Vec<Figure> {
    let (Some(first), Some(last)) = (picture.t_s.first().copied(), picture.t_s.last().copied()) else { return Vec::new() };
    let whole = (first, last);
    let heading = format!("{}, {}", picture.error.name, picture.run);
    let mut figures = vec![over(picture, whole, width_px, 150.0, &heading).caption(caption(picture))];
    if last - first > 3.0 * CLOSE_UP_S {
        let from = worst_start(picture, CLOSE_UP_S);
        let heading = format!("The worst {CLOSE_UP_S:.0} s of it");
        figures.push(over(picture, (from, from + CLOSE_UP_S), width_px, 130.0, &heading));
    }
    figures
}

fn over(picture: &BeforeAfter, span: (f64, f64), width_px: f64, height_px: f64, heading: &str) -> Figure {
    let scale = scale_of(&picture.error, picture.before.iter().chain(&picture.after).copied());
    let x = Axis::new("Time, s").range(span.0, span.1);
    let mut panel = Panel::new(Axis::new(title("Error", &scale))).height(height_px);
    let floor = picture.noise_floor.filter(|floor| floor.is_finite()).map(|floor| 2.0 * floor * scale.per_unit);
    if let Some(half) = floor {
        panel = panel.mark(Mark::Band { colour: Colour::GREY, points: vec![(span.0, -half, half), (span.1, -half, half)] });
    }
    let figure = Figure::new(heading, x).width(width_px);
    let columns = figure.columns_px();
    let line = |name: &str, colour, values: &[f64]| {
        let samples = picture.t_s.iter().copied().zip(values.iter().map(|value| value * scale.per_unit));
        Mark::strokes(name, colour, decimate::min_max(samples, span, columns, 0.1 * (span.1 - span.0))).style("thin")
    };
    let lines = [line("before", BEFORE, &picture.before), line("after", AFTER, &picture.after)];
    // The edges of the band lie on top: a long run hides the band itself.
    let edge = |height: f64| Mark::line("", Colour::INK, vec![(span.0, height), (span.1, height)]).style("thin dashed");
    let edges = floor.into_iter().flat_map(|half| [edge(-half), edge(half)]);
    figure.panel(panel.mark(Mark::Rule { y: 0.0 }).marks(lines).marks(edges))
}

fn caption(picture: &BeforeAfter) -> String {
    let floor = picture.noise_floor.filter(|floor| floor.is_finite());
    let band = floor.map_or_else(String::new, |floor| {
        format!(" Noise alone ({} RMS) stays between the dashed lines 95 % of the time.", with_unit(floor, &picture.error.unit))
    });
    format!("What is shown of {} was not used for fitting.{band}", picture.run)
}

/// Start of the stretch of a length with the most energy before the correction, by a running sum over the samples.
fn worst_start(picture: &BeforeAfter, length_s: f64) -> f64 {
    let samples: Vec<(f64, f64)> = picture.t_s.iter().copied().zip(picture.before.iter().map(|value| value * value)).collect();
    let (mut start, mut sum, mut best) = (0, 0.0, (f64::NEG_INFINITY, picture.t_s.first().copied().unwrap_or(0.0)));
    for (t, square) in &samples {
        sum += if square.is_finite() { *square } else { 0.0 };
        while samples[start].0 < t - length_s {
            sum -= if samples[start].1.is_finite() { samples[start].1 } else { 0.0 };
            start += 1;
        }
        if start > 0 && sum > best.0 {
            best = (sum, samples[start].0);
        }
    }
    best.1
}
