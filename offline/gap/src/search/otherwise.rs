//! The search, begun again with another effect first. What explains most by itself may be neither of two effects that are there: a step and a
//! slow drift look like a cable that creeps, and what is beside that then explains little.

use super::judged::resolution;
use super::{Beyond, Effect, Scored, Search, price};
use crate::floors::floor;
use crate::hypothesis::Candidate;
use crate::series::rms;
use crate::unexplained::NEAR_FORMS;

/// Times the noise that effects leave of a cell, from which on others are looked for in their place, and that these may leave at most;
const BEYOND: f64 = 3.0;
/// and the share of what the first ones leave.
const LESS: f64 = 0.5;
/// Claims that are begun with.
const BEGUN: usize = 4;

impl Search<'_, '_> {
    /// Two effects or more that leave so much less than those that were chosen that they are there in their place, and the best beside them.
    pub(super) fn otherwise(
        &mut self,
        chosen: &[Candidate],
        firsts: Vec<Scored>,
        trace: &mut dyn FnMut(String),
    ) -> Option<(Vec<Candidate>, Vec<Effect>, Option<Scored>)> {
        // What a near form leaves of something large is its own.
        if chosen.iter().any(|own| NEAR_FORMS.contains(&own.family.physics)) {
            return None;
        }
        let height = self.height(chosen).filter(|height| *height > BEYOND)?;
        let enough = BEYOND.min(LESS * height);
        let mut begun: Vec<Candidate> = Vec::new();
        for Scored { candidate, .. } in firsts {
            if begun.len() < BEGUN && !begun.iter().chain(chosen).any(|other| other.same_claim(&candidate)) {
                begun.push(candidate);
            }
        }
        for first in begun {
            trace(format!("begun with {} {:?}: {height:.1} times the noise was left", first.family.physics, first.family.joints));
            let mut others = vec![first];
            let Beyond { next, .. } = self.forward(&mut others, trace);
            if others.len() < 2 || self.height(&others)? > enough {
                continue;
            }
            let effects = self.settle(&mut others, trace);
            let (left, better) = (self.height(&others)?, self.better_by(&others, chosen));
            trace(format!("begun so: {} effects, {left:.1} times the noise is left, better by {better:.1} nats", others.len()));
            if others.len() >= 2 && left <= enough && better > self.thresholds.nats {
                return Some((others, effects, next));
            }
        }
        None
    }

    /// Times its noise that effects leave of a cell, where that is most; none where recording and simulation are not compared sample by sample.
    fn height(&self, chosen: &[Candidate]) -> Option<f64> {
        let problem = self.problem;
        let exact = !problem.from_recording && !problem.practical.is_known() && !problem.of_points();
        if !exact || problem.nuisances.iter().any(|nuisance| !nuisance.columns.is_empty()) {
            return None;
        }
        let fit = self.scorer.fit(&self.grams(chosen, None));
        let least =
            |c: usize| floor(&problem.cells[c]).max(problem.own_error(c)).max(resolution(problem.cells[c].channel)).max(1e-300);
        let of_cell = |(c, left): (usize, Vec<f64>)| rms(left.into_iter()) / least(c);
        Some(self.residuals(&chosen.iter().collect::<Vec<_>>(), &fit).into_iter().enumerate().map(of_cell).fold(0.0, f64::max))
    }

    /// By how much effects predict better than others, nats, less what they pay more; by no more than twice what they do without the block that says most.
    pub(super) fn better_by(&mut self, effects: &[Candidate], others: &[Candidate]) -> f64 {
        let grams = self.grams(effects, None);
        let fit = self.scorer.fit(&grams);
        self.scorer.temper(&grams, &fit);
        let gain = self.scorer.gain(&self.scorer.fit(&self.grams(others, None)), &fit);
        self.scorer.untempered();
        let prices = |all: &[Candidate]| all.iter().map(price).sum::<f64>();
        gain.nats.min(2.0 * gain.least) - prices(effects) + prices(others)
    }
}
