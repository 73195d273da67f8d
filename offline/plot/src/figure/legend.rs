//! What the colours of cells mean.

use std::fmt::Write;

use super::Cells;
use super::colour::HEAT_LEVELS;
use super::layout::{self, BAR, Layout, Place};
use super::scale::ticks;
use super::xml::{coordinate, text};

/// A bar beside a panel, from the least value to the greatest.
pub(super) fn colour_bar(out: &mut String, layout: &Layout<'_>, place: &Place<'_>, cells: &Cells) {
    let (low, high) = cells.range();
    // One value, or none.
    if low >= high {
        return;
    }
    let left = layout::bar_left(layout);
    let step = place.height / HEAT_LEVELS as f64;
    for i in 0..HEAT_LEVELS {
        let top = place.top + place.height - (i + 1) as f64 * step;
        let (x, y) = (coordinate(left), coordinate(top));
        let _ = write!(out, "<rect class=\"h{i}\" x=\"{x}\" y=\"{y}\" width=\"{BAR}\" height=\"{}\"/>", coordinate(step + 0.3));
    }
    let scale = ticks(low, high, 5);
    for (value, label) in scale.values.iter().zip(&scale.labels) {
        let y = place.top + place.height * (high - value) / (high - low);
        text(out, "muted", "start", left + BAR + 5.0, y + 4.0, label);
    }
}

/// A legend of [`super::Ramp::Ratio`] as a drawing of its own, to be put into a page that has [`super::STYLE`]: noise on the left, `most` times
/// as much on the right.
pub fn ratio_legend(most: f64) -> String {
    const WIDTH: f64 = 320.0;
    const LEFT: f64 = 40.0;
    const BAR_WIDTH: f64 = 200.0;
    let mut out = String::new();
    let step = BAR_WIDTH / HEAT_LEVELS as f64;
    for i in 0..HEAT_LEVELS {
        let (x, w) = (coordinate(LEFT + step * i as f64), coordinate(step + 0.3));
        let _ = write!(out, "<rect class=\"h{i}\" x=\"{x}\" y=\"2\" width=\"{w}\" height=\"{BAR}\"/>");
    }
    text(&mut out, "muted", "end", LEFT - 5.0, 11.0, "noise");
    let most = if most > 1.0 { most } else { 1.0 + 1e-9 };
    for value in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0].into_iter().filter(|value| *value <= most) {
        let at = LEFT + BAR_WIDTH * f64::ln(value) / most.ln();
        text(&mut out, "muted", "middle", at, 26.0, &format!("{value}"));
    }
    text(&mut out, "muted", "start", LEFT + BAR_WIDTH + 6.0, 11.0, "× noise");
    let label = format!("Colour scale from noise to {most:.0} times noise");
    let size = format!("viewBox=\"0 0 {WIDTH} 30\" width=\"{WIDTH}\" height=\"30\"");
    format!("<svg class=\"rp legend\" {size} role=\"img\" aria-label=\"{label}\">{out}</svg>")
}
