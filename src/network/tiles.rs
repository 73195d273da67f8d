//! Matrix times vector in whole numbers: weights of one byte, of one and a half or of two, activations of two, exact sums by VNNI.
//!
//! Activations become `scale * (256 * high + low)` with one scale for the whole vector; `high` and `low` are stored as unsigned bytes,
//! 128 too large, as the instruction wants one unsigned operand. What the 128 adds to a sum, it adds for every input alike: it is in
//! the number that each sum starts from. Weights that are larger have a second digit, of eight bits or of four; the product of both low
//! digits is left out: it is zero on average and no more than what rounding the weights did.
//!
//! A tile is sixteen outputs by four inputs: a cache line of high digits, and one of low digits, or half of one that it shares with its
//! neighbour. There a byte is `16 a + b + 8` of the two low digits: its products as it is, less those of its lower half, are 16 times those
//! of `a`. Up to eight tiles (a panel) that use the same inputs lie together, high digits first, in the order in which they are read.
//!
//! This module contains `unsafe`: vector loads through pointers whose bounds are checked once before the loop, and calls of functions
//! compiled for an instruction set that was found on this machine.

#[allow(clippy::wildcard_imports, reason = "vector instructions")]
use std::arch::x86_64::*;

use super::activation;
use super::format::{Format, LARGEST_DIGITS};
use super::instructions::{InstructionSet, LANE, Lane, Line};
use super::region::Lines;
use super::rounding::Whole;
use ravenpose_importer::Activation;

/// Inputs of a tile.
const DEPTH: usize = 4;
/// Most tiles side by side: their sums fit the registers.
const WIDTH: usize = 8;
/// The same where each tile has two lines: what is read at wider strides is fetched ahead less well (decision 0013).
const WIDTH_OF_TWO: usize = 6;

/// Bits of the low digit of weights of 16 bits, of 12, and of 8, which have none.
const BYTE: u32 = 8;
const NIBBLE: u32 = 4;
const NONE: u32 = 0;

/// `number = 2^bits * high + low`, with a low digit of so many bits, balanced around zero.
fn digits(number: i32, bits: u32) -> (i32, i32) {
    let high = (number + ((1 << bits) >> 1)) >> bits;
    (high, number - (high << bits))
}

/// What makes a low digit of half a byte positive.
const HALF_STEPS: i32 = 8;

/// Lines of one group of inputs in a panel so wide.
const fn lines_per_group(width: usize, low: u32) -> usize {
    match low {
        NONE => width,
        NIBBLE => width + width.div_ceil(2),
        _ => 2 * width,
    }
}

/// Activations as digits, for [`Tiles::run`].
#[derive(Clone)]
pub(super) struct Digits {
    high: Box<[Line]>,
    low: Box<[Line]>,
    scale: f32,
}

impl Digits {
    /// Room for `lanes` lanes of activations.
    pub(super) fn new(lanes: usize) -> Self {
        let room = vec![Line([0; 64]); (lanes * LANE).div_ceil(64)].into_boxed_slice();
        Self { high: room.clone(), low: room, scale: 0.0 }
    }

    /// The sum of the upper digits of so many groups, 128 too large each.
    ///
    /// # Safety
    /// AVX-512F and VNNI must be present, and the digits of so many groups there.
    #[target_feature(enable = "avx512f,avx512vnni")]
    unsafe fn tops(&self, groups: usize) -> i32 {
        let ones = _mm512_set1_epi8(1);
        let mut sums = _mm512_setzero_si512();
        for first in (0..groups).step_by(LANE) {
            let there = if groups - first < LANE { (1 << (groups - first)) - 1 } else { u16::MAX };
            // SAFETY: a group is four bytes, and those behind the last one are not read.
            let digits = unsafe { _mm512_maskz_loadu_epi32(there, self.high.as_ptr().cast::<i32>().add(first)) };
            sums = _mm512_dpbusd_epi32(sums, digits, ones);
        }
        _mm512_reduce_add_epi32(sums)
    }

    /// Takes `values` in; with NaN or infinity among them the scale is NaN, and so is every output.
    #[target_feature(enable = "avx512f")]
    fn take(&mut self, values: &[Lane]) {
        assert!(self.high.len() * 64 >= values.len() * LANE && self.low.len() == self.high.len(), "plan buffers disagree");
        let sign = _mm512_set1_epi32(i32::MAX);
        let mut largest = _mm512_setzero_si512();
        for lane in values {
            // As whole numbers, magnitudes keep their order and NaN is the largest; the maximum of floats would lose it.
            // SAFETY: a lane is 64 aligned bytes.
            let bits = unsafe { _mm512_load_si512(lane.0.as_ptr().cast()) };
            largest = _mm512_max_epi32(largest, _mm512_and_si512(bits, sign));
        }
        let largest = f32::from_bits(_mm512_reduce_max_epi32(largest).cast_unsigned());
        let usable = largest.is_finite() && largest >= super::SMALLEST_WEIGHT;
        self.scale = if usable { largest / LARGEST_DIGITS } else { largest * 0.0 };
        let inverse = _mm512_set1_ps(if usable { LARGEST_DIGITS / largest } else { 0.0 });
        // Both digits 128 too large: the two bytes of the number with as much added.
        let offset = _mm512_set1_ps(128.0 * 257.0);
        let (high, low) = (self.high.as_mut_ptr().cast::<u8>(), self.low.as_mut_ptr().cast::<u8>());
        for (index, lane) in values.iter().enumerate() {
            // SAFETY: a lane is 64 aligned bytes; 16 bytes per lane fit into both buffers, which was checked above.
            unsafe {
                let number = _mm512_cvtps_epi32(_mm512_fmadd_ps(_mm512_load_ps(lane.0.as_ptr()), inverse, offset));
                _mm_store_si128(high.add(index * LANE).cast(), _mm512_cvtepi32_epi8(_mm512_srli_epi32::<8>(number)));
                _mm_store_si128(low.add(index * LANE).cast(), _mm512_cvtepi32_epi8(number));
            }
        }
    }
}

/// A layer's weights.
pub(super) struct Tiles {
    pub(super) lines: Lines,
    /// Groups of four inputs.
    groups: usize,
    /// Tiles side by side in the whole layer.
    across: usize,
    /// Bits of the weights' low digit.
    low: u32,
    /// What each sum starts from, by output: that of high digits alone, and that where activations or weights have the low one.
    start: Box<[[i32; LANE]]>,
    start_mixed: Box<[[i32; LANE]]>,
    scale: Box<[Lane]>,
}

impl Tiles {
    /// Packs whole numbers; only where the machine has VNNI.
    pub(super) fn new(whole: &Whole) -> Self {
        assert_eq!(InstructionSet::best(), InstructionSet::Avx512Vnni, "tiles are for VNNI");
        let low = match whole.format {
            Format::I8 => NONE,
            Format::I12 => NIBBLE,
            _ => BYTE,
        };
        let (groups, tiles) = (whole.inputs.div_ceil(DEPTH), whole.scale.len().div_ceil(LANE));
        // Of each tile: its panel's first tile and width, and the line where that begins.
        let mut panel_of = Vec::with_capacity(tiles);
        let mut lines = 0;
        for (first, width) in panels(tiles, low) {
            panel_of.extend(std::iter::repeat_n((first, width, lines), width));
            lines += groups * lines_per_group(width, low);
        }
        let mut lines = vec![Line([0; 64]); lines].into_boxed_slice();
        if low == NIBBLE {
            // Of inputs that pad, too: those are added for all inputs at once.
            for (first, width) in panels(tiles, low) {
                let groups = lines[panel_of[first].2..].chunks_exact_mut(lines_per_group(width, low)).take(groups);
                groups.for_each(|group| group[width..width + width / 2].fill(Line([HALF_STEPS as u8; 64])));
            }
        }
        let mut start = vec![[0; LANE]; tiles].into_boxed_slice();
        let (mut start_mixed, mut scales) = (start.clone(), super::zeros(tiles));
        for (row, (numbers, scale)) in whole.numbers.chunks_exact(whole.inputs).zip(&whole.scale).enumerate() {
            let (tile, place) = (row / LANE, row % LANE);
            // A step of the high digit is so many steps of the weights; `panel` has the rest.
            scales[tile].0[place] = (1_u32 << low) as f32 * scale;
            let (panel, side_by_side, begin) = panel_of[tile];
            let in_panel = tile - panel;
            for (column, number) in numbers.iter().enumerate() {
                let group = begin + column / DEPTH * lines_per_group(side_by_side, low);
                let byte = place * DEPTH + column % DEPTH;
                let (high, rest) = digits(*number, low);
                lines[group + in_panel].0[byte] = (high as i8).cast_unsigned();
                start[tile][place] -= 128 * high;
                // In the upper bits of a byte, which has a sign: times as much as makes a step of its product one of `rests`.
                let rest = rest << (BYTE - low);
                start_mixed[tile][place] -= 128 * (high + rest);
                let (rest, lows) = ((rest as i8).cast_unsigned(), group + side_by_side);
                match low {
                    NONE => {}
                    // Of two neighbours the first has the upper half of the byte, the other the lower, which stands at its middle.
                    NIBBLE if in_panel.is_multiple_of(2) => lines[lows + in_panel / 2].0[byte] |= rest,
                    NIBBLE => lines[lows + in_panel / 2].0[byte] ^= (rest >> NIBBLE) & 0x0f,
                    _ => lines[lows + in_panel].0[byte] = rest,
                }
            }
        }
        Self { lines: lines.into(), groups, across: tiles, low, start, start_mixed, scale: scales }
    }

    /// `output = activation(weights * input + bias)`; `digits` is room to work in.
    pub(super) fn run(&self, activation: Activation, bias: &[Lane], input: &[Lane], digits: &mut Digits, output: &mut [Lane]) {
        // SAFETY: `new` made sure that the machine has VNNI.
        unsafe {
            match self.low {
                NONE => self.panels::<NONE>(activation, bias, input, digits, output),
                NIBBLE => self.panels::<NIBBLE>(activation, bias, input, digits, output),
                _ => self.panels::<BYTE>(activation, bias, input, digits, output),
            }
        }
    }

    /// # Safety
    /// AVX-512F and VNNI must be present; `LOW` is `self.low`.
    #[target_feature(enable = "avx512f,avx512vnni")]
    unsafe fn panels<const LOW: u32>(
        &self,
        activation: Activation,
        bias: &[Lane],
        input: &[Lane],
        digits: &mut Digits,
        output: &mut [Lane],
    ) {
        let lanes = (self.groups * DEPTH).div_ceil(LANE);
        assert!(input.len() >= lanes && bias.len() >= self.across && output.len() >= self.across, "plan buffers disagree");
        digits.take(&input[..lanes]);
        // SAFETY: of so many lanes the digits were just taken.
        let eighths = if LOW == NIBBLE { unsafe { digits.tops(self.groups) }.wrapping_mul(HALF_STEPS) } else { 0 };
        let mut lines = &*self.lines;
        for (first, width) in panels(self.across, LOW) {
            let (panel, behind) = lines.split_at(self.groups * lines_per_group(width, LOW));
            lines = behind;
            // SAFETY: the caller's promise; the panel begins at a tile that exists and is `width` tiles wide, and these are its lines.
            unsafe {
                match width {
                    1 => self.panel::<1, 4, LOW>(panel, first, bias, digits, eighths, output),
                    2 => self.panel::<2, 4, LOW>(panel, first, bias, digits, eighths, output),
                    3 => self.panel::<3, 2, LOW>(panel, first, bias, digits, eighths, output),
                    4 => self.panel::<4, 2, LOW>(panel, first, bias, digits, eighths, output),
                    5 => self.panel::<5, 1, LOW>(panel, first, bias, digits, eighths, output),
                    6 => self.panel::<6, 1, LOW>(panel, first, bias, digits, eighths, output),
                    7 => self.panel::<7, 1, LOW>(panel, first, bias, digits, eighths, output),
                    _ => self.panel::<8, 1, LOW>(panel, first, bias, digits, eighths, output),
                }
            }
            // While the next panel's weights are on their way.
            activation::apply_avx512(activation, &mut output[first..first + width]);
        }
    }

    /// Sums of `N` tiles side by side, `DEEP` groups of inputs at a time with sums of their own: the few sums of a narrow panel would wait
    /// for one another.
    ///
    /// # Safety
    /// As [`Tiles::panels`], and tiles `first..first + N` must exist and be the panel of these `lines`.
    #[target_feature(enable = "avx512f,avx512vnni")]
    unsafe fn panel<const N: usize, const DEEP: usize, const LOW: u32>(
        &self,
        lines: &[Line],
        first: usize,
        bias: &[Lane],
        digits: &Digits,
        eighths: i32,
        output: &mut [Lane],
    ) {
        let (high, low) = (digits.high.as_ptr().cast::<i32>(), digits.low.as_ptr().cast::<i32>());
        let scale = _mm512_set1_ps(digits.scale);
        let lower_halves = _mm512_set1_epi8(0x0f);
        let none = [[_mm512_setzero_si512(); N]; DEEP];
        let (mut tops, mut rests, mut crossed) = (none, none, none);
        // SAFETY: `panels` checked the lengths and `new` made them: `groups` words of activations, as many times the lines of a group, a
        // start and a scale for each tile.
        unsafe {
            let mut w = lines.as_ptr().cast::<__m512i>();
            let mut add = |group: usize, deep: usize| {
                let (top, rest) = (_mm512_set1_epi32(*high.add(group)), _mm512_set1_epi32(*low.add(group)));
                for tile in 0..N {
                    let weight = _mm512_load_si512(w.add(tile));
                    tops[deep][tile] = _mm512_dpbusd_epi32(tops[deep][tile], top, weight);
                    rests[deep][tile] = _mm512_dpbusd_epi32(rests[deep][tile], rest, weight);
                    let low = match LOW {
                        NONE => continue,
                        // Both halves of the byte, and the lower one alone.
                        NIBBLE if tile % 2 == 0 => _mm512_load_si512(w.add(N + tile / 2)),
                        NIBBLE => _mm512_and_si512(_mm512_load_si512(w.add(N + tile / 2)), lower_halves),
                        _ => _mm512_load_si512(w.add(N + tile)),
                    };
                    crossed[deep][tile] = _mm512_dpbusd_epi32(crossed[deep][tile], top, low);
                }
                w = w.add(lines_per_group(N, LOW));
            };
            let whole = self.groups / DEEP * DEEP;
            let mut group = 0;
            while group < whole {
                for deep in 0..DEEP {
                    add(group + deep, deep);
                }
                group += DEEP;
            }
            for group in whole..self.groups {
                add(group, 0);
            }
            let mut sums = crossed[0];
            for other in &crossed[1..] {
                for (sum, other) in sums.iter_mut().zip(other) {
                    *sum = _mm512_add_epi32(*sum, *other);
                }
            }
            for tile in 0..N {
                let at = first + tile;
                let start = |of: &[[i32; LANE]]| _mm512_loadu_si512(of[at].as_ptr().cast());
                let mut top = start(&self.start);
                // Without low digits both start alike.
                let mut rest = if LOW == NONE { top } else { start(&self.start_mixed) };
                for deep in 0..DEEP {
                    top = _mm512_add_epi32(top, tops[deep][tile]);
                    rest = _mm512_add_epi32(rest, rests[deep][tile]);
                }
                let crossed = match LOW {
                    NONE => _mm512_setzero_si512(),
                    NIBBLE if tile % 2 == 1 => {
                        _mm512_slli_epi32::<NIBBLE>(_mm512_sub_epi32(sums[tile], _mm512_set1_epi32(eighths)))
                    }
                    NIBBLE if tile + 1 < N => _mm512_sub_epi32(sums[tile], sums[tile + 1]),
                    _ => sums[tile],
                };
                rest = _mm512_add_epi32(rest, crossed);
                let sum = _mm512_fmadd_ps(_mm512_cvtepi32_ps(top), _mm512_set1_ps(256.0), _mm512_cvtepi32_ps(rest));
                let factor = _mm512_mul_ps(scale, _mm512_load_ps(self.scale[at].0.as_ptr()));
                _mm512_store_ps(output[at].0.as_mut_ptr(), _mm512_fmadd_ps(sum, factor, _mm512_load_ps(bias[at].0.as_ptr())));
            }
        }
    }
}

/// The panels of so many tiles: first tile, and how many lie side by side. As few panels as can be, as equal as can be.
fn panels(tiles: usize, low: u32) -> impl Iterator<Item = (usize, usize)> {
    let count = tiles.div_ceil(if low == BYTE { WIDTH_OF_TWO } else { WIDTH });
    let (narrow, wider) = (tiles / count.max(1), tiles % count.max(1));
    (0..count).map(move |panel| (panel * narrow + panel.min(wider), narrow + usize::from(panel < wider)))
}

#[cfg(test)]
mod tests {
    use super::{BYTE, Format, NIBBLE, NONE, WIDTH, WIDTH_OF_TWO, digits, panels};

    #[test]
    fn panels_follow_one_another_and_differ_by_one_tile_at_most() {
        for (tiles, (low, most)) in
            (1..200).flat_map(|tiles| [(NONE, WIDTH), (NIBBLE, WIDTH), (BYTE, WIDTH_OF_TWO)].map(|low| (tiles, low)))
        {
            let (mut first, mut widths) = (0, Vec::new());
            for (start, width) in panels(tiles, low) {
                assert!(start == first && width > 0, "{tiles} {first}");
                widths.push(width);
                first += width;
            }
            let (narrowest, widest) = (widths.iter().min().unwrap_or(&0), widths.iter().max().unwrap_or(&0));
            assert!(first == tiles && *widest <= most && widest - narrowest <= 1, "{tiles}: {widths:?}");
        }
    }

    #[test]
    fn digits_make_up_their_number() {
        for (format, bits, lows) in [(Format::I16, BYTE, -128..128), (Format::I12, NIBBLE, -8..8), (Format::I8, NONE, 0..1)] {
            let largest = format.round(1e9, 1.0);
            for number in -largest..=largest {
                let (high, low) = digits(number, bits);
                assert!((high << bits) + low == number && (-128..128).contains(&high) && lows.contains(&low), "{number}");
            }
            assert_eq!(digits(largest + 1, bits).0, 128, "{format} could have larger numbers");
        }
    }
}
