//! Numbers as people read them: three significant digits, a true minus sign, no more digits than the interval gives.

use plot::figure::number as fixed;

use super::unit::{Scale, scale, written};
use crate::{ExcessRms, Fit};

/// A value with three significant digits; `unknown` for one that is not finite.
pub(crate) fn short(value: f64) -> String {
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    if value != 0.0 && !(1e-6..1e7).contains(&value.abs()) {
        return format!("{value:.2e}").replace('-', "\u{2212}");
    }
    fixed(value, decimals(value, 3))
}

/// Decimals that give a value so many significant digits.
fn decimals(value: f64, digits: i32) -> usize {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    // Rounding may add a digit: 9.996 has two decimals like 10.0 has one.
    let magnitude = value.abs().log10().floor() as i32;
    let rounded = fixed(value.abs(), (digits - 1 - magnitude).clamp(0, 9) as usize).parse().unwrap_or(value);
    (digits - 1 - f64::log10(rounded).floor() as i32).clamp(0, 9) as usize
}

/// A value of the report with its unit, in the multiple that reads best: `23.1 ms`.
pub(crate) fn with_unit(value: f64, unit: &str) -> String {
    let Scale { name, per_unit } = scale(value, unit);
    joined(&short(value * per_unit), &name)
}

/// A value of the report with its unit as it stands: `1.62 mm`.
pub(crate) fn as_given(value: f64, unit: &str) -> String {
    joined(&short(value), &written(unit))
}

/// Values of the report in one multiple of their unit, that in which the largest reads best.
pub(crate) fn in_one_unit<const N: usize>(values: [f64; N], unit: &str) -> [String; N] {
    let largest = values.iter().filter(|value| value.is_finite()).fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let Scale { name, per_unit } = scale(largest, unit);
    values.map(|value| joined(&short(value * per_unit), &name))
}

/// What a figure is before and after, and by noise alone where that is known, in one multiple of its unit.
pub(crate) fn before_and_after(fit: &Fit) -> ([String; 2], Option<String>) {
    let [before, after, floor] = in_one_unit([fit.before, fit.after, fit.noise_floor.unwrap_or(0.0)], &fit.unit);
    ([before, after], fit.noise_floor.map(|_| floor))
}

/// What is beyond noise, noise alone, and the model's own error where that is the reason, in one multiple of their unit.
pub(crate) fn beside_noise(excess: &ExcessRms) -> ([String; 2], Option<String>) {
    let own = excess.model_error();
    let [value, floor, missed] = in_one_unit([excess.value, excess.noise_floor, own.unwrap_or(0.0)], &excess.unit);
    ([value, floor], own.map(|_| missed))
}

/// Number and unit, not to be broken between lines; no space before degrees.
pub(crate) fn joined(number: &str, unit: &str) -> String {
    match unit {
        "" => number.to_owned(),
        "°" => format!("{number}°"),
        unit => format!("{number}\u{a0}{}", unit.replace(' ', "\u{a0}")),
    }
}

/// A value and its interval, in one unit and with equal decimals.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Estimate {
    /// The value without its unit.
    pub(crate) value: String,
    /// Lower limit.
    pub(crate) low: String,
    /// Upper limit.
    pub(crate) high: String,
    /// The unit; empty for plain numbers.
    pub(crate) unit: String,
}

impl Estimate {
    /// In the multiple of a unit of the report that reads best.
    pub(crate) fn new(value: f64, ci95: [f64; 2], unit: &str) -> Self {
        Self::scaled(value, ci95, &scale(value, unit))
    }

    /// In a given multiple. As many decimals as two digits of the half width need, but three significant digits at most.
    pub(crate) fn scaled(value: f64, ci95: [f64; 2], scale: &Scale) -> Self {
        Self::in_digits(value, ci95, value, scale)
    }

    /// With the digits of its distance from what would be nothing.
    pub(crate) fn beside(value: f64, ci95: [f64; 2], nothing: f64, unit: &str) -> Self {
        Self::in_digits(value, ci95, value - nothing, &scale(value, unit))
    }

    fn in_digits(value: f64, ci95: [f64; 2], of: f64, scale: &Scale) -> Self {
        let [value, low, high, of] = [value, ci95[0], ci95[1], of].map(|value| value * scale.per_unit);
        let half = 0.5 * (high - low).abs();
        let largest = of.abs().max(if of == 0.0 { half } else { 0.0 });
        let places = if half > 0.0 { decimals(largest, 3).min(decimals(half, 2)) } else { decimals(largest, 3) };
        let text = |value: f64| if value.is_finite() { fixed(value, places) } else { "unknown".to_owned() };
        Self { value: text(value), low: text(low), high: text(high), unit: scale.name.clone() }
    }

    /// `12.1 N (11.3 to 12.9)`.
    pub(crate) fn with_interval(&self) -> String {
        format!("{} ({})", self.plain(), self.interval())
    }

    /// `12.1 N`.
    pub(crate) fn plain(&self) -> String {
        joined(&self.value, &self.unit)
    }

    /// `11.3 to 12.9`.
    pub(crate) fn interval(&self) -> String {
        if self.unit == "°" {
            format!("{}°\u{a0}to\u{a0}{}°", self.low, self.high)
        } else {
            format!("{}\u{a0}to\u{a0}{}", self.low, self.high)
        }
    }
}

/// A share as per cent: `98.7 %`, below one per mille `< 0.1 %`.
pub(crate) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value {
        value if !value.is_finite() => "unknown".to_owned(),
        value if value > 0.0 && value < 0.1 => "< 0.1\u{a0}%".to_owned(),
        value if value.abs() < 10.0 && value != 0.0 => format!("{}\u{a0}%", fixed(value, 1)),
        value => format!("{}\u{a0}%", fixed(value, 0)),
    }
}

/// A probability as per cent without claiming certainty: never 0 or 100.
pub(crate) fn probability(value: f64) -> String {
    match value {
        value if value > 0.99 => "> 99\u{a0}%".to_owned(),
        value if value < 0.01 => "< 1\u{a0}%".to_owned(),
        value => format!("{}\u{a0}%", fixed(100.0 * value, 0)),
    }
}

/// A p or q value: `< 0.001`, `0.0040`, `0.46`.
pub(crate) fn significance(value: f64) -> String {
    match value {
        value if value < 0.001 => "< 0.001".to_owned(),
        value if value < 0.1 => fixed(value, 3),
        value => fixed(value, 2),
    }
}

/// A duration: `11.1 s`, `5 min 2 s`, `2 h 20 min`.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.round();
    match seconds {
        s if !s.is_finite() => "unknown".to_owned(),
        s if s < 119.5 => with_unit(s, "s").replacen(".0\u{a0}", "\u{a0}", 1),
        s if s < 7199.5 => format!("{}\u{a0}min {}\u{a0}s", (whole / 60.0).floor(), whole % 60.0),
        _ => format!("{}\u{a0}h {}\u{a0}min", (whole / 3600.0).floor(), ((whole % 3600.0) / 60.0).floor()),
    }
}

/// A count with thin spaces between thousands.
pub(crate) fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (13.4, "13.4"),
            (0.97, "0.970"),
            (9.996, "10.0"),
            (99.96, "100"),
            (0.0, "0"),
            (1234.6, "1235"),
            (-0.000_5, "\u{2212}0.000500"),
            (3e-9, "3.00e\u{2212}9"),
            (f64::NAN, "unknown"),
        ] {
            assert_eq!(short(value), text);
        }
        assert_eq!(with_unit(0.0231, "s"), "23.1\u{a0}ms");
        assert_eq!(as_given(1.62, "mm"), "1.62\u{a0}mm");
        assert_eq!(in_one_unit([3.5e-4, 5.86e-5], "rad"), ["350\u{a0}\u{b5}rad", "58.6\u{a0}\u{b5}rad"]);
        assert_eq!(in_one_unit([0.925, 3.65e-3], "N.m"), ["0.925\u{a0}N\u{a0}m", "0.00365\u{a0}N\u{a0}m"]);
        assert_eq!(in_one_unit([f64::NAN, 2.67e-6], "m"), ["unknown\u{a0}\u{b5}m", "2.67\u{a0}\u{b5}m"]);
    }

    #[test]
    fn intervals_share_their_decimals() {
        let text = |value, ci95, unit| Estimate::new(value, ci95, unit).with_interval().replace('\u{a0}', " ");
        assert_eq!(text(12.1, [11.3, 12.9], "N"), "12.1 N (11.3 to 12.9)");
        assert_eq!(text(0.81, [0.70, 0.92], "N.m"), "0.81 N m (0.70 to 0.92)");
        assert_eq!(text(0.0231, [0.0219, 0.0244], "s"), "23.1 ms (21.9 to 24.4)");
        assert_eq!(text(3.2, [-4.0, 10.1], "N"), "3.2 N (\u{2212}4.0 to 10.1)");
        assert_eq!(text(5700.0, [5100.0, 6200.0], "N.m/rad"), "5700 N m/rad (5100 to 6200)");
        assert_eq!(text(0.0, [-0.2, 0.2], "1"), "0.00 (\u{2212}0.20 to 0.20)");
        assert_eq!(text(2.0, [2.0, 2.0], "1"), "2.00 (2.00 to 2.00)");
    }

    #[test]
    fn shares_and_times_read_well() {
        let plain = |text: String| text.replace(['\u{a0}', '\u{202f}'], " ");
        assert_eq!(plain(percent(0.987)), "99 %");
        assert_eq!(plain(percent(0.045)), "4.5 %");
        assert_eq!(plain(probability(0.999)), "> 99 %");
        assert_eq!(plain(probability(0.71)), "71 %");
        assert_eq!(plain(duration(302.0)), "5 min 2 s");
        assert_eq!(plain(duration(0.9)), "900 ms");
        assert_eq!(plain(duration(45.0)), "45 s");
        assert_eq!(plain(duration(11.1)), "11.1 s");
        assert_eq!(plain(count(62_000)), "62 000");
        assert_eq!(significance(1e-6), "< 0.001");
    }
}
