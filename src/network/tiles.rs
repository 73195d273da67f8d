//! Matrix times vector in whole numbers: weights of one or two signed bytes, activations of two, exact sums by VNNI.
//!
//! Activations become `scale * (256 * high + low)` with one scale for the whole vector; `high` and `low` are stored as unsigned bytes,
//! 128 too large, as the instruction wants one unsigned operand. What the 128 adds to a sum, it adds for every input alike: it is in
//! the number that each sum starts from. Of two-byte weights the product of both low digits is left out: it is zero on average and
//! below what rounding the weights did.
//!
//! A tile is sixteen outputs by four inputs, one cache line per digit. Up to eight tiles (a panel) that use the same inputs lie together, in the
//! order in which they are read.
//!
//! This module contains `unsafe`: vector loads through pointers whose bounds are checked once before the loop, and calls of functions
//! compiled for an instruction set that was found on this machine.

#[allow(clippy::wildcard_imports, reason = "vector instructions")]
use std::arch::x86_64::*;

use super::activation;
use super::format::LARGEST_DIGITS;
use super::instructions::{InstructionSet, LANE, Lane, Line};
use super::rounding::Whole;
use ravenpose_importer::Activation;

/// Inputs of a tile.
const DEPTH: usize = 4;
/// Most tiles side by side.
const WIDTH: usize = 8;

/// `number = 256 * high + low` with both digits in [-128, 127].
fn digits(number: i32) -> (i32, i32) {
    let high = (number + 128) >> 8;
    (high, number - (high << 8))
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
    lines: Box<[Line]>,
    /// Groups of four inputs.
    groups: usize,
    /// Tiles side by side in the whole layer.
    across: usize,
    two: bool,
    /// What each sum starts from, by output: with the weights' only or high digit, and with the low one added for two.
    start: Box<[[i32; LANE]]>,
    start_mixed: Box<[[i32; LANE]]>,
    scale: Box<[Lane]>,
}

impl Tiles {
    /// Packs whole numbers of one or two bytes; only where the machine has VNNI.
    pub(super) fn new(whole: &Whole) -> Self {
        assert_eq!(InstructionSet::best(), InstructionSet::Avx512Vnni, "tiles are for VNNI");
        let two = whole.bytes == 2;
        let (groups, tiles) = (whole.inputs.div_ceil(DEPTH), whole.scale.len().div_ceil(LANE));
        let panel_of: Vec<_> = panels(tiles).flat_map(|panel| std::iter::repeat_n(panel, panel.1)).collect();
        let mut packed = Self {
            lines: vec![Line([0; 64]); groups * tiles * whole.bytes].into_boxed_slice(),
            groups,
            across: tiles,
            two,
            start: vec![[0; LANE]; tiles].into_boxed_slice(),
            start_mixed: vec![[0; LANE]; tiles].into_boxed_slice(),
            scale: super::zeros(tiles),
        };
        for (row, (numbers, scale)) in whole.numbers.chunks_exact(whole.inputs).zip(&whole.scale).enumerate() {
            let (tile, place) = (row / LANE, row % LANE);
            // A step of the sum of high digits is 256 steps of the weights, or 1 where there is one digit; `panel` has the rest.
            packed.scale[tile].0[place] = if two { 256.0 * scale } else { *scale };
            let (panel, side_by_side) = panel_of[tile];
            for (column, number) in numbers.iter().enumerate() {
                let line = (panel * groups + column / DEPTH * side_by_side + tile - panel) * whole.bytes;
                let byte = place * DEPTH + column % DEPTH;
                let (high, low) = if two { digits(*number) } else { (*number, 0) };
                packed.lines[line].0[byte] = (high as i8).cast_unsigned();
                packed.start[tile][place] -= 128 * high;
                packed.start_mixed[tile][place] -= 128 * (high + low);
                if two {
                    packed.lines[line + 1].0[byte] = (low as i8).cast_unsigned();
                }
            }
        }
        packed
    }

    pub(super) fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// `output = activation(weights * input + bias)`; `digits` is room to work in.
    pub(super) fn run(&self, activation: Activation, bias: &[Lane], input: &[Lane], digits: &mut Digits, output: &mut [Lane]) {
        // SAFETY: `new` made sure that the machine has VNNI.
        unsafe {
            if self.two {
                self.panels::<true>(activation, bias, input, digits, output);
            } else {
                self.panels::<false>(activation, bias, input, digits, output);
            }
        }
    }

    /// # Safety
    /// AVX-512F and VNNI must be present; `TWO` is `self.two`.
    #[target_feature(enable = "avx512f,avx512vnni")]
    unsafe fn panels<const TWO: bool>(
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
        for (first, width) in panels(self.across) {
            // SAFETY: the caller's promise; the panel begins at a tile that exists and is `width` tiles wide.
            unsafe {
                match width {
                    1 => self.panel::<1, 4, TWO>(first, bias, digits, output),
                    2 => self.panel::<2, 4, TWO>(first, bias, digits, output),
                    3 => self.panel::<3, 2, TWO>(first, bias, digits, output),
                    4 => self.panel::<4, 2, TWO>(first, bias, digits, output),
                    5 => self.panel::<5, 1, TWO>(first, bias, digits, output),
                    6 => self.panel::<6, 1, TWO>(first, bias, digits, output),
                    7 => self.panel::<7, 1, TWO>(first, bias, digits, output),
                    _ => self.panel::<8, 1, TWO>(first, bias, digits, output),
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
    /// As [`Tiles::panels`], and tiles `first..first + N` must exist and lie together.
    #[target_feature(enable = "avx512f,avx512vnni")]
    unsafe fn panel<const N: usize, const DEEP: usize, const TWO: bool>(
        &self,
        first: usize,
        bias: &[Lane],
        digits: &Digits,
        output: &mut [Lane],
    ) {
        let (high, low) = (digits.high.as_ptr().cast::<i32>(), digits.low.as_ptr().cast::<i32>());
        let scale = _mm512_set1_ps(digits.scale);
        // Words of a tile: one line per digit.
        let words = if TWO { 32 } else { 16 };
        let none = [[_mm512_setzero_si512(); N]; DEEP];
        let (mut tops, mut rests, mut crossed) = (none, none, none);
        // SAFETY: `panels` checked the lengths and `new` made them: `groups` words of activations, `groups * N` tiles from the panel's
        // first, a start and a scale for each.
        unsafe {
            let mut w = self.lines.as_ptr().cast::<i32>().add(first * self.groups * words);
            let mut add = |group: usize, deep: usize| {
                let (top, rest) = (_mm512_set1_epi32(*high.add(group)), _mm512_set1_epi32(*low.add(group)));
                for tile in 0..N {
                    let weight = _mm512_load_si512(w.add(tile * words).cast());
                    tops[deep][tile] = _mm512_dpbusd_epi32(tops[deep][tile], top, weight);
                    rests[deep][tile] = _mm512_dpbusd_epi32(rests[deep][tile], rest, weight);
                    if TWO {
                        let weight_rest = _mm512_load_si512(w.add(tile * words + 16).cast());
                        crossed[deep][tile] = _mm512_dpbusd_epi32(crossed[deep][tile], top, weight_rest);
                    }
                }
                w = w.add(N * words);
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
            for tile in 0..N {
                let at = first + tile;
                let start = |of: &[[i32; LANE]]| _mm512_loadu_si512(of[at].as_ptr().cast());
                let mut top = start(&self.start);
                let mut rest = start(if TWO { &self.start_mixed } else { &self.start });
                for deep in 0..DEEP {
                    top = _mm512_add_epi32(top, tops[deep][tile]);
                    rest = _mm512_add_epi32(rest, _mm512_add_epi32(rests[deep][tile], crossed[deep][tile]));
                }
                let sum = _mm512_fmadd_ps(_mm512_cvtepi32_ps(top), _mm512_set1_ps(256.0), _mm512_cvtepi32_ps(rest));
                let factor = _mm512_mul_ps(scale, _mm512_load_ps(self.scale[at].0.as_ptr()));
                _mm512_store_ps(output[at].0.as_mut_ptr(), _mm512_fmadd_ps(sum, factor, _mm512_load_ps(bias[at].0.as_ptr())));
            }
        }
    }
}

/// The panels of so many tiles: first tile, and how many lie side by side. As few panels as can be, as equal as can be.
fn panels(tiles: usize) -> impl Iterator<Item = (usize, usize)> {
    let count = tiles.div_ceil(WIDTH);
    let (narrow, wider) = (tiles / count.max(1), tiles % count.max(1));
    (0..count).map(move |panel| (panel * narrow + panel.min(wider), narrow + usize::from(panel < wider)))
}

#[cfg(test)]
mod tests {
    use super::{WIDTH, digits, panels};

    #[test]
    fn panels_follow_one_another_and_differ_by_one_tile_at_most() {
        for tiles in 1..200 {
            let (mut first, mut widths) = (0, Vec::new());
            for (start, width) in panels(tiles) {
                assert!(start == first && width > 0, "{tiles} {first}");
                widths.push(width);
                first += width;
            }
            let (narrowest, widest) = (widths.iter().min().unwrap_or(&0), widths.iter().max().unwrap_or(&0));
            assert!(first == tiles && *widest <= WIDTH && widest - narrowest <= 1, "{tiles}: {widths:?}");
        }
    }

    #[test]
    fn digits_make_up_their_number() {
        for number in -32_639..=32_639 {
            let (high, low) = digits(number);
            assert!(256 * high + low == number && (-128..128).contains(&high) && (-128..128).contains(&low), "{number}");
        }
    }
}
