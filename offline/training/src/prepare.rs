//! What the network sees of the inputs: a linear map that training fits and the exported file has folded in.
//!
//! Raw features differ in size by six orders, and what matters most, how far a motor lags its command, is the small difference of
//! two large ones. So the default preset shows the network such differences, scaled on their own.

use crate::data::Trajectory;
use crate::error::TrainingError;
use ndarray::{Array1, Array2};
use ravenpose_wire::FEATURES;
use serde::{Deserialize, Serialize};

/// Which map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preparation {
    /// Every input, standardised.
    Standard,
    /// For `raven118-v1`: tip, rotation, torques, joints, motor speeds, commanded minus measured; nothing that a homing changes.
    Physical,
}

/// One number that the network sees: a sum of inputs times coefficients, minus its mean, by its standard deviation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Feature {
    /// Inputs and coefficients, raw units.
    pub terms: Vec<(usize, f64)>,
    /// Mean of the sum over training.
    pub mean: f64,
    /// Its standard deviation; 0 for a constant, which the network sees as 0.
    pub sd: f64,
}

/// The map, with the statistics of each raw input for the exported normalisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prepared {
    /// What the network sees, in order.
    pub features: Vec<Feature>,
    /// Per raw input: mean over training.
    pub mean: Vec<f64>,
    /// Per raw input: standard deviation over training; 0 for constants.
    pub sd: Vec<f64>,
}

/// Slots of `raven118-v1` that belong to a joint (slot 3 does not).
const SLOTS: [usize; 7] = [0, 1, 2, 4, 5, 6, 7];

/// The sums that [`Preparation::Physical`] uses: first features of the fields, wire/src/features.rs.
pub(crate) fn physical() -> Vec<Vec<(usize, f64)>> {
    let alone = |start: usize, slots: &[usize]| slots.iter().map(|slot| vec![(start + slot, 1.0)]).collect::<Vec<_>>();
    let minus =
        |a: usize, b: usize, slots: &[usize]| slots.iter().map(|slot| vec![(a + slot, 1.0), (b + slot, -1.0)]).collect::<Vec<_>>();
    [
        alone(0, &[0, 1, 2]),                   // pos
        minus(3, 0, &[0, 1, 2]),                // pos_d - pos
        alone(6, &[0, 1, 2, 3, 4, 5, 6, 7, 8]), // ori
        alone(40, &SLOTS),                      // tau
        alone(56, &SLOTS),                      // jpos
        alone(64, &SLOTS),                      // mvel
        minus(80, 48, &SLOTS),                  // mpos_d - mpos
        minus(88, 56, &SLOTS),                  // jpos_d - jpos
    ]
    .concat()
}

impl Prepared {
    /// Fits the map to the rows of training trajectories.
    ///
    /// # Errors
    /// [`TrainingError::Constant`] if nothing in the inputs changes.
    pub fn fit(trajectories: &[Trajectory], inputs: usize, preparation: Preparation) -> Result<Self, TrainingError> {
        let sums: Vec<Vec<(usize, f64)>> = match preparation {
            Preparation::Standard => (0..inputs).map(|input| vec![(input, 1.0)]).collect(),
            // What is appended to the layout is memory, each a feature of its own.
            Preparation::Physical => physical().into_iter().chain((FEATURES..inputs).map(|input| vec![(input, 1.0)])).collect(),
        };
        let raw: Vec<Vec<(usize, f64)>> = (0..inputs).map(|input| vec![(input, 1.0)]).collect();
        let (mut mean, mut sd) = statistics(trajectories, inputs, &raw);
        // The exported normalisation works in float32; the folded bias has to make up for just that.
        for mean in &mut mean {
            *mean = f64::from(*mean as f32);
        }
        // Both sides of a difference are normalised alike, so that it cancels before anything is rounded.
        for terms in sums.iter().filter(|terms| terms.len() == 2) {
            let (a, b) = (terms[0].0, terms[1].0);
            if sd[b] > 0.0 && sd[a] > 0.0 {
                (mean[a], sd[a]) = (mean[b], sd[b]);
            }
        }
        let (sum_mean, sum_sd) = statistics(trajectories, inputs, &sums);
        let features: Vec<Feature> =
            sums.into_iter().zip(sum_mean.into_iter().zip(sum_sd)).map(|(terms, (mean, sd))| Feature { terms, mean, sd }).collect();
        if features.iter().all(|feature| feature.sd == 0.0) {
            return Err(TrainingError::Constant { inputs });
        }
        Ok(Self { features, mean, sd })
    }

    /// Number of features that the network sees.
    pub fn width(&self) -> usize {
        self.features.len()
    }

    /// What the network sees of rows of raw inputs.
    pub fn apply(&self, inputs: &[f32]) -> Array2<f32> {
        let raw = self.mean.len().max(1);
        let rows = inputs.len() / raw;
        let mut out = Array2::zeros((rows, self.width()));
        for (row, mut to) in inputs.chunks_exact(raw).zip(out.rows_mut()) {
            for (to, feature) in to.iter_mut().zip(&self.features) {
                *to = feature.of(row);
            }
        }
        out
    }

    /// The map as a layer on normalised raw inputs (x - mean) · scale: weights features x inputs, and a bias. The scale of an
    /// input is [`Prepared::scale`].
    pub fn fold(&self) -> (Array2<f64>, Array1<f64>) {
        let mut weight = Array2::zeros((self.width(), self.mean.len()));
        let mut bias = Array1::zeros(self.width());
        for (index, feature) in self.features.iter().enumerate().filter(|(_, feature)| feature.sd > 0.0) {
            let mut rest = -feature.mean;
            for (input, coefficient) in &feature.terms {
                let scale = self.scale(*input);
                rest += coefficient * self.mean[*input];
                if scale > 0.0 {
                    weight[[index, *input]] += coefficient / (scale * feature.sd);
                }
            }
            bias[index] = rest / feature.sd;
        }
        (weight, bias)
    }

    /// Factor of the exported normalisation; 0 where training saw a constant, so that a new constant changes nothing.
    pub fn scale(&self, input: usize) -> f64 {
        if self.sd[input] > 0.0 { f64::from((1.0 / self.sd[input]) as f32) } else { 0.0 }
    }

    /// Does the network look at this raw input at all?
    pub fn uses(&self, input: usize) -> bool {
        self.sd[input] > 0.0
            && self.features.iter().any(|feature| feature.sd > 0.0 && feature.terms.iter().any(|(term, _)| *term == input))
    }
}

impl Feature {
    fn of(&self, row: &[f32]) -> f32 {
        if self.sd == 0.0 {
            return 0.0;
        }
        ((self.sum(row) - self.mean) / self.sd) as f32
    }

    fn sum(&self, row: &[f32]) -> f64 {
        self.terms.iter().map(|(input, coefficient)| coefficient * f64::from(row[*input])).sum()
    }
}

/// Mean and standard deviation of sums of inputs; a deviation within the rounding of float32 counts as 0.
fn statistics(trajectories: &[Trajectory], inputs: usize, sums: &[Vec<(usize, f64)>]) -> (Vec<f64>, Vec<f64>) {
    let of = |row: &[f32], terms: &[(usize, f64)]| terms.iter().map(|(i, c)| c * f64::from(row[*i])).sum::<f64>();
    let rows = || trajectories.iter().flat_map(|one| one.inputs.chunks_exact(inputs.max(1)));
    let n = rows().count().max(1) as f64;
    let mut mean = vec![0.0; sums.len()];
    for row in rows() {
        mean.iter_mut().zip(sums).for_each(|(mean, terms)| *mean += of(row, terms) / n);
    }
    let mut variance = vec![0.0; sums.len()];
    for row in rows() {
        for ((variance, mean), terms) in variance.iter_mut().zip(&mean).zip(sums) {
            *variance += (of(row, terms) - mean).powi(2) / n;
        }
    }
    let sd = variance
        .iter()
        .zip(&mean)
        .map(|(variance, mean)| if variance.sqrt() > 1e-6 * mean.abs() { variance.sqrt() } else { 0.0 })
        .collect();
    (mean, sd)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use ravenpose_wire::features;

    fn trajectory(rows: usize) -> Trajectory {
        let mut random = Random::new(9, 0);
        let inputs = (0..rows * FEATURES).map(|i| if i % FEATURES == 117 { 0.001 } else { (50.0 + 9.0 * random.normal()) as f32 });
        Trajectory { time_s: vec![0.0; rows], inputs: inputs.collect(), ..Trajectory::default() }
    }

    #[test]
    fn the_folded_map_gives_what_the_map_gives() {
        let data = [trajectory(200)];
        for preparation in [Preparation::Standard, Preparation::Physical] {
            let prepared = Prepared::fit(&data, FEATURES, preparation).expect("map");
            let (weight, bias) = prepared.fold();
            let row = &data[0].inputs[FEATURES..2 * FEATURES];
            let direct = prepared.apply(row);
            let normal: Array1<f64> = (0..FEATURES).map(|i| (f64::from(row[i]) - prepared.mean[i]) * prepared.scale(i)).collect();
            let folded = weight.dot(&normal) + bias;
            for (a, b) in direct.iter().zip(&folded) {
                assert!((f64::from(*a) - b).abs() < 1e-5, "{preparation:?} {a} {b}");
            }
        }
    }

    #[test]
    fn what_a_homing_changes_and_what_never_changes_is_not_looked_at() {
        let prepared = Prepared::fit(&[trajectory(50)], FEATURES, Preparation::Physical).expect("map");
        for input in 0..FEATURES {
            let name = features::name(input);
            if ["encVals", "encoffsets", "dt"].iter().any(|field| name.starts_with(field)) {
                assert!(!prepared.uses(input), "{name}");
            }
        }
        assert!(prepared.uses(0) && prepared.uses(40) && prepared.uses(80));
    }

    #[test]
    fn inputs_that_never_change_are_refused() {
        let one = Trajectory { time_s: vec![0.0, 1.0], inputs: vec![2.0, 3.0, 2.0, 3.0], ..Trajectory::default() };
        let error = Prepared::fit(&[one], 2, Preparation::Standard).expect_err("constant");
        assert!(error.to_string().starts_with("all 2 inputs are constant"), "{error}");
    }
}
