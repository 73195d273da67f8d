//! [`Pairs`] on AVX2: `vpmaddwd`, eight outputs to a register.
//!
//! This module contains `unsafe`: vector loads through pointers whose bounds were checked before.

#[allow(clippy::wildcard_imports, reason = "vector instructions")]
use std::arch::x86_64::*;

use super::{BLOCK, LANE, Lane, Numbers, Pairs, SHIFT, WIDTH};

/// Numbers in a register.
const HALF: usize = LANE / 2;

/// # Safety
/// AVX2 and FMA must be present and the lengths as `Pairs::run` checks them.
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn run(pairs: &Pairs, bias: &[Lane], input: &[Lane], numbers: &mut Numbers, output: &mut [Lane]) {
    // SAFETY: the caller's promise; a panel begins at a tile that exists and is `width` tiles wide.
    unsafe {
        take(numbers, input);
        let mut first = 0;
        while first < pairs.across {
            let width = (pairs.across - first).min(WIDTH);
            match (width, pairs.two) {
                (1, true) => panel::<1, 2>(pairs, first, bias, numbers, output),
                (2, true) => panel::<2, 2>(pairs, first, bias, numbers, output),
                (3, true) => panel::<3, 2>(pairs, first, bias, numbers, output),
                (_, true) => panel::<WIDTH, 2>(pairs, first, bias, numbers, output),
                (1, false) => panel::<1, 1>(pairs, first, bias, numbers, output),
                (2, false) => panel::<2, 1>(pairs, first, bias, numbers, output),
                (3, false) => panel::<3, 1>(pairs, first, bias, numbers, output),
                (_, false) => panel::<WIDTH, 1>(pairs, first, bias, numbers, output),
            }
            first += width;
        }
    }
}

/// # Safety
/// There must be room for the activations.
#[target_feature(enable = "avx2")]
unsafe fn take(numbers: &mut Numbers, values: &[Lane]) {
    let sign = _mm256_set1_epi32(i32::MAX);
    let mut largest = [_mm256_setzero_si256(); 2];
    for lane in values {
        for (half, largest) in largest.iter_mut().enumerate() {
            // SAFETY: a lane is 64 aligned bytes, a half of it 32.
            let bits = unsafe { _mm256_load_si256(lane.0.as_ptr().add(half * HALF).cast()) };
            *largest = _mm256_max_epi32(*largest, _mm256_and_si256(bits, sign));
        }
    }
    let largest = _mm256_max_epi32(largest[0], largest[1]);
    let largest = _mm_max_epi32(_mm256_castsi256_si128(largest), _mm256_extracti128_si256::<1>(largest));
    let largest = _mm_max_epi32(largest, _mm_shuffle_epi32::<0b0100_1110>(largest));
    let largest = _mm_max_epi32(largest, _mm_shuffle_epi32::<0b1011_0001>(largest));
    let inverse = _mm256_set1_ps(numbers.scale_for(_mm_cvtsi128_si32(largest).cast_unsigned()));
    let to = numbers.lines.as_mut_ptr().cast::<u8>();
    for (index, lane) in values.iter().enumerate() {
        // SAFETY: a lane is 64 aligned bytes; the caller promised room for the 32 bytes that become of it.
        unsafe {
            let number = |half: usize| _mm256_cvtps_epi32(_mm256_mul_ps(_mm256_load_ps(lane.0.as_ptr().add(half * HALF)), inverse));
            // Packing works in each half of the registers: the quarters are put back in order.
            let packed = _mm256_permute4x64_epi64::<0b1101_1000>(_mm256_packs_epi32(number(0), number(1)));
            _mm256_store_si256(to.add(index * LANE * 2).cast(), packed);
        }
    }
}

/// # Safety
/// As [`run`], and tiles `first..first + N` of weights of `BYTES` must exist and lie together.
#[target_feature(enable = "avx2,fma")]
unsafe fn panel<const N: usize, const BYTES: usize>(
    pairs: &Pairs,
    first: usize,
    bias: &[Lane],
    numbers: &Numbers,
    output: &mut [Lane],
) {
    const REGISTER: usize = HALF * super::DEPTH;
    // SAFETY: `Pairs::run` checked the lengths and `Pairs::new` made them: `groups` pairs of activations, `groups * N` tiles from the
    // panel's first, a start and a scale for each; every load of weights is at a multiple of its own size from an aligned address.
    unsafe {
        let x = numbers.lines.as_ptr().cast::<i32>();
        let mut w = pairs.lines.as_ptr().cast::<u8>().add(first * pairs.groups * 2 * REGISTER * BYTES);
        let start = |tile: usize, half: usize| _mm256_load_ps(pairs.start[first + tile].0.as_ptr().add(half * HALF));
        let mut sums: [[__m256; 2]; N] = std::array::from_fn(|tile| [start(tile, 0), start(tile, 1)]);
        let mut group = 0;
        while group < pairs.groups {
            let end = (group + BLOCK).min(pairs.groups);
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
                let factor = _mm256_mul_ps(scale, _mm256_load_ps(pairs.scale[at].0.as_ptr().add(half * HALF)));
                let bias = _mm256_load_ps(bias[at].0.as_ptr().add(half * HALF));
                _mm256_store_ps(output[at].0.as_mut_ptr().add(half * HALF), _mm256_fmadd_ps(*sum, factor, bias));
            }
        }
    }
}
