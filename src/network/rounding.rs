//! Weights as whole numbers with a scale per row.
//!
//! Rounding each weight to the nearest number is best where inputs have nothing to do with one another. Those of an inner layer do: a few
//! hundred of them follow a hundred features. Then what one rounding adds to a row's sum, the next one can take off again. Row by row
//! and input by input, what has been lost so far is carried over to the inputs that are yet to be rounded, as far as they vary with those
//! before (Babai's nearest plane; GPTQ rounds large language models so). What is left on average goes into the bias.

use super::examples::show_examples;
use super::{Format, TILE_OUTPUTS_MIN};
use nalgebra::{Cholesky, DMatrix, DVector};
use ravenpose_importer::{Dense, Network};

/// Variance that every input has of its own, as a share of the mean one: no number is trusted to take off everything.
const OWN_VARIANCE: f64 = 0.05;
/// Random inputs from which it is learnt how each layer's inputs spread, at most; of large networks as many as can be had with so many
/// products and so many numbers kept, so that a start stays one of seconds and of some 100 MB.
const EXAMPLES: usize = 512;
const EXAMPLE_PRODUCTS: usize = 300_000_000;
const EXAMPLE_NUMBERS: usize = 8_000_000;
/// Networks whose rounding takes more products than this in all (a second or two) are rounded as if inputs were not related.
const RELATED_PRODUCTS: f64 = 3e9;

/// For each layer how its inputs spread; none for the first, and for those of too few outputs for whole numbers.
pub(super) fn spreads(network: &Network) -> Vec<Option<Spread>> {
    let inner = |(index, layer): (usize, &Dense)| index > 0 && layer.outputs >= TILE_OUTPUTS_MIN;
    let layers = || network.layers.iter().enumerate().filter(|numbered| inner(*numbered)).map(|(_, layer)| layer);
    let widest = layers().map(|layer| layer.inputs).max().unwrap_or(1);
    let count = EXAMPLES.min(EXAMPLE_PRODUCTS / network.parameter_count().max(1)).min(EXAMPLE_NUMBERS / widest).max(1);
    // Covariance, its factor, and what is carried over in each row.
    let products = |layer: &Dense| {
        let [inputs, outputs] = [layer.inputs, layer.outputs].map(|width| width as f64);
        inputs * inputs * (count as f64 + inputs / 3.0 + outputs / 2.0)
    };
    let related = layers().map(products).sum::<f64>() <= RELATED_PRODUCTS;
    let mut spreads = Vec::with_capacity(network.layers.len());
    show_examples(network, count, |index, x| {
        spreads.push(inner((index, &network.layers[index])).then(|| Spread::of(x, related)));
    });
    spreads
}

/// How the inputs of a layer spread.
pub(super) struct Spread {
    mean: DVector<f64>,
    /// Rows of the lower triangular factor of their covariance; none where they are taken for unrelated.
    factor: Option<Vec<Vec<f64>>>,
}

impl Spread {
    /// Of these examples, one in each column, whose numbers are `related` to one another or not.
    fn of(examples: &DMatrix<f64>, related: bool) -> Self {
        let (inputs, count) = examples.shape();
        let mean = examples.column_mean();
        let factor = || {
            let mut offsets = examples.clone();
            offsets.column_iter_mut().for_each(|mut column| column -= &mean);
            let mut covariance = &offsets * offsets.transpose() / count as f64;
            // What is left of inputs that never change is rounding of float64.
            let unchanging = 1e-12 * mean.norm_squared();
            let own = (OWN_VARIANCE * covariance.trace() + unchanging) / inputs as f64;
            (0..inputs).for_each(|input| covariance[(input, input)] += own);
            let lower = Cholesky::new(covariance)?.unpack();
            Some((0..inputs).map(|row| lower.row(row).iter().take(row + 1).copied().collect()).collect())
        };
        let factor = if related { factor() } else { None };
        Self { mean, factor }
    }
}

/// A layer's weights as whole numbers.
pub(super) struct Whole {
    /// Inputs of the layer.
    pub(super) inputs: usize,
    /// Of the numbers.
    pub(super) format: Format,
    /// Row by row.
    pub(super) numbers: Vec<i32>,
    /// Of each row: what a number is multiplied by to give a weight.
    pub(super) scale: Vec<f32>,
    /// The layer's, with what rounding loses on average.
    pub(super) bias: Vec<f32>,
}

impl Whole {
    /// Rounds to a format of whole numbers; each weight to the nearest number where no `spread` is given.
    pub(super) fn new(dense: &Dense, format: Format, spread: Option<&Spread>) -> Self {
        let inputs = dense.inputs.max(1);
        let mut whole = Self {
            inputs,
            format,
            numbers: Vec::with_capacity(dense.weights.len()),
            scale: Vec::with_capacity(dense.outputs),
            bias: dense.bias.clone(),
        };
        for (row, bias) in dense.weights.chunks_exact(inputs).zip(&mut whole.bias) {
            let scale = format.row_scale(row);
            match spread {
                Some(spread) => *bias += round_together(row, format, scale, spread, &mut whole.numbers),
                None => whole.numbers.extend(row.iter().map(|weight| format.round(*weight, scale))),
            }
            whole.scale.push(scale);
        }
        whole
    }
}

/// Appends a row's numbers, and gives what its sums lose on average.
fn round_together(row: &[f32], format: Format, scale: f32, spread: &Spread, numbers: &mut Vec<i32>) -> f32 {
    let first = numbers.len();
    numbers.resize(first + row.len(), 0);
    // What was lost of the inputs behind, as the factor weighs it.
    let mut owed = vec![0.0_f64; row.len()];
    let mut lost_on_average = 0.0;
    for (input, weight) in row.iter().enumerate().rev() {
        let factor = spread.factor.as_ref().and_then(|factor| factor[input].split_last());
        let carried = factor.map_or(0.0, |(own, _)| owed[input] / own);
        let number = format.round(*weight + carried as f32, scale);
        let lost = f64::from(*weight) - f64::from(scale) * f64::from(number);
        if let Some((_, others)) = factor {
            owed.iter_mut().zip(others).for_each(|(owed, other)| *owed += lost * other);
        }
        lost_on_average += lost * spread.mean[input];
        numbers[first + input] = number;
    }
    lost_on_average as f32
}

#[cfg(test)]
mod tests {
    use super::{DMatrix, DVector, Spread, Whole};
    use crate::network::Format;
    use ravenpose_importer::{Activation, Dense, Network, Random};

    const INPUTS: usize = 60;
    const CAUSES: usize = 12;

    /// Inputs that follow a few causes, around a mean; one example in each column.
    fn examples(count: usize, seed: u64) -> DMatrix<f64> {
        let mut mix = Random::new(1);
        let mix: Vec<f64> = (0..INPUTS * CAUSES).map(|_| mix.uniform() - 0.5).collect();
        let mut random = Random::new(seed);
        let mut example = || -> DVector<f64> {
            let causes: Vec<f64> = (0..CAUSES).map(|_| random.uniform() - 0.5).collect();
            mix.chunks_exact(CAUSES)
                .map(|row| 0.5 + row.iter().zip(&causes).map(|(a, b)| a * b).sum::<f64>())
                .collect::<Vec<_>>()
                .into()
        };
        DMatrix::from_columns(&(0..count).map(|_| example()).collect::<Vec<_>>())
    }

    fn layer() -> Dense {
        let mut random = Random::new(2);
        let mut numbers = |count: usize| (0..count).map(|_| random.uniform() as f32 - 0.5).collect();
        Dense { inputs: INPUTS, outputs: 40, weights: numbers(40 * INPUTS), bias: numbers(40), activation: Activation::Identity }
    }

    /// Mean and RMS of what the rounded layer's sums are off, over outputs and examples.
    fn errors(dense: &Dense, whole: &Whole, examples: &DMatrix<f64>) -> (f64, f64) {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for example in examples.column_iter() {
            for row in 0..dense.outputs {
                let at = row * INPUTS..(row + 1) * INPUTS;
                let truth: f64 = dense.weights[at.clone()].iter().zip(example.iter()).map(|(w, x)| f64::from(*w) * x).sum();
                let found: f64 = whole.numbers[at].iter().zip(example.iter()).map(|(n, x)| f64::from(*n) * x).sum();
                let off = found * f64::from(whole.scale[row]) + f64::from(whole.bias[row]) - truth - f64::from(dense.bias[row]);
                (sum, squares, count) = (sum + off, squares + off * off, count + 1.0);
            }
        }
        (sum / count, (squares / count).sqrt())
    }

    #[test]
    fn related_inputs_take_off_what_rounding_does_also_where_they_were_not_seen() {
        let dense = layer();
        let spread = Spread::of(&examples(500, 3), true);
        let unseen = examples(500, 4);
        let (_, nearest) = errors(&dense, &Whole::new(&dense, Format::I8, None), &unseen);
        let (mean, together) = errors(&dense, &Whole::new(&dense, Format::I8, Some(&spread)), &unseen);
        assert!(together < 0.3 * nearest, "{together:e} instead of {nearest:e}");
        assert!(mean.abs() < 0.2 * together, "{mean:e} is left on average of {together:e}");
    }

    #[test]
    fn numbers_stay_in_range_and_near_their_weights() {
        let dense = layer();
        let whole = Whole::new(&dense, Format::I8, Some(&Spread::of(&examples(500, 3), true)));
        for (row, scale) in whole.scale.iter().enumerate() {
            for at in row * INPUTS..(row + 1) * INPUTS {
                assert!(whole.numbers[at].abs() <= 127);
                let steps = (dense.weights[at] / scale - whole.numbers[at] as f32).abs();
                assert!(steps < 8.0, "a weight moved by {steps} steps");
            }
        }
    }

    #[test]
    fn inputs_that_never_change_are_taken_for_unrelated() {
        let dense = layer();
        let spread = Spread::of(&DMatrix::repeat(INPUTS, 50, 0.7), true);
        let whole = Whole::new(&dense, Format::I8, Some(&spread));
        assert_eq!(whole.numbers, Whole::new(&dense, Format::I8, None).numbers);
        let (mean, rms) = errors(&dense, &whole, &DMatrix::repeat(INPUTS, 1, 0.7));
        assert!(mean.abs() < 1e-6 && rms < 1e-6, "{mean:e} {rms:e}");
    }

    #[test]
    fn what_is_too_large_is_rounded_without_relations_and_from_few_examples() {
        let spreads =
            |widths: &[usize]| super::spreads(&Network::dense(widths, Activation::Tanh, |place, _| (place % 7) as f32 * 1e-3));
        let factors = |widths: &[usize]| -> Vec<Option<bool>> {
            spreads(widths).iter().map(|spread| spread.as_ref().map(|spread| spread.factor.is_some())).collect()
        };
        assert_eq!(factors(&[118, 40, 30, 3]), [None, Some(true), None]);
        // A covariance of 3000 by 3000 takes 9e9 products to take apart.
        assert_eq!(factors(&[10, 3000, 9, 3]), [None, Some(false), None]);
    }
}
