//! What was chosen, held against everything else in its place: swapped, or dropped.

use super::judged::Judged;
use super::{Effect, Scored, Search, all_but, describe, price};
use crate::hypothesis::Candidate;

/// What may stand in an effect's place beside the others: all, the first of it, and what of it is acceptable.
struct Place {
    ranked: Vec<Scored>,
    first: Option<(Scored, Judged)>,
    accepted: Option<(Scored, Judged)>,
}

impl Search<'_, '_> {
    /// Each effect against everything else in its place, beside the others; what does not hold is dropped.
    pub(super) fn settle(&mut self, chosen: &mut Vec<Candidate>, trace: &mut dyn FnMut(String)) -> Vec<Effect> {
        let mut effects = Vec::new();
        let mut of_a_ripple: Vec<Candidate> = Vec::new();
        let mut sweep = 0;
        'again: loop {
            sweep += 1;
            effects.clear();
            // The last ones first: they explain what the first ones may explain as well, once refined alone.
            for k in (0..chosen.len()).rev() {
                let as_they_are = all_but(chosen, k);
                let mut others = as_they_are.clone();
                if let [only] = others.as_mut_slice() {
                    *only = self.refined(&self.scorer.empty(), only);
                } else {
                    self.polish(&mut others);
                }
                let mut place = self.in_place_of(&chosen[k], &others, &of_a_ripple);
                // Once the others are refined without it there may be no room for it, though all of them together do far better.
                let stays = |place: &Place| place.accepted.as_ref().is_some_and(|(best, _)| best.candidate.same_claim(&chosen[k]));
                if !others.is_empty() && !stays(&place) {
                    let instead = place.accepted.iter().map(|(best, _)| &best.candidate);
                    let instead: Vec<Candidate> = others.iter().chain(instead).cloned().collect();
                    if self.better_by(chosen, &instead) > self.thresholds.nats {
                        let beside = self.in_place_of(&chosen[k], &as_they_are, &of_a_ripple);
                        if stays(&beside) {
                            trace(format!("  stays beside them as they are: {}", chosen[k].family.physics));
                            place = beside;
                        }
                    }
                }
                let Place { ranked, first, accepted } = place;
                let Some((first, judged)) = first else { continue };
                let Some((best, judged)) = accepted else {
                    trace(format!("  dropped {} {judged:.2?}", describe(&first)));
                    if judged.of_the_model && !others.is_empty() && first.candidate.same_claim(&chosen[k]) {
                        of_a_ripple.push(chosen[k].clone());
                    }
                    *chosen = others;
                    continue 'again;
                };
                let swapped = !best.candidate.same_claim(&chosen[k]);
                if swapped && sweep < 4 {
                    trace(format!("  swapped for {}", describe(&best)));
                    chosen[k] = best.candidate;
                    self.polish(chosen);
                    continue 'again;
                }
                chosen[k] = best.candidate.clone();
                // What stands before it is not acceptable, and no rival.
                let place = ranked.iter().position(|r| r.candidate.same_claim(&best.candidate)).unwrap_or(0);
                let rivals = ranked.into_iter().skip(place + 1).collect();
                effects.push(Effect { chosen: best, rivals, gain: judged.gain, share: judged.share, second: place > 0 });
            }
            effects.reverse();
            return effects;
        }
    }

    /// What may stand in the place of an effect beside the others, and which of that is acceptable: the best, or the effect itself behind what is not.
    fn in_place_of(&mut self, effect: &Candidate, others: &[Candidate], of_a_ripple: &[Candidate]) -> Place {
        let base = self.grams(others, None);
        let mut ranked = self.rank(others);
        // Claims that stand beside are not also rivals; a link and its drive are one claim, and may both be there.
        let there = |c: &Candidate| others.iter().any(|o| o.same_claim(c) && o.is_of_a_drive() == c.is_of_a_drive());
        ranked.retain(|r| !there(&r.candidate));
        let Some(first) = ranked.first() else { return Place { ranked, first: None, accepted: None } };
        let judged = self.judged(&base, others, first);
        let first = (first.clone(), judged);
        // What a ripple only seems to leave does not come in its place either.
        let shaken = of_a_ripple.iter().any(|other| other.same_claim(&first.0.candidate));
        let mut accepted = (!shaken && self.accepts(&first.0, &judged)).then(|| first.clone());
        // What was accepted may stand behind what is not acceptable.
        if accepted.is_none()
            && let Some(own) = ranked.iter().skip(1).find(|r| r.candidate.same_claim(effect))
        {
            let judged = self.judged(&base, others, own);
            // Beside what is not acceptable it may score little, or less than nothing: what it gains is judged.
            let score = own.score.max(judged.gain.nats - price(&own.candidate));
            accepted = self.accepts(own, &judged).then(|| (Scored { score, ..own.clone() }, judged));
        }
        Place { ranked, first: Some(first), accepted }
    }
}
