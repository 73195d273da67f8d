//! Spectrum of an error, both axes by powers of ten.

use plot::figure::{Axis, Colour, Figure, Mark, Panel};

use super::{AFTER, BEFORE};
use crate::Spectrum;
use crate::text::written;

/// One spectrum.
pub(crate) fn spectrum(picture: &Spectrum, width_px: f64) -> Figure {
    let points = |values: &[f64]| -> Vec<(f64, f64)> {
        let all = picture.frequency_hz.iter().zip(values).map(|(f, value)| (f.log10(), value.log10()));
        all.filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
    };
    let series = [&picture.noise_floor, &picture.before, &picture.after].map(|values| points(values));
    let unit = format!("{}/√Hz", written(&picture.error.unit));
    let y = Axis::new(format!("Amplitude, {unit}")).names(decades(series.iter().flatten().map(|point| point.1)));
    let x = Axis::new("Frequency, Hz").names(decades(series.iter().flatten().map(|point| point.0)));
    let [noise, before, after] = series;
    let panel = Panel::new(y)
        .mark(Mark::line("noise", Colour::GREY, noise))
        .mark(Mark::line("before", BEFORE, before))
        .mark(Mark::line("after", AFTER, after))
        .height(150.0);
    let caption = "Both axes rise by powers of ten.";
    Figure::new(format!("Spectrum: {}", picture.error.name), x).panel(panel).width(width_px).caption(caption)
}

/// Names of the powers of ten within the logarithms of a set of values.
fn decades(logarithms: impl Iterator<Item = f64>) -> Vec<(f64, String)> {
    let (low, high) = logarithms.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return Vec::new();
    }
    let (first, last) = ((low - 0.02).ceil() as i32, (high + 0.02).floor() as i32);
    let power = |n: i32| if (-3..=4).contains(&n) { format!("{}", 10_f64.powi(n)) } else { format!("1e{n}") };
    (first..=last).take(24).map(|n| (f64::from(n), power(n))).collect()
}
