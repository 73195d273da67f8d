//! Activations and their derivatives, written so that the compiler can use vector instructions.

use serde::{Deserialize, Serialize};

/// Elementwise function between two layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// None.
    Identity,
    /// 1 / (1 + exp(-x)).
    Sigmoid,
    /// tanh x.
    Tanh,
    /// max(0, x).
    Relu,
    /// x above 0, exp(x) - 1 below.
    Elu,
}

impl Activation {
    /// Applies it.
    pub fn apply(self, values: &mut [f32]) {
        match self {
            Self::Identity => {}
            Self::Sigmoid => values.iter_mut().for_each(|x| *x = 0.5 + 0.5 * tanh(0.5 * *x)),
            Self::Tanh => values.iter_mut().for_each(|x| *x = tanh(*x)),
            Self::Relu => values.iter_mut().for_each(|x| *x = x.max(0.0)),
            Self::Elu => values.iter_mut().for_each(|x| *x = if *x > 0.0 { *x } else { x.exp_m1() }),
        }
    }

    /// Multiplies gradients by the derivative, which all of these have as a function of their own output `y`.
    pub fn backward(self, y: &[f32], gradient: &mut [f32]) {
        let pairs = gradient.iter_mut().zip(y);
        match self {
            Self::Identity => {}
            Self::Sigmoid => pairs.for_each(|(g, y)| *g *= y * (1.0 - y)),
            Self::Tanh => pairs.for_each(|(g, y)| *g *= 1.0 - y * y),
            Self::Relu => pairs.for_each(|(g, y)| *g *= f32::from(*y > 0.0)),
            Self::Elu => pairs.for_each(|(g, y)| *g *= if *y > 0.0 { 1.0 } else { y + 1.0 }),
        }
    }

    /// Name of the ONNX operator; none for the identity.
    pub fn operator(self) -> Option<&'static str> {
        match self {
            Self::Identity => None,
            Self::Sigmoid => Some("Sigmoid"),
            Self::Tanh => Some("Tanh"),
            Self::Relu => Some("Relu"),
            Self::Elu => Some("Elu"),
        }
    }
}

/// tanh as the quotient of two polynomials (the coefficients of Eigen's `ptanh`), within 3e-7 of the true value.
fn tanh(x: f32) -> f32 {
    const ODD: [f32; 7] =
        [4.893_524_6e-3, 6.372_619_3e-4, 1.485_722_4e-5, 5.122_297e-8, -8.604_672e-11, 2.000_188e-13, -2.760_768_5e-16];
    const EVEN: [f32; 4] = [4.893_525e-3, 2.268_434_6e-3, 1.185_347_1e-4, 1.198_258_4e-6];
    let x = x.clamp(-7.905_311, 7.905_311);
    let s = x * x;
    let odd = ODD.iter().rev().fold(0.0, |sum, c| sum * s + c);
    let even = EVEN.iter().rev().fold(0.0, |sum, c| sum * s + c);
    x * odd / even
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Activation; 5] = [Activation::Identity, Activation::Sigmoid, Activation::Tanh, Activation::Relu, Activation::Elu];

    #[test]
    fn tanh_is_tanh() {
        for k in -4000..=4000 {
            let x = k as f32 * 0.005;
            assert!((tanh(x) - x.tanh()).abs() < 4e-7, "{x}");
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        for activation in ALL {
            for x in [-2.0_f32, -0.3, 0.4, 1.7] {
                let at = |x: f32| {
                    let mut y = [x];
                    activation.apply(&mut y);
                    y[0]
                };
                let mut gradient = [1.0];
                activation.backward(&[at(x)], &mut gradient);
                let expected = (at(x + 1e-2) - at(x - 1e-2)) / 2e-2;
                assert!((gradient[0] - expected).abs() < 2e-3, "{activation:?} {x}: {} {expected}", gradient[0]);
            }
        }
    }
}
