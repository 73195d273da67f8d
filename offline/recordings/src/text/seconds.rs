//! Times in seconds to whole nanoseconds.

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
