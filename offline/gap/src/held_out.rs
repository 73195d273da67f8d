//! What effects leave of what was held out, where no size was fitted; and which of them do not hold there. What was fitted says how well a
//! claim fits, and its blocks how well it predicts their neighbours: a wrong one, bent to what is there, may do both. Nor does hold what is
//! said beside a larger effect and may by its own interval be nothing.

use crate::held_windows;
use crate::hypothesis::{Candidate, Dictionary, UNMODELLED, Windows};
use crate::intervals::Estimate;
use crate::noise::Noise;
use crate::problem::Problem;
use crate::score::segments;
use crate::search::{AHEAD, Answer, Effect, Scored, Thresholds, confused, describe};
use crate::series::{less_means, mean};
use crate::told::main_cell;

/// Of the squared size of an effect, what it has to leave less of what was held out at least: 1 where it is as it was fitted, -1 where it has
/// nothing to do with what is there; 0 where it is half of what it should be.
const HOLDS: f64 = -0.2;
/// Of an effect that was accepted barely: one that gains less than so many times what is asked, and a memory, whose many numbers find something
/// in most of what they are fitted to.
const HOLDS_BARELY: f64 = 0.0;
const BARELY: f64 = 3.0;
/// Times the noise that an effect has to be large where it is, if it is in no run that was held out.
const STANDS_OUT: f64 = 1.0;
/// What a rival has to leave less there to be taken instead, and the share of the claim's score that it has to have.
const INSTEAD: f64 = 0.5;
const NEAR: f64 = 0.3;
/// What an effect has to leave there above the noise, in squares of that, for a rival to be asked for; the share of its score that the
/// rival has to have, and what that may leave of it.
const MUCH: f64 = 3.0;
const CLOSE: f64 = 0.95;
const FAR_LESS: f64 = 0.25;
/// Share of what the largest effect explains from which on another one is something, whatever its own number says; and how often a rival may be
/// taken for what says it.
const LARGE: f64 = 0.1;
const ANEW: usize = 6;
/// Of its squared size where it was fitted, what it has to have there to be judged.
const SHOWS: f64 = 1e-6;
/// What may be otherwise in each run: whether the hand touches, how warm a drive is when it begins.
const OTHERWISE: [&str; 2] = ["external_contact", "thermal_drift"];

/// What was held out, and what it is compared with.
pub(crate) struct HeldOut<'a> {
    /// Residuals of the fit.
    pub problem: &'a Problem<'a>,
    /// Columns of what was held out.
    pub dictionary: &'a Dictionary<'a>,
    /// Noise floor of each cell of the fit.
    pub floors: &'a [f64],
}

/// A claim with its coefficients.
pub(crate) type Sized<'a> = (&'a Candidate, &'a [f64]);

/// The chosen ones of effects, with their sizes.
pub(crate) fn sized<'a>(effects: &'a [Effect], estimates: &'a [Estimate]) -> Vec<Sized<'a>> {
    effects.iter().zip(estimates).map(|(effect, estimate)| (&effect.chosen.candidate, &estimate.coefficients[..])).collect()
}

/// The same of candidates whose coefficients stand in a row.
pub(crate) fn sized_in_a_row<'a>(candidates: impl IntoIterator<Item = &'a Candidate>, mut all: &'a [f64]) -> Vec<Sized<'a>> {
    candidates.into_iter().map(|own| (own, all.split_off(..own.columns.len()).unwrap_or_default())).collect()
}

/// All but one of them.
pub(crate) fn others<'a>(all: &[Sized<'a>], without: usize) -> Vec<Sized<'a>> {
    all.iter().enumerate().filter(|(k, _)| *k != without).map(|(_, one)| *one).collect()
}

/// Likeliest values of what is known only roughly beside all effects, per cell.
pub(crate) fn beside(problem: &Problem, effects: &[Effect], estimates: &[Estimate]) -> Vec<Vec<f64>> {
    let all = sized(effects, estimates);
    let left = |c: usize| left(problem, c, &all);
    (0..problem.cells.len()).map(|c| problem.nuisances[c].estimate(&left(c))).collect()
}

/// What effects leave of the residual of a cell.
pub(crate) fn left(problem: &Problem, c: usize, effects: &[Sized]) -> Vec<f64> {
    let mut left = problem.cells[c].residual.clone();
    for (candidate, coefficients) in effects {
        candidate.take_off(c, coefficients, &mut left);
    }
    left
}

/// What effects leave of a cell, without what the nominal model may make up for.
pub(crate) fn left_without(problem: &Problem, c: usize, effects: &[Sized]) -> Vec<f64> {
    problem.nuisances[c].without(&left(problem, c, effects))
}

/// Autoregression of what effects leave, per cell.
pub(crate) fn noise_left(problem: &Problem, effects: &[Sized]) -> Vec<Noise> {
    let of_cell = |c: usize| {
        let left = left_without(problem, c, effects);
        let parts: Vec<&[f64]> = segments(problem, c).into_iter().map(|rows| &left[rows]).collect();
        Noise::fit(&parts)
    };
    (0..problem.cells.len()).map(of_cell).collect()
}

/// An effect that explains what was fitted and not what was held out.
#[derive(Debug, Clone)]
pub struct Refused {
    /// What was accepted.
    pub effect: Effect,
    /// Cell in which it shows most.
    pub cell: usize,
    /// RMS of what was held out there, without it and with it, in the cell's unit.
    pub rms: [f64; 2],
    /// Is what was held out a later part of the only run?
    pub later: bool,
}

impl Refused {
    /// What the error goes with then.
    pub(crate) fn goes_with(&self) -> &'static str {
        if self.later { "what differs from one part of the run to the next" } else { "what differs from run to run" }
    }
}

/// What becomes of an effect that does not stay as it is.
enum Fate {
    /// A rival says it, the first of its rivals then what was said.
    Otherwise(usize),
    /// A rival holds in its place.
    Exchanged(usize),
    /// It need not be said.
    Needless,
    /// It does not hold, nor does a rival.
    Refused,
}

impl HeldOut<'_> {
    /// Takes back what does not hold or need not be said, or takes a rival that does in its place; tells the first effect, if it went without one.
    pub(crate) fn judge(
        &self,
        answer: &mut Answer,
        estimates: &mut Vec<Estimate>,
        sizes: &dyn Fn(&Answer) -> Vec<Estimate>,
        thresholds: &Thresholds,
        trace: &mut dyn FnMut(String),
    ) -> Option<Refused> {
        let (mut refused, mut anew) = (None, 0);
        // Each step takes an effect back, or a rival that holds there, or a plainer one; a rival that no longer does is not exchanged again.
        loop {
            let all = sized(&answer.effects, estimates);
            let of = |k: usize| Some((k, self.fate(answer, estimates, &all, k, thresholds, anew < ANEW)?));
            let Some((k, fate)) = (0..all.len()).rev().find_map(of) else { return refused };
            trace(format!("  held out: {}", describe(&answer.effects[k].chosen)));
            match &fate {
                Fate::Otherwise(rival) | Fate::Exchanged(rival) => {
                    trace(format!("   instead: {}", describe(&answer.effects[k].rivals[*rival])));
                }
                Fate::Needless => trace("   need not be said".to_owned()),
                Fate::Refused => trace("   does not hold".to_owned()),
            }
            match fate {
                Fate::Otherwise(other) => {
                    anew += 1;
                    answer.prefer(k, other);
                }
                Fate::Exchanged(rival) => answer.exchange(k, rival),
                Fate::Needless => {
                    answer.take_back(k);
                }
                Fate::Refused => {
                    let cell = main_cell(self.floors, all[k].0, all[k].1);
                    let rms = self.without_and_with(&all, k, all[k], cell).map(|(without, with, _)| [without.sqrt(), with.sqrt()]);
                    let effect = answer.take_back(k);
                    let large = effect.gain.nats >= BARELY * thresholds.nats && effect.is_named();
                    if let (0, true, Some(rms), None) = (k, large, rms, &refused) {
                        refused = Some(Refused { effect, cell, rms, later: self.is_later_part() });
                    }
                }
            }
            *estimates = sizes(answer);
        }
    }

    /// What becomes of an effect that does not stay as it is; `anew` says whether a rival may still be taken for what is large.
    fn fate(
        &self,
        answer: &Answer,
        estimates: &[Estimate],
        all: &[Sized],
        k: usize,
        thresholds: &Thresholds,
        anew: bool,
    ) -> Option<Fate> {
        let rival = || self.rival(answer, all, k, thresholds);
        if let Some(level) = level_of_a_curve(answer, estimates, k) {
            return Some(Fate::Otherwise(level));
        }
        // Points have offset, play and coupling on every joint.
        if !self.problem.of_points() && is_needless(answer, estimates, k) {
            if let Some(plainer) = plainer(answer, k) {
                return Some(Fate::Otherwise(plainer));
            }
            if !is_large(answer, k) {
                return Some(Fate::Needless);
            }
            // What is as large is something, though not by its own number: a rival says it, or none does.
            if anew && let Some(rival) = rival() {
                return Some(Fate::Otherwise(rival));
            }
        }
        if self.holds(answer, all, k, thresholds) {
            return self.better_there(answer, all, k).filter(|_| anew).map(Fate::Otherwise);
        }
        let exchanged = if answer.effects[k].second { None } else { rival() };
        Some(exchanged.map_or(Fate::Refused, Fate::Exchanged))
    }

    /// Is what was held out a later part of the only run?
    pub(crate) fn is_later_part(&self) -> bool {
        let id = |problem: &Problem| problem.pairs[0].real.run.id.clone();
        id(self.problem) == id(self.dictionary.problem)
    }

    fn holds(&self, answer: &Answer, all: &[Sized], k: usize, thresholds: &Thresholds) -> bool {
        let (claim, coefficients) = all[k];
        let barely = is_barely(answer, k, thresholds);
        // What came on the way may have gone before the rest; what is still there has to hold.
        let gone = claim.edges() > 0 && self.is_later_part() && self.is_absent(all, k);
        if !barely && (OTHERWISE.contains(&claim.family.physics) || claim.family.physics == UNMODELLED || gone) {
            return true;
        }
        let cell = main_cell(self.floors, claim, coefficients);
        if self.is_absent(all, k) {
            // In one run and not in the others is what stands out there, and is not what a larger effect leaves.
            let seen = !barely || is_ahead(answer, k, thresholds);
            return seen && is_large(answer, k) && claim.rms_where_it_is(cell, coefficients) > STANDS_OUT * self.floors[cell];
        }
        let Some((without, with, own)) = self.without_and_with(all, k, all[k], cell) else { return true };
        if own <= SHOWS * claim.rms(cell, coefficients).powi(2) {
            // It does not show there, or is a constant that each run has of its own.
            return !barely || self.problem.nuisances[cell].of_run.contains(&true);
        }
        if barely { without - with > HOLDS_BARELY * own } else { without - with >= HOLDS * own }
    }

    /// The first rival that scores about as well, and of what was held out leaves far less above the noise where the effect leaves much.
    fn better_there(&self, answer: &Answer, all: &[Sized], k: usize) -> Option<usize> {
        let effect = &answer.effects[k];
        let cell = main_cell(self.floors, all[k].0, all[k].1);
        let noise = self.floors[cell].powi(2);
        let above = |claim: Sized| self.without_and_with(all, k, claim, cell).map(|(_, with, _)| with - noise);
        let own = above(all[k]).filter(|own| *own > MUCH * noise)?;
        let is_close = |rival: &Scored| {
            rival.candidate.family.physics != UNMODELLED
                && rival.score >= CLOSE * effect.chosen.score
                && !all.iter().any(|(other, _)| other.same_claim(&rival.candidate))
        };
        let leaves_little =
            |rival: &Scored| above((&rival.candidate, &rival.coefficients)).is_some_and(|left| left <= FAR_LESS * own);
        effect.rivals.iter().position(|rival| is_close(rival) && leaves_little(rival))
    }

    /// Is an effect not there in any run that was held out?
    fn is_absent(&self, all: &[Sized], k: usize) -> bool {
        let (_, windows) = self.there(all);
        windows[k].as_ref().is_some_and(Windows::is_never)
    }

    /// The first rival of an effect that holds in its place.
    fn rival(&self, answer: &Answer, all: &[Sized], k: usize, thresholds: &Thresholds) -> Option<usize> {
        let effect = &answer.effects[k];
        let least = thresholds.nats.max(NEAR * effect.chosen.score);
        effect.rivals.iter().position(|rival| {
            let claim = (&rival.candidate, &rival.coefficients[..]);
            let cell = main_cell(self.floors, claim.0, claim.1);
            let removes = |(without, with, own): (f64, f64, f64)| {
                without - with >= INSTEAD * own.max(without - self.floors[cell].powi(2)) && own > 0.0
            };
            let there = |other: &Sized| other.0.same_claim(&rival.candidate);
            rival.candidate.family.physics != UNMODELLED
                && !all.iter().any(there)
                && rival.score >= least
                && rival.gain.least >= 0.5 * thresholds.nats
                && self.without_and_with(all, k, claim, cell).is_some_and(removes)
        })
    }

    /// Mean squares of what was held out in a cell of the fit: beside all effects but one, beside these and a claim in its place, and of the
    /// claim's own part.
    fn without_and_with(&self, all: &[Sized], k: usize, claim: Sized, cell: usize) -> Option<(f64, f64, f64)> {
        let (_, without, with) = self.beside(all, k, claim, cell)?;
        let square = |of: &dyn Fn(usize) -> f64| mean(&(0..with.len()).map(|i| of(i).powi(2)).collect::<Vec<_>>());
        Some((square(&|i| without[i]), square(&|i| with[i]), square(&|i| without[i] - with[i])))
    }

    /// What was held out in a cell of the fit, with its number there: beside all effects but one, and beside these and a claim in its place.
    pub(crate) fn beside(&self, all: &[Sized], k: usize, claim: Sized, cell: usize) -> Option<(usize, Vec<f64>, Vec<f64>)> {
        let others = others(all, k);
        let with: Vec<Sized> = others.iter().copied().chain([claim]).collect();
        let roughly = self.problem.nuisances[cell].estimate(&left(self.problem, cell, &with));
        // The others are there when they are beside it: what they leave without it is its own.
        let (there, _) = self.there(&with);
        let (_, _, without) = self.less(&there[..others.len()], &others, &roughly, cell)?;
        let (c, _, with) = self.less(&there, &with, &roughly, cell)?;
        Some((c, without, with))
    }

    /// Some effects as they are in what was held out, and when each is there.
    pub(crate) fn there(&self, effects: &[Sized]) -> (Vec<Candidate>, Vec<Option<Windows>>) {
        let held = self.dictionary.problem;
        let whole: Vec<(Candidate, &[f64])> =
            effects.iter().map(|(own, theta)| (Candidate::new(self.dictionary, &own.family, &own.shape, None), *theta)).collect();
        let fitted: Vec<Option<Windows>> = effects.iter().map(|(own, _)| own.windows.clone()).collect();
        let windows = held_windows::windows(held, &held_windows::floors(self.problem, self.floors, held), &whole, &fitted);
        let within = |((whole, _), windows): (&(Candidate, _), &Option<Windows>)| {
            windows.as_ref().map_or_else(|| whole.clone(), |windows| whole.within(held, windows))
        };
        (whole.iter().zip(&windows).map(within).collect(), windows)
    }

    /// Residuals of a cell of what was held out, before and after the correction by some effects, beside the likeliest values of what is known
    /// only roughly; with the cell's number there.
    pub(crate) fn corrected(&self, effects: &[Sized], beside: &[f64], cell: usize) -> Option<(usize, Vec<f64>, Vec<f64>)> {
        self.less(&self.there(effects).0, effects, beside, cell)
    }

    /// The same of effects as they are there.
    fn less(&self, there: &[Candidate], effects: &[Sized], beside: &[f64], cell: usize) -> Option<(usize, Vec<f64>, Vec<f64>)> {
        let (of, held) = (&self.problem.cells[cell], self.dictionary.problem);
        let c = held.cell(of.channel, of.index)?;
        let before = held.cells[c].residual.clone();
        let mut after = before.clone();
        for (there, (_, coefficients)) in there.iter().zip(effects) {
            there.take_off(c, coefficients, &mut after);
        }
        let nuisance = &held.nuisances[c];
        if self.problem.nuisances[cell].of_run.contains(&true) {
            let rows = &held.cells[c].rows;
            after = less_means(&after, |k| rows[k].0);
        } else if nuisance.columns.len() == beside.len() && !nuisance.columns.is_empty() {
            after.iter_mut().zip(nuisance.predict(beside)).for_each(|(y, p)| *y -= p);
        }
        Some((c, before, after))
    }
}

/// Is an effect said beside a larger one of its joint or of the whole robot, or in place of a plainer one, though it may be nothing by its own interval?
fn is_needless(answer: &Answer, estimates: &[Estimate], k: usize) -> bool {
    let effect = &answer.effects[k];
    let place = |effect: &Effect| effect.chosen.candidate.family.joints.first().copied();
    let of_one_place = |other: &Effect| place(other).is_none() || place(effect).is_none() || place(other) == place(effect);
    let beside_larger = answer.effects.iter().any(|other| other.gain.nats > effect.gain.nats && of_one_place(other));
    let asked = plainer(answer, k).is_some() || (beside_larger && !effect.chosen.candidate.is_by_load_and_level());
    asked && effect.is_named() && estimates[k].may_be_nothing(&effect.chosen.candidate.family)
}

/// Does an effect explain a good part of what the largest one does?
fn is_large(answer: &Answer, k: usize) -> bool {
    let largest = answer.effects.iter().map(|effect| effect.gain.nats).fold(0.0, f64::max);
    answer.effects[k].gain.nats > LARGE * largest
}

/// The rival that an effect is where its own number is nothing: friction by load and a level is the level, a memory whose many numbers gain next to
/// nothing beside a constant is the constant.
fn plainer(answer: &Answer, k: usize) -> Option<usize> {
    let own = &answer.effects[k].chosen;
    if own.candidate.is_by_load_and_level() {
        plain(answer, k, "coulomb_friction", NEAR * own.score)
    } else if !own.candidate.family.limits.is_empty() {
        plain(answer, k, "joint_offset", own.score - confused(own.score))
    } else {
        None
    }
}

/// The rival that a Stribeck curve is which says nothing of slow motion: one as narrow as may be, whose height is that of standstills, or whose
/// interval of friction at rest holds that of sliding. The latter then has to be as good.
fn level_of_a_curve(answer: &Answer, estimates: &[Estimate], k: usize) -> Option<usize> {
    let own = &answer.effects[k].chosen;
    if own.candidate.is_a_spike() {
        plain(answer, k, "coulomb_friction", NEAR * own.score)
    } else if estimates[k].is_a_level() {
        plain(answer, k, "coulomb_friction", own.score - confused(own.score))
    } else {
        None
    }
}

/// A plain effect on an effect's joint among its rivals, of this score at least, if it is not said besides.
fn plain(answer: &Answer, k: usize, physics: &str, least: f64) -> Option<usize> {
    let effect = &answer.effects[k];
    let joints = &effect.chosen.candidate.family.joints;
    let is_there = |rival: &Scored| answer.effects.iter().any(|other| other.chosen.candidate.same_claim(&rival.candidate));
    effect.rivals.iter().position(|rival| {
        let family = &rival.candidate.family;
        family.physics == physics && family.joints == *joints && rival.score >= least && !is_there(rival)
    })
}

/// Does a memory gain far more than is asked, say more than every other physics in its place, and depend on the way? Held-out runs without it
/// cannot tell it from a spring that is bent.
fn is_ahead(answer: &Answer, k: usize, thresholds: &Thresholds) -> bool {
    let effect = &answer.effects[k];
    let own = &effect.chosen;
    let others = effect.rivals.iter().filter(|rival| rival.candidate.family.physics != own.candidate.family.physics);
    let next = others.map(|rival| rival.score).fold(0.0, f64::max);
    !own.candidate.is_a_bent_spring() && own.gain.nats >= BARELY * thresholds.nats && own.score - next >= AHEAD * thresholds.nats
}

/// Is an effect the only one, and accepted barely or bent in many numbers?
fn is_barely(answer: &Answer, k: usize, thresholds: &Thresholds) -> bool {
    let effect = &answer.effects[k];
    answer.effects.len() == 1 && (effect.gain.nats < BARELY * thresholds.nats || !effect.chosen.candidate.family.limits.is_empty())
}
