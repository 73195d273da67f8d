//! What was found is borne as the links are: a weight stretches a soft cable, and loads what rubs by its load; and a motor that gives too little has to
//! give for all of it. Effects are first sized by what is believed alone, and anew by all once it is known.

use super::{Effect, Search, Thresholds, all_but};
use crate::hypothesis::{Candidate, Dictionary, besides, torque_scale};
use crate::score::Scorer;

/// Most times that sizes are found anew with what is borne, which depends on them, and the share of each by which it is then known.
const TIMES: usize = 24;
const KNOWN: f64 = 1e-3;
/// Of what a motor gives for, most that is taken of the new: from 2 on what other joints tell, a weight, would never settle.
const MOST_OF_NEW: f64 = 1.5;
/// Times that shapes are found anew with it.
const SHAPES: usize = 2;

/// Sizes and shapes of effects by all that is borne, which the dictionary bears from then on; of them those are dropped that gain nothing any more.
/// What bears nothing stays as it is.
pub(super) fn bear<'p>(
    dictionary: &mut Dictionary<'p>,
    mut scorer: Scorer<'p>,
    thresholds: Thresholds,
    effects: &mut Vec<Effect>,
) -> Scorer<'p> {
    loop {
        let mut chosen: Vec<Candidate> = effects.iter().map(|effect| effect.chosen.candidate.clone()).collect();
        let mut bears = false;
        for _ in 0..SHAPES {
            let changed = loaded(dictionary, &scorer, &mut chosen);
            if changed.is_empty() {
                break;
            }
            bears = true;
            let search = Search { problem: dictionary.problem, dictionary, scorer, candidates: Vec::new(), thresholds };
            for k in changed {
                let others = search.grams(&chosen, Some(k));
                chosen[k] = search.refined(&others, &chosen[k]);
            }
            scorer = search.scorer;
        }
        let mut search = Search { problem: dictionary.problem, dictionary, scorer, candidates: Vec::new(), thresholds };
        let needless = search.needless(&chosen, if bears { thresholds.nats } else { 0.0 });
        scorer = search.scorer;
        if let Some(needless) = needless {
            effects.remove(needless);
            continue;
        }
        let sizes = sizes(&scorer, &chosen);
        for ((effect, candidate), coefficients) in effects.iter_mut().zip(chosen).zip(sizes) {
            (effect.chosen.candidate, effect.chosen.coefficients) = (candidate, coefficients);
        }
        return scorer;
    }
}

impl Search<'_, '_> {
    /// The one of some effects that gains least beside the others, if that is less than so much, nats: once loads are known than is asked of an effect,
    /// else than what it pays, since the others were settled after it.
    fn needless(&mut self, chosen: &[Candidate], nats: f64) -> Option<usize> {
        let gains: Vec<f64> = (0..chosen.len()).map(|k| self.better_by(chosen, &all_but(chosen, k))).collect();
        (0..gains.len()).filter(|k| gains[*k] < nats).min_by(|a, b| gains[*a].total_cmp(&gains[*b]))
    }
}

/// Makes columns anew until what is borne agrees with the sizes; which of them depend on it.
fn loaded(dictionary: &mut Dictionary, scorer: &Scorer, chosen: &mut [Candidate]) -> Vec<usize> {
    let mut changed = Vec::new();
    let mut before = sizes(scorer, chosen);
    for _ in 0..TIMES {
        let all = || chosen.iter().zip(before.iter().map(Vec::as_slice));
        // Of what a weak motor gives for, it is asked for more than that: for what was found and is not in its own column yet, by its scale.
        let scale = |joint: usize| {
            let of = |(own, theta): (&Candidate, &[f64])| {
                (own.family.joints == [joint]).then(|| torque_scale(&own.family, theta)).flatten()
            };
            all().find_map(of).unwrap_or(1.0).min(MOST_OF_NEW)
        };
        dictionary.bear(besides(dictionary, all()), scale);
        for (k, own) in chosen.iter_mut().enumerate() {
            let anew = own.anew(dictionary);
            if anew.shows() && anew.columns != own.columns {
                *own = anew;
                if !changed.contains(&k) {
                    changed.push(k);
                }
            }
        }
        if changed.is_empty() {
            break;
        }
        let after = sizes(scorer, chosen);
        let is_known = |(before, after): (&f64, &f64)| (after - before).abs() <= KNOWN * after.abs();
        let done = before.iter().flatten().zip(after.iter().flatten()).all(is_known);
        before = after;
        if done {
            break;
        }
    }
    changed
}

/// Coefficients of each of some candidates, beside the others.
fn sizes(scorer: &Scorer, chosen: &[Candidate]) -> Vec<Vec<f64>> {
    let mut all = scorer.fit(&scorer.grams(chosen)).coefficients.into_iter();
    chosen.iter().map(|own| all.by_ref().take(own.columns.len()).collect()).collect()
}
