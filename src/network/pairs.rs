//! Matrix times vector with whole numbers on AVX2: weights of one or two signed bytes, activations of two; `vpmaddwd` multiplies two
//! inputs by their weights and adds the products exactly.
//!
//! Activations become `scale * number` with one scale for the whole vector. A tile is sixteen outputs by two inputs. Up to [`WIDTH`]
//! tiles that use the same inputs lie together, in the order in which they are read.
//!
//! This module contains `unsafe`: vector loads through pointers whose bounds are checked once before the loop, and calls of functions
//! compiled for an instruction set that was found on this machine.

#[allow(clippy::wildcard_imports, reason = "vector instructions")]
use std::arch::x86_64::*;

use super::format::{Format, LARGEST_DIGITS};
use super::instructions::{InstructionSet, LANE, Lane, Line};

/// Inputs of a tile.
const DEPTH: usize = 2;
/// Most tiles side by side: two registers of sums each.
const WIDTH: usize = 4;
/// Numbers in a register.
const HALF: usize = LANE / 2;
/// Pairs of products that are summed in whole numbers: as many certainly fit in 32 bits, of one byte by two (`2^31 / (2 * 127 * 32639)`)
/// as of two by two, shifted (`2^31 / (2 * 32639^2 / 2^SHIFT)`, which is 258).
const BLOCK: usize = 256;
/// Two products of two bytes fill 32 bits: they lose their last bits before they are summed. That rounds down, by a half on average where
/// they are not 0, and is less than what rounding the weights does.
const SHIFT: i32 = 8;

/// Activations as whole numbers of two bytes, for [`Pairs::run`].
pub(super) struct Numbers {
    lines: Box<[Line]>,
    scale: f32,
}

impl Numbers {
    /// Room for `lanes` lanes of activations.
    pub(super) fn new(lanes: usize) -> Self {
        Self { lines: vec![Line([0; 64]); (lanes * LANE * 2).div_ceil(64)].into_boxed_slice(), scale: 0.0 }
    }

    /// Takes `values` in; with NaN or infinity among them the scale is NaN, and so is every output.
    #[target_feature(enable = "avx2")]
    fn take(&mut self, values: &[Lane]) {
        assert!(self.lines.len() * 64 >= values.len() * LANE * 2, "plan buffers disagree");
        let sign = _mm256_set1_epi32(i32::MAX);
        let mut largest = [_mm256_setzero_si256(); 2];
        for lane in values {
            for (half, largest) in largest.iter_mut().enumerate() {
                // As whole numbers, magnitudes keep their order and NaN is the largest; the maximum of floats would lose it.
                // SAFETY: a lane is 64 aligned bytes, a half of it 32.
                let bits = unsafe { _mm256_load_si256(lane.0.as_ptr().add(half * HALF).cast()) };
                *largest = _mm256_max_epi32(*largest, _mm256_and_si256(bits, sign));
            }
        }
        let largest = _mm256_max_epi32(largest[0], largest[1]);
        let largest = _mm_max_epi32(_mm256_castsi256_si128(largest), _mm256_extracti128_si256::<1>(largest));
        let largest = _mm_max_epi32(largest, _mm_shuffle_epi32::<0b0100_1110>(largest));
        let largest = _mm_max_epi32(largest, _mm_shuffle_epi32::<0b1011_0001>(largest));
        let largest = f32::from_bits(_mm_cvtsi128_si32(largest).cast_unsigned());
        let usable = largest.is_finite() && largest >= super::SMALLEST_WEIGHT;
        self.scale = if usable { largest / LARGEST_DIGITS } else { largest * 0.0 };
        let inverse = _mm256_set1_ps(if usable { LARGEST_DIGITS / largest } else { 0.0 });
        let to = self.lines.as_mut_ptr().cast::<u8>();
        for (index, lane) in values.iter().enumerate() {
            // SAFETY: a lane is 64 aligned bytes; 32 bytes per lane fit into the buffer, which was checked above.
            unsafe {
                let number =
                    |half: usize| _mm256_cvtps_epi32(_mm256_mul_ps(_mm256_load_ps(lane.0.as_ptr().add(half * HALF)), inverse));
                // Packing works in each half of the registers: the quarters are put back in order.
                let packed = _mm256_permute4x64_epi64::<0b1101_1000>(_mm256_packs_epi32(number(0), number(1)));
                _mm256_store_si256(to.add(index * LANE * 2).cast(), packed);
            }
        }
    }
}

/// A layer's weights.
pub(super) struct Pairs {
    lines: Box<[Line]>,
    /// Groups of two inputs.
    groups: usize,
    /// Tiles side by side in the whole layer.
    across: usize,
    two: bool,
    /// What each sum starts from, by output: what shifting takes off on average.
    start: Box<[Lane]>,
    scale: Box<[Lane]>,
}

impl Pairs {
    /// Packs `weights`, row by row of `inputs` numbers, as `I8` or `I16`; only where the machine has AVX2.
    pub(super) fn new(weights: &[f32], inputs: usize, format: Format) -> Self {
        assert!(InstructionSet::best() >= InstructionSet::Avx2, "pairs are for AVX2");
        let bytes = format.bytes();
        let outputs = weights.len() / inputs.max(1);
        let (groups, tiles) = (inputs.div_ceil(DEPTH), outputs.div_ceil(LANE));
        let mut lines = vec![Line([0; 64]); (groups * tiles * LANE * DEPTH * bytes).div_ceil(64)].into_boxed_slice();
        let (mut start, mut scale) = (super::zeros(tiles), super::zeros(tiles));
        for (row, weights) in weights.chunks_exact(inputs.max(1)).enumerate() {
            let row_scale = format.row_scale(weights);
            let (tile, place) = (row / LANE, row % LANE);
            scale[tile].0[place] = if bytes == 2 { row_scale * (1 << SHIFT) as f32 } else { row_scale };
            if bytes == 2 {
                let numbers = |pair: &[f32]| pair.iter().any(|weight| format.round(*weight, row_scale) != 0);
                start[tile].0[place] = 0.5 * weights.chunks(DEPTH).filter(|pair| numbers(pair)).count() as f32;
            }
            let panel = tile / WIDTH * WIDTH;
            let side_by_side = (tiles - panel).min(WIDTH);
            for (column, weight) in weights.iter().enumerate() {
                let block = panel * groups + column / DEPTH * side_by_side + tile - panel;
                let at = (block * LANE * DEPTH + place * DEPTH + column % DEPTH) * bytes;
                lines[at / 64].0[at % 64..at % 64 + bytes].copy_from_slice(&format.encode(*weight, row_scale)[..bytes]);
            }
        }
        Self { lines, groups, across: tiles, two: bytes == 2, start, scale }
    }

    pub(super) fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// `output = weights * input + bias`; `numbers` is room to work in.
    pub(super) fn run(&self, bias: &[Lane], input: &[Lane], numbers: &mut Numbers, output: &mut [Lane]) {
        // SAFETY: `new` made sure that the machine has AVX2; FMA is asked for together with it.
        unsafe { self.run_avx2(bias, input, numbers, output) }
    }

    /// # Safety
    /// AVX2 and FMA must be present.
    #[target_feature(enable = "avx2,fma")]
    unsafe fn run_avx2(&self, bias: &[Lane], input: &[Lane], numbers: &mut Numbers, output: &mut [Lane]) {
        let lanes = (self.groups * DEPTH).div_ceil(LANE);
        assert!(input.len() >= lanes && bias.len() >= self.across && output.len() >= self.across, "plan buffers disagree");
        numbers.take(&input[..lanes]);
        let mut first = 0;
        while first < self.across {
            let width = (self.across - first).min(WIDTH);
            // SAFETY: the caller's promise; the panel begins at a tile that exists and is `width` tiles wide.
            unsafe {
                match (width, self.two) {
                    (1, true) => self.panel::<1, 2>(first, bias, numbers, output),
                    (2, true) => self.panel::<2, 2>(first, bias, numbers, output),
                    (3, true) => self.panel::<3, 2>(first, bias, numbers, output),
                    (_, true) => self.panel::<WIDTH, 2>(first, bias, numbers, output),
                    (1, false) => self.panel::<1, 1>(first, bias, numbers, output),
                    (2, false) => self.panel::<2, 1>(first, bias, numbers, output),
                    (3, false) => self.panel::<3, 1>(first, bias, numbers, output),
                    (_, false) => self.panel::<WIDTH, 1>(first, bias, numbers, output),
                }
            }
            first += width;
        }
    }

    /// # Safety
    /// As [`Pairs::run_avx2`], and tiles `first..first + N` of weights of `BYTES` must exist and lie together.
    #[target_feature(enable = "avx2,fma")]
    unsafe fn panel<const N: usize, const BYTES: usize>(
        &self,
        first: usize,
        bias: &[Lane],
        numbers: &Numbers,
        output: &mut [Lane],
    ) {
        const REGISTER: usize = HALF * DEPTH;
        // SAFETY: `run_avx2` checked the lengths and `new` made them: `groups` pairs of activations, `groups * N` tiles from the panel's
        // first, a start and a scale for each; every load of weights is at a multiple of its own size from an aligned address.
        unsafe {
            let x = numbers.lines.as_ptr().cast::<i32>();
            let mut w = self.lines.as_ptr().cast::<u8>().add(first * self.groups * 2 * REGISTER * BYTES);
            let start = |tile: usize, half: usize| _mm256_load_ps(self.start[first + tile].0.as_ptr().add(half * HALF));
            let mut sums: [[__m256; 2]; N] = std::array::from_fn(|tile| [start(tile, 0), start(tile, 1)]);
            let mut group = 0;
            while group < self.groups {
                let end = (group + BLOCK).min(self.groups);
                let mut whole = [[_mm256_setzero_si256(); 2]; N];
                while group < end {
                    let pair = _mm256_set1_epi32(*x.add(group));
                    for (half, sum) in whole.as_flattened_mut().iter_mut().enumerate() {
                        let at = w.add(half * REGISTER * BYTES);
                        let products = if BYTES == 2 {
                            _mm256_srai_epi32::<SHIFT>(_mm256_madd_epi16(_mm256_load_si256(at.cast()), pair))
                        } else {
                            _mm256_madd_epi16(_mm256_cvtepi8_epi16(_mm_load_si128(at.cast())), pair)
                        };
                        *sum = _mm256_add_epi32(*sum, products);
                    }
                    w = w.add(N * 2 * REGISTER * BYTES);
                    group += 1;
                }
                for (sum, whole) in sums.as_flattened_mut().iter_mut().zip(whole.as_flattened()) {
                    *sum = _mm256_add_ps(*sum, _mm256_cvtepi32_ps(*whole));
                }
            }
            let scale = _mm256_set1_ps(numbers.scale);
            for (tile, sums) in sums.iter().enumerate() {
                let at = first + tile;
                for (half, sum) in sums.iter().enumerate() {
                    let factor = _mm256_mul_ps(scale, _mm256_load_ps(self.scale[at].0.as_ptr().add(half * HALF)));
                    let bias = _mm256_load_ps(bias[at].0.as_ptr().add(half * HALF));
                    _mm256_store_ps(output[at].0.as_mut_ptr().add(half * HALF), _mm256_fmadd_ps(*sum, factor, bias));
                }
            }
        }
    }
}
