//! Which candidates explain the residuals: forward, then swap and drop (gap-design.md, section 7).

use std::sync::Arc;

use crate::hypothesis::{Candidate, Dictionary, Family, library};
use crate::noise::Noise;
use crate::problem::{Channel, Problem};
use crate::refine::{refined, starts};
use crate::score::{Fit, Gain, Grams, Scorer, within_bounds};

/// What decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// Least gain of an effect, nats.
    pub nats: f64,
    /// Least share of the remaining squared error of its best cell that a further effect has to remove.
    pub share: f64,
    /// Most effects.
    pub effects: usize,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { nats: 12.0, share: 0.15, effects: 4 }
    }
}

/// A candidate with what it gains beside the others chosen.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The candidate.
    pub candidate: Candidate,
    /// Over the set without it.
    pub gain: Gain,
    /// Gain less what is paid for being searched or less likely, nats.
    pub score: f64,
    /// Coefficients of its columns.
    pub coefficients: Vec<f64>,
}

/// An effect that was accepted, and its rivals.
#[derive(Debug, Clone)]
pub struct Effect {
    /// What was accepted.
    pub chosen: Scored,
    /// The best of every other claim in its place, beside the other effects, best first.
    pub rivals: Vec<Scored>,
    /// Largest share of a cell's squared error that it removes beside the others.
    pub share: f64,
}

/// The search's answer.
pub struct Answer<'a> {
    /// In the order of acceptance.
    pub effects: Vec<Effect>,
    /// Columns of all effects, in order.
    pub grams: Grams,
    /// Fit of all of them together.
    pub fit: Fit,
    /// Fit of none.
    pub none: Fit,
    /// The best that was not accepted.
    pub next: Option<Scored>,
    /// Scores of this problem.
    pub scorer: Scorer<'a>,
    /// Everything that could have been said.
    pub families: Vec<Arc<Family>>,
}

/// Measurement noise of every cell: white at the sensor, coloured by the window.
fn window_noise(problem: &Problem) -> Vec<Noise> {
    let motion = &problem.pairs[0].real;
    let step = motion.rows.get(1).map_or(1, |second| second - motion.rows[0]);
    let behind = motion.window.autocovariance(step, 3);
    let of = |tip: bool, rows: usize| if tip { Noise::default() } else { Noise::from_autocovariance(&behind, rows) };
    problem.cells.iter().map(|cell| of(cell.channel == Channel::EndEffector, cell.rows.len())).collect()
}

/// A search under way.
struct Search<'p, 'd> {
    problem: &'p Problem<'p>,
    dictionary: &'d Dictionary<'p>,
    scorer: Scorer<'p>,
    candidates: Vec<Candidate>,
    thresholds: Thresholds,
}

/// Searches.
pub fn search<'p>(
    problem: &'p Problem<'p>,
    dictionary: &Dictionary<'p>,
    thresholds: &Thresholds,
    trace: &mut dyn FnMut(String),
) -> Answer<'p> {
    let families = library(dictionary);
    let candidates: Vec<Candidate> = starts(dictionary, &families);
    let mut search = Search { problem, dictionary, scorer: Scorer::new(problem, window_noise(problem)), candidates, thresholds: *thresholds };
    let none = search.scorer.fit(&search.scorer.empty());
    let mut chosen: Vec<Candidate> = Vec::new();
    let mut next = None;
    while chosen.len() < thresholds.effects {
        let base = search.grams(&chosen, None);
        let ranked = search.rank(&base);
        ranked.iter().take(6).for_each(|scored| trace(describe(scored)));
        let Some(best) = ranked.into_iter().next() else { break };
        let (best, share) = search.judged(&base, best);
        trace(format!("  best: {} removes {:.1} % of its cell", describe(&best), 100.0 * share));
        if !search.accepts(&best, share, chosen.len()) {
            next = Some(best);
            break;
        }
        chosen.push(best.candidate);
    }
    let effects = search.settle(&mut chosen, trace);
    let grams = search.grams(&chosen, None);
    let fit = search.scorer.fit(&grams);
    search.scorer.temper(&grams, &fit);
    Answer { effects, grams, fit, none, next, scorer: search.scorer, families }
}

impl Search<'_, '_> {
    fn grams(&self, chosen: &[Candidate], without: Option<usize>) -> Grams {
        chosen.iter().enumerate().filter(|(k, _)| Some(*k) != without).fold(self.scorer.empty(), |grams, (_, candidate)| {
            self.scorer.extended(&grams, &candidate.columns)
        })
    }

    /// Gain with the correlation that the model itself leaves, and the share that it removes.
    fn judged(&mut self, base: &Grams, scored: Scored) -> (Scored, f64) {
        let before = self.scorer.fit(base);
        let grams = self.scorer.extended(base, &scored.candidate.columns);
        let after = self.scorer.fit(&grams);
        self.scorer.temper(&grams, &after);
        let gain = self.scorer.gain(&before, &after);
        let sum = |fit: &Fit, c: usize| fit.held_out[c].iter().sum::<f64>();
        let share = (0..before.held_out.len()).map(|c| 1.0 - sum(&after, c) / sum(&before, c).max(1e-300)).fold(0.0, f64::max);
        (Scored { score: gain.nats - price(&scored.candidate), gain, ..scored }, share)
    }

    fn accepts(&self, best: &Scored, share: f64, beside: usize) -> bool {
        let needed = if beside == 0 { 0.0 } else { self.thresholds.share };
        best.score >= self.thresholds.nats && best.gain.nats >= 2.0 * best.gain.error && share >= needed
    }

    /// Each effect against everything else in its place, beside the others; what does not hold is dropped.
    fn settle(&mut self, chosen: &mut Vec<Candidate>, trace: &mut dyn FnMut(String)) -> Vec<Effect> {
        let mut effects = Vec::new();
        let mut sweep = 0;
        'again: loop {
            sweep += 1;
            effects.clear();
            for k in 0..chosen.len() {
                let base = self.grams(chosen, Some(k));
                // Claims that stand beside are not also rivals.
                let others: Vec<Candidate> = chosen.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, c)| c.clone()).collect();
                let mut ranked = self.rank(&base);
                ranked.retain(|r| !others.iter().any(|o| o.same_claim(&r.candidate)));
                let Some(best) = ranked.first().cloned() else { continue };
                let swapped = !best.candidate.same_claim(&chosen[k]);
                let (judged, share) = self.judged(&base, best);
                if !self.accepts(&judged, share, others.len()) {
                    trace(format!("  dropped {}", describe(&judged)));
                    let _ = chosen.remove(k);
                    continue 'again;
                }
                if swapped {
                    trace(format!("  swapped for {}", describe(&judged)));
                }
                chosen[k] = judged.candidate.clone();
                if swapped && sweep < 4 {
                    continue 'again;
                }
                let scale = judged.gain.nats / ranked[0].gain.nats.max(1e-9);
                let rivals = ranked
                    .into_iter()
                    .skip(1)
                    .map(|mut r| {
                        // On the scale of the judged gain.
                        r.gain.nats *= scale;
                        r.score = r.gain.nats - price(&r.candidate);
                        r
                    })
                    .collect();
                effects.push(Effect { chosen: judged, rivals, share });
            }
            return effects;
        }
    }

    /// The best form of every claim, best claim first.
    fn rank(&mut self, grams: &Grams) -> Vec<Scored> {
        let base = self.scorer.fit(grams);
        self.scorer.temper(grams, &base);
        let score = |candidate: &Candidate| self.score(grams, &base, candidate);
        let mut all = parallel(&self.candidates, &score);
        sort(&mut all);
        // Effects that begin on the way: the best claims again, with an onset.
        let shortest = self.problem.pairs.iter().map(|p| p.real.run.len() as f64 * p.real.run.dt_s).fold(f64::INFINITY, f64::min);
        let begun: Vec<Candidate> = distinct(&all)
            .into_iter()
            .take(12)
            .filter(|s| s.gain.nats > 3.0)
            .flat_map(|s| (1..20).map(move |k| (s.clone(), shortest * f64::from(k) / 20.0)))
            .map(|(s, onset)| {
                let mut begun = s.candidate;
                begun.onset_s = Some(onset);
                begun.columns.iter_mut().for_each(|column| *column = column.begun_at(self.problem, onset));
                begun
            })
            .filter(Candidate::shows)
            .collect();
        all.extend(parallel(&begun, &score));
        sort(&mut all);
        let mut claims = distinct(&all);
        // Between the grid's points, for those that may win.
        let best = claims.first().map_or(0.0, |s| s.score);
        for scored in claims.iter_mut().take(5).filter(|s| s.score > 3.0 && s.score > 0.2 * best) {
            let candidate = refined(self.dictionary, &scored.candidate, &|candidate| {
                let fit = self.scorer.fit(&self.scorer.extended(grams, &candidate.columns));
                if within_bounds(candidate, &fit) { self.scorer.misfit(&fit) } else { f64::INFINITY }
            });
            if let Some(better) = self.score(grams, &base, &candidate)
                && better.score > scored.score
            {
                *scored = better;
            }
        }
        sort(&mut claims);
        claims
    }

    fn score(&self, grams: &Grams, base: &Fit, candidate: &Candidate) -> Option<Scored> {
        let fit = self.scorer.fit(&self.scorer.extended(grams, &candidate.columns));
        let coefficients = fit.coefficients[fit.coefficients.len() - candidate.columns.len()..].to_vec();
        let gain = self.scorer.gain(base, &fit);
        within_bounds(candidate, &fit).then(|| Scored { candidate: candidate.clone(), gain, score: gain.nats - price(candidate), coefficients })
    }
}

/// What a candidate pays for being one of many or less likely, nats.
fn price(candidate: &Candidate) -> f64 {
    candidate.family.penalty_nats + if candidate.onset_s.is_some() { 6.0 } else { 0.0 }
}

fn sort(all: &mut [Scored]) {
    all.sort_by(|a, b| b.score.total_cmp(&a.score));
}

/// The first of every claim.
fn distinct(sorted: &[Scored]) -> Vec<Scored> {
    let mut out: Vec<Scored> = Vec::new();
    for scored in sorted {
        if !out.iter().any(|o| o.candidate.same_claim(&scored.candidate)) {
            out.push(scored.clone());
        }
    }
    out
}

fn parallel(candidates: &[Candidate], score: &(dyn Fn(&Candidate) -> Option<Scored> + Sync)) -> Vec<Scored> {
    let (left, right) = candidates.split_at(candidates.len() / 2);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| right.iter().filter_map(score).collect::<Vec<_>>());
        let mut all: Vec<Scored> = left.iter().filter_map(score).collect();
        all.extend(other.join().expect("no panic in scoring"));
        all
    })
}

/// One line of a trace.
pub fn describe(scored: &Scored) -> String {
    let c = &scored.candidate;
    let family = &c.family;
    format!(
        "  {:9.1} ± {:5.1}  {} {:?} ({}) {:?} {:.5?} onset {:?} θ {:.5?}",
        scored.score,
        scored.gain.error,
        family.physics,
        family.joints.iter().map(|j| j + 1).collect::<Vec<_>>(),
        family.form,
        family.shape,
        c.shape,
        c.onset_s,
        scored.coefficients
    )
}
