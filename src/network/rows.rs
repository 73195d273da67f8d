//! Matrix times vector in float32, four rows at a time, for each instruction set.
//!
//! The weights of four rows lie interleaved by lanes of sixteen, in the order in which they are read: one stream from the first byte
//! to the last.
//!
//! This module contains `unsafe`: vector loads through pointers whose bounds are checked once before the loop, and calls of functions
//! compiled for an instruction set that was found on this machine.

use super::activation;
use super::format::{Format, from_f16, to_bf16, to_f16};
use super::instructions::{InstructionSet, LANE, Lane, Line, bytes_of};
use super::region::Lines;
use ravenpose_importer::Activation;

/// Rows worked on together.
const ROWS: usize = 4;

/// How weights are stored here.
#[derive(Debug, Clone, Copy)]
pub(super) enum Float {
    F32,
    F16,
    Bf16,
}

impl Float {
    fn format(self) -> Format {
        match self {
            Self::F32 => Format::F32,
            Self::F16 => Format::F16,
            Self::Bf16 => Format::Bf16,
        }
    }

    /// The bytes of `weight / scale`, little-endian, in as many places as the format has. Weights near zero become zero.
    fn encode(self, weight: f32, scale: f32) -> [u8; 4] {
        let weight = if weight.abs() < super::SMALLEST_WEIGHT { 0.0 } else { weight };
        let two = |bytes: [u8; 2]| [bytes[0], bytes[1], 0, 0];
        match self {
            Self::F32 => weight.to_le_bytes(),
            Self::F16 => two(to_f16(weight / scale).to_le_bytes()),
            Self::Bf16 => two(to_bf16(weight).to_le_bytes()),
        }
    }
}

/// A layer's weights.
pub(super) struct Rows {
    pub(super) lines: Lines,
    /// Lanes of one row.
    row_lanes: usize,
    height: usize,
    float: Float,
    /// One per row, by lanes; rows that pad have 0.
    scale: Box<[Lane]>,
}

impl Rows {
    /// Packs `weights`, row by row of `inputs` numbers.
    pub(super) fn new(weights: &[f32], inputs: usize, float: Float) -> Self {
        let format = float.format();
        let given = weights.len() / inputs.max(1);
        let rows = given.next_multiple_of(ROWS);
        let row_lanes = inputs.div_ceil(LANE);
        let bytes = format.bytes();
        let mut lines = vec![Line([0; 64]); (rows * row_lanes * LANE * bytes).div_ceil(64)].into_boxed_slice();
        let mut scale = super::zeros(rows.div_ceil(LANE));
        for (row, weights) in weights.chunks_exact(inputs.max(1)).enumerate() {
            let row_scale = format.row_scale(weights);
            scale[row / LANE].0[row % LANE] = row_scale;
            for (column, weight) in weights.iter().enumerate() {
                let lane = (row / ROWS * row_lanes + column / LANE) * ROWS + row % ROWS;
                let at = (lane * LANE + column % LANE) * bytes;
                lines[at / 64].0[at % 64..at % 64 + bytes].copy_from_slice(&float.encode(*weight, row_scale)[..bytes]);
            }
        }
        Self { lines: lines.into(), row_lanes, height: rows, float, scale }
    }

    /// `output = activation(weights * input + bias)`.
    pub(super) fn run(&self, set: InstructionSet, activation: Activation, bias: &[Lane], input: &[Lane], output: &mut [Lane]) {
        let lanes = self.height.div_ceil(LANE);
        assert!(
            self.lines.len() * 64 >= self.height * self.row_lanes * LANE * self.float.format().bytes()
                && self.height.is_multiple_of(ROWS)
                && self.scale.len() == lanes
                && bias.len() >= lanes
                && output.len() >= lanes
                && input.len() >= self.row_lanes,
            "plan buffers disagree"
        );
        let out = &mut output[..lanes];
        match set {
            // SAFETY: `set` came from `InstructionSet::available`, which found AVX-512F; the lengths were checked above.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 | InstructionSet::Avx512Vnni => unsafe { x86::wide(self, input, out) },
            // SAFETY: as above, with AVX2, FMA and F16C.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => unsafe { x86::narrow(self, input, out) },
            // SAFETY: as above; every aarch64 has NEON.
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => unsafe { neon::run(self, input, out) },
            _ => self.portable(input, out),
        }
        for ((out, scale), bias) in out.iter_mut().zip(&*self.scale).zip(bias) {
            for ((out, scale), bias) in out.0.iter_mut().zip(&scale.0).zip(&bias.0) {
                *out = *out * scale + bias;
            }
        }
        activation::apply(set, activation, out);
    }

    fn portable(&self, input: &[Lane], output: &mut [Lane]) {
        let two = |bytes: &[u8; 2]| u16::from_le_bytes(*bytes);
        match self.float {
            Float::F32 => self.sums(input, output, |bytes: &[u8; 4]| f32::from_le_bytes(*bytes)),
            Float::F16 => self.sums(input, output, |bytes| from_f16(two(bytes))),
            Float::Bf16 => self.sums(input, output, |bytes| f32::from_bits(u32::from(two(bytes)) << 16)),
        }
    }

    fn sums<const BYTES: usize>(&self, input: &[Lane], output: &mut [Lane], read: impl Fn(&[u8; BYTES]) -> f32) {
        let (weights, _) = bytes_of(&self.lines).as_chunks::<BYTES>();
        for (group, weights) in weights.chunks_exact(self.row_lanes * LANE * ROWS).take(self.height / ROWS).enumerate() {
            let mut sums = [[0.0_f32; LANE]; ROWS];
            for (weights, x) in weights.chunks_exact(LANE * ROWS).zip(input) {
                for (weights, sums) in weights.chunks_exact(LANE).zip(&mut sums) {
                    for ((weight, x), sum) in weights.iter().zip(&x.0).zip(sums) {
                        *sum += read(weight) * x;
                    }
                }
            }
            for (row, mut sum) in sums.into_iter().enumerate() {
                // Pairwise, as the vector kernels reduce: keeps the rounding error small.
                let mut width = LANE / 2;
                while width > 0 {
                    for index in 0..width {
                        sum[index] += sum[index + width];
                    }
                    width /= 2;
                }
                let row = group * ROWS + row;
                output[row / LANE].0[row % LANE] = sum[0];
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Float, LANE, Lane, ROWS, Rows};
    #[allow(clippy::wildcard_imports, reason = "vector instructions")]
    use std::arch::x86_64::*;

    /// # Safety
    /// AVX-512F must be present and the lengths as `Rows::run` checks them.
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn wide(rows: &Rows, input: &[Lane], output: &mut [Lane]) {
        // SAFETY: the caller's promise, passed on.
        unsafe {
            match rows.float {
                Float::F32 => wide_f32(rows, input, output),
                Float::F16 => wide_f16(rows, input, output),
                Float::Bf16 => wide_bf16(rows, input, output),
            }
        }
    }

    /// # Safety
    /// AVX2, FMA and F16C must be present and the lengths as `Rows::run` checks them.
    #[target_feature(enable = "avx2,fma,f16c")]
    pub(super) unsafe fn narrow(rows: &Rows, input: &[Lane], output: &mut [Lane]) {
        // SAFETY: the caller's promise, passed on.
        unsafe {
            match rows.float {
                Float::F32 => narrow_f32(rows, input, output),
                Float::F16 => narrow_f16(rows, input, output),
                Float::Bf16 => narrow_bf16(rows, input, output),
            }
        }
    }

    /// The sums of four vectors, side by side.
    #[target_feature(enable = "avx512f")]
    fn reduce_wide([a, b, c, d]: [__m512; ROWS]) -> __m128 {
        let low = _mm512_add_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
        let high = _mm512_add_ps(_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
        let (low, high) = (_mm512_castps_pd(low), _mm512_castps_pd(high));
        let all = _mm512_add_ps(_mm512_castpd_ps(_mm512_unpacklo_pd(low, high)), _mm512_castpd_ps(_mm512_unpackhi_pd(low, high)));
        let all = _mm512_add_ps(all, _mm512_shuffle_f32x4::<0b0100_1110>(all, all));
        let all = _mm512_add_ps(all, _mm512_shuffle_f32x4::<0b1011_0001>(all, all));
        _mm512_castps512_ps128(all)
    }

    /// As [`reduce_wide`].
    #[target_feature(enable = "avx2")]
    fn reduce_narrow([a, b, c, d]: [__m256; ROWS]) -> __m128 {
        let all = _mm256_hadd_ps(_mm256_hadd_ps(a, b), _mm256_hadd_ps(c, d));
        _mm_add_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps::<1>(all))
    }

    macro_rules! wide {
        ($name:ident, $bytes:literal, |$at:ident| $load:expr) => {
            /// # Safety
            /// As [`wide`].
            #[target_feature(enable = "avx512f")]
            unsafe fn $name(rows: &Rows, input: &[Lane], output: &mut [Lane]) {
                const STEP: usize = LANE * $bytes;
                let x = input.as_ptr().cast::<f32>();
                let out = output.as_mut_ptr().cast::<f32>();
                // SAFETY: there are `rows / ROWS` groups of `row_lanes * ROWS` lanes of weights; every lane begins at a multiple of its
                // own size from an address that is a multiple of 64; `out` has a place for every row.
                unsafe {
                    let load = |$at: *const u8| $load;
                    let mut w = rows.lines.as_ptr().cast::<u8>();
                    for group in 0..rows.height / ROWS {
                        let mut sums = [_mm512_setzero_ps(); 2 * ROWS];
                        let mut lane = 0;
                        while lane + 2 <= rows.row_lanes {
                            let x0 = _mm512_load_ps(x.add(lane * LANE));
                            let x1 = _mm512_load_ps(x.add((lane + 1) * LANE));
                            for row in 0..ROWS {
                                sums[row] = _mm512_fmadd_ps(load(w.add(row * STEP)), x0, sums[row]);
                                sums[ROWS + row] = _mm512_fmadd_ps(load(w.add((ROWS + row) * STEP)), x1, sums[ROWS + row]);
                            }
                            w = w.add(2 * ROWS * STEP);
                            lane += 2;
                        }
                        if lane < rows.row_lanes {
                            let x0 = _mm512_load_ps(x.add(lane * LANE));
                            for row in 0..ROWS {
                                sums[row] = _mm512_fmadd_ps(load(w.add(row * STEP)), x0, sums[row]);
                            }
                            w = w.add(ROWS * STEP);
                        }
                        let sums = std::array::from_fn(|row| _mm512_add_ps(sums[row], sums[ROWS + row]));
                        _mm_store_ps(out.add(group * ROWS), reduce_wide(sums));
                    }
                }
            }
        };
    }

    wide!(wide_f32, 4, |at| _mm512_load_ps(at.cast()));
    wide!(wide_f16, 2, |at| _mm512_cvtph_ps(_mm256_load_si256(at.cast())));
    wide!(wide_bf16, 2, |at| { _mm512_castsi512_ps(_mm512_slli_epi32::<16>(_mm512_cvtepu16_epi32(_mm256_load_si256(at.cast())))) });

    macro_rules! narrow {
        ($name:ident, $bytes:literal, |$at:ident| $load:expr) => {
            /// # Safety
            /// As [`narrow`].
            #[target_feature(enable = "avx2,fma,f16c")]
            unsafe fn $name(rows: &Rows, input: &[Lane], output: &mut [Lane]) {
                const HALF: usize = LANE / 2;
                const STEP: usize = LANE * $bytes;
                let x = input.as_ptr().cast::<f32>();
                let out = output.as_mut_ptr().cast::<f32>();
                // SAFETY: as for the wide kernels, with half a lane at a time.
                unsafe {
                    let load = |$at: *const u8| $load;
                    let mut w = rows.lines.as_ptr().cast::<u8>();
                    for group in 0..rows.height / ROWS {
                        let mut sums = [_mm256_setzero_ps(); 2 * ROWS];
                        for lane in 0..rows.row_lanes {
                            let x0 = _mm256_load_ps(x.add(lane * LANE));
                            let x1 = _mm256_load_ps(x.add(lane * LANE + HALF));
                            for row in 0..ROWS {
                                let w = w.add(row * STEP);
                                sums[row] = _mm256_fmadd_ps(load(w), x0, sums[row]);
                                sums[ROWS + row] = _mm256_fmadd_ps(load(w.add(STEP / 2)), x1, sums[ROWS + row]);
                            }
                            w = w.add(ROWS * STEP);
                        }
                        let sums = std::array::from_fn(|row| _mm256_add_ps(sums[row], sums[ROWS + row]));
                        _mm_store_ps(out.add(group * ROWS), reduce_narrow(sums));
                    }
                }
            }
        };
    }

    narrow!(narrow_f32, 4, |at| _mm256_load_ps(at.cast()));
    narrow!(narrow_f16, 2, |at| _mm256_cvtph_ps(_mm_load_si128(at.cast())));
    narrow!(narrow_bf16, 2, |at| {
        _mm256_castsi256_ps(_mm256_slli_epi32::<16>(_mm256_cvtepu16_epi32(_mm_load_si128(at.cast()))))
    });
}

#[cfg(target_arch = "aarch64")]
mod neon {
    use super::{Float, LANE, Lane, ROWS, Rows};
    #[allow(clippy::wildcard_imports, reason = "vector instructions")]
    use std::arch::aarch64::*;

    /// Numbers in a register.
    const QUARTER: usize = 4;
    /// Registers to a lane.
    const QUARTERS: usize = LANE / QUARTER;

    /// # Safety
    /// The lengths must be as `Rows::run` checks them.
    #[target_feature(enable = "neon")]
    pub(super) unsafe fn run(rows: &Rows, input: &[Lane], output: &mut [Lane]) {
        // SAFETY: the caller's promise, passed on.
        unsafe {
            match rows.float {
                Float::F32 => run_f32(rows, input, output),
                Float::F16 => run_f16(rows, input, output),
                Float::Bf16 => run_bf16(rows, input, output),
            }
        }
    }

    macro_rules! neon {
        ($name:ident, $bytes:literal, |$at:ident| $load:expr) => {
            /// # Safety
            /// As [`run`].
            #[target_feature(enable = "neon")]
            unsafe fn $name(rows: &Rows, input: &[Lane], output: &mut [Lane]) {
                const STEP: usize = LANE * $bytes;
                let x = input.as_ptr().cast::<f32>();
                let out = output.as_mut_ptr().cast::<f32>();
                // SAFETY: as for the kernels of x86, with a quarter of a lane at a time.
                unsafe {
                    let load = |$at: *const u8| $load;
                    let mut w = rows.lines.as_ptr().cast::<u8>();
                    for group in 0..rows.height / ROWS {
                        let mut sums = [[vdupq_n_f32(0.0); QUARTERS]; ROWS];
                        for lane in 0..rows.row_lanes {
                            let x: [_; QUARTERS] = std::array::from_fn(|at| vld1q_f32(x.add(lane * LANE + at * QUARTER)));
                            for (row, sums) in sums.iter_mut().enumerate() {
                                let w = w.add(row * STEP);
                                for (at, sum) in sums.iter_mut().enumerate() {
                                    *sum = vfmaq_f32(*sum, load(w.add(at * QUARTER * $bytes)), x[at]);
                                }
                            }
                            w = w.add(ROWS * STEP);
                        }
                        let [a, b, c, d] = sums.map(|[a, b, c, d]| vaddq_f32(vaddq_f32(a, b), vaddq_f32(c, d)));
                        vst1q_f32(out.add(group * ROWS), vpaddq_f32(vpaddq_f32(a, b), vpaddq_f32(c, d)));
                    }
                }
            }
        };
    }

    neon!(run_f32, 4, |at| vld1q_f32(at.cast()));
    neon!(run_f16, 2, |at| vcvt_f32_f16(vreinterpret_f16_u16(vld1_u16(at.cast()))));
    neon!(run_bf16, 2, |at| vreinterpretq_f32_u32(vshll_n_u16::<16>(vld1_u16(at.cast()))));
}
