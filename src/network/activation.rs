//! Activations over lanes, written so that the compiler vectorises them for the instruction set in use.
//!
//! `exp` is a range reduction and a polynomial: relative error below 2e-7 in the range used. Absolute errors of what is made of it: sigmoid
//! below 1.5e-7, tanh below 3e-7, elu below 2e-7 for alpha = 1 (tests, on every instruction set present). Arguments are clamped by
//! comparisons that let NaN through; `min`/`max` instructions would turn it into a number.
//!
//! This module contains `unsafe`: calls of functions compiled for an instruction set that was found on this machine.

#![expect(clippy::inline_always, reason = "inlined into functions compiled for an instruction set, or they would not use it")]

use super::InstructionSet;
use super::instructions::Lane;
use ravenpose_importer::Activation;

/// Beyond this a sigmoid is 0 or 1 to 4e-18, and its smallest value stays far from the denormal range.
const SIGMOID_LIMIT: f32 = 40.0;

pub(super) fn apply(set: InstructionSet, activation: Activation, values: &mut [Lane]) {
    match set {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` was found on this machine.
        InstructionSet::Avx512 | InstructionSet::Avx512Vnni => unsafe { apply_avx512(activation, values) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `set` was found on this machine.
        InstructionSet::Avx2 => unsafe { apply_avx2(activation, values) },
        // Every aarch64 multiplies and adds in one step; elsewhere, without an instruction for it, that would be a call.
        _ => apply_any::<{ cfg!(target_arch = "aarch64") }>(activation, values),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
pub(super) fn apply_avx512(activation: Activation, values: &mut [Lane]) {
    apply_any::<true>(activation, values);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn apply_avx2(activation: Activation, values: &mut [Lane]) {
    apply_any::<true>(activation, values);
}

#[inline(always)]
fn apply_any<const FUSED: bool>(activation: Activation, values: &mut [Lane]) {
    match activation {
        Activation::Identity => {}
        Activation::Sigmoid => each(values, sigmoid::<FUSED>),
        Activation::Tanh => each(values, |x| 2.0 * sigmoid::<FUSED>(2.0 * x) - 1.0),
        Activation::Relu => each(values, |x| if x < 0.0 { 0.0 } else { x }),
        Activation::Elu { alpha } => each(values, |x| {
            let negative = alpha * (exp::<FUSED>(clamp(x, -SIGMOID_LIMIT, 0.0)) - 1.0);
            if x < 0.0 { negative } else { x }
        }),
    }
}

/// `a * b + c`, in one step where `FUSED`.
#[inline(always)]
fn sum<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

#[inline(always)]
fn each(values: &mut [Lane], function: impl Fn(f32) -> f32) {
    for lane in values {
        for value in &mut lane.0 {
            *value = function(*value);
        }
    }
}

#[inline(always)]
fn sigmoid<const FUSED: bool>(x: f32) -> f32 {
    1.0 / (1.0 + exp::<FUSED>(-clamp(x, -SIGMOID_LIMIT, SIGMOID_LIMIT)))
}

/// NaN stays NaN: both comparisons are false for it.
#[inline(always)]
fn clamp(x: f32, low: f32, high: f32) -> f32 {
    let x = if x < low { low } else { x };
    if x > high { high } else { x }
}

/// `e^x` for |x| <= 87; NaN for NaN.
#[inline(always)]
fn exp<const FUSED: bool>(x: f32) -> f32 {
    // 1.5 * 2^23: adding it rounds to the nearest integer, which then sits in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let shifted = sum::<FUSED>(x, std::f32::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    // ln 2 in two parts (Cody and Waite), so that the remainder is exact enough.
    let r = sum::<FUSED>(n, -0.693_359_4, x);
    let r = sum::<FUSED>(n, 2.121_944_4e-4, r);
    // Minimax polynomial of e^r on |r| <= ln 2 / 2 (Cephes, expf).
    let p = 1.987_569_1e-4;
    let p = sum::<FUSED>(p, r, 1.398_199_9e-3);
    let p = sum::<FUSED>(p, r, 8.333_452e-3);
    let p = sum::<FUSED>(p, r, 4.166_579_6e-2);
    let p = sum::<FUSED>(p, r, 1.666_666_5e-1);
    let p = sum::<FUSED>(p, r, 0.5);
    let e = sum::<FUSED>(p * r, r, r) + 1.0;
    let scale = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3f80_0000));
    e * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_within_its_stated_error() {
        let mut worst = [0.0_f64; 2];
        for step in -400_000..=400_000 {
            let x = step as f32 * 1e-4;
            let truth = f64::from(x).exp();
            for (worst, found) in worst.iter_mut().zip([exp::<false>(x), exp::<true>(x)]) {
                *worst = worst.max(((f64::from(found) - truth) / truth).abs());
            }
        }
        assert!(worst.iter().all(|worst| *worst < 2e-7), "{worst:?}");
    }

    #[test]
    fn every_activation_is_within_its_stated_error() {
        type Truth = fn(f64) -> f64;
        let all: [(Activation, Truth, f64); 4] = [
            (Activation::Sigmoid, |x| 1.0 / (1.0 + (-x).exp()), 1.5e-7),
            (Activation::Tanh, f64::tanh, 3e-7),
            (Activation::Relu, |x| x.max(0.0), 0.0),
            (Activation::Elu { alpha: 1.0 }, |x| if x < 0.0 { x.exp_m1() } else { x }, 2e-7),
        ];
        for set in InstructionSet::present() {
            for (activation, truth, most) in all {
                let mut worst = 0.0_f64;
                for step in -45_000..=45_000 {
                    let x = step as f32 * 1e-3;
                    let mut values = [Lane([x; 16])];
                    apply(set, activation, &mut values);
                    worst = worst.max((f64::from(values[0].0[7]) - truth(f64::from(x))).abs());
                }
                println!("{activation:?} {set:?}: {worst:.1e}");
                assert!(worst <= most, "{activation:?} {set:?}: {worst:e}");
            }
        }
    }

    #[test]
    fn every_activation_lets_nan_through() {
        for set in InstructionSet::present() {
            for activation in
                [Activation::Identity, Activation::Sigmoid, Activation::Tanh, Activation::Relu, Activation::Elu { alpha: 1.0 }]
            {
                let mut values = [Lane([f32::NAN; 16])];
                apply(set, activation, &mut values);
                assert!(values[0].0.iter().all(|value| value.is_nan()), "{activation:?} {set:?}");
            }
        }
    }

    #[test]
    fn sigmoid_saturates_without_denormals() {
        for (x, truth) in [(-1e30, 0.0), (1e30, 1.0), (f32::NEG_INFINITY, 0.0), (f32::INFINITY, 1.0), (0.0, 0.5)] {
            let y = sigmoid::<true>(x);
            assert!((y - truth).abs() < 1e-17 && (y == 0.0 || y.is_normal()), "{x} {y}");
        }
    }
}
