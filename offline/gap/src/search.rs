//! Which candidates explain the residuals: forward, then swap and drop (gap-design.md, section 7).

mod at_once;
mod borne;
mod by_run;
mod explained;
mod judged;
mod likeliest;
mod otherwise;
mod rank;
mod recast;
mod settle;

pub(crate) use judged::is_uneven;
use judged::{shares, window_noise};
pub(crate) use likeliest::{confused, likelihood, numbers_beyond, score_scale};

use crate::hypothesis::{Candidate, Dictionary, UNMODELLED, Windows, library};
use crate::problem::Problem;
use crate::refine::{refined, starts};
use crate::score::{Fit, Gain, Grams, Scorer};

/// What decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// Least gain of an effect, nats.
    pub nats: f64,
    /// Least share of the remaining squared error of its best cell that a further effect has to remove.
    pub share: f64,
    /// Least RMS of a further effect, of the largest effect's in some cell where it helps: what is smaller may be the
    /// larger one's model error.
    pub amplitude: f64,
    /// Claims whose scores differ by less than this share are equal: the likeliest one is taken, which is mostly the simplest.
    pub equal: f64,
    /// Most effects, beside three for each joint: a simulation may have been made without any friction, and without rotors.
    pub effects: usize,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { nats: 12.0, share: 0.2, amplitude: 0.25, equal: 0.005, effects: 2 }
    }
}

/// What a delay in a window pays more than others, nats: a little lateness passes for the last of what a motion's middle leaves.
const LATE_IN_A_WINDOW: f64 = 25.0;

/// Claims that are judged before no further effect is said to be there: so many of the first, and of those that gain most.
const JUDGED: usize = 5;

/// The first claims that may be the first effect, where others are looked for.
const FIRSTS: usize = 8;

/// By so many times what is asked of an effect a memory has to be ahead of every other physics, if nothing else speaks for it.
pub(crate) const AHEAD: f64 = 2.0;

/// A candidate with what it gains beside the others chosen.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The candidate.
    pub candidate: Candidate,
    /// Over the set without it.
    pub gain: Gain,
    /// Gain less what is paid for being searched or less likely, nats.
    pub score: f64,
    /// The same of the gain on what was fitted, nats: what comes and goes predicts badly what was held out, but is seen there.
    seen: f64,
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
    /// Its significance beside the other effects.
    pub gain: Gain,
    /// Largest share of a cell's squared error that it removes beside the others.
    pub share: f64,
    /// Was it taken in place of what fits better, and is not acceptable or does not hold on what was held out?
    pub second: bool,
}

impl Effect {
    /// Has the vocabulary a name for it?
    pub fn is_named(&self) -> bool {
        self.chosen.candidate.family.physics != UNMODELLED
    }
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
}

impl<'a> Answer<'a> {
    /// The same, its sizes by what is borne of the effects that are there.
    #[must_use]
    pub(crate) fn bearing(mut self, dictionary: &mut Dictionary<'a>, thresholds: &Thresholds) -> Self {
        self.scorer = borne::bear(dictionary, self.scorer, *thresholds, &mut self.effects);
        self.fit_anew();
        self
    }

    /// Takes an effect back that was accepted; the last of them is then the best that was not.
    pub fn take_back(&mut self, effect: usize) -> Effect {
        let taken = self.effects.remove(effect);
        if self.effects.is_empty() {
            self.next = Some(taken.chosen.clone());
        }
        self.fit_anew();
        taken
    }

    /// Takes a rival of an effect in its place. What was chosen, and what stood before the rival, is no longer among its own rivals.
    pub fn exchange(&mut self, effect: usize, rival: usize) {
        let Some(rival) = self.effects[effect].rivals.drain(..=rival).next_back() else { return };
        self.effects[effect].second = true;
        self.choose(effect, rival);
    }

    /// Takes a rival of an effect in its place; what was chosen stays one of its rivals, the first.
    pub fn prefer(&mut self, effect: usize, rival: usize) {
        let rival = self.effects[effect].rivals.remove(rival);
        let chosen = self.choose(effect, rival);
        self.effects[effect].rivals.insert(0, chosen);
    }

    /// Puts something else in the place of what was chosen, which is returned.
    fn choose(&mut self, effect: usize, other: Scored) -> Scored {
        self.effects[effect].gain = other.gain;
        let chosen = std::mem::replace(&mut self.effects[effect].chosen, other);
        self.fit_anew();
        let base = self.grams_of(|k| k != effect);
        let before = self.scorer.fit(&base);
        let after = self.scorer.fit(&self.scorer.extended(&base, &self.effects[effect].chosen.candidate.columns));
        self.effects[effect].share = shares(&before, &after).into_iter().fold(0.0, f64::max);
        chosen
    }

    fn grams_of(&self, which: impl Fn(usize) -> bool) -> Grams {
        let of = self.effects.iter().enumerate().filter(|(k, _)| which(*k));
        self.scorer.grams(of.map(|(_, effect)| &effect.chosen.candidate))
    }

    fn fit_anew(&mut self) {
        self.grams = self.grams_of(|_| true);
        self.fit = self.scorer.fit(&self.grams);
        self.scorer.temper(&self.grams, &self.fit);
    }
}

/// What a forward search did not take.
#[derive(Default)]
struct Beyond {
    /// The best beside all that it took.
    next: Option<Scored>,
    /// What else could have been the first.
    firsts: Vec<Scored>,
}

/// A search under way.
struct Search<'p, 'd> {
    problem: &'p Problem<'p>,
    dictionary: &'d Dictionary<'p>,
    scorer: Scorer<'p>,
    candidates: Vec<Candidate>,
    thresholds: Thresholds,
}

/// Searches. The dictionary bears what is found from then on: columns that are made of it are loaded by that.
pub fn search<'p>(
    problem: &'p Problem<'p>,
    dictionary: &mut Dictionary<'p>,
    thresholds: &Thresholds,
    trace: &mut dyn FnMut(String),
) -> Answer<'p> {
    let families = library(dictionary);
    let candidates: Vec<Candidate> = starts(dictionary, &families);
    let mut search =
        Search { problem, dictionary, scorer: Scorer::new(problem, window_noise(problem)), candidates, thresholds: *thresholds };
    let none = search.scorer.fit(&search.scorer.empty());
    let mut chosen = Vec::new();
    let Beyond { mut next, firsts } = search.forward(&mut chosen, trace);
    let mut effects = search.settle(&mut chosen, trace);
    if let Some((others, of_others, beyond)) = search.otherwise(&chosen, firsts, trace) {
        (chosen, effects, next) = (others, of_others, beyond);
    }
    if let Some((_, of_others, beyond)) = search.recast(&chosen, trace) {
        (effects, next) = (of_others, beyond);
    }
    let (grams, fit) = (search.scorer.empty(), none.clone());
    Answer { effects, grams, fit, none, next, scorer: search.scorer }.bearing(dictionary, thresholds)
}

impl Search<'_, '_> {
    fn grams(&self, chosen: &[Candidate], without: Option<usize>) -> Grams {
        self.scorer.grams(chosen.iter().enumerate().filter(|(k, _)| Some(*k) != without).map(|(_, candidate)| candidate))
    }

    /// Takes one more effect as long as one is acceptable beside those chosen.
    fn forward(&mut self, chosen: &mut Vec<Candidate>, trace: &mut dyn FnMut(String)) -> Beyond {
        let mut beyond = Beyond::default();
        while chosen.len() < self.thresholds.effects + 3 * self.problem.robot.joint_count() {
            let base = self.grams(chosen, None);
            let ranked = self.rank(chosen);
            ranked.iter().take(6).for_each(|scored| trace(describe(scored)));
            let mut accepted = None;
            for scored in to_judge(&ranked) {
                let judged = self.judged(&base, chosen, scored);
                trace(format!("  judged: {} {judged:.2?}", describe(scored)));
                if self.accepts(scored, &judged) {
                    // One that removes little stands only where none removes more.
                    if judged.share >= self.thresholds.share {
                        accepted = Some(scored.clone());
                        break;
                    }
                    accepted = accepted.or_else(|| Some(scored.clone()));
                }
                beyond.next.get_or_insert_with(|| scored.clone());
            }
            let Some(best) = accepted else { break };
            if chosen.is_empty() {
                beyond.firsts.extend(ranked.iter().take(FIRSTS).filter(|s| s.score > self.thresholds.nats).cloned());
            }
            beyond.next = None;
            chosen.push(best.candidate);
            self.polish(chosen);
        }
        beyond
    }

    /// Shapes of all that was chosen, one after the other, beside the rest.
    fn polish(&self, chosen: &mut [Candidate]) {
        if chosen.len() < 2 {
            return;
        }
        for k in 0..chosen.len() {
            let base = self.grams(chosen, Some(k));
            chosen[k] = self.refined(&base, &chosen[k]);
        }
    }

    fn refined(&self, base: &Grams, candidate: &Candidate) -> Candidate {
        if !candidate.family.limits.is_empty() {
            return self.refined_at_once(base, candidate);
        }
        refined(self.dictionary, candidate, &|candidate| self.scorer.fitted(base, candidate))
    }
}

/// The claims that are judged, in this order: the first ones, and those that gain most however much they pay. Where the best one leaves much
/// that is not independent from row to row, as one of two effects does, prices weigh more than all gains, and what explains nothing but
/// costs nothing stands first.
fn to_judge(ranked: &[Scored]) -> Vec<&Scored> {
    let mut by_gain: Vec<usize> = (0..ranked.len()).collect();
    by_gain.sort_by(|a, b| ranked[*b].gain.nats.total_cmp(&ranked[*a].gain.nats));
    let first = (0..ranked.len()).take(JUDGED);
    first.chain(by_gain.into_iter().take(JUDGED).filter(|k| *k >= JUDGED)).map(|k| &ranked[k]).collect()
}

/// All of some candidates but one.
fn all_but(chosen: &[Candidate], without: usize) -> Vec<Candidate> {
    chosen.iter().enumerate().filter(|(k, _)| *k != without).map(|(_, candidate)| candidate.clone()).collect()
}

/// What a candidate pays for being one of many or less likely, nats.
fn price(candidate: &Candidate) -> f64 {
    let late = candidate.windows.is_some() && candidate.family.physics == "measurement_delay";
    let windows = candidate.windows.as_ref().map_or(0.0, Windows::price);
    candidate.family.penalty_nats + windows + if late { LATE_IN_A_WINDOW } else { 0.0 }
}

/// One line of a trace.
pub fn describe(scored: &Scored) -> String {
    let c = &scored.candidate;
    let family = &c.family;
    format!(
        "  {:9.1} ± {:5.1}  {} {:?} ({}) {:?} {:.5?} {:?} θ {:.5?}",
        scored.score,
        scored.gain.error,
        family.physics,
        family.joints.iter().map(|j| j + 1).collect::<Vec<_>>(),
        family.form,
        family.shape,
        c.shape,
        c.windows.as_ref().map(Windows::all),
        scored.coefficients
    )
}
