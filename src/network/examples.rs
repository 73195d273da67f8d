//! Random inputs, and what goes into each layer for them, in float64.

use nalgebra::DMatrix;
use ravenpose_importer::{Network, Random};

/// Shows what goes into each layer, one column per input, over as many random inputs as are asked for: others than those that
/// deviations are measured on.
pub(super) fn show_examples(network: &Network, count: usize, see: impl FnMut(usize, &DMatrix<f64>)) {
    let mut random = Random::new(0x00CA_11B0);
    let inputs: Vec<Vec<f32>> = (0..count).map(|_| random_input(network, &mut random)).collect();
    evaluate(network, &inputs, see);
}

/// As [`Network::evaluate_f64`] does, but all inputs at once, one column each: a service that was killed is to be back soon.
pub(super) fn evaluate(network: &Network, inputs: &[Vec<f32>], mut see: impl FnMut(usize, &DMatrix<f64>)) -> DMatrix<f64> {
    let scaled = inputs.iter().flat_map(|input| network.scaled_f64(input));
    let mut x = DMatrix::from_iterator(network.input_width, inputs.len(), scaled);
    for (index, layer) in network.layers.iter().enumerate() {
        see(index, &x);
        let weights = layer.weights.iter().map(|weight| f64::from(*weight));
        x = DMatrix::from_row_iterator(layer.outputs, layer.inputs, weights) * x;
        for mut column in x.column_iter_mut() {
            for (y, bias) in column.iter_mut().zip(&layer.bias) {
                *y = layer.activation.apply_f64(*y + f64::from(*bias));
            }
        }
    }
    x
}

/// Normal, by Box and Muller.
fn normal(random: &mut Random) -> f64 {
    (-2.0 * random.uniform().max(1e-300).ln()).sqrt() * (std::f64::consts::TAU * random.uniform()).cos()
}

/// An input of the spread that the network was trained for.
pub(super) fn random_input(network: &Network, random: &mut Random) -> Vec<f32> {
    (0..network.input_width).map(|index| network.raw_input(index, normal(random))).collect()
}

#[cfg(test)]
mod tests {
    use super::{Network, Random, evaluate, random_input};
    use ravenpose_importer::Activation;

    #[test]
    fn all_inputs_at_once_give_what_each_gives() {
        let mut random = Random::new(1);
        let mut network = Network::dense(&[30, 90, 70, 3], Activation::Sigmoid, |_, inputs| {
            (random.uniform() as f32 - 0.5) * 9.0 / inputs as f32
        });
        network.layers.iter_mut().flat_map(|layer| &mut layer.bias).for_each(|bias| *bias = random.uniform() as f32);
        let inputs: Vec<Vec<f32>> = (0..40).map(|_| random_input(&network, &mut random)).collect();
        let mut widths = Vec::new();
        let found = evaluate(&network, &inputs, |index, x| widths.push((index, x.shape())));
        assert_eq!(widths, [(0, (30, 40)), (1, (90, 40)), (2, (70, 40))]);
        for (input, found) in inputs.iter().zip(found.column_iter()) {
            for (truth, found) in network.evaluate_f64(input).iter().zip(found.iter()) {
                assert!((truth - found).abs() < 1e-13 * truth.abs().max(1.0), "{found} instead of {truth}");
            }
        }
    }
}
