//! Text to numbers.

/// Powers of ten that are exact in a double.
pub(super) const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21,
    1e22,
];

/// Largest whole number below which a double holds every whole number.
const EXACT_MAX: u64 = 1 << 53;

/// A number in the forms that Rust reads (`1`, `-1.5`, `+.5e-3`, `inf`, `nan`), rounded to the nearest double.
pub(crate) fn number(text: &[u8]) -> Option<f64> {
    plain(text).or_else(|| std::str::from_utf8(text).ok()?.parse().ok())
}

/// `[-]digits[.digits]` with few digits: one exact integer divided by one exact power is rounded once, so correctly
/// (Clinger 1990). Everything else is left to the standard library.
fn plain(text: &[u8]) -> Option<f64> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, text),
    };
    if digits.is_empty() || digits.len() > 19 {
        return None;
    }
    let (mut whole, mut point) = (0_u64, None);
    for (i, byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => whole = whole * 10 + u64::from(byte - b'0'),
            b'.' if point.is_none() => point = Some(i),
            _ => return None,
        }
    }
    let decimals = match point {
        Some(_) if digits.len() == 1 => return None,
        Some(point) => digits.len() - 1 - point,
        None => 0,
    };
    if whole > EXACT_MAX {
        return None;
    }
    let value = whole as f64 / POWERS[decimals];
    Some(if negative { -value } else { value })
}

/// Seconds as decimal text to nanoseconds, to the nearest, without the rounding of a double; none if it is not a finite
/// decimal number or beyond the range.
pub(crate) fn decimal_nanoseconds(text: &[u8]) -> Option<i64> {
    let (negative, rest) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    };
    let (mantissa, exponent) = match rest.iter().position(|byte| matches!(byte, b'e' | b'E')) {
        Some(at) => (&rest[..at], std::str::from_utf8(&rest[at + 1..]).ok()?.parse::<i32>().ok()?),
        None => (rest, 0),
    };
    let (digits, decimals) = digits_of(mantissa)?;
    let scale = exponent.checked_sub(decimals)?.checked_add(9)?;
    let nanoseconds = scaled(digits, scale)?;
    Some(if negative { -nanoseconds } else { nanoseconds })
}

/// The digits as one whole number, and how many of them stand after the point; beyond 30 digits the rest is cut.
fn digits_of(text: &[u8]) -> Option<(u128, i32)> {
    let (mut whole, mut decimals, mut count, mut after_point, mut any) = (0_u128, 0_i32, 0, false, false);
    for byte in text {
        match byte {
            b'0'..=b'9' => {
                any = true;
                if count < 30 {
                    whole = whole * 10 + u128::from(byte - b'0');
                    count += i32::from(whole != 0);
                    decimals += i32::from(after_point);
                } else if !after_point {
                    decimals -= 1;
                }
            }
            b'.' if !after_point => after_point = true,
            _ => return None,
        }
    }
    any.then_some((whole, decimals))
}

/// `digits · 10^scale`, rounded to the nearest.
fn scaled(digits: u128, scale: i32) -> Option<i64> {
    if digits == 0 {
        return Some(0);
    }
    let value = if scale >= 0 {
        digits.checked_mul(10_u128.checked_pow(scale as u32)?)?
    } else if scale < -38 {
        0
    } else {
        let divisor = 10_u128.pow(scale.unsigned_abs());
        digits / divisor + u128::from(digits % divisor >= divisor.div_ceil(2))
    };
    i64::try_from(value).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        for text in [
            "0", "-0", "1", "-1.5", "0.001", "51559.76562", "9007199254740993", "9007199254740992", "1e5", "+.5", "5.", ".", "-",
            "", "1.2.3", "1e999", "inf", "-inf", "nan", "0x10", "1_000", "123456789012345678901234567890", "1.000000000000000000e+00",
            "0.30000000000000004", "4.9e-324", "12345678901234.567", "1234567890123456789", "-0.0",
        ] {
            let (found, expected) = (number(text.as_bytes()), text.parse::<f64>().ok());
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{text}");
        }
    }

    #[test]
    fn seconds_become_nanoseconds_exactly() {
        for (text, expected) in [
            ("1570000000.123456789", Some(1_570_000_000_123_456_789)),
            ("1.570000000123456789e+09", Some(1_570_000_000_123_456_789)),
            ("0", Some(0)),
            ("-0.001", Some(-1_000_000)),
            ("1e-9", Some(1)),
            ("5e-10", Some(1)),
            ("4.9e-10", Some(0)),
            ("1e-60", Some(0)),
            ("0.0000000000000000000000000000000000001", Some(0)),
            ("1e99", None),
            ("9.3e9", None),
            ("nan", None),
            ("", None),
            (".", None),
            ("1e", None),
        ] {
            assert_eq!(decimal_nanoseconds(text.as_bytes()), expected, "{text}");
        }
    }
}
