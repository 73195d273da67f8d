//! Keeping weights in the caches and the vector unit awake between two runs.
//!
//! This module contains `unsafe`: calls of functions compiled for an instruction set that was found on this machine.

#![expect(clippy::inline_always, reason = "inlined into functions compiled for an instruction set, or they would not use it")]

use super::InstructionSet;
use super::instructions::Line;

/// Reads every line once, in the registers that the kernels use: a core puts those that nobody uses to sleep.
pub(super) fn touch(set: InstructionSet, lines: &[Line]) {
    let sum = match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` was found on this machine.
        InstructionSet::Avx512 | InstructionSet::Avx512Vnni => unsafe { sum_avx512(lines) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` was found on this machine.
        InstructionSet::Avx2 => unsafe { sum_avx2(lines) },
        _ => sum_any(lines),
    };
    std::hint::black_box(sum);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn sum_avx512(lines: &[Line]) -> [u64; 8] {
    sum_any(lines)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn sum_avx2(lines: &[Line]) -> [u64; 8] {
    sum_any(lines)
}

#[inline(always)]
fn sum_any(lines: &[Line]) -> [u64; 8] {
    let mut sums = [0_u64; 8];
    for line in lines {
        for (sum, word) in sums.iter_mut().zip(line.0.as_chunks::<8>().0) {
            *sum = sum.wrapping_add(u64::from_le_bytes(*word));
        }
    }
    sums
}
