//! Matrix times vector in whole numbers: weights of one or two signed bytes, activations of two. Two inputs are multiplied by their
//! weights and the products added exactly: `vpmaddwd` on AVX2, `smull` and `addp` on NEON, and what the compiler makes of plain Rust.
//!
//! Activations become `scale * number` with one scale for the whole vector. A tile is sixteen outputs by two inputs. Up to [`WIDTH`]
//! tiles that use the same inputs lie together, in the order in which they are read.
//!
//! This module contains `unsafe`: calls of functions compiled for an instruction set that was found on this machine.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "aarch64")]
mod neon;
mod plain;

use super::activation;
use super::format::LARGEST_DIGITS;
use super::instructions::{InstructionSet, LANE, Lane, Line};
use super::region::Lines;
use super::rounding::Whole;
use ravenpose_importer::Activation;

/// Inputs of a tile.
const DEPTH: usize = 2;
/// Most tiles side by side: their sums, the digits and what is loaded fit the 16 registers of AVX2.
const WIDTH: usize = 4;
/// Pairs of products that are summed in whole numbers: as many certainly fit in 32 bits, of one byte by two (`2^31 / (2 * 127 * 32639)`)
/// as of two by two, shifted (`2^31 / (2 * 32639^2 / 2^SHIFT)`, which is 258).
const BLOCK: usize = 256;
/// Two products of two bytes fill 32 bits: they lose their last bits before they are summed. That rounds down, by a half on average where
/// they are not 0, and is less than what rounding the weights does.
const SHIFT: i32 = 8;

/// Activations as whole numbers of two bytes, for [`Pairs::run`].
#[derive(Clone)]
pub(super) struct Numbers {
    lines: Box<[Line]>,
    scale: f32,
}

impl Numbers {
    /// Room for `lanes` lanes of activations.
    pub(super) fn new(lanes: usize) -> Self {
        Self { lines: vec![Line([0; 64]); (lanes * LANE * 2).div_ceil(64)].into_boxed_slice(), scale: 0.0 }
    }

    /// Notes the scale of activations whose largest magnitude has these bits, and gives what they are to be multiplied by. As whole
    /// numbers, magnitudes keep their order and NaN is the largest; with NaN or infinity the scale is NaN, and so is every output.
    fn scale_for(&mut self, largest: u32) -> f32 {
        let largest = f32::from_bits(largest);
        let usable = largest.is_finite() && largest >= super::SMALLEST_WEIGHT;
        self.scale = if usable { largest / LARGEST_DIGITS } else { largest * 0.0 };
        if usable { LARGEST_DIGITS / largest } else { 0.0 }
    }
}

/// A layer's weights.
pub(super) struct Pairs {
    pub(super) lines: Lines,
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
    /// Packs whole numbers of one or two bytes.
    pub(super) fn new(whole: &Whole) -> Self {
        let bytes = whole.format.bytes();
        let (groups, tiles) = (whole.inputs.div_ceil(DEPTH), whole.scale.len().div_ceil(LANE));
        let mut lines = vec![Line([0; 64]); (groups * tiles * LANE * DEPTH * bytes).div_ceil(64)].into_boxed_slice();
        let (mut start, mut scale) = (super::zeros(tiles), super::zeros(tiles));
        for (row, (numbers, row_scale)) in whole.numbers.chunks_exact(whole.inputs).zip(&whole.scale).enumerate() {
            let (tile, place) = (row / LANE, row % LANE);
            scale[tile].0[place] = if bytes == 2 { row_scale * (1 << SHIFT) as f32 } else { *row_scale };
            if bytes == 2 {
                start[tile].0[place] =
                    0.5 * numbers.chunks(DEPTH).filter(|pair| pair.iter().any(|number| *number != 0)).count() as f32;
            }
            let panel = tile / WIDTH * WIDTH;
            let side_by_side = (tiles - panel).min(WIDTH);
            for (column, number) in numbers.iter().enumerate() {
                let block = panel * groups + column / DEPTH * side_by_side + tile - panel;
                let at = (block * LANE * DEPTH + place * DEPTH + column % DEPTH) * bytes;
                lines[at / 64].0[at % 64..at % 64 + bytes].copy_from_slice(&number.to_le_bytes()[..bytes]);
            }
        }
        Self { lines: lines.into(), groups, across: tiles, two: bytes == 2, start, scale }
    }

    /// `output = activation(weights * input + bias)`; `numbers` is room to work in.
    pub(super) fn run(
        &self,
        set: InstructionSet,
        activation: Activation,
        bias: &[Lane],
        input: &[Lane],
        numbers: &mut Numbers,
        output: &mut [Lane],
    ) {
        let lanes = (self.groups * DEPTH).div_ceil(LANE);
        assert!(
            input.len() >= lanes
                && numbers.lines.len() * 64 >= lanes * LANE * 2
                && bias.len() >= self.across
                && output.len() >= self.across,
            "plan buffers disagree"
        );
        let input = &input[..lanes];
        match set {
            InstructionSet::Portable => plain::run(self, bias, input, numbers, output),
            // SAFETY: `set` came from `InstructionSet::available`, which found AVX2 and FMA; the lengths were checked above.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 | InstructionSet::Avx512 | InstructionSet::Avx512Vnni => unsafe {
                avx2::run(self, bias, input, numbers, output);
            },
            // SAFETY: every aarch64 has NEON; the lengths were checked above.
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => unsafe { neon::run(self, bias, input, numbers, output) },
            _ => plain::run(self, bias, input, numbers, output),
        }
        activation::apply(set, activation, &mut output[..self.across]);
    }
}
