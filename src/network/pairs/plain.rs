//! [`Pairs`] in plain Rust, written so that compilers find the products of pairs: what runs where no kernel is written for.

use super::{BLOCK, DEPTH, LANE, Lane, Numbers, Pairs, SHIFT, WIDTH};
use crate::network::instructions::bytes_of;

/// 1.5 * 2^23: adding it rounds to the nearest whole number, which then sits in the low bits.
const ROUND: f32 = 12_582_912.0;

pub(super) fn run(pairs: &Pairs, bias: &[Lane], input: &[Lane], numbers: &mut Numbers, output: &mut [Lane]) {
    take(numbers, input);
    let x = &bytes_of(&numbers.lines).as_chunks::<2>().0[..pairs.groups * DEPTH];
    let mut first = 0;
    while first < pairs.across {
        let width = (pairs.across - first).min(WIDTH);
        for tile in 0..width {
            let sums = if pairs.two {
                sums::<2>(pairs, first, width, tile, x, |bytes| i16::from_le_bytes(*bytes))
            } else {
                sums::<1>(pairs, first, width, tile, x, |bytes| i16::from(bytes[0].cast_signed()))
            };
            let at = first + tile;
            let places = output[at].0.iter_mut().zip(&sums).zip(&pairs.scale[at].0).zip(&bias[at].0);
            for (((out, sum), scale), bias) in places {
                *out = sum * (scale * numbers.scale) + bias;
            }
        }
        first += width;
    }
}

fn take(numbers: &mut Numbers, values: &[Lane]) {
    let bits = values.iter().flat_map(|lane| lane.0).map(|value| value.to_bits() & (u32::MAX >> 1));
    let inverse = numbers.scale_for(bits.fold(0, u32::max));
    let places = numbers.lines.iter_mut().flat_map(|line| line.0.as_chunks_mut::<{ 2 * LANE }>().0);
    for (to, lane) in places.zip(values) {
        for (to, value) in to.as_chunks_mut::<2>().0.iter_mut().zip(&lane.0) {
            let number = (value * inverse + ROUND).to_bits().wrapping_sub(ROUND.to_bits());
            *to = (number as i16).to_le_bytes();
        }
    }
}

/// The sums of one tile of a panel that begins at tile `first` and is `width` tiles wide.
fn sums<const BYTES: usize>(
    pairs: &Pairs,
    first: usize,
    width: usize,
    tile: usize,
    x: &[[u8; 2]],
    read: impl Fn(&[u8; BYTES]) -> i16,
) -> [f32; LANE] {
    let (weights, _) = bytes_of(&pairs.lines).as_chunks::<BYTES>();
    let (tiles, _) = weights[first * pairs.groups * LANE * DEPTH..].as_chunks::<{ LANE * DEPTH }>();
    let mut sums = pairs.start[first + tile].0;
    let shift = if BYTES == 2 { SHIFT } else { 0 };
    let blocks = tiles.chunks(BLOCK * width).zip(x.chunks(BLOCK * DEPTH));
    for (tiles, x) in blocks {
        let mut whole = [0_i32; LANE];
        for (weights, x) in tiles.iter().skip(tile).step_by(width).zip(x.as_chunks::<DEPTH>().0) {
            let x = x.map(|bytes| i32::from(i16::from_le_bytes(bytes)));
            for (sum, weights) in whole.iter_mut().zip(weights.as_chunks::<DEPTH>().0) {
                let [a, b] = weights.each_ref().map(|bytes| i32::from(read(bytes)));
                *sum += (a * x[0] + b * x[1]) >> shift;
            }
        }
        for (sum, whole) in sums.iter_mut().zip(whole) {
            *sum += whole as f32;
        }
    }
    sums
}
