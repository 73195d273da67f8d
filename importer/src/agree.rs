//! Compares the imported layers with tract's own runner of the same file, so that a fault in the reading of the graph (or an odd
//! graph) never becomes a wrong network.
//!
//! The accepted distance follows the rounding of float32 through the layers: local rounding of each sum, propagated as
//! independent errors through the weights. A network with large inner values is so given more room than one with small ones.

use crate::error::ImportError;
use crate::fold::Folded;
use crate::network::{Activation, Dense, scaled_f64};
use crate::oracle::Oracle;
use crate::random::Random;

/// Half the distance between 1 and the next float32.
const ROUNDING: f64 = 1.0 / 16_777_216.0;
/// Accepted distance per estimated rounding. Measured: at most 0.35 on the reference networks, 0.6 on some 4,000 small ones
/// with a flipped bit, 2 on a chain of 999 additions. On the reference networks it amounts to less than 1e-3 (mm).
const MARGIN: f64 = 8.0;
/// Spread of the test inputs in units of the input scaling; 0 first, the largest beyond what training saw.
const SPREADS: [f64; 8] = [0.0, 0.01, 0.1, 0.5, 1.0, 1.0, 1.0, 3.0];

pub(crate) fn check(folded: &Folded, oracle: &mut Oracle) -> Result<(), ImportError> {
    let mut random = Random::new(0x5EED);
    for spread in SPREADS {
        let input = test_input(folded, spread, &mut random);
        let tract = oracle.run(&input)?;
        compare(&estimate(folded, &input), &tract)?;
    }
    Ok(())
}

fn compare(imported: &[Value], tract: &[f32]) -> Result<(), ImportError> {
    if imported.len() != tract.len() {
        let node = "tract's output".to_owned();
        return Err(ImportError::OutputWidth { node, found: tract.len(), expected: imported.len() });
    }
    for (index, (value, tract)) in imported.iter().zip(tract).enumerate() {
        let tract = f64::from(*tract);
        for (source, number) in [("imported output", value.y), ("tract's output", tract)] {
            if !number.is_finite() {
                return Err(ImportError::NotFinite { tensor: source.to_owned(), index, value: number });
            }
        }
        let tolerance = MARGIN * value.rounding;
        // Both are finite; a tolerance that overflowed to NaN must refuse too.
        if !tolerance.is_finite() || (value.y - tract).abs() > tolerance {
            return Err(ImportError::Disagreement { index, imported: value.y, tract, tolerance });
        }
    }
    Ok(())
}

/// A raw input that the network's own scaling turns into numbers of about `spread`.
fn test_input(folded: &Folded, spread: f64, random: &mut Random) -> Vec<f32> {
    let inputs = (0..folded.network.input_width).map(|index| folded.network.raw_input(index, normal(random) * spread));
    inputs.map(|x| if x.is_finite() { x } else { 0.0 }).collect()
}

/// A number and an estimate of what float32 rounding may do to it.
#[derive(Clone, Copy)]
struct Value {
    y: f64,
    rounding: f64,
}

fn estimate(folded: &Folded, input: &[f32]) -> Vec<Value> {
    let layers = folded.network.layers.iter().zip(&folded.bias_terms);
    layers.fold(inputs(folded, input), |x, (layer, terms)| through(layer, terms, &x))
}

fn inputs(folded: &Folded, input: &[f32]) -> Vec<Value> {
    let scale = folded.network.input_scale.as_ref();
    let scaled = scaled_f64(scale, input).into_iter().enumerate();
    let terms = |index: usize| {
        scale.map_or(0.0, |s| f64::from(s.scale[index].abs()) * f64::from(input[index].abs() + s.shift[index].abs()))
    };
    scaled
        .map(|(index, y)| {
            let coarse = if folded.cancelling[index] { terms(index) } else { 0.0 };
            Value { y, rounding: ROUNDING * (y.abs() + coarse) }
        })
        .collect()
}

fn through(layer: &Dense, terms: &[f64], x: &[Value]) -> Vec<Value> {
    let rows = layer.weights.chunks_exact(layer.inputs).zip(&layer.bias).zip(terms);
    rows.map(|((row, bias), terms)| {
        let (mut sum, mut size, mut carried) = (f64::from(*bias), terms + f64::from(bias.abs()), 0.0);
        for (weight, x) in row.iter().map(|w| f64::from(*w)).zip(x) {
            sum += weight * x.y;
            size += (weight * x.y).abs();
            carried += (weight * x.rounding).powi(2);
        }
        let y = layer.activation.apply_f64(sum);
        let rounding = steepness(layer.activation) * (carried.sqrt() + ROUNDING * size) + ROUNDING * (1.0 + y.abs());
        Value { y, rounding }
    })
    .collect()
}

/// Largest slope of an activation.
fn steepness(activation: Activation) -> f64 {
    match activation {
        Activation::Sigmoid => 0.25,
        Activation::Elu { alpha } => f64::from(alpha.abs()).max(1.0),
        Activation::Identity | Activation::Tanh | Activation::Relu => 1.0,
    }
}

/// Nearly normal with deviation 1: a sum of twelve uniform numbers.
fn normal(random: &mut Random) -> f64 {
    (0..12).map(|_| random.uniform()).sum::<f64>() - 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{Chain, bytes};
    use crate::{Expected, chain, check as proto, fold, tract};

    const EXPECTED: Expected = Expected { inputs: 6, outputs: 3 };

    fn folded() -> (Folded, Oracle) {
        let model = Chain::new(6).with("Sub", &[2.0; 6]).dense(6).norm().activate("Sigmoid").dense(3).finish();
        let checked = proto::check(&bytes(&model), &EXPECTED).unwrap();
        let oracle = Oracle::load(&checked.proto, EXPECTED.inputs).unwrap();
        let links = chain::read(&tract::declutter(checked, EXPECTED.inputs).unwrap(), &EXPECTED).unwrap();
        (fold::fold(links, EXPECTED.inputs, std::collections::BTreeMap::default()).unwrap(), oracle)
    }

    fn refused(change: impl FnOnce(&mut Folded)) -> bool {
        let (mut folded, mut oracle) = folded();
        change(&mut folded);
        matches!(check(&folded, &mut oracle), Err(ImportError::Disagreement { .. }))
    }

    #[test]
    fn every_kind_of_misreading_is_noticed() {
        assert!(!refused(|_| ()), "the unchanged network agrees");
        assert!(refused(|f| f.network.layers[0].weights.swap(3, 17)));
        assert!(refused(|f| f.network.layers[1].weights[5] *= 1.001));
        assert!(refused(|f| f.network.layers[0].bias[2] += 1e-3));
        assert!(refused(|f| f.network.layers[0].activation = Activation::Tanh));
        assert!(refused(|f| f.network.input_scale = None));
        assert!(refused(|f| f.network.layers[1].bias.swap(0, 1)));
    }

    #[test]
    fn a_transposed_square_layer_is_noticed() {
        let transpose = |w: &[f32]| (0..36).map(|i| w[i % 6 * 6 + i / 6]).collect::<Vec<f32>>();
        assert!(refused(|f| f.network.layers[0].weights = transpose(&f.network.layers[0].weights)));
    }
}
