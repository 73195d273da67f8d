//! Text to numbers.

/// Powers of ten that are exact in a double.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Largest whole number below which a double holds every whole number.
const EXACT_MAX: u64 = 1 << 53;

/// A number in the forms that Rust reads (`1`, `-1.5`, `+.5e-3`, `inf`, `nan`), rounded to the nearest double.
pub(crate) fn number(text: &[u8]) -> Option<f64> {
    match scan(text) {
        Some(decimal) if decimal.end == text.len() => decimal.double(),
        _ => None,
    }
    .or_else(|| std::str::from_utf8(text).ok()?.parse().ok())
}

/// The number in the cell that the text begins with, as [`number`], and where the cell ends; blanks round it are passed over.
pub(crate) fn number_of_cell(text: &[u8], ends: impl Fn(u8) -> bool) -> (Option<f64>, usize) {
    let decimal = scan(text).filter(|decimal| text.get(decimal.end).is_none_or(|byte| ends(*byte)));
    if let Some((value, end)) = decimal.and_then(|decimal| Some((decimal.double()?, decimal.end))) {
        return (Some(value), end);
    }
    let end = text.iter().position(|byte| ends(*byte)).unwrap_or(text.len());
    (number(text[..end].trim_ascii()), end)
}

/// The same, rounded to the nearest single.
pub(crate) fn single_of_cell(text: &[u8], ends: impl Fn(u8) -> bool) -> (Option<f32>, usize) {
    let decimal = scan(text).filter(|decimal| text.get(decimal.end).is_none_or(|byte| ends(*byte)));
    if let Some((value, end)) = decimal.and_then(|decimal| Some((decimal.single()?, decimal.end))) {
        return (Some(value), end);
    }
    let end = text.iter().position(|byte| ends(*byte)).unwrap_or(text.len());
    (std::str::from_utf8(text[..end].trim_ascii()).ok().and_then(|cell| cell.parse().ok()), end)
}

/// A decimal number of at most nineteen digits at the start of a text: `±whole · 10^power`.
struct Decimal {
    negative: bool,
    whole: u64,
    power: i32,
    end: usize,
}

impl Decimal {
    fn signed(&self, value: f64) -> f64 {
        if self.negative { -value } else { value }
    }

    /// The nearest double, where one rounding is enough to get there: an exact whole number times or over an exact power of
    /// ten (Clinger 1990). Everything else is left to the standard library.
    fn double(&self) -> Option<f64> {
        let (mut whole, mut power) = (self.whole, self.power);
        if whole > EXACT_MAX {
            // `%.18e` of a whole number ends in zeros.
            for (zeros, scale) in [(8, 100_000_000), (4, 10_000), (4, 10_000), (2, 100), (1, 10)] {
                if whole.is_multiple_of(scale) {
                    whole /= scale;
                    power += zeros;
                }
            }
        }
        (whole <= EXACT_MAX).then(|| scaled_by_power(whole, power)).flatten().map(|value| self.signed(value))
    }

    /// The nearest single, where a double that is off by less than two of its steps tells it.
    fn single(&self) -> Option<f32> {
        let near = scaled_by_power(self.whole, self.power)?;
        let (low, high) = (near.next_down().next_down() as f32, near.next_up().next_up() as f32);
        if near == 0.0 {
            return Some(self.signed(0.0) as f32);
        }
        (low == high).then(|| self.signed(near) as f32)
    }
}

/// Rounded twice at most, once if the whole number is exact in a double; none for powers that are not.
fn scaled_by_power(whole: u64, power: i32) -> Option<f64> {
    if whole == 0 {
        return Some(0.0);
    }
    let scale = *POWERS.get(power.unsigned_abs() as usize)?;
    Some(if power < 0 { whole as f64 / scale } else { whole as f64 * scale })
}

/// `[-]digits[.digits][e[+-]digits]`; none where it is something else, has more digits, or runs into a letter.
fn scan(text: &[u8]) -> Option<Decimal> {
    let negative = text.first() == Some(&b'-');
    let start = usize::from(negative);
    let (whole, point) = digits(text, start, 0);
    let (whole, mut at, decimals) = if text.get(point) == Some(&b'.') {
        let (whole, end) = digits(text, point + 1, whole);
        (whole, end, end - point - 1)
    } else {
        (whole, point, 0)
    };
    // Nineteen digits fit 64 bits, and more were not counted wrongly: they are refused here.
    let count = point - start + decimals;
    if count == 0 || count > 19 {
        return None;
    }
    let mut power = -(decimals as i32);
    if matches!(text.get(at), Some(b'e' | b'E')) {
        let (exponent, end) = exponent(text, at + 1)?;
        power += exponent;
        at = end;
    }
    Some(Decimal { negative, whole, power, end: at })
}

/// Appends decimal digits to a number; where they end. Beyond nineteen digits in all the number is meaningless.
fn digits(text: &[u8], start: usize, mut whole: u64) -> (u64, usize) {
    let mut at = start;
    while let Some(eight) = text.get(at..at + 8).and_then(|chunk| <[u8; 8]>::try_from(chunk).ok()).and_then(eight_digits) {
        whole = whole.wrapping_mul(100_000_000).wrapping_add(eight);
        at += 8;
    }
    while let Some(digit) = text.get(at).filter(|byte| byte.is_ascii_digit()) {
        whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit - b'0'));
        at += 1;
    }
    (whole, at)
}

/// Eight digits at once, if all are (Lemire, "Quickly parsing eight digits", 2018).
fn eight_digits(text: [u8; 8]) -> Option<u64> {
    let chunk = u64::from_le_bytes(text);
    let is_digits = (chunk & 0xf0f0_f0f0_f0f0_f0f0) | ((chunk.wrapping_add(0x0606_0606_0606_0606) & 0xf0f0_f0f0_f0f0_f0f0) >> 4)
        == 0x3333_3333_3333_3333;
    if !is_digits {
        return None;
    }
    let pairs = (chunk & 0x0f0f_0f0f_0f0f_0f0f).wrapping_mul(2561) >> 8;
    let fours = (pairs & 0x00ff_00ff_00ff_00ff).wrapping_mul(6_553_601) >> 16;
    Some((fours & 0x0000_ffff_0000_ffff).wrapping_mul(42_949_672_960_001) >> 32)
}

/// `[+-]digits` with at most three digits, and where they end.
fn exponent(text: &[u8], start: usize) -> Option<(i32, usize)> {
    let signed = matches!(text.get(start), Some(b'+' | b'-'));
    let first = start + usize::from(signed);
    let (mut value, mut at) = (0, first);
    while let Some(digit) = text.get(at).filter(|byte| byte.is_ascii_digit()) {
        value = value * 10 + i32::from(digit - b'0');
        at += 1;
        if at - first > 3 {
            return None;
        }
    }
    let negative = text.get(start) == Some(&b'-');
    (at > first).then_some((if negative { -value } else { value }, at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        for text in [
            "0",
            "-0",
            "1",
            "-1.5",
            "0.001",
            "51559.76562",
            "9007199254740993",
            "9007199254740992",
            "1e5",
            "+.5",
            "5.",
            ".",
            "-",
            "",
            "1.2.3",
            "1e999",
            "inf",
            "-inf",
            "nan",
            "0x10",
            "1_000",
            "123456789012345678901234567890",
            "1.000000000000000000e+00",
            "0.30000000000000004",
            "4.9e-324",
            "1e",
            "1e+",
            "1e5x",
            "1x",
            "12e",
            "1.500000000000000000e-03",
            "-1.200000000000000000e+01",
            "1.570000000123456001e+09",
            "9.007199254740993000e+15",
            "1e22",
            "1e23",
            "1e-22",
            "3e-23",
            "1e0005",
            "e5",
            "5e-1 ",
            "12345678901234.567",
            "1234567890123456789",
            "-0.0",
        ] {
            let (found, expected) = (number(text.as_bytes()), text.parse::<f64>().ok());
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{text}");
        }
    }

    #[test]
    fn singles_are_those_of_the_standard_library() {
        let mut bits = 1_u64;
        for round in 0..200_000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = f32::from_bits((bits >> 32) as u32);
            let text = match round % 4 {
                0 => format!("{:.18e}", f64::from(value)),
                1 => format!("{:.6}", bits as i64 as f64 / 1e14),
                // Half way between two singles, and a hair beside.
                2 => format!("{:.18e}", f64::midpoint(f64::from(value), f64::from(value.next_up()))),
                _ => format!("{}", bits >> 8),
            };
            let (found, end) = single_of_cell(text.as_bytes(), |byte| byte == b',');
            let expected: f32 = text.parse().expect("number");
            assert_eq!(found.map(f32::to_bits), Some(expected.to_bits()), "{text}");
            assert_eq!(end, text.len());
            assert_eq!(number(text.as_bytes()).map(f64::to_bits), text.parse().ok().map(f64::to_bits), "{text}");
        }
        assert_eq!(single_of_cell(b"-0.000000 ", |byte| byte == b' ').0.map(f32::to_bits), Some((-0.0_f32).to_bits()));
    }

    #[test]
    fn a_cell_ends_where_it_ends() {
        let comma = |byte| byte == b',';
        for (text, value, end) in [
            ("1.5,2", Some(1.5), 3),
            (" 1.5 ,2", Some(1.5), 5),
            ("", None, 0),
            (",2", None, 0),
            ("1.5", Some(1.5), 3),
            ("-2e3,", Some(-2000.0), 4),
            ("0.1234567890123456789,", Some(0.123_456_789_012_345_68), 21),
            ("1.5abc,2", None, 6),
            ("inf,2", Some(f64::INFINITY), 3),
            ("1e400,2", Some(f64::INFINITY), 5),
        ] {
            assert_eq!(number_of_cell(text.as_bytes(), comma), (value, end), "{text}");
        }
    }
}
