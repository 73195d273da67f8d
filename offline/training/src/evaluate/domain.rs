//! How often the bound that the card states holds, and how often its domain is left: computed as the service does.

use super::{FarOff, Friction, Load, Rest, Trust, Unsettled};
use crate::card::{VALIDATION_RMS, distance};
use crate::commands::Model;
use crate::data::Trajectory;
use crate::data::memory::AGES_S;
use crate::load::{self, Weighed};
use ravenpose::correction::Quantity;
use ravenpose::load::LoadCard;
use std::ops::Range;

/// Inputs named in the report at most.
const LEAVING: usize = 6;

/// Judges bound and domain on trajectories with the model's estimates; `card` if the model watches the load.
pub(super) fn trust(
    model: &Model,
    target: Quantity,
    card: Option<&LoadCard>,
    test: &[Trajectory],
    estimates: &[Rest],
    names: &[String],
) -> Trust {
    let numbers = |key: &str| -> Vec<f64> { model.words(key).iter().filter_map(|word| word.parse().ok()).collect() };
    // As the inputs are: a constant of a card is exactly its float32.
    let floats = |key: &str| -> Vec<f32> { model.words(key).iter().filter_map(|word| word.parse().ok()).collect() };
    let keys = target.keys();
    let (bound95, bound95_unsettled) = (numbers(keys.bound95), numbers(keys.bound95_unsettled));
    let mut trust = Trust { bound95, bound95_unsettled, ..Trust::default() };
    coverage(&mut trust, test, estimates);
    let (low, high) = (floats("ravenpose.feature_min"), floats("ravenpose.feature_max"));
    let (center, weight) = (floats("ravenpose.domain_center"), floats("ravenpose.domain_weight"));
    let limit = model.number("ravenpose.domain_limit").unwrap_or(f64::INFINITY);
    let inputs = model.chain.inputs().max(1);
    let mut left = vec![0_usize; low.len()];
    let (mut outside, mut beyond) = (0_usize, 0_usize);
    let mut doubtful: Vec<bool> = Vec::new();
    for row in test.iter().flat_map(|one| one.inputs.chunks_exact(inputs)) {
        let mut inside = true;
        for (((value, low), high), left) in row.iter().zip(&low).zip(&high).zip(&mut left) {
            if !(low..=high).contains(&value) {
                *left += 1;
                inside = false;
            }
        }
        outside += usize::from(!inside);
        let is_beyond = distance(row, &center, &weight) > limit;
        beyond += usize::from(is_beyond);
        doubtful.push(!inside || is_beyond);
    }
    let share = |count: usize| percent(count, doubtful.len().max(1));
    (trust.out_of_range, trust.out_of_domain) = (share(outside), share(beyond));
    let mut leaving: Vec<(String, f64)> =
        left.iter().zip(names).filter(|(count, _)| **count > 0).map(|(count, name)| (name.clone(), share(*count))).collect();
    leaving.sort_by(|a, b| b.1.total_cmp(&a.1));
    leaving.truncate(LEAVING);
    trust.leaving = leaving;
    if !model.chain.plays.is_empty() {
        trust.settled_after_s = test.iter().map(Trajectory::settled_after_s).collect();
    }
    if let Some(card) = card {
        let mut admitted = doubtful.iter().map(|doubtful| !doubtful);
        let weighed = |one: &Trajectory| {
            let admitted: Vec<bool> = admitted.by_ref().take(one.rows()).collect();
            load::weigh(card, model.chain.plays.len(), [one], |row| admitted[row])
        };
        let weighed: Vec<Weighed> = test.iter().map(weighed).collect();
        trust.load = Some(observed(card, test, estimates, &trust, &weighed));
        trust.friction = card.friction.map(|_| told(test, &weighed));
        let unseen = weighed.iter().flat_map(|one| one.unseen.iter().zip(&one.friction_unseen));
        doubtful.iter_mut().zip(unseen).for_each(|(doubtful, (load, friction))| *doubtful |= load | friction);
    }
    trust.far_off = model.number(VALIDATION_RMS).map(|rms| far_off(3.0 * rms, test, estimates, &doubtful));
    trust.unsettled = AGES_S.iter().filter_map(|age_s| unsettled(model, test, &trust.bound95_unsettled, age_s)).collect();
    trust
}

fn percent(count: usize, all: usize) -> f64 {
    100.0 * count as f64 / all as f64
}

/// Each row's truth and estimate.
fn rows<'a>(one: &'a Trajectory, estimate: &'a Rest) -> impl Iterator<Item = (&'a [f32], &'a [f32])> {
    let outputs = (one.exact.len() / one.rows().max(1)).max(1);
    one.exact.chunks_exact(outputs).zip(estimate.chunks_exact(outputs))
}

fn far_off(limit: f64, test: &[Trajectory], estimates: &[Rest], doubtful: &[bool]) -> FarOff {
    let length = |(truth, estimate): (&[f32], &[f32])| {
        truth.iter().zip(estimate).map(|(truth, estimate)| f64::from(truth - estimate).powi(2)).sum::<f64>().sqrt()
    };
    let all = test.iter().zip(estimates).flat_map(|(one, estimate)| rows(one, estimate).map(length));
    let far: Vec<bool> = all.zip(doubtful).filter(|(length, _)| *length > limit).map(|(_, flag)| *flag).collect();
    let flagged = far.iter().filter(|flag| **flag).count();
    FarOff { limit, rows: percent(far.len(), doubtful.len().max(1)), flagged: percent(flagged, far.len()) }
}

fn observed(card: &LoadCard, test: &[Trajectory], estimates: &[Rest], trust: &Trust, weighed: &[Weighed]) -> Load {
    let (mut others, mut inside) = (0_usize, 0_usize);
    for ((one, estimate), weighed) in test.iter().zip(estimates).zip(weighed) {
        for (row, ((truth, estimate), _)) in
            rows(one, estimate).zip(&weighed.unseen).enumerate().filter(|(_, (_, unseen))| !**unseen)
        {
            let rests = truth.iter().zip(estimate).map(|(truth, estimate)| f64::from((truth - estimate).abs()));
            others += truth.len();
            inside += rests.zip(trust.published(one, row)).filter(|(rest, bound)| rest <= *bound).count();
        }
    }
    let first = |(one, weighed): (&Trajectory, &Weighed)| Some(one.time_s[weighed.unseen.iter().position(|unseen| *unseen)?]);
    let all = || weighed.iter().flat_map(|one| &one.unseen);
    Load {
        limit_kg: f64::from(card.limit_kg),
        mass_kg: weighed.iter().filter_map(|one| one.mass_kg.last().copied()).collect(),
        unseen_from_s: test.iter().zip(weighed).map(first).collect(),
        unseen: percent(all().filter(|unseen| **unseen).count(), all().count().max(1)),
        coverage_of_rest: percent(inside, others),
    }
}

fn told(test: &[Trajectory], weighed: &[Weighed]) -> Friction {
    let first =
        |(one, weighed): (&Trajectory, &Weighed)| Some(one.time_s[weighed.friction_unseen.iter().position(|unseen| *unseen)?]);
    let all = || weighed.iter().flat_map(|one| &one.friction_unseen);
    Friction {
        end_nm: weighed.iter().filter_map(|one| one.friction_nm.last().copied()).collect(),
        unseen_from_s: test.iter().zip(weighed).map(first).collect(),
        unseen: percent(all().filter(|unseen| **unseen).count(), all().count().max(1)),
    }
}

fn unsettled(model: &Model, test: &[Trajectory], bound95: &[f64], age_s: &Range<f64>) -> Option<Unsettled> {
    let outputs = model.chain.outputs().max(1);
    let (mut squares, mut rows, mut inside) = (0.0_f64, 0_usize, 0_usize);
    for one in test.iter().map(|one| one.unsettled(age_s)) {
        let estimate = model.chain.estimate(&one.inputs);
        rows += one.rows();
        for (at, (truth, estimate)) in one.exact.iter().zip(&estimate).enumerate() {
            let rest = f64::from((truth - estimate).abs());
            squares += rest * rest;
            inside += usize::from(bound95.get(at % outputs).is_some_and(|bound| rest <= *bound));
        }
    }
    let n = rows.max(1) as f64;
    Some(Unsettled {
        age_s: (age_s.start, age_s.end),
        rows,
        rms: (squares / n).sqrt(),
        coverage: (!bound95.is_empty()).then(|| 100.0 * inside as f64 / (n * outputs as f64)),
    })
    .filter(|_| rows > 0)
}

fn coverage(trust: &mut Trust, test: &[Trajectory], estimates: &[Rest]) {
    let outputs = trust.bound95.len();
    if outputs == 0 {
        return;
    }
    let mut inside = vec![0_usize; outputs];
    let (mut rows, mut lowest, mut highest) = (0_usize, 100.0_f64, 0.0_f64);
    for (one, estimate) in test.iter().zip(estimates) {
        let mut held = 0;
        for (row, (truth, estimate)) in one.exact.chunks_exact(outputs).zip(estimate.chunks_exact(outputs)).enumerate() {
            for (axis, bound) in trust.published(one, row).iter().enumerate() {
                if f64::from((truth[axis] - estimate[axis]).abs()) <= *bound {
                    inside[axis] += 1;
                    held += 1;
                }
            }
        }
        rows += one.rows();
        let share = 100.0 * f64::from(held) / (one.rows() * outputs).max(1) as f64;
        (lowest, highest) = (lowest.min(share), highest.max(share));
    }
    trust.coverage = inside.iter().map(|count| 100.0 * *count as f64 / rows.max(1) as f64).collect();
    trust.coverage_all = trust.coverage.iter().sum::<f64>() / outputs as f64;
    trust.coverage_of_runs = (lowest, highest);
}
