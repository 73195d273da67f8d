//! Matrix times vector, four rows at a time, for each instruction set.
//!
//! This module contains `unsafe`: vector loads through pointers whose bounds are checked once before the loop, and calls of functions
//! compiled for an instruction set that was found on this machine.

/// Numbers in a lane: one AVX-512 register, two of AVX2.
pub(super) const LANE: usize = 16;
/// Rows worked on together.
pub(super) const ROWS: usize = 4;

/// Sixteen numbers on a cache line of their own.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub(super) struct Lane(pub(super) [f32; LANE]);

/// Instruction sets that the kernel is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// Plain Rust, left to the compiler's baseline (SSE2, NEON).
    Portable,
    /// AVX2 with FMA.
    Avx2,
    /// AVX-512F.
    Avx512,
}

impl InstructionSet {
    /// The widest that this machine has.
    pub fn best() -> Self {
        Self::Avx512.available()
    }

    /// This one if the machine has it, else the next narrower that it has.
    #[must_use]
    pub fn available(self) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if self >= Self::Avx512 && is_x86_feature_detected!("avx512f") {
                return Self::Avx512;
            }
            if self >= Self::Avx2 && is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// Name as printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2+fma",
            Self::Avx512 => "avx512f",
        }
    }
}

/// `output = weights * input + bias`, where a row of `weights` has `row_lanes` lanes and `bias` gives the number of output lanes.
///
/// Rows beyond a multiple of four do not exist: the plan pads them with zeros.
pub(super) fn dense(set: InstructionSet, weights: &[Lane], bias: &[Lane], row_lanes: usize, input: &[Lane], output: &mut [Lane]) {
    let rows = weights.len() / row_lanes.max(1);
    assert!(
        rows.is_multiple_of(ROWS) && rows <= bias.len() * LANE && bias.len() <= output.len() && row_lanes <= input.len(),
        "plan buffers disagree"
    );
    let input = &input[..row_lanes];
    let output = &mut output[..bias.len()];
    output.copy_from_slice(bias);
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` came from `InstructionSet::available`, which found AVX-512F; the lengths were checked above.
        InstructionSet::Avx512 => unsafe { x86::dense_avx512(weights, row_lanes, input, output) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above, with AVX2 and FMA.
        InstructionSet::Avx2 => unsafe { x86::dense_avx2(weights, row_lanes, input, output) },
        _ => dense_portable(weights, row_lanes, input, output),
    }
}

fn dense_portable(weights: &[Lane], row_lanes: usize, input: &[Lane], output: &mut [Lane]) {
    for (row, weights) in weights.chunks_exact(row_lanes).enumerate() {
        let mut sum = [0.0_f32; LANE];
        for (weight, value) in weights.iter().zip(input) {
            for ((sum, weight), value) in sum.iter_mut().zip(&weight.0).zip(&value.0) {
                *sum += weight * value;
            }
        }
        // Pairwise, as the vector kernels reduce: keeps the rounding error small.
        let mut width = LANE / 2;
        while width > 0 {
            for index in 0..width {
                sum[index] += sum[index + width];
            }
            width /= 2;
        }
        output[row / LANE].0[row % LANE] += sum[0];
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{LANE, Lane, ROWS};
    use std::arch::x86_64::{
        _mm_add_ps, _mm_add_ss, _mm_cvtss_f32, _mm_movehl_ps, _mm_shuffle_ps, _mm256_add_ps, _mm256_castps256_ps128,
        _mm256_extractf128_ps, _mm256_fmadd_ps, _mm256_load_ps, _mm256_setzero_ps, _mm512_add_ps, _mm512_fmadd_ps, _mm512_load_ps,
        _mm512_reduce_add_ps, _mm512_setzero_ps,
    };

    /// # Safety
    /// AVX-512F must be present, and `weights` must hold a multiple of four rows of `row_lanes` lanes, `input` `row_lanes` lanes and
    /// `output` all rows.
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn dense_avx512(weights: &[Lane], row_lanes: usize, input: &[Lane], output: &mut [Lane]) {
        let x = input.as_ptr().cast::<f32>();
        let out = output.as_mut_ptr().cast::<f32>();
        let stride = row_lanes * LANE;
        for group in 0..weights.len() / row_lanes / ROWS {
            // SAFETY: `group` counts whole groups of four rows inside `weights`; every load is inside its row, aligned to 64 bytes
            // by `Lane`, and `out` has an element for every row.
            unsafe {
                let w = weights.as_ptr().cast::<f32>().add(group * ROWS * stride);
                let mut sums = [_mm512_setzero_ps(); 2 * ROWS];
                let mut at = 0;
                while at + 2 * LANE <= stride {
                    let x0 = _mm512_load_ps(x.add(at));
                    let x1 = _mm512_load_ps(x.add(at + LANE));
                    for row in 0..ROWS {
                        let w = w.add(row * stride + at);
                        sums[row] = _mm512_fmadd_ps(_mm512_load_ps(w), x0, sums[row]);
                        sums[ROWS + row] = _mm512_fmadd_ps(_mm512_load_ps(w.add(LANE)), x1, sums[ROWS + row]);
                    }
                    at += 2 * LANE;
                }
                if at < stride {
                    let x0 = _mm512_load_ps(x.add(at));
                    for (row, sum) in sums.iter_mut().take(ROWS).enumerate() {
                        *sum = _mm512_fmadd_ps(_mm512_load_ps(w.add(row * stride + at)), x0, *sum);
                    }
                }
                for row in 0..ROWS {
                    *out.add(group * ROWS + row) += _mm512_reduce_add_ps(_mm512_add_ps(sums[row], sums[ROWS + row]));
                }
            }
        }
    }

    /// # Safety
    /// As [`dense_avx512`], with AVX2 and FMA present.
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn dense_avx2(weights: &[Lane], row_lanes: usize, input: &[Lane], output: &mut [Lane]) {
        const HALF: usize = LANE / 2;
        let x = input.as_ptr().cast::<f32>();
        let out = output.as_mut_ptr().cast::<f32>();
        let stride = row_lanes * LANE;
        for group in 0..weights.len() / row_lanes / ROWS {
            // SAFETY: as in `dense_avx512`; 32-byte loads are aligned because lanes are.
            unsafe {
                let w = weights.as_ptr().cast::<f32>().add(group * ROWS * stride);
                let mut sums = [_mm256_setzero_ps(); 2 * ROWS];
                let mut at = 0;
                while at < stride {
                    let x0 = _mm256_load_ps(x.add(at));
                    let x1 = _mm256_load_ps(x.add(at + HALF));
                    for row in 0..ROWS {
                        let w = w.add(row * stride + at);
                        sums[row] = _mm256_fmadd_ps(_mm256_load_ps(w), x0, sums[row]);
                        sums[ROWS + row] = _mm256_fmadd_ps(_mm256_load_ps(w.add(HALF)), x1, sums[ROWS + row]);
                    }
                    at += LANE;
                }
                for row in 0..ROWS {
                    let sum = _mm256_add_ps(sums[row], sums[ROWS + row]);
                    let sum = _mm_add_ps(_mm256_castps256_ps128(sum), _mm256_extractf128_ps::<1>(sum));
                    let sum = _mm_add_ps(sum, _mm_movehl_ps(sum, sum));
                    let sum = _mm_add_ss(sum, _mm_shuffle_ps::<1>(sum, sum));
                    *out.add(group * ROWS + row) += _mm_cvtss_f32(sum);
                }
            }
        }
    }
}
