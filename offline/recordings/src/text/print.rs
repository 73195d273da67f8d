//! Numbers to text.

/// Appends the shortest text that reads back as the same double, bit for bit (but for the sign and payload of NaN).
pub(crate) fn shortest(out: &mut Vec<u8>, value: f64) {
    if !value.is_finite() {
        out.extend_from_slice(not_finite(value).as_bytes());
        return;
    }
    // Whole numbers need no search for digits; minus zero keeps its sign.
    if value.trunc() == value && value.abs() < 1e15 {
        if value.is_sign_negative() {
            out.push(b'-');
        }
        unsigned(out, value.abs() as u64);
        return;
    }
    let mut buffer = zmij::Buffer::new();
    let text = buffer.format_finite(value);
    out.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
}

fn not_finite(value: f64) -> &'static str {
    match (value.is_nan(), value > 0.0) {
        (true, _) => "nan",
        (false, true) => "inf",
        (false, false) => "-inf",
    }
}

/// Appends a whole number.
pub(crate) fn integer(out: &mut Vec<u8>, value: i64) {
    if value < 0 {
        out.push(b'-');
    }
    unsigned(out, value.unsigned_abs());
}

fn unsigned(out: &mut Vec<u8>, value: u64) {
    let mut digits = [0_u8; 20];
    let start = fill(&mut digits, value);
    out.extend_from_slice(&digits[start..]);
}

/// Appends a whole number with leading zeros up to a width.
fn padded(out: &mut Vec<u8>, value: u64, width: usize) {
    let mut digits = [b'0'; 20];
    let start = fill(&mut digits, value).min(20 - width);
    out.extend_from_slice(&digits[start..]);
}

/// Digits of every number below 100, two by two: half the divisions.
const PAIRS: [u8; 200] = {
    let mut pairs = [0; 200];
    let mut i = 0;
    while i < 100 {
        pairs[2 * i] = b'0' + (i / 10) as u8;
        pairs[2 * i + 1] = b'0' + (i % 10) as u8;
        i += 1;
    }
    pairs
};

/// Writes the digits at the end of the buffer; returns where they begin.
fn fill(digits: &mut [u8; 20], mut value: u64) -> usize {
    let mut at = 20;
    while value >= 100 {
        let pair = 2 * (value % 100) as usize;
        value /= 100;
        at -= 2;
        digits[at..at + 2].copy_from_slice(&PAIRS[pair..pair + 2]);
    }
    if value >= 10 {
        at -= 2;
        digits[at..].iter_mut().zip(&PAIRS[2 * value as usize..2 * value as usize + 2]).for_each(|(to, from)| *to = *from);
    } else {
        at -= 1;
        digits[at] = b'0' + value as u8;
    }
    at
}

/// Appends a float as C's `%.6f` does, ties to even.
pub(crate) fn fixed6(out: &mut Vec<u8>, value: f32) {
    // 24 bits of mantissa times 15625 · 2^6 fit the 53 bits of a double, so the product is exact and rounded once.
    let scaled = (f64::from(value) * 1e6).round_ties_even();
    if scaled.abs() < 1e18 {
        if value.is_sign_negative() {
            out.push(b'-');
        }
        let scaled = scaled.abs() as u64;
        unsigned(out, scaled / 1_000_000);
        out.push(b'.');
        padded(out, scaled % 1_000_000, 6);
    } else if value.is_finite() {
        out.extend_from_slice(format!("{value:.6}").as_bytes());
    } else {
        out.extend_from_slice(not_finite(f64::from(value)).as_bytes());
    }
}

/// Appends nanoseconds as seconds with six decimals, to the nearest.
pub(crate) fn microseconds_as_seconds(out: &mut Vec<u8>, nanoseconds: i64) {
    if nanoseconds < 0 {
        out.push(b'-');
    }
    let microseconds = nanoseconds.unsigned_abs().saturating_add(500) / 1000;
    unsigned(out, microseconds / 1_000_000);
    out.push(b'.');
    padded(out, microseconds % 1_000_000, 6);
}

/// Significant digits of `%.18e`.
const DIGITS: i32 = 19;
const DIGITS_MIN: u128 = 10_u128.pow(18);
const DIGITS_MAX: u128 = 10_u128.pow(19);

/// Appends a double as C's `%.18e` does, ties to even.
pub(crate) fn exponent18(out: &mut Vec<u8>, value: f64) {
    if !value.is_finite() {
        out.extend_from_slice(not_finite(value).as_bytes());
        return;
    }
    if value.is_sign_negative() {
        out.push(b'-');
    }
    if value == 0.0 {
        out.extend_from_slice(b"0.000000000000000000e+00");
        return;
    }
    match digits_of(value.abs()) {
        Some((digits, exponent)) => scientific(out, digits, exponent),
        None => by_standard_library(out, value.abs()),
    }
}

/// Nineteen digits of a positive number and the decimal exponent of the first, exactly, where 128 bits are enough.
fn digits_of(value: f64) -> Option<(u64, i32)> {
    let bits = value.to_bits();
    let biased = (bits >> 52) as i32;
    if biased == 0 {
        return None;
    }
    let mantissa = (bits & ((1 << 52) - 1)) | (1 << 52);
    let zeros = mantissa.trailing_zeros();
    let (mantissa, binary) = (mantissa >> zeros, biased - 1075 + zeros as i32);
    // log10(2) is a little more than 1233/4096: the decimal exponent is this or one more.
    let mut exponent = ((biased - 1023) * 1233) >> 12;
    for _ in 0..3 {
        let digits = times_power(mantissa, binary, DIGITS - 1 - exponent)?;
        if digits < DIGITS_MIN {
            exponent -= 1;
        } else if digits >= DIGITS_MAX {
            exponent += 1;
        } else {
            return Some((digits as u64, exponent));
        }
    }
    None
}

/// `mantissa · 2^binary · 10^decimal` rounded to a whole number, ties to even.
fn times_power(mantissa: u64, binary: i32, decimal: i32) -> Option<u128> {
    let five = 5_u128.checked_pow(u32::try_from(decimal).ok()?)?;
    let product = u128::from(mantissa).checked_mul(five)?;
    let shift = binary + decimal;
    if shift >= 0 {
        let shift = shift as u32;
        return (shift < product.leading_zeros()).then(|| product << shift);
    }
    let shift = shift.unsigned_abs();
    if shift >= 128 {
        return None;
    }
    let (whole, rest, half) = (product >> shift, product & ((1 << shift) - 1), 1_u128 << (shift - 1));
    Some(whole + u128::from(rest > half || (rest == half && whole & 1 == 1)))
}

fn scientific(out: &mut Vec<u8>, digits: u64, exponent: i32) {
    out.push(b'0' + (digits / DIGITS_MIN as u64) as u8);
    out.push(b'.');
    padded(out, digits % DIGITS_MIN as u64, 18);
    out.push(b'e');
    out.push(if exponent < 0 { b'-' } else { b'+' });
    let exponent = u64::from(exponent.unsigned_abs());
    padded(out, exponent, if exponent < 100 { 2 } else { 3 });
}

fn by_standard_library(out: &mut Vec<u8>, value: f64) {
    let text = format!("{value:.18e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    out.extend_from_slice(mantissa.as_bytes());
    let exponent: i32 = exponent.parse().unwrap_or(0);
    out.push(b'e');
    out.push(if exponent < 0 { b'-' } else { b'+' });
    let exponent = u64::from(exponent.unsigned_abs());
    padded(out, exponent, if exponent < 100 { 2 } else { 3 });
}

/// Appends nanoseconds as seconds in the form of `%.18e`: nineteen digits hold every nanosecond since 1970 exactly, which a
/// double does not.
pub(crate) fn nanoseconds_as_exponent18(out: &mut Vec<u8>, nanoseconds: i64) {
    if nanoseconds < 0 {
        out.push(b'-');
    }
    let mut digits = nanoseconds.unsigned_abs();
    if digits == 0 {
        out.extend_from_slice(b"0.000000000000000000e+00");
        return;
    }
    let mut exponent = 9;
    while u128::from(digits) < DIGITS_MIN {
        digits *= 10;
        exponent -= 1;
    }
    scientific(out, digits, exponent);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(print: impl FnOnce(&mut Vec<u8>)) -> String {
        let mut out = Vec::new();
        print(&mut out);
        String::from_utf8(out).expect("ASCII")
    }

    /// SplitMix64: bit patterns from all over the range.
    fn patterns() -> impl Iterator<Item = u64> {
        let mut state = 7_u64;
        std::iter::repeat_with(move || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb)
        })
        .take(20_000)
    }

    /// What C prints for `%.18e`.
    fn reference18(value: f64) -> String {
        let text = format!("{value:.18e}");
        let (mantissa, exponent) = text.split_once('e').expect("exponent");
        let exponent: i32 = exponent.parse().expect("number");
        format!("{mantissa}e{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs())
    }

    #[test]
    fn the_shortest_text_reads_back_bit_for_bit() {
        for value in patterns().map(f64::from_bits).chain([0.0, -0.0, 1.0, -12.0, 0.1, 1e15, 1e21, 5e-324, 1.5e300, 123_456.789]) {
            let text = text(|out| shortest(out, value));
            let read: f64 = text.parse().expect("number");
            assert!(read.to_bits() == value.to_bits() || (read.is_nan() && value.is_nan()), "{value:e}: {text}");
        }
        assert_eq!(text(|out| shortest(out, -0.0)), "-0");
        assert_eq!(text(|out| shortest(out, 0.001)), "0.001");
        assert_eq!(text(|out| shortest(out, 77_925.0)), "77925");
    }

    #[test]
    fn six_decimals_are_those_of_c() {
        for value in patterns().map(|bits| f32::from_bits(bits as u32)).chain([0.0, -0.0, 0.5e-6, 1.5e-6, -12.0, 51_559.766, 3e38])
        {
            let expected = if value.is_nan() { "nan".to_owned() } else { format!("{value:.6}") };
            assert_eq!(text(|out| fixed6(out, value)), expected, "{value:e}");
        }
    }

    #[test]
    fn nineteen_digits_are_those_of_c() {
        let singles = patterns().map(|bits| f64::from(f32::from_bits(bits as u32)));
        let usual = patterns().map(|bits| (bits >> 11) as f64 / 1e10 - 450_000.0);
        let powers = (-30..30).map(|power| 10_f64.powi(power));
        for value in patterns().map(f64::from_bits).chain(singles).chain(usual).chain(powers).filter(|value| value.is_finite()) {
            if value != 0.0 {
                assert_eq!(text(|out| exponent18(out, value)), reference18(value), "{value:e}");
            }
        }
        assert_eq!(text(|out| exponent18(out, -0.0)), "-0.000000000000000000e+00");
        assert_eq!(text(|out| exponent18(out, f64::NAN)), "nan");
    }

    #[test]
    fn times_keep_their_nanoseconds() {
        for (nanoseconds, expected) in [
            (1_570_000_000_123_456_789, "1.570000000123456789e+09"),
            (0, "0.000000000000000000e+00"),
            (-1_000_000, "-1.000000000000000000e-03"),
            (i64::MAX, "9.223372036854775807e+09"),
            (1, "1.000000000000000000e-09"),
        ] {
            assert_eq!(text(|out| nanoseconds_as_exponent18(out, nanoseconds)), expected);
        }
        assert_eq!(text(|out| microseconds_as_seconds(out, 1_570_000_000_123_456_789)), "1570000000.123457");
        assert_eq!(text(|out| microseconds_as_seconds(out, -1_500)), "-0.000002");
        assert_eq!(text(|out| integer(out, i64::MIN)), "-9223372036854775808");
    }
}
