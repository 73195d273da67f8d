//! Numbers in words and captions.

use crate::figure::number;
use crate::statistics::Statistics;

/// A value with three significant digits, no exponent for ordinary sizes; `–` for one that is not finite.
pub(super) fn short(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = value.abs().log10().floor();
    if !(-6.0..7.0).contains(&magnitude) {
        return format!("{value:.2e}").replace('-', "\u{2212}");
    }
    number(value, (2.0 - magnitude).clamp(0.0, 8.0) as usize)
}

/// Duration in words.
pub(super) fn duration(seconds: f64) -> String {
    let whole = seconds.round();
    match seconds {
        s if s < 120.0 => format!("{} s", short(s)),
        s if s < 7200.0 => format!("{} min {} s", (whole / 60.0).floor(), whole % 60.0),
        _ => format!("{} h {} min", (whole / 3600.0).floor(), ((whole % 3600.0) / 60.0).floor()),
    }
}

/// A count with thin spaces between thousands.
pub(super) fn count(value: usize) -> String {
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

/// `RMS 1.23 mm, 95 % below 2.34 mm, at most 3.45 mm`.
pub(super) fn sizes(statistics: &Statistics, unit: &str) -> String {
    let with = |value: f64| if unit.is_empty() { short(value) } else { format!("{} {unit}", short(value)) };
    format!("RMS {}, 95 % below {}, at most {}", with(statistics.rms), with(statistics.p95), with(statistics.max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (1.234_56, "1.23"),
            (-12.345, "\u{2212}12.3"),
            (98_765.4, "98765"),
            (0.000_123_4, "0.000123"),
            (f64::NAN, "–"),
            (1.5e9, "1.50e9"),
        ] {
            assert_eq!(short(value), text);
        }
        assert_eq!(duration(12.0), "12.0 s");
        assert_eq!(duration(119.999), "120 s");
        assert_eq!(duration(839.7), "14 min 0 s");
        assert_eq!(duration(8400.0), "2 h 20 min");
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
    }
}
