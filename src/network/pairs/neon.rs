//! [`Pairs`] on NEON: products of two bytes by `smull`, added two and two by `addp`, four outputs to a register.
//!
//! This module contains `unsafe`: vector loads through pointers whose bounds were checked before.

#[allow(clippy::wildcard_imports, reason = "vector instructions")]
use std::arch::aarch64::*;

use super::{BLOCK, DEPTH, LANE, Lane, Numbers, Pairs, SHIFT, WIDTH};

/// Numbers in a register.
const QUARTER: usize = 4;
/// Registers to a lane.
const QUARTERS: usize = LANE / QUARTER;

/// # Safety
/// The lengths must be as `Pairs::run` checks them.
#[target_feature(enable = "neon")]
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
#[target_feature(enable = "neon")]
unsafe fn take(numbers: &mut Numbers, values: &[Lane]) {
    let sign = vdupq_n_u32(u32::MAX >> 1);
    let mut largest = [vdupq_n_u32(0); QUARTERS];
    for lane in values {
        for (quarter, largest) in largest.iter_mut().enumerate() {
            // SAFETY: a lane is four registers.
            let bits = unsafe { vld1q_u32(lane.0.as_ptr().add(quarter * QUARTER).cast()) };
            *largest = vmaxq_u32(*largest, vandq_u32(bits, sign));
        }
    }
    let largest = vmaxq_u32(vmaxq_u32(largest[0], largest[1]), vmaxq_u32(largest[2], largest[3]));
    let inverse = numbers.scale_for(vmaxvq_u32(largest));
    let to = numbers.lines.as_mut_ptr().cast::<i16>();
    for (index, lane) in values.iter().enumerate() {
        for quarter in 0..QUARTERS {
            // SAFETY: a lane is four registers; the caller promised room for the 32 bytes that become of it.
            unsafe {
                let number = vcvtnq_s32_f32(vmulq_n_f32(vld1q_f32(lane.0.as_ptr().add(quarter * QUARTER)), inverse));
                vst1_s16(to.add(index * LANE + quarter * QUARTER), vqmovn_s32(number));
            }
        }
    }
}

/// # Safety
/// As [`run`], and tiles `first..first + N` of weights of `BYTES` must exist and lie together.
#[target_feature(enable = "neon")]
unsafe fn panel<const N: usize, const BYTES: usize>(
    pairs: &Pairs,
    first: usize,
    bias: &[Lane],
    numbers: &Numbers,
    output: &mut [Lane],
) {
    const REGISTER: usize = QUARTER * DEPTH;
    // SAFETY: `Pairs::run` checked the lengths and `Pairs::new` made them: `groups` pairs of activations, `groups * N` tiles from the
    // panel's first, a start and a scale for each.
    unsafe {
        let x = numbers.lines.as_ptr().cast::<i32>();
        let mut w = pairs.lines.as_ptr().cast::<u8>().add(first * pairs.groups * QUARTERS * REGISTER * BYTES);
        let start = |tile: usize, quarter: usize| vld1q_f32(pairs.start[first + tile].0.as_ptr().add(quarter * QUARTER));
        let mut sums: [[float32x4_t; QUARTERS]; N] = std::array::from_fn(|tile| std::array::from_fn(|at| start(tile, at)));
        let mut group = 0;
        while group < pairs.groups {
            let end = (group + BLOCK).min(pairs.groups);
            let mut whole = [[vdupq_n_s32(0); QUARTERS]; N];
            while group < end {
                let pair = vreinterpretq_s16_s32(vdupq_n_s32(*x.add(group)));
                for (quarter, sum) in whole.as_flattened_mut().iter_mut().enumerate() {
                    let at = w.add(quarter * REGISTER * BYTES);
                    let weights = if BYTES == 2 { vld1q_s16(at.cast()) } else { vmovl_s8(vld1_s8(at.cast())) };
                    let low = vmull_s16(vget_low_s16(weights), vget_low_s16(pair));
                    let products = vpaddq_s32(low, vmull_high_s16(weights, pair));
                    *sum = if BYTES == 2 { vsraq_n_s32::<SHIFT>(*sum, products) } else { vaddq_s32(*sum, products) };
                }
                w = w.add(N * QUARTERS * REGISTER * BYTES);
                group += 1;
            }
            for (sum, whole) in sums.as_flattened_mut().iter_mut().zip(whole.as_flattened()) {
                *sum = vaddq_f32(*sum, vcvtq_f32_s32(*whole));
            }
        }
        for (tile, sums) in sums.iter().enumerate() {
            let at = first + tile;
            for (quarter, sum) in sums.iter().enumerate() {
                let factor = vmulq_n_f32(vld1q_f32(pairs.scale[at].0.as_ptr().add(quarter * QUARTER)), numbers.scale);
                let bias = vld1q_f32(bias[at].0.as_ptr().add(quarter * QUARTER));
                vst1q_f32(output[at].0.as_mut_ptr().add(quarter * QUARTER), vfmaq_f32(bias, *sum, factor));
            }
        }
    }
}
