//! Axes: ranges from data, ticks at round numbers, labels with as many decimals as they need.

/// Values beyond this are drawn nowhere: no quantity of a robot has them, and they would overflow the arithmetic.
const DRAWABLE_MAX: f64 = 1e100;

/// May a value be drawn?
pub(super) fn drawable(value: f64) -> bool {
    value.abs() <= DRAWABLE_MAX
}

/// An axis: a title with the unit, and a range if it is not to follow the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Title, such as `Time, s`.
    pub title: String,
    /// Fixed range; otherwise that of the data with a little room.
    pub range: Option<(f64, f64)>,
    /// Values that the range must include.
    pub including: Vec<f64>,
    /// Names instead of numbers, each at its place.
    pub names: Vec<(f64, String)>,
}

impl Axis {
    /// An axis whose range follows the data.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), range: None, including: Vec::new(), names: Vec::new() }
    }

    /// Fixes the range; limits that are not finite or not rising are passed over.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        if drawable(low) && drawable(high) && low < high {
            self.range = Some((low, high));
        }
        self
    }

    /// Makes sure that the range holds a value.
    #[must_use]
    pub fn including(mut self, value: f64) -> Self {
        if drawable(value) {
            self.including.push(value);
        }
        self
    }

    /// Names for 0, 1, 2, ...
    #[must_use]
    pub fn categories(self, names: impl IntoIterator<Item = String>) -> Self {
        self.names(names.into_iter().enumerate().map(|(i, name)| (i as f64, name)))
    }

    /// Names at their places instead of numbers at round ones; where two would touch, the later one is left out.
    #[must_use]
    pub fn names(mut self, names: impl IntoIterator<Item = (f64, String)>) -> Self {
        self.names = names.into_iter().filter(|(value, _)| drawable(*value)).collect();
        self
    }

    /// Range for data from `low` to `high` (low above high: no data), with `room` as a share of the span on both sides.
    pub(super) fn span(&self, data: (f64, f64), room: f64) -> (f64, f64) {
        if let Some(range) = self.range {
            return range;
        }
        let start = if data.0 <= data.1 { data } else { (f64::INFINITY, f64::NEG_INFINITY) };
        let (low, high) = self.including.iter().fold(start, |(low, high), value| (low.min(*value), high.max(*value)));
        if low > high {
            return (0.0, 1.0);
        }
        // A constant gets a band around it, so that it is seen to be constant and not noise.
        if high - low <= 1e-9 * low.abs().max(high.abs()) {
            let half = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            return (low - half, high + half);
        }
        (low - room * (high - low), high + room * (high - low))
    }
}

/// Ticks with their labels; labels are the values divided by ten to the `exponent`.
#[derive(Debug, Clone, PartialEq)]
pub struct Ticks {
    /// Round values within the range.
    pub values: Vec<f64>,
    /// One label per value.
    pub labels: Vec<String>,
    /// Multiple of three, zero for ordinary sizes: to be written beside the axis.
    pub exponent: i32,
}

/// At most `most` (at least two) round numbers in a range: steps of 1, 2 or 5 times a power of ten.
pub fn ticks(low: f64, high: f64, most: usize) -> Ticks {
    if !(drawable(low) && drawable(high) && high > low) {
        return Ticks { values: Vec::new(), labels: Vec::new(), exponent: 0 };
    }
    let step = round_step((high - low) / most.max(2) as f64);
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    let count = if last >= first { (last - first) as usize + 1 } else { 0 };
    // Adding zero makes a negative zero a plain one.
    let values: Vec<f64> = (0..count.min(100)).map(|i| (first + i as f64) * step + 0.0).collect();
    let size = low.abs().max(high.abs());
    let exponent = if (1e-3..1e5).contains(&size) { 0 } else { 3 * (size.log10() / 3.0).floor() as i32 };
    let unit = 10_f64.powi(exponent);
    let decimals = (-(step / unit).log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
    let labels = values.iter().map(|value| number(value / unit, decimals)).collect();
    Ticks { values, labels, exponent }
}

fn round_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= least * (1.0 - 1e-9)).unwrap_or(10.0);
    factor * power
}

/// A number with so many decimals, a true minus sign, and no minus before zero.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.bytes().all(|byte| matches!(byte, b'0' | b'.')) => size.to_owned(),
        Some(size) => format!("\u{2212}{size}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        for (low, high, labels, exponent) in [
            (0.0, 10.0, "0 2 4 6 8 10", 0),
            (-0.35, 0.41, "\u{2212}0.2 0.0 0.2 0.4", 0),
            (3.02, 3.11, "3.02 3.04 3.06 3.08 3.10", 0),
            (0.0, 250_000.0, "0 50 100 150 200 250", 3),
            (-2e-5, 2e-5, "\u{2212}20 \u{2212}10 0 10 20", -6),
        ] {
            let ticks = ticks(low, high, 5);
            assert_eq!((ticks.labels.join(" "), ticks.exponent), (labels.to_owned(), exponent), "{low}..{high}");
        }
        assert!(ticks(1.0, 1.0, 5).values.is_empty() && ticks(f64::NAN, 1.0, 5).values.is_empty());
        assert!(ticks(0.0, f64::INFINITY, 5).values.is_empty());
    }

    #[test]
    fn ranges_survive_constants_and_nothing() {
        let axis = Axis::new("");
        assert_eq!(axis.span((f64::INFINITY, f64::NEG_INFINITY), 0.05), (0.0, 1.0));
        assert_eq!(axis.span((0.0, 0.0), 0.05), (-1.0, 1.0));
        assert_eq!(axis.span((-4.0, -4.0), 0.05), (-4.4, -3.6));
        assert_eq!(axis.clone().including(0.0).span((1.0, 2.0), 0.0), (0.0, 2.0));
        assert_eq!(axis.clone().range(2.0, 1.0).range(f64::NAN, 1.0).range, None);
    }
}
