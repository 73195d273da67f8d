//! The model card as metadata: what a network may be used for, in the form that `docs/models.md` lays down.

use crate::chain::Chain;
use crate::data::Trajectory;
use crate::data::memory::AGES_S;
use crate::load;
use crate::prepare::Prepared;
use ravenpose::correction::Quantity;
use ravenpose::load::LoadCard;
use ravenpose_wire::{FEATURES, PEDAL_DOWN, features};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Property: RMS of the vector that is left on the validation trajectories, without the truth's known noise; for `evaluate`.
pub const VALIDATION_RMS: &str = "ravenpose.validation_rms";
/// Coverage that the bound is stated for.
pub const COVERAGE: f64 = 0.95;
/// Share of the unseen trajectories in which it is to be reached at least.
const TRAJECTORIES: f64 = 0.75;
/// The range of a feature is widened by this share of itself on both sides: an unseen trajectory of the same kind leaves the
/// extremes of a finite sample now and then.
const RANGE_MARGIN: f64 = 0.05;
/// Share of the validation rows that lie within the limit of the domain, and room beyond it.
const DOMAIN_SHARE: f64 = 0.999;
const DOMAIN_ROOM: f64 = 1.1;
/// One row in so many is looked at without its friction.
const FRICTION_EVERY: usize = 8;
/// Golden pairs in a card.
const GOLDEN: usize = 8;
/// Room of the correction bound beyond the largest estimate seen.
const BOUND_ROOM: f64 = 1.25;
/// What `dt` can be at all: the network does not look at it, and it varies from machine to machine.
const DT_RANGE: (f32, f32) = (0.0, 0.1);
/// Least and largest excess kurtosis that the expansion is used for: two values, and heavier tails than a Laplace distribution's.
const EXCESS: (f64, f64) = (-2.0, 6.0);
/// 97.5 % quantile of the normal distribution.
const NORMAL_975: f64 = 1.959_964;

/// What a card is made of.
pub struct Facts<'a> {
    /// The exported network.
    pub chain: &'a Chain,
    /// Are the inputs `raven118-v1`, perhaps with a memory behind them? The card speaks of the layout's 118 only: what a memory
    /// adds is bounded by itself.
    pub is_raven: bool,
    /// What of a RAVEN-II's tip it gives.
    pub target: Quantity,
    /// What it looks at.
    pub prepared: &'a Prepared,
    /// What torque tells about the load, if it does.
    pub load: Option<&'a LoadCard>,
    /// Trajectories of training.
    pub train: &'a [Trajectory],
    /// Trajectories that the bound and the limit of the domain are taken from.
    pub validation: &'a [Trajectory],
    /// In words: data, split, recipe.
    pub trained_on: &'a str,
    /// Further properties.
    pub more: BTreeMap<String, String>,
}

/// Half width per output that held the true value with [`COVERAGE`] in [`TRAJECTORIES`] of the validation trajectories, counted as
/// split conformal prediction does: whole trajectories, since what differs from run to run is not in the rows of one. The gradient never
/// saw them, but the epoch was chosen by them. Of fewer than three it is the widest. Rows whose memory had not settled have a bound of
/// their own, and count only where no other is there. NaN where there are no rows.
pub fn bounds(chain: &Chain, validation: &[Trajectory]) -> Vec<f64> {
    let outputs = chain.outputs();
    let per_axis = 1.0 / (outputs.max(1) as f64).sqrt();
    let any_settled = validation.iter().any(|one| (0..one.rows()).any(|row| one.is_settled(row)));
    let estimates: Vec<Vec<f32>> = validation.iter().map(|one| chain.estimate(&one.inputs)).collect();
    let runs = || validation.iter().zip(&estimates).filter(|(one, _)| one.rows() > 0);
    (0..outputs)
        .map(|output| {
            let of_run = |(one, estimates): (&Trajectory, &Vec<f32>)| {
                let rests = one.labels.iter().zip(estimates).skip(output).step_by(outputs);
                let counted = rests.enumerate().filter(|(row, _)| !any_settled || one.is_settled(*row));
                let rests: Vec<f64> = counted.map(|(_, (label, estimate))| f64::from(label - estimate).abs()).collect();
                (!rests.is_empty()).then(|| half_width(rests, one.noise * per_axis))
            };
            let mut all: Vec<f64> = runs().filter_map(of_run).collect();
            all.sort_by(f64::total_cmp);
            let place = (TRAJECTORIES * (all.len() + 1) as f64).ceil() as usize;
            all.get(place.clamp(1, all.len().max(1)) - 1).copied().unwrap_or(f64::NAN)
        })
        .collect()
}

/// Half width that holds [`COVERAGE`] of the errors without their known Gaussian noise: from their second and fourth moments, from which
/// the noise's are taken off (Cornish and Fisher's expansion); without noise the quantile itself.
fn half_width(mut lengths: Vec<f64>, noise: f64) -> f64 {
    if noise == 0.0 {
        return quantile(&mut lengths, COVERAGE);
    }
    let n = lengths.len().max(1) as f64;
    let moment = |power: i32| lengths.iter().map(|length| length.powi(power)).sum::<f64>() / n;
    let variance = noise * noise;
    let second = (moment(2) - variance).max(f64::MIN_POSITIVE);
    let fourth = moment(4) - 6.0 * variance * second - 3.0 * variance * variance;
    let excess = (fourth / (second * second) - 3.0).clamp(EXCESS.0, EXCESS.1);
    second.sqrt() * (NORMAL_975 + (NORMAL_975.powi(3) - 3.0 * NORMAL_975) / 24.0 * excess)
}

/// The same while a memory has not settled: the widest over its ages and of runs whose friction is not known, and no narrower than
/// `settled`, that of one that has. None where no memory was unsettled. How far friction can be from the usual three validation
/// runs do not tell: for that the training runs count too, whose errors are hardly smaller.
fn unsettled_bounds(chain: &Chain, train: &[Trajectory], validation: &[Trajectory], settled: &[f64]) -> Option<Vec<f64>> {
    let of_age = |age_s| bounds(chain, &validation.iter().map(|one: &Trajectory| one.unsettled(age_s)).collect::<Vec<_>>());
    let unknown = chain.friction.then(|| {
        let runs: Vec<Trajectory> = train.iter().chain(validation).map(|one| load::without_friction(one, FRICTION_EVERY)).collect();
        bounds(chain, &runs)
    });
    let all = AGES_S.iter().map(of_age).chain(unknown);
    let found: Vec<Vec<f64>> = all.filter(|bounds| bounds.iter().all(|bound| bound.is_finite())).collect();
    let wider = |widest: Vec<f64>, bounds: &Vec<f64>| widest.iter().zip(bounds).map(|(a, b)| a.max(*b)).collect();
    (!found.is_empty()).then(|| found.iter().fold(settled.to_vec(), wider))
}

/// The smallest value with at least this share of all at or below it.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (share * values.len() as f64).ceil() as usize;
    values.get(place.clamp(1, values.len().max(1)) - 1).copied().unwrap_or(0.0)
}

/// All properties of a model.
pub fn card(facts: &Facts) -> BTreeMap<String, String> {
    let mut card = facts.more.clone();
    let mut put = |key: &str, value: String| drop(card.insert(key.to_owned(), value));
    let (is_raven, keys) = (facts.is_raven, facts.target.keys());
    let settled = bounds(facts.chain, facts.validation);
    put("ravenpose.trained_on", facts.trained_on.to_owned());
    if is_raven {
        put("ravenpose.feature_layout", features::LAYOUT.to_owned());
        put("ravenpose.units", facts.target.units().to_owned());
        put("ravenpose.runlevels", PEDAL_DOWN.to_string());
        let boards: BTreeSet<i32> = facts.train.iter().chain(facts.validation).map(|one| one.board).collect();
        if !boards.contains(&0) {
            put("ravenpose.boards", words(&boards.into_iter().collect::<Vec<_>>()));
        }
        if let Some(wider) = unsettled_bounds(facts.chain, facts.train, facts.validation, &settled) {
            put(keys.bound95_unsettled, words(&wider));
        }
        let largest = facts.train.iter().chain(facts.validation).flat_map(|one| {
            facts
                .chain
                .estimate(&one.inputs)
                .chunks_exact(3)
                .map(|e| e.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt())
                .collect::<Vec<_>>()
        });
        if let Some(load) = facts.load {
            put("ravenpose.load_expected", load.expected.iter().map(|row| words(row)).collect::<Vec<_>>().join("\n"));
            put("ravenpose.load_pull", load.pull.iter().map(|row| words(row)).collect::<Vec<_>>().join("\n"));
            put("ravenpose.load_noise_nm", words(&load.noise_nm));
            put("ravenpose.load_weight", words(&load.weight));
            put("ravenpose.load_travel_deg", words(&load.travel_deg));
            put("ravenpose.load_information", words(&load.information));
            put("ravenpose.load_limit_kg", load.limit_kg.to_string());
        }
        if let (true, Some(load)) = (facts.chain.friction, facts.load) {
            let known = load::friction_known(load, facts.chain.plays.len(), facts.train.iter().chain(facts.validation));
            put("ravenpose.friction_min_nm", words(&known.map(|(least, _)| least)));
            put("ravenpose.friction_max_nm", words(&known.map(|(_, largest)| largest)));
        }
        put(keys.bound, format!("{:.2}", BOUND_ROOM * largest.fold(0.0, f64::max)));
    }
    let (low, high) = ranges(facts, is_raven);
    let stated = if is_raven { FEATURES } else { facts.chain.inputs() };
    put("ravenpose.feature_min", words(&low[..stated]));
    put("ravenpose.feature_max", words(&high[..stated]));
    let (center, weight, limit) = domain(facts);
    put("ravenpose.domain_center", words(&center[..stated]));
    put("ravenpose.domain_weight", words(&weight[..stated]));
    put("ravenpose.domain_limit", limit.to_string());
    put(keys.bound95, words(&settled));
    put("ravenpose.golden", golden(facts));
    put(VALIDATION_RMS, validation_rms(facts).to_string());
    card
}

fn validation_rms(facts: &Facts) -> f64 {
    let squares = |one: &Trajectory| {
        let rests = one.labels.iter().zip(facts.chain.estimate(&one.inputs)).map(|(label, estimate)| f64::from(label - estimate));
        rests.map(|rest| rest * rest).sum::<f64>() - one.rows() as f64 * one.noise * one.noise
    };
    let rows: usize = facts.validation.iter().map(Trajectory::rows).sum();
    let mean = facts.validation.iter().map(squares).sum::<f64>() / rows as f64;
    mean.max(0.0).sqrt()
}

fn words<T: std::fmt::Display>(numbers: &[T]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// Range of each input in training and validation, widened where it moves. A constant stays exact: other encoder offsets mean
/// another homing, whose static error this model cannot know.
fn ranges(facts: &Facts, is_raven: bool) -> (Vec<f32>, Vec<f32>) {
    let inputs = facts.chain.inputs();
    let (mut low, mut high) = (vec![f32::INFINITY; inputs], vec![f32::NEG_INFINITY; inputs]);
    for row in facts.train.iter().chain(facts.validation).flat_map(|one| one.inputs.chunks_exact(inputs.max(1))) {
        for ((low, high), value) in low.iter_mut().zip(&mut high).zip(row) {
            *low = low.min(*value);
            *high = high.max(*value);
        }
    }
    for (low, high) in low.iter_mut().zip(&mut high) {
        let margin = (RANGE_MARGIN * f64::from(*high - *low)) as f32;
        *low -= margin;
        *high += margin;
    }
    if is_raven {
        (low[features::DT], high[features::DT]) = DT_RANGE;
    }
    (low, high)
}

/// How far a row is from what was trained on.
pub(crate) fn distance(row: &[f32], center: &[f32], weight: &[f32]) -> f64 {
    row.iter().zip(center).zip(weight).map(|((x, c), w)| f64::from((x - c) * w).powi(2)).sum::<f64>().sqrt()
}

/// Centre, weights and limit of the distance: standardised inputs that the network looks at.
fn domain(facts: &Facts) -> (Vec<f32>, Vec<f32>, f32) {
    let inputs = facts.chain.inputs();
    let center = facts.chain.shift.clone();
    let weight: Vec<f32> = (0..inputs)
        .map(|input| {
            let counts = facts.prepared.uses(input) && !(facts.is_raven && input >= FEATURES);
            if counts { facts.chain.scale[input] } else { 0.0 }
        })
        .collect();
    let rows = facts.validation.iter().flat_map(|one| one.inputs.chunks_exact(inputs.max(1)));
    let mut distances: Vec<f64> = rows.map(|row| distance(row, &center, &weight)).collect();
    let limit = (DOMAIN_ROOM * quantile(&mut distances, DOMAIN_SHARE)).max(f64::from(f32::MIN_POSITIVE));
    (center, weight, limit as f32)
}

/// Rows spread over training with what the network gives for them.
fn golden(facts: &Facts) -> String {
    let inputs = facts.chain.inputs().max(1);
    let rows: Vec<&[f32]> = facts.train.iter().flat_map(|one| one.inputs.chunks_exact(inputs)).collect();
    let mut text = String::new();
    for k in 0..GOLDEN.min(rows.len()) {
        let mut row = rows[k * rows.len() / GOLDEN.min(rows.len())].to_vec();
        let stated = if facts.is_raven { FEATURES } else { inputs };
        // A memory that has seen nothing but this state.
        row[stated..].fill(0.0);
        let _ = writeln!(text, "{} {}", words(&row[..stated]), words(&facts.chain.estimate_exactly(&row)));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::Dense;
    use crate::network::Activation;
    use crate::random::Random;
    use ndarray::Array2;

    fn chain_of_nothing(outputs: usize) -> Chain {
        let layer = Dense { weight: Array2::zeros((outputs, 1)), bias: vec![0.0; outputs], activation: Activation::Identity };
        Chain { shift: vec![0.0], scale: vec![1.0], layers: vec![layer], plays: Vec::new(), friction: false }
    }

    #[test]
    fn the_bound_holds_19_of_20_true_values_though_the_truth_is_noisy() {
        let mut random = Random::new(8, 0);
        let (n, noise) = (40_000, 0.5);
        let normal = |random: &mut Random| 0.6 * random.normal();
        // Rarely far, and always about as far, where the expansion is wider than need be.
        let rarely = |random: &mut Random| if random.share() < 0.2 { 0.5 * random.normal() } else { 0.15 * random.normal() };
        let always = |random: &mut Random| if random.share() < 0.5 { 0.3 } else { -0.3 } + 0.05 * random.normal();
        for (of, off) in [(&normal as &dyn Fn(&mut Random) -> f64, 0.01), (&rarely, 0.02), (&always, 0.051)] {
            let exact: Vec<f32> = (0..3 * n).map(|_| of(&mut random) as f32).collect();
            let mut one =
                Trajectory { time_s: vec![0.0; n], inputs: vec![0.0; n], labels: exact.clone(), exact, ..Trajectory::default() };
            crate::data::add_noise(&mut one, 3, noise, &mut random);
            let bounds = bounds(&chain_of_nothing(3), std::slice::from_ref(&one));
            for (output, bound) in bounds.iter().enumerate() {
                let inside = one.exact.iter().skip(output).step_by(3).filter(|value| f64::from(value.abs()) <= *bound).count();
                let share = inside as f64 / n as f64;
                assert!(share > 0.93 && (share - COVERAGE).abs() < off, "{share}");
            }
        }
    }

    #[test]
    fn rows_with_an_unsettled_memory_and_the_best_of_few_runs_make_no_bound() {
        // Errors of 5 until the memory has settled, then of 1; and a run of 2.
        let of = |settled: f32, after: usize| {
            let labels: Vec<f32> = (0..100).map(|row| if row < 30 { 5.0 } else { settled }).collect();
            let time_s = (0..100).map(f64::from).collect();
            let is_unsettled = (0..100).map(|row| row < after).collect();
            Trajectory { time_s, inputs: vec![0.0; 100], is_unsettled, labels, ..Trajectory::default() }
        };
        assert_eq!(bounds(&chain_of_nothing(1), &[of(1.0, 30)]), [1.0]);
        assert_eq!(bounds(&chain_of_nothing(1), &[of(2.0, 30), of(1.0, 30)]), [2.0]);
        assert_eq!(bounds(&chain_of_nothing(1), &[of(1.0, 100)]), [5.0]);
    }
}
