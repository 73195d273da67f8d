//! Which candidates explain the residuals: forward, then swap and drop (gap-design.md, section 7).

mod at_once;
mod by_run;
mod explained;
mod likeliest;
mod otherwise;
mod recast;
mod settle;

use explained::explained;
pub(crate) use likeliest::{complexity, confused, likelihood, score_scale};
use likeliest::{likeliest_first, simpler_is_enough};

use crate::cell::Channel;
use crate::hypothesis::{Candidate, Dictionary, Family, RIPPLE, UNMODELLED, WALL, Windows, library, rounds, shaken};
use crate::noise::Noise;
use crate::parallel;
use crate::problem::Problem;
use crate::refine::{refined, starts};
use crate::robot::Robot;
use crate::score::{Fit, Gain, Grams, Scorer, segments, within_bounds};

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
/// Times its standard error over the blocks that the gain of an effect has to reach, or the ranks of the blocks theirs, which the largest
/// block does not sway; or the squared error that it explains,
const SEEN_OFTEN: f64 = 2.0;
const EXPLAINED_OFTEN: f64 = 3.0;
/// but for what is there so shortly that blocks cannot be told apart: there as many nats without the block that says most are enough, if it has
/// few coefficients and nothing else is said,
const SURE: f64 = 36.0;
const FEW: usize = 2;
/// but for what is met seldom by its nature: a wall, a load that changes sides.
const SELDOM: [&str; 2] = ["external_contact", "backlash"];
/// Share of the remaining squared error that no model's error explains, if every block says so (standard errors of what is explained; or of the ranks of
/// what they gain, if as good as nothing is left), and of the least amplitude what is enough then: what a wrong form leaves, another one explains in
/// part, or in some blocks.
const NEARLY_ALL: f64 = 0.9;
const EVERYWHERE: f64 = 5.0;
const ALL: f64 = 0.97;
const IN_EACH: f64 = 3.0;
const LESS_THEN: f64 = 0.4;
/// Share of what an effect explains that may be where the nominal model is wrong by far more, if it begins or ends on the way: in the opened
/// cases that were looked at it is 0.44 at most of what is there, and 0.77 at least of what is none.
const OF_THE_MODEL: f64 = 2.0 / 3.0;
/// Share of what an effect explains beside a ripple that may be where that shakes the cable, and times the share of those rows that it may be: in the
/// opened cases that were looked at it is 1.2 times at most of what is there, and mostly more than twice of what is none.
const OF_A_RIPPLE: f64 = 0.5;
const OFTENER: f64 = 1.6;
/// Positions of the tip are published in whole micrometres: what does less than this to them (m RMS) is how they were computed.
const TIP_RESOLUTION: f64 = 2e-6;
/// No encoder tells less than this of a joint (rad or m RMS); a simulation without noise does.
const JOINT_RESOLUTION: f64 = 1e-7;

/// Least RMS of an effect in a channel, in its unit.
fn resolution(channel: Channel) -> f64 {
    match channel {
        Channel::EndEffector => TIP_RESOLUTION,
        Channel::Transmission => JOINT_RESOLUTION,
        Channel::JointTorque => 0.0,
    }
}

/// Claims that are tried in windows.
const CLAIMS_IN_WINDOWS: usize = 14;

/// Forms that are tried in the window of the best claim, between the grid's points: their number, and the share of its score.
const FORMS_IN_WINDOW: usize = 8;
const NEAR_IN_WINDOW: f64 = 0.5;

/// Share of the best claim's score from which on a rival begins again with its rounding.
const ROUNDED: f64 = 0.2;

/// Claims that are judged before no further effect is said to be there: so many of the first, and of those that gain most.
const JUDGED: usize = 5;

/// The first claims that may be the first effect, where others are looked for.
const FIRSTS: usize = 8;

/// By so many times what is asked of an effect a memory has to be ahead of every other physics, if nothing else speaks for it.
pub(crate) const AHEAD: f64 = 2.0;

/// Claims are close whose score is this share of the best, and as many are looked at again.
const CLOSE: f64 = 0.9;
const MOST_CLOSE: usize = 5;

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

/// How a candidate stands beside others.
#[derive(Debug, Clone, Copy)]
struct Judged {
    gain: Gain,
    /// Largest share of a cell that it removes.
    share: f64,
    /// Is most of what it explains there where the nominal model is wrong: by far more, if it begins or ends on the way, alone; or since a ripple
    /// beside it shakes the cable?
    of_the_model: bool,
    /// Its RMS over the largest other effect's where it removes as much as is asked; infinite beside nothing.
    amplitude: f64,
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

impl Answer<'_> {
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

/// Shares of the cells' squared errors, held out, that one fit leaves out and another has.
fn shares(before: &Fit, after: &Fit) -> Vec<f64> {
    let sum = |fit: &Fit, c: usize| fit.held_out[c].iter().sum::<f64>();
    (0..before.held_out.len()).map(|c| 1.0 - sum(after, c) / sum(before, c).max(1e-300)).collect()
}

/// Measurement noise of every cell: white at the sensor, coloured by the window.
fn window_noise(problem: &Problem) -> Vec<Noise> {
    let behind = problem.pairs[0].real.noise_of_rows();
    let white = problem.from_recording;
    let of = |tip: bool, rows: usize| if tip || white { Noise::default() } else { Noise::from_autocovariance(&behind, rows) };
    problem.cells.iter().map(|cell| of(cell.channel == Channel::EndEffector, cell.rows.len())).collect()
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

/// Searches.
pub fn search<'p>(
    problem: &'p Problem<'p>,
    dictionary: &Dictionary<'p>,
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
    if let Some((others, of_others, beyond)) = search.recast(&chosen, trace) {
        (chosen, effects, next) = (others, of_others, beyond);
    }
    let grams = search.grams(&chosen, None);
    let fit = search.scorer.fit(&grams);
    search.scorer.temper(&grams, &fit);
    Answer { effects, grams, fit, none, next, scorer: search.scorer }
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

    fn judged(&mut self, base: &Grams, others: &[Candidate], scored: &Scored) -> Judged {
        let before = self.scorer.fit(base);
        let grams = self.scorer.extended(base, &scored.candidate.columns);
        let after = self.scorer.fit(&grams);
        let gain = self.significance(others, &scored.candidate);
        let shares = shares(&before, &after);
        let mut start = 0;
        let mut sizes: Vec<Vec<f64>> = Vec::new();
        for candidate in others.iter().chain([&scored.candidate]) {
            let theta = &after.coefficients[start..start + candidate.columns.len()];
            start += theta.len();
            sizes.push((0..shares.len()).map(|c| candidate.varies_by(c, theta)).collect());
        }
        let own = sizes.pop().unwrap_or_default();
        let amplitude = (0..shares.len())
            .filter(|c| shares[*c] >= self.thresholds.share)
            .map(|c| own[c] / sizes.iter().map(|s| s[c]).fold(1e-300, f64::max))
            .fold(0.0, f64::max);
        let theta = &after.coefficients[after.coefficients.len() - scored.candidate.columns.len()..];
        let family = &scored.candidate.family;
        let practical = self.problem.practical.of(family.physics, &family.joints);
        let beyond = |c: usize| {
            let told = scored.candidate.effect(c, theta);
            !told.is_empty() && crate::series::rms(self.problem.nuisances[c].without(&told).into_iter()) >= practical[c]
        };
        let enough =
            !self.problem.practical.is_known() || (0..shares.len()).any(|c| shares[c] >= self.thresholds.share && beyond(c));
        let begins_or_ends = others.is_empty() && scored.candidate.edges() > 0;
        let ripples: Vec<&Candidate> = others.iter().filter(|other| other.family.physics == RIPPLE).collect();
        let of_the_model = (begins_or_ends || !ripples.is_empty()) && {
            let effects: Vec<Vec<f64>> = (0..shares.len()).map(|c| scored.candidate.effect(c, theta)).collect();
            let left = [self.scorer.left(base, &before), self.scorer.left(&grams, &after)];
            begins_or_ends && {
                let explained = explained(&left, &effects, |c| self.problem.is_within_a_miss(c, &effects[c]).collect());
                explained.within > OF_THE_MODEL * explained.all
            } || ripples.into_iter().any(|ripple| {
                let explained = explained(&left, &effects, |c| shaken(self.problem, c, ripple));
                explained.within > explained.all * OF_A_RIPPLE.max(OFTENER * explained.rows)
            })
        };
        let share = shares.into_iter().fold(0.0, f64::max);
        let amplitude = if others.is_empty() { f64::INFINITY } else { amplitude };
        let resolved = |c: usize| own[c] > 0.0 && own[c] >= resolution(self.problem.cells[c].channel);
        let enough = enough && (0..own.len()).any(resolved);
        Judged { gain, share, of_the_model, amplitude: if enough { amplitude } else { -1.0 } }
    }

    /// Gain of a candidate over the others with the noise that it leaves itself (Cochrane-Orcutt): by its autoregression, or
    /// by the number of rows that count as one; whichever says more. Noise that an effect only seems to explain stays in
    /// what it leaves, and is whitened away.
    fn significance(&self, others: &[Candidate], candidate: &Candidate) -> Gain {
        let all = |scorer: &Scorer| {
            let base = scorer.grams(others);
            let with = scorer.extended(&base, &candidate.columns);
            (base, with)
        };
        let (_, with) = all(&self.scorer);
        let noise = self.noise_left(others, candidate, &self.scorer.fit(&with));
        let shown = candidate.blocks(self.problem);
        let edges = candidate.blocks_of_edges(self.problem);
        let with_noise = |noise: Vec<Noise>| {
            let mut scorer = Scorer::new(self.problem, noise);
            let (base, with) = all(&scorer);
            let (before, after) = (scorer.fit(&base), scorer.fit(&with));
            scorer.temper(&with, &after);
            let mut gain = scorer.gain_in(&before, &after, |b| shown[b]);
            if candidate.edges() > 0 {
                let between = scorer.gain_in(&before, &after, |b| shown[b] && !edges[b]);
                gain.error = gain.error.min(between.error);
                gain.explained = gain.explained.max(between.explained);
                gain.ranks = gain.ranks.max(between.ranks);
            }
            gain
        };
        let (of_window, left) = parallel::both(|| with_noise(window_noise(self.problem)), || with_noise(noise));
        if left.nats > of_window.nats { left } else { of_window }
    }

    /// Autoregression of what a set leaves, per cell.
    fn noise_left(&self, others: &[Candidate], candidate: &Candidate, fit: &Fit) -> Vec<Noise> {
        let all: Vec<&Candidate> = others.iter().chain([candidate]).collect();
        let left = self.residuals(&all, fit);
        let of_cell = |(c, left): (usize, Vec<f64>)| {
            let parts: Vec<&[f64]> = segments(self.problem, c).into_iter().map(|s| &left[s]).collect();
            Noise::fit(&parts)
        };
        left.into_iter().enumerate().map(of_cell).collect()
    }

    /// What a set leaves of each cell.
    fn residuals(&self, all: &[&Candidate], fit: &Fit) -> Vec<Vec<f64>> {
        (0..self.problem.cells.len())
            .map(|c| {
                let mut left = self.problem.cells[c].residual.clone();
                let mut start = 0;
                for own in all {
                    let theta = &fit.coefficients[start..start + own.columns.len()];
                    start += theta.len();
                    own.take_off(c, theta, &mut left);
                }
                self.problem.nuisances[c].without(&left)
            })
            .collect()
    }

    fn accepts(&self, scored: &Scored, judged: &Judged) -> bool {
        let alone = judged.amplitude.is_infinite();
        // In a window it is met for as long as that lasts; a wall is met seldom all the same.
        let family = &scored.candidate.family;
        let seldom = SELDOM.contains(&family.physics) && (scored.candidate.edges() == 0 || family.form == WALL);
        let short = alone && scored.candidate.edges() > 0 && scored.candidate.columns.len() <= FEW && judged.gain.least > SURE;
        judged.gain.nats - price(&scored.candidate) >= self.thresholds.nats
            && judged.gain.least >= 0.5 * self.thresholds.nats
            && (is_met_often(&judged.gain) || seldom || short)
            && judged.amplitude >= 0.0
            && !judged.of_the_model
            && (alone || (judged.share >= self.thresholds.share && judged.amplitude >= self.least_amplitude(judged)))
    }

    /// Of the largest effect's amplitude, what a further one has to have.
    fn least_amplitude(&self, judged: &Judged) -> f64 {
        let everywhere = judged.gain.explained >= EVERYWHERE || (judged.share >= ALL && judged.gain.ranks >= IN_EACH);
        let surely = judged.share >= NEARLY_ALL && everywhere;
        if surely { LESS_THEN * self.thresholds.amplitude } else { self.thresholds.amplitude }
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

    /// The best form of every claim beside the others, best claim first. Claims are ordered by how much of the error they
    /// explain; the scale is that of the first one's significance.
    fn rank(&mut self, others: &[Candidate]) -> Vec<Scored> {
        let grams = &self.grams(others, None);
        let base = self.scorer.fit(grams);
        self.scorer.untempered();
        let mut all = best_claims(self.candidates.len(), &|k| self.score_of_start(grams, &base, &self.candidates[k]));
        // Effects that begin or end on the way: the claims that do something, again, in windows.
        let windows = self.windows();
        all.sort_by(|a, b| b.seen.total_cmp(&a.seen));
        let mut worth: Vec<Scored> = distinct(&all).into_iter().take(CLAIMS_IN_WINDOWS).filter(|s| s.seen > 3.0).collect();
        let refined = self.refined_often(grams, &base, &all);
        all.retain(|scored| self.is_borne_out(grams, scored));
        all.extend(refined);
        sort(&mut all);
        let mut claims = distinct(&all);
        for scored in claims.iter().take(CLAIMS_IN_WINDOWS).filter(|s| s.gain.nats > 3.0) {
            if !worth.iter().any(|other| other.candidate.same_start(&scored.candidate)) {
                worth.push(scored.clone());
            }
        }
        worth.retain(|s| s.candidate.family.comes_and_goes());
        claims.extend(best_claims(worth.len() * windows.len(), &|k| {
            let candidate = worth[k / windows.len()].candidate.within(self.problem, &windows[k % windows.len()]);
            if candidate.shows() { self.score(grams, &base, &candidate) } else { None }
        }));
        sort(&mut claims);
        let mut claims = distinct(&claims);
        // Between the grid's points, for those that may win; an edge that is off costs what is right more than what bends.
        let best = claims.first().map_or(0.0, |s| s.score);
        let worth = claims.iter_mut().enumerate().filter(|(k, s)| *k < if s.candidate.edges() > 0 { 12 } else { 6 });
        let worth: Vec<_> = worth.filter(|(_, s)| s.score > 3.0 && s.score > 0.1 * best).collect();
        let _ = parallel::map(worth, |(_, scored)| {
            self.run_by_run(grams, &base, scored);
            self.settle_shape(grams, &base, scored);
        });
        sort(&mut claims);
        self.round_alike(grams, &base, &mut claims);
        // What an edge that is not quite sharp, or not quite there, leaves of one effect is not another one.
        // And of one joint's dry friction there is one level, and what ripples in a drive shakes its cable.
        let robot = self.problem.robot;
        let of =
            |other: &Candidate, s: &Candidate| other.shares_edge(s) || levels_twice(other, s) || ripples_alike(other, s, robot);
        let rest = |s: &Scored| others.iter().any(|other| of(other, &s.candidate));
        claims.retain(|s| !rest(s));
        sort(&mut claims);
        claims.extend(self.in_the_window_of_the_first(&claims, grams, &base));
        claims.extend(self.refined_often_in_windows(grams, &base, &claims));
        claims.retain(|s| !rest(s));
        claims.extend(self.bent_where_a_memory_is(grams, &base, &claims));
        claims.retain(|s| !rest(s));
        sort(&mut claims);
        let mut claims = distinct(&claims);
        // One that was found in the window only may turn round otherwise than what stood first before.
        self.round_alike(grams, &base, &mut claims);
        claims.retain(|s| !rest(s));
        sort(&mut claims);
        // Rivals are told apart by the rows that count once the best of them is in: what it leaves is its model's error, and
        // that is not independent from row to row.
        if let Some(best) = claims.first().filter(|best| best.gain.nats > 0.0) {
            let with = self.scorer.extended(grams, &best.candidate.columns);
            let after = self.scorer.fit(&with);
            self.scorer.temper(&with, &after);
            let scale = (self.scorer.gain(&base, &after).nats.max(0.0) / best.gain.nats).min(1.0);
            self.scorer.untempered();
            for scored in &mut claims {
                let Gain { nats, error, least, explained, ranks } = scored.gain;
                scored.gain = Gain { nats: scale * nats, error: scale * error, least: scale * least, explained, ranks };
                scored.score = scored.gain.nats - price(&scored.candidate);
            }
        }
        sort(&mut claims);
        self.told_apart(others, &mut claims);
        likeliest_first(&mut claims, self.thresholds.equal, self.problem.robot);
        claims
    }

    /// Everything once more in the window that was found with the best claim: the grid of windows takes each claim in the form
    /// that fits the whole of the runs best, and some are not tried in windows of their own.
    fn in_the_window_of_the_first(&self, claims: &[Scored], grams: &Grams, base: &Fit) -> Vec<Scored> {
        let best = claims.first().filter(|best| best.score > self.thresholds.nats);
        let Some((best, windows)) = best.and_then(|best| Some((best, best.candidate.windows.clone()?))) else { return Vec::new() };
        let mut forms = best_of(self.candidates.len(), Candidate::same_form, &|k| {
            let candidate = self.candidates[k].within(self.problem, &windows);
            if candidate.shows() && candidate.family.may_have_edges() { self.score(grams, base, &candidate) } else { None }
        });
        sort(&mut forms);
        let mut forms = distinct_by(&forms, Candidate::same_form);
        forms.retain(|s| s.score > NEAR_IN_WINDOW * best.score);
        forms.truncate(FORMS_IN_WINDOW);
        let _ = parallel::map(&mut forms, |scored| self.settle_shape(grams, base, scored));
        forms.iter().filter(|form| !simpler_is_enough(form, claims.iter().chain(&forms))).cloned().collect()
    }

    /// How a sign turns round belongs to the joint and not to the law: rivals of the best claim, which round otherwise and do worse, begin
    /// again from its numbers. A search over one more number than it has starts seldom finds them.
    fn round_alike(&self, grams: &Grams, base: &Fit, claims: &mut [Scored]) {
        let Some((Scored { candidate: own, score: best, .. }, rivals)) = claims.split_first_mut() else { return };
        let rounding: Vec<(&str, f64)> =
            own.family.shape.iter().copied().zip(own.shape.iter().copied()).filter(|(name, _)| rounds(name)).collect();
        if rounding.is_empty() {
            return;
        }
        let least = (ROUNDED * *best).max(3.0);
        let alike = |family: &Family| {
            family.joints == own.family.joints
                && family.side() == own.family.side()
                && rounding.iter().all(|(name, _)| family.shape.contains(name))
        };
        let again = |rival: &mut Scored| {
            let mut starts: Vec<Candidate> = Vec::new();
            for start in self.candidates.iter().filter(|start| start.same_claim(&rival.candidate) && alike(&start.family)) {
                let mut shape = start.shape.clone();
                for (name, value) in &rounding {
                    if let Some(k) = start.family.shape.iter().position(|own| own == name) {
                        shape[k] = *value;
                    }
                }
                // Many starts differ in nothing but the rounding.
                if !starts.iter().any(|other| other.same_form(start) && other.shape == shape) {
                    starts.push(Candidate::new(self.dictionary, &start.family, &shape, rival.candidate.windows.as_ref()));
                }
            }
            let scored = starts.iter().filter(|start| start.shows()).filter_map(|start| self.score(grams, base, start));
            let Some(mut again) = scored.max_by(|a, b| a.score.total_cmp(&b.score)) else { return };
            self.settle_shape(grams, base, &mut again);
            if again.score > rival.score {
                *rival = again;
            }
        };
        let _ = parallel::map(rivals.iter_mut().filter(|rival| rival.score > least), again);
    }

    /// Moves a candidate between the grid's points, where that is better.
    fn settle_shape(&self, grams: &Grams, base: &Fit, scored: &mut Scored) {
        let candidate = self.refined(grams, &scored.candidate);
        if let Some(better) = self.score(grams, base, &candidate)
            && better.score > scored.score
        {
            *scored = better;
        }
    }

    /// The first claims, where they are close to each other, in the order of their gain over the noise that the best of them
    /// leaves: what differs between close rivals is small, and drowns in the plain sum of squares.
    fn told_apart(&self, others: &[Candidate], claims: &mut [Scored]) {
        let Some(best) = claims.first().filter(|best| best.score > self.thresholds.nats) else { return };
        let close = claims.iter().take(MOST_CLOSE).take_while(|s| s.score >= CLOSE * best.score).count();
        if close < 2 {
            return;
        }
        let grams = |scorer: &Scorer, one: Option<&Candidate>| scorer.grams(others.iter().chain(one));
        let fit = self.scorer.fit(&grams(&self.scorer, Some(&best.candidate)));
        let scorer = Scorer::new(self.problem, self.noise_left(others, &best.candidate, &fit));
        let base = scorer.fit(&grams(&scorer, None));
        let over: Vec<f64> = parallel::map(&claims[..close], |s| {
            scorer.gain(&base, &scorer.fit(&grams(&scorer, Some(&s.candidate)))).nats - price(&s.candidate)
        });
        let most = over.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if most <= 0.0 {
            return;
        }
        let score = best.score;
        for (claim, over) in claims[..close].iter_mut().zip(over) {
            claim.score = score * over / most;
        }
        sort(&mut claims[..close]);
    }

    /// Is a candidate as large as it has to be, and does its first part say no less than half of what the whole says?
    fn is_borne_out(&self, grams: &Grams, Scored { candidate, coefficients, .. }: &Scored) -> bool {
        if candidate.apart.is_empty() {
            return true;
        }
        let fit = self.scorer.fit(&self.scorer.extended(grams, &candidate.apart));
        let first = fit.coefficients[fit.coefficients.len() - candidate.apart.len()];
        coefficients[0].abs() >= candidate.family.least && first / coefficients[0] >= BORNE_OUT
    }

    fn score(&self, grams: &Grams, base: &Fit, candidate: &Candidate) -> Option<Scored> {
        self.score_of_start(grams, base, candidate).filter(|scored| self.is_borne_out(grams, scored))
    }

    /// The same of what may be more in a window, and is not held to what it has to be there.
    fn score_of_start(&self, grams: &Grams, base: &Fit, candidate: &Candidate) -> Option<Scored> {
        let fit = self.scorer.fit(&self.scorer.extended(grams, &candidate.columns));
        let coefficients = fit.coefficients[fit.coefficients.len() - candidate.columns.len()..].to_vec();
        let gain = self.scorer.gain(base, &fit);
        within_bounds(candidate, &fit).then(|| Scored {
            candidate: candidate.clone(),
            gain,
            score: gain.nats - price(candidate),
            seen: self.scorer.misfit(base) - self.scorer.misfit(&fit) - price(candidate),
            coefficients,
        })
    }
}

/// How much of what a whole says its first part has to say at least beside the others, which may pull the whole the other way.
const BORNE_OUT: f64 = 0.5;

/// The claims that are judged, in this order: the first ones, and those that gain most however much they pay. Where the best one leaves much
/// that is not independent from row to row, as one of two effects does, prices weigh more than all gains, and what explains nothing but
/// costs nothing stands first.
fn to_judge(ranked: &[Scored]) -> Vec<&Scored> {
    let mut by_gain: Vec<usize> = (0..ranked.len()).collect();
    by_gain.sort_by(|a, b| ranked[*b].gain.nats.total_cmp(&ranked[*a].gain.nats));
    let first = (0..ranked.len()).take(JUDGED);
    first.chain(by_gain.into_iter().take(JUDGED).filter(|k| *k >= JUDGED)).map(|k| &ranked[k]).collect()
}

/// Do both have a level of dry friction at the same joint, all the time? Only their sum is seen.
fn levels_twice(one: &Candidate, other: &Candidate) -> bool {
    let has_level = |candidate: &Candidate| {
        matches!(candidate.family.physics, "coulomb_friction" | "stribeck_friction") || candidate.is_by_load_and_level()
    };
    one.windows == other.windows && one.family.joints == other.family.joints && has_level(one) && has_level(other)
}

/// Difference of two periods that are one, of either.
const ALIKE: f64 = 0.03;

/// Does a motor ripple as often as a pulley of its joint is out of true?
fn ripples_alike(ripple: &Candidate, pulley: &Candidate, robot: &Robot) -> bool {
    let (one, other) = (&ripple.family, &pulley.family);
    if (one.physics, other.physics) != (RIPPLE, "pulley_eccentricity") || one.joints != other.joints {
        return false;
    }
    let turn = 2.0 * std::f64::consts::PI / robot.motor_from_joint[(one.joints[0], one.joints[0])].abs();
    let Some((order, period)) = ripple.shape_of("order").zip(pulley.shape_of("period")) else { return false };
    (turn / order - period).abs() < ALIKE * period
}

/// What a candidate pays for being one of many or less likely, nats.
fn price(candidate: &Candidate) -> f64 {
    let late = candidate.windows.is_some() && candidate.family.physics == "measurement_delay";
    let windows = candidate.windows.as_ref().map_or(0.0, Windows::price);
    candidate.family.penalty_nats + windows + if late { LATE_IN_A_WINDOW } else { 0.0 }
}

/// Does an effect show in more than a block or two: in their gains, their ranks, or the squared error that each explains?
fn is_met_often(gain: &Gain) -> bool {
    gain.nats > SEEN_OFTEN * gain.error || gain.ranks > SEEN_OFTEN || is_uneven(gain)
}

/// Is an effect accepted for what each block explains, though its gain is that of a few?
pub(crate) fn is_uneven(gain: &Gain) -> bool {
    gain.nats <= SEEN_OFTEN * gain.error && gain.explained > EXPLAINED_OFTEN
}

fn sort(all: &mut [Scored]) {
    all.sort_by(|a, b| b.score.total_cmp(&a.score));
}

/// The first of every claim.
fn distinct(sorted: &[Scored]) -> Vec<Scored> {
    distinct_by(sorted, Candidate::same_claim)
}

fn distinct_by(sorted: &[Scored], same: fn(&Candidate, &Candidate) -> bool) -> Vec<Scored> {
    let mut out: Vec<Scored> = Vec::new();
    for scored in sorted {
        if !out.iter().any(|o| same(&o.candidate, &scored.candidate)) {
            out.push(scored.clone());
        }
    }
    out
}

/// The best of every claim among so many candidates, by score and by what is seen; the first of equals. What loses is dropped
/// at once: with its columns it would take as much memory as the whole library.
fn best_claims(count: usize, score: &(dyn Fn(usize) -> Option<Scored> + Sync)) -> Vec<Scored> {
    best_of(count, Candidate::same_claim, score)
}

/// Candidates that are scored by one core before it takes others.
const PART: usize = 32;

/// The same of every kind of candidate: of those that are the same.
fn best_of(
    count: usize,
    same: fn(&Candidate, &Candidate) -> bool,
    score: &(dyn Fn(usize) -> Option<Scored> + Sync),
) -> Vec<Scored> {
    let best = |of: &mut dyn Iterator<Item = Scored>| {
        let (mut by_score, mut by_seen) = (Vec::new(), Vec::new());
        for scored in of {
            keep_better(&mut by_score, &scored, same, |s| s.score);
            keep_better(&mut by_seen, &scored, same, |s| s.seen);
        }
        by_score.extend(by_seen);
        by_score
    };
    // Those of either half stay: where the best one is not borne out another may be.
    let half = |range: std::ops::Range<usize>| {
        let parts = range.clone().step_by(PART).map(|from| from..(from + PART).min(range.end));
        let of_parts = parallel::map(parts, |part| best(&mut part.filter_map(score)));
        best(&mut of_parts.into_iter().flatten())
    };
    [half(0..count / 2), half(count / 2..count)].concat()
}

/// Takes a candidate in place of the one that says the same, if it is better.
fn keep_better(all: &mut Vec<Scored>, scored: &Scored, same: fn(&Candidate, &Candidate) -> bool, value: impl Fn(&Scored) -> f64) {
    match all.iter_mut().find(|other| same(&other.candidate, &scored.candidate)) {
        Some(other) if value(scored) > value(other) => *other = scored.clone(),
        Some(_) => {}
        None => all.push(scored.clone()),
    }
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
