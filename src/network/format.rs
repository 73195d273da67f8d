//! Number formats of stored weights, and how a row of weights becomes one.

use thiserror::Error;

/// How weights are stored. Sums are always of float32, or exact in integers; only what is read from memory gets smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// IEEE 754 binary32, as imported.
    F32,
    /// IEEE 754 binary16 with a power of two per row that keeps it clear of overflow.
    F16,
    /// The upper half of binary32.
    Bf16,
    /// Whole numbers of 16 bits with a scale per row.
    I16,
    /// Whole numbers of 12 bits with a scale per row.
    I12,
    /// Whole numbers of 8 bits with a scale per row.
    I8,
}

/// A word that names no format.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0:?} is not a weight format; use f32, f16, bf16, i16, i12 or i8")]
pub struct UnknownFormat(String);

impl std::str::FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(text: &str) -> Result<Self, UnknownFormat> {
        Self::ALL.into_iter().find(|format| format.name() == text).ok_or_else(|| UnknownFormat(text.to_owned()))
    }
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 6] = [Self::F32, Self::F16, Self::Bf16, Self::I16, Self::I12, Self::I8];

    /// Name in configurations and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
            Self::Bf16 => "bf16",
            Self::I16 => "i16",
            Self::I12 => "i12",
            Self::I8 => "i8",
        }
    }

    /// Bytes of one weight; those of 12 bits are packed closer where the kernel can.
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 | Self::Bf16 | Self::I16 | Self::I12 => 2,
            Self::I8 => 1,
        }
    }

    /// Largest whole number of an integer format: its balanced digits, the high one of 8 bits, the low one of what is left, still fit.
    fn largest(self) -> f32 {
        match self {
            Self::I8 => 127.0,
            Self::I12 => 2039.0,
            _ => LARGEST_DIGITS,
        }
    }

    /// Is each number rounded with regard to the others of its row? With 16 bits there is nothing to gain: their sums leave out as much.
    pub(super) fn is_rounded_together(self) -> bool {
        matches!(self, Self::I12 | Self::I8)
    }

    /// What a layer takes in this one's place of whose inputs nothing is known: the first.
    pub(super) fn unrelated(self) -> Self {
        match self {
            Self::I8 => Self::I12,
            Self::I12 => Self::I16,
            other => other,
        }
    }

    /// What a stored number of this row is multiplied by to give the weight.
    pub(super) fn row_scale(self, row: &[f32]) -> f32 {
        let largest = row.iter().fold(0.0_f32, |largest, weight| largest.max(weight.abs()));
        match self {
            Self::F32 | Self::Bf16 => 1.0,
            _ if largest < super::SMALLEST_WEIGHT => 1.0,
            // Largest number between 2^14 and 2^15: half of what binary16 holds.
            Self::F16 => (largest.log2().floor() - 14.0).exp2(),
            Self::I16 | Self::I12 | Self::I8 => largest / self.largest(),
        }
    }

    /// The whole number nearest to `weight / scale`.
    pub(super) fn round(self, weight: f32, scale: f32) -> i32 {
        (weight / scale).round_ties_even().clamp(-self.largest(), self.largest()) as i32
    }
}

/// `127 * 256 + 127`: the largest number whose two balanced digits both fit in a signed byte.
pub(super) const LARGEST_DIGITS: f32 = 32_639.0;

/// To binary16, to nearest, ties to even.
pub(super) fn to_f16(value: f32) -> u16 {
    let bits = value.to_bits();
    let sign = (bits >> 16 & 0x8000) as u16;
    let magnitude = bits & 0x7fff_ffff;
    if magnitude >= 0x4780_0000 {
        // Too large, infinite or NaN.
        return sign | if magnitude > 0x7f80_0000 { 0x7e00 } else { 0x7c00 };
    }
    if magnitude < 0x3880_0000 {
        // Denormal: adding 0.5 leaves the rounded number of steps of 2^-24 in the low bits.
        let steps = (f32::from_bits(magnitude) + 0.5).to_bits() - 0.5_f32.to_bits();
        return sign | steps as u16;
    }
    let odd = magnitude >> 13 & 1;
    sign | ((magnitude - 0x3800_0000 + 0x0fff + odd) >> 13) as u16
}

/// From binary16.
#[expect(clippy::inline_always, reason = "inlined into loops that are to be vectorised")]
#[inline(always)]
pub(super) fn from_f16(bits: u16) -> f32 {
    // Exponent and fraction moved into place are the number times 2^-112; infinity and NaN get their exponent back.
    let magnitude = f32::from_bits(u32::from(bits & 0x7fff) << 13) * f32::from_bits(0x7780_0000);
    let magnitude = if bits & 0x7c00 == 0x7c00 { f32::from_bits(magnitude.to_bits() | 0x7f80_0000) } else { magnitude };
    f32::from_bits(magnitude.to_bits() | u32::from(bits & 0x8000) << 16)
}

/// To the upper half of binary32, to nearest, ties to even.
pub(super) fn to_bf16(value: f32) -> u16 {
    let bits = value.to_bits();
    if value.is_nan() {
        return (bits >> 16) as u16 | 0x40;
    }
    (bits.wrapping_add(0x7fff + (bits >> 16 & 1)) >> 16) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Binary16 by its definition.
    fn f16_value(bits: u16) -> f64 {
        let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
        let fraction = f64::from(bits & 0x3ff) / 1024.0;
        match bits >> 10 & 31 {
            0 => sign * fraction * 2.0_f64.powi(-14),
            31 if fraction == 0.0 => sign * f64::INFINITY,
            31 => f64::NAN,
            exponent => sign * (1.0 + fraction) * 2.0_f64.powi(i32::from(exponent) - 15),
        }
    }

    #[test]
    fn every_binary16_is_read_as_its_definition_says_and_survives_the_way_back() {
        for bits in 0..=u16::MAX {
            let (value, truth) = (from_f16(bits), f16_value(bits));
            assert!(f64::from(value) == truth || (value.is_nan() && truth.is_nan()), "{bits:#x}");
            if !truth.is_nan() {
                assert_eq!(to_f16(value), bits, "{value:e}");
            }
        }
        assert!(from_f16(to_f16(f32::NAN)).is_nan());
    }

    #[test]
    fn binary16_rounds_to_the_nearest_and_halves_to_even() {
        for bits in 0..0x7bff_u16 {
            let (low, high) = (f16_value(bits), f16_value(bits + 1));
            let middle = f64::midpoint(low, high) as f32;
            let even = if bits & 1 == 0 { bits } else { bits + 1 };
            assert_eq!(to_f16(middle), even, "{middle:e}");
            assert_eq!(to_f16(middle.next_down()), bits);
            assert_eq!(to_f16(middle.next_up()), bits + 1);
            assert_eq!(to_f16(-middle), even | 0x8000);
        }
    }

    #[test]
    fn bf16_rounds_to_the_nearest_and_halves_to_even() {
        for (value, bits) in [(1.0, 0x3f80), (f32::from_bits(0x3f80_8000), 0x3f80), (f32::from_bits(0x3f81_8000), 0x3f82)] {
            assert_eq!(to_bf16(value), bits);
        }
        assert!(f32::from_bits(u32::from(to_bf16(f32::from_bits(0x7f80_0001))) << 16).is_nan());
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        for format in Format::ALL {
            assert_eq!(format.name().parse(), Ok(format));
        }
        assert!("int4".parse::<Format>().is_err_and(|error| error.to_string().contains("\"int4\"")));
    }
}
